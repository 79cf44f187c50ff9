"""Observability and detectability: symbolic ranks, frozen modes, gramians, nonlinear and stochastic tests."""
