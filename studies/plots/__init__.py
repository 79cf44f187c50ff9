"""Pictures: drawing and saving."""
