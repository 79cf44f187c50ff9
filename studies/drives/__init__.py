"""Recorded drives: read, replayed through the corner observers, compared with references and baselines."""
