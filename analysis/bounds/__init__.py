"""Bounds of the papers on the errors of force and sliding-mode observers."""
