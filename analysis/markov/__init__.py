"""Markov jump linear systems: mean-square stability, stationary moments, optimal gains."""
