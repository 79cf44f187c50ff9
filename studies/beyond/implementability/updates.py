r"""Discretisations of the observer x^' = A x^ + B u + L (y - C x^) that people use, as the matrix M of e+ = M e.

u, y and the wheel speed are held over a sample; M is then what multiplies an error of the estimate in one sample.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray
from estimators.phi import phi_of

Update = Callable[[FloatArray, FloatArray, FloatArray, ArrayLike], FloatArray]
"""M (..., 2, 2) from A (..., 2, 2), L (..., 2, 1), C (..., 1, 2) and sample times (...) in s."""
EYE = np.eye(2)


def _update(formula: Callable[[FloatArray, FloatArray, FloatArray], ArrayLike]) -> Update:
    """M from a formula in A, L C and T."""
    return lambda A, L, C, sample_time: np.asarray(formula(A, L @ C, np.asarray(sample_time, float)[..., None, None]))


exact_closed_loop = _update(lambda A, LC, T: EYE + (T * (A - LC)) @ phi_of(T * (A - LC)))
"""e^{(A - L C) T}: the observer integrated inside the sample, as the runtime does (P1 notes 9)."""
BREAKABLE: dict[str, Update] = {
    "forward Euler": _update(lambda A, LC, T: EYE + T * (A - LC)),
    # e^{A T} - int_0^T e^{A s} ds L C: the open loop exactly, the innovation computed once and held (P3 (10), literally)
    "sampled innovation": _update(lambda A, LC, T: EYE + T * (phi_of(T * A) @ (A - LC))),
    # e^{A T} - T L C: the open loop exactly, then the correction T L times the innovation
    "predict, then T·L": _update(lambda A, LC, T: EYE + T * (phi_of(T * A) @ A - LC)),
}
LASTING: dict[str, Update] = {
    "Tustin": _update(lambda A, LC, T: np.linalg.solve(EYE - 0.5 * T * (A - LC), EYE + 0.5 * T * (A - LC))),
    "backward Euler": _update(lambda A, LC, T: np.linalg.inv(EYE - T * (A - LC))),
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
