"""Studies beyond the papers."""
