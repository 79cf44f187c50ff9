"""Switched gains: what is guaranteed however the modes follow each other (P3 Example 1)."""
