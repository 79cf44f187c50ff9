"""Pairs (A, C) and (A, B) as they are given, checked; of unit size; and without entries that are rounding."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.checks import as_stack, leading, square
from analysis.errors import AnalysisError
from analysis.state_space import given_system
from estimators.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

EPSILON = float(np.finfo(float).eps)


def observed_pair(A: Any, C: ArrayLike | None, discrete: object = None) -> tuple[FloatArray, FloatArray, bool]:
    """A (..., n, n), C (..., m, n) with equal leading axes, and the kind of time; a system object may stand in the place of A.

    Raises AnalysisError for shapes that do not fit, values not finite, complex or masked, and a missing C.
    """
    A, _, C, _, time = given_system(A, C=C, discrete=discrete)
    if C is None:
        raise AnalysisError("C is missing; give A and C, or a system object with both")
    A, C = square("A", A), as_stack("C", C)
    if C.shape[-1] != A.shape[-1] or not C.shape[-2]:
        raise AnalysisError(
            f"C has the shape {C.shape}; A {A.shape} needs {A.shape[-1]} columns, and at least one row (of zeros)"
        )
    lead = leading({"A": A, "C": C})
    return np.broadcast_to(A, (*lead, *A.shape[-2:])), np.broadcast_to(C, (*lead, *C.shape[-2:])), time


def driven_pair(A: Any, B: ArrayLike | None, discrete: object = None) -> tuple[FloatArray, FloatArray, bool]:
    """The dual pair (A', B') of A (..., n, n), B (..., n, m): what the inputs reach is what B' sees of A'."""
    A, B, _, _, time = given_system(A, B=B, discrete=discrete)
    if B is None:
        raise AnalysisError("B is missing; give A and B, or a system object with both")
    A, B = square("A", A), as_stack("B", B)
    if B.shape[-2] != A.shape[-1] or not B.shape[-1]:
        raise AnalysisError(
            f"B has the shape {B.shape}; A {A.shape} needs {A.shape[-1]} rows, and at least one column (of zeros)"
        )
    lead = leading({"A": A, "B": B})
    A, B = np.broadcast_to(A, (*lead, *A.shape[-2:])), np.broadcast_to(B, (*lead, *B.shape[-2:]))
    return np.swapaxes(A, -1, -2), np.swapaxes(B, -1, -2), time


def unit_pair(A: FloatArray, C: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(A / |A|, C / |C|, |A|) in the spectral norm, zero matrices left as they are; |A| (..., 1, 1)."""
    size, seen = (np.linalg.norm(matrix, 2, axis=(-2, -1))[..., None, None] for matrix in (A, C))
    size, seen = np.where(size > 0.0, size, 1.0), np.where(seen > 0.0, seen, 1.0)
    return A / size, C / seen, size


def without_dust(A: FloatArray, C: FloatArray, rounding: float = 4.0 * EPSILON) -> tuple[FloatArray, FloatArray]:
    """Entries below rounding beside the others of their row (and, in A, of their column) set to zero.

    cos(pi/2) = 6e-17 is no sensor.
    """

    def small(matrix: FloatArray, axis: int) -> Any:
        size = np.abs(matrix)
        return size < rounding * size.max(axis=axis, keepdims=True, initial=0.0)

    return np.where(small(A, -1) & small(A, -2), 0.0, A), np.where(small(C, -1), 0.0, C)
