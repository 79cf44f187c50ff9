"""Matrix polynomials: arrays for the solvers, exact rationals for the proofs."""
