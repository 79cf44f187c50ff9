r"""Exact test for a common quadratic Lyapunov function of two 2 x 2 modes (Shorten, Narendra 2002).

Two stable 2 x 2 matrices share one if and only if neither A1 A2 nor A1 A2^-1 has a real negative eigenvalue. Both products
have positive determinant, so M has one if and only if trace(M) <= -2 sqrt(det M). Discrete modes go through the bilinear
map A -> (A - I)(A + I)^-1, which keeps P: A'PA - P < 0 if and only if C'P + PC < 0 (Mason, Shorten 2004).
"""

from __future__ import annotations

import numpy as np
from flint import fmpq
from numpy.typing import ArrayLike

from analysis.checks import leading, square
from analysis.errors import AnalysisError
from analysis.exact import Rational, rationals
from analysis.mode_objects import state_matrices
from estimators.arrays import FloatArray
from synthesis.lmi.result import Verdict


def pair_margin(first: ArrayLike, second: ArrayLike, discrete: bool | None = None) -> FloatArray:
    r"""min over both products of 1 + trace(M)/(2 sqrt(det M)): positive if and only if a common P exists.

    Stacks (..., 2, 2) whose leading axes broadcast; an unstable mode gives -inf. In floating point:
    use `exact_pair_test` where the value is at rounding level. Raises AnalysisError for modes that are not 2 x 2.

    >>> bool(pair_margin([[-1.0, 1.0], [0.0, -1.0]], [[-1.0, 0.0], [9.0, -1.0]]) > 0.0)
    False
    """
    A1, A2, discrete = _two_by_two(first, second, discrete)
    shape = leading({"first": A1, "second": A2})
    A1, A2 = (np.broadcast_to(A, (*shape, 2, 2)) for A in (A1, A2))
    stable = np.ones(shape, dtype=bool)
    for A in (A1, A2):
        poles = np.linalg.eigvals(A)
        stable &= (np.abs(poles) < 1.0 if discrete else poles.real < 0.0).all(axis=-1)
    safe = np.zeros((2, 2)) if discrete else -np.eye(2)  # anything stable: masked below
    A1, A2 = (np.where(stable[..., None, None], A, safe) for A in (A1, A2))
    if discrete:
        A1, A2 = _bilinear(A1), _bilinear(A2)
    root = np.sqrt(_det(A1) * _det(A2))
    # A1 adj(A2) has the sign of A1 A2^-1, and needs no division
    adjugate = np.stack(
        [np.stack([A2[..., 1, 1], -A2[..., 0, 1]], -1), np.stack([-A2[..., 1, 0], A2[..., 0, 0]], -1)], -2
    )
    traces = [np.trace(A1 @ B, axis1=-2, axis2=-1) for B in (A2, adjugate)]
    return np.where(stable, 1.0 + np.minimum(*traces) / (2.0 * root), -np.inf)


def exact_pair_test(first: ArrayLike, second: ArrayLike, discrete: bool | None = None) -> Verdict:
    """CERTIFIED: a common quadratic Lyapunov function exists; REFUTED: none does. In exact rational arithmetic.

    One pair of 2 x 2 modes, read bit for bit; the boundary itself is REFUTED, as the inequalities are strict.

    >>> print(exact_pair_test([[-1.0, 1.0], [0.0, -1.0]], [[-1.0, 0.0], [9.0, -1.0]]))
    refuted
    """
    A1, A2, discrete = _two_by_two(first, second, discrete)
    if A1.ndim != 2 or A2.ndim != 2:
        raise AnalysisError("the exact test takes one pair of 2 x 2 modes; use pair_margin for stacks")
    exact = [rationals(A) for A in (A1, A2)]
    if discrete:
        one = rationals(np.eye(2))
        if not all(_schur(A) for A in exact):
            return Verdict.REFUTED
        exact = [(A - one) * (A + one).inv() for A in exact]
    elif not all(_trace(A) < 0 and A.det() > 0 for A in exact):
        return Verdict.REFUTED
    for M in (exact[0] * exact[1], exact[0] * exact[1].inv()):
        if _trace(M) < 0 and _trace(M) ** 2 >= 4 * M.det():
            return Verdict.REFUTED
    return Verdict.CERTIFIED


def _two_by_two(first: ArrayLike, second: ArrayLike, discrete: bool | None) -> tuple[FloatArray, FloatArray, bool]:
    """Both modes, of arrays or of objects with A and dt, and whether time is discrete."""
    (one, time), (two, other) = (state_matrices(mode, discrete) for mode in (first, second))
    if time != other:
        raise AnalysisError("one mode is continuous and one discrete; a switched system has one kind of time")
    A1, A2 = square("first mode", one), square("second mode", two)
    if A1.shape[-1] != 2 or A2.shape[-1] != 2:
        raise AnalysisError(f"the exact test is for 2 states, not {A1.shape[-1]} and {A2.shape[-1]}")
    return A1, A2, time


def _bilinear(A: FloatArray) -> FloatArray:
    eye = np.eye(2)
    return np.asarray((A - eye) @ np.linalg.inv(A + eye))


def _det(A: FloatArray) -> FloatArray:
    return np.asarray(A[..., 0, 0] * A[..., 1, 1] - A[..., 0, 1] * A[..., 1, 0])


def _trace(matrix: Rational) -> fmpq:
    return matrix[0, 0] + matrix[1, 1]


def _schur(matrix: Rational) -> bool:
    """Both eigenvalues inside the unit circle (Jury): |det| < 1 and |trace| < 1 + det."""
    det, trace = matrix.det(), _trace(matrix)
    return bool(-1 < det < 1 and -(1 + det) < trace < 1 + det)
