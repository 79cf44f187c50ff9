"""P3, resilient corner-based velocity estimation: its claims, tables and figures recomputed."""
