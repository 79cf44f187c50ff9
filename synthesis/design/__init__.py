"""Gains for a model: H-infinity and sampled observer design, deployment as a table, stability of given gains."""
