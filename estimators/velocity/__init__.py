"""Velocity observers."""

from estimators.velocity.lpv import LpvStep, LpvVelocityObserver

__all__ = ["LpvStep", "LpvVelocityObserver"]
