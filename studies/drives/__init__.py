"""Recorded drives: read, replayed through the corner observers, judged against references and baselines."""
