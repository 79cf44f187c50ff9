"""What both tires have in common: a deflection with z' = v - a z, stepped exactly for v and a held over the step.

    z(h) = z e^-s + h v phi,   mean z = z phi + h v psi,   s = a h, phi = (1 - e^-s)/s, psi = (1 - phi)/s
    mean z' = (z(h) - z)/h = v - a (mean z)

Sliding makes a as large as 2e4 1/s on ice; the exact step is regular there and at a = 0 (a wheel at rest).
"""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray

_SMALL = 1e-3  # below, psi by its series, whose error is s^3/120


def held(z: FloatArray, v: FloatArray, a: FloatArray, h: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """z after the step, its mean and the mean of z' (same shapes); m, m/s, 1/s (not negative), s."""
    s = a * h
    few = s < _SMALL
    if few.any():
        safe = np.where(few, 1.0, s)
        phi = np.where(few, 1.0 - s * (0.5 - s / 6.0), -np.expm1(-safe) / safe)
        psi = np.where(few, 0.5 - s * (1.0 / 6.0 - s / 24.0), (1.0 - phi) / safe)
    else:
        phi = -np.expm1(-s) / s
        psi = (1.0 - phi) / s
    mean = z * phi + (h * v) * psi
    rate = v - a * mean
    return z + h * rate, mean, rate
