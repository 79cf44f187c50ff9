"""The LMI engine: problem, relaxation, conic assembly, solve, verdict."""
