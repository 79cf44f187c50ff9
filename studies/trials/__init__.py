"""Estimators on truth vehicles: many sensor draws of one drive, played through a pipeline and judged seed by seed."""
