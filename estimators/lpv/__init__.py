"""Observers of any size that follow a schedule over any number of parameters."""

from estimators.lazy import door

__getattr__, __dir__, __all__ = door(__name__, __file__)
