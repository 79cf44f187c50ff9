"""One folder for each paper: its claims as data, what recomputes them, and the study that puts both together."""
