"""Loops along parameter trajectories as they run: Monte Carlo, worst inputs, worst trajectories. Floats: no proofs."""
