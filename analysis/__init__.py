"""Norms, sensitivity, switching, Markov jumps, packet drops, observability."""
