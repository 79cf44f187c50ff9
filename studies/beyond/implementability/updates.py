r"""Discretisations of the observer x^' = A x^ + B u + L (y - C x^) that people use, as the matrix M of e+ = M e.

u, y and the wheel speed are held over a sample; M is then what multiplies an error of the estimate in one sample.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from estimators.phi import phi_of
from synthesis.polynomials.matrix import FloatArray

Update = Callable[[FloatArray, FloatArray, FloatArray, ArrayLike], FloatArray]


def _time(sample_time: ArrayLike) -> FloatArray:
    return np.asarray(sample_time, float)[..., None, None]


def forward_euler(A: FloatArray, L: FloatArray, C: FloatArray, sample_time: ArrayLike) -> FloatArray:
    """I + T (A - L C)."""
    return np.asarray(np.eye(2) + _time(sample_time) * (A - L @ C))


def sampled_innovation(A: FloatArray, L: FloatArray, C: FloatArray, sample_time: ArrayLike) -> FloatArray:
    r"""e^{A T} - int_0^T e^{A s} ds L C: the open loop exactly, the innovation computed once and held (P3 (10), literally)."""
    T = _time(sample_time)
    return np.asarray(np.eye(2) + T * (phi_of(T * A) @ (A - L @ C)), dtype=np.float64)


def predict_then_correct(A: FloatArray, L: FloatArray, C: FloatArray, sample_time: ArrayLike) -> FloatArray:
    r"""e^{A T} - T L C: the open loop exactly, then the correction T L times the innovation."""
    T = _time(sample_time)
    return np.asarray(np.eye(2) + T * (phi_of(T * A) @ A - L @ C), dtype=np.float64)


def tustin(A: FloatArray, L: FloatArray, C: FloatArray, sample_time: ArrayLike) -> FloatArray:
    r"""(I - T/2 (A - L C))^-1 (I + T/2 (A - L C))."""
    half = 0.5 * _time(sample_time) * (A - L @ C)
    return np.asarray(np.linalg.solve(np.eye(2) - half, np.eye(2) + half), dtype=np.float64)


def backward_euler(A: FloatArray, L: FloatArray, C: FloatArray, sample_time: ArrayLike) -> FloatArray:
    r"""(I - T (A - L C))^-1."""
    return np.asarray(np.linalg.inv(np.eye(2) - _time(sample_time) * (A - L @ C)), dtype=np.float64)


def exact_closed_loop(A: FloatArray, L: FloatArray, C: FloatArray, sample_time: ArrayLike) -> FloatArray:
    r"""e^{(A - L C) T}: the observer integrated inside the sample, as the runtime does (P1 section 9)."""
    M = _time(sample_time) * (A - L @ C)
    return np.asarray(np.eye(2) + M @ phi_of(M), dtype=np.float64)


BREAKABLE: dict[str, Update] = {
    "forward Euler": forward_euler,
    "sampled innovation": sampled_innovation,
    "predict, then T·L": predict_then_correct,
}
LASTING: dict[str, Update] = {
    "Tustin": tustin,
    "backward Euler": backward_euler,
    "exact closed loop": exact_closed_loop,
}
UPDATES: dict[str, Update] = {**BREAKABLE, **LASTING}


def spectral_radius(M: FloatArray) -> FloatArray:
    """Of 2 x 2 matrices (..., 2, 2), from trace and determinant."""
    half, det = 0.5 * np.trace(M, axis1=-2, axis2=-1), np.linalg.det(M)
    root = np.sqrt((half**2 - det).astype(complex))
    return np.asarray(np.maximum(np.abs(half - root), np.abs(half + root)))


def jury_margin(M: FloatArray) -> FloatArray:
    """min(1 - det, 1 + tr + det, 1 - tr + det) of (..., 2, 2): positive exactly where the spectral radius is below one."""
    trace, det = np.trace(M, axis1=-2, axis2=-1), np.linalg.det(M)
    return np.asarray(np.minimum(1.0 - det, np.minimum(1.0 + trace + det, 1.0 - trace + det)))
