"""Symbolic LPV models, the catalogue of the papers and their parameter values."""
