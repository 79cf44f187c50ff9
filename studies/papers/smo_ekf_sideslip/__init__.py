"""P5, Baffet, Charara, Lechner 2009: sliding-mode force observer, then an extended filter with adaptive stiffness."""
