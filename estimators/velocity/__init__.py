"""Velocity observers of the corners, their mapping to the vehicle, and the vehicle-level fusion."""

from estimators.lazy import door

__getattr__, __dir__, __all__ = door(__name__, __file__)
