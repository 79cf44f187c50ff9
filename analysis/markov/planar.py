r"""Second-moment radii of many systems with two states: repeated squaring, with two-sided bounds that prove each answer.

The operator M leaves the cone of (X_1, ..., X_m), X_j >= 0, invariant. For any X in its interior (Collatz and Wielandt; Krein
and Rutman)

    min_j lambda_min(X_j^-1 Y_j) <= radius <= max_j lambda_max(X_j^-1 Y_j),    Y = M X,

with equality at the eigenvector, which M^(2^k) makes of the identity: k matrix products instead of an eigenvalue problem.
Where the bounds do not meet (nearly equal moduli, a singular eigenvector) the caller falls back on eigenvalues.
"""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray

SQUARINGS = 9  # M^512: enough unless two moduli differ by less than some 5 %
AGREEMENT = 1e-13  # relative distance of the bounds at which an answer is taken
IDENTITY = np.array([1.0, 0.0, 1.0])  # svec of the identity


def planar_radius(operator: FloatArray) -> FloatArray:
    """Radius (b,) of operators (b, 3m, 3m) on half-vectorised 2 x 2 matrices; NaN where the bounds do not meet."""
    scale = np.maximum(np.abs(operator).sum(axis=-1).max(axis=-1), np.finfo(float).tiny)
    power = scaled = operator / scale[:, None, None]
    for _ in range(SQUARINGS):
        power = power @ power
        size = np.abs(power).sum(axis=-1).max(axis=-1)
        power = power / np.maximum(size, np.finfo(float).tiny)[:, None, None]
    X = power @ np.tile(IDENTITY, operator.shape[-1] // 3)
    Y = (scaled @ X[..., None])[..., 0]
    lower, upper = _bounds(X.reshape(len(X), operator.shape[-1] // 3, 3), Y.reshape(len(X), operator.shape[-1] // 3, 3))
    met = (upper - lower <= AGREEMENT * upper) & (lower > 0.0)
    return np.asarray(np.where(met, upper * scale, np.nan))


def _bounds(X: FloatArray, Y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest eigenvalue of X_j^-1 Y_j over j; (-inf, inf) where an X_j is not positive definite."""
    a, c, b = X[..., 0], X[..., 2], 0.5 * X[..., 1] ** 2  # x11, x22, x12^2
    det = a * c - b
    half = 0.5 * (a * Y[..., 2] + c * Y[..., 0] - X[..., 1] * Y[..., 1])
    # In Y - r X with r = half / det, which nearly vanishes at the eigenvector, the discriminant does not cancel.
    definite = (det > 1e-8 * a * c) & (a > 0.0)
    safe = np.where(definite, det, 1.0)
    ratio = half / safe
    rest = Y - ratio[..., None] * X
    spread = np.sqrt(np.maximum(0.5 * rest[..., 1] ** 2 - rest[..., 0] * rest[..., 2], 0.0) / safe)
    good = definite.all(axis=-1)
    lower, upper = (ratio - spread).min(axis=-1), (ratio + spread).max(axis=-1)
    return np.where(good, lower, -np.inf), np.where(good, upper, np.inf)
