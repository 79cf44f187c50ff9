"""Estimators on truth vehicles: many sensor draws of one simulated manoeuvre, and errors against the truth by draw."""
