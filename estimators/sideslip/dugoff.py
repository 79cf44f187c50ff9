"""Dugoff tire under pure lateral slip: linear, then saturating towards friction times load."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray

LEAST_KNEE = 1e-15  # keeps 0/0 away where a lifted wheel does not slip


def dugoff_force(stiffness: FloatArray | float, tangent: FloatArray, knee: FloatArray | float) -> FloatArray:
    """Fbar = C tan(alpha) f(lambda), f = (2 - lambda) lambda for lambda < 1 and 1 otherwise; P4 (3)-(5).

    lambda = mu F_z / (2 C |tan alpha|) = knee / |tan alpha|. A positive slip angle gives a positive force (the minus
    sign of (3) contradicts (2) and (1)).

    Args:
        stiffness: C in N/rad.
        tangent: tan(alpha), any shape.
        knee: mu F_z / (2 C), at least `LEAST_KNEE`: the slip up to which the tire is linear.
    """
    ratio = knee / np.maximum(np.absolute(tangent), knee)  # min(lambda, 1)
    return np.asarray(stiffness * tangent * (2.0 - ratio) * ratio)


def dugoff_slope(stiffness: FloatArray | float, tangent: FloatArray, knee: FloatArray | float) -> FloatArray:
    """dFbar / d tan(alpha): C where the tire is linear, C lambda^2 beyond; P4 (3)-(5) differentiated."""
    return np.asarray(stiffness * (knee / np.maximum(np.absolute(tangent), knee)) ** 2)


def used_friction(force: FloatArray, load: FloatArray) -> FloatArray:
    """mu = F_y / F_z, P4 (14); 0 where the wheel carries less than 1 N. Shapes broadcast."""
    force, load = np.asarray(force, dtype=np.float64), np.asarray(load, dtype=np.float64)
    loaded = load >= 1.0
    return np.asarray(np.where(loaded, force / np.where(loaded, load, 1.0), 0.0))
