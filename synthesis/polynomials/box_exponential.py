"""phi(M) and e^M of matrix polynomials on many boxes at once (`synthesis.polynomials.exponential` in the ring of `boxes`)."""

from __future__ import annotations

from math import ceil, factorial, log2

import numpy as np

from estimators.arrays import FloatArray
from synthesis.polynomials.boxes import EPS, INFLATE, Boxes, constants
from synthesis.polynomials.exponential import LARGEST, balance_of

TERMS = 14  # of the series of phi at |X| <= 1/2: remainder 5e-17


def phi(matrix: Boxes) -> Boxes | None:
    """An enclosure of int_0^1 e^(M s) ds on every box (`synthesis.polynomials.exponential`); None if M is too large."""
    n = matrix.shape[0]
    size = matrix.size.max(axis=0)
    if not np.isfinite(size).all():
        return None
    weights = np.array([float(w.p) / float(w.q) for w in balance_of(size)])  # powers of two: exact
    turned = _turned(matrix, weights)
    norm = float(turned.size.sum(axis=2).max()) * INFLATE
    if not norm < LARGEST:
        return None
    halvings = max(0, ceil(log2(norm)) + 1) if norm > 0.0 else 0
    X = turned * 2.0**-halvings
    unit = constants(np.eye(n), matrix.variables, matrix.highest)
    found = unit * (1.0 / factorial(TERMS))
    for k in range(TERMS - 1, 0, -1):
        found = X @ found + (unit * (1.0 / factorial(k))).widened(np.full((1, n, n), EPS / factorial(k)))
    small = norm * 2.0**-halvings
    found = found.widened(np.full((1, n, n), 1.01 * small**TERMS / factorial(TERMS + 1) + EPS / factorial(TERMS)))
    for _ in range(halvings):
        found = (unit + (X @ found) * 0.5) @ found
        X = X * 2.0
    return _turned(found, 1.0 / weights)


def _turned(matrix: Boxes, weights: FloatArray) -> Boxes:
    """diag(w) M diag(w)^-1 for powers of two."""
    factor = weights[:, None] / weights
    return Boxes(matrix.middle * factor, matrix.radius * factor, matrix.variables, matrix.highest)


def exponential(matrix: Boxes, integral: Boxes) -> Boxes:
    """e^M = I + M phi(M), from phi(M)."""
    return constants(np.eye(matrix.shape[0]), matrix.variables, matrix.highest) + matrix @ integral
