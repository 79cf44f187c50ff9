r"""The second moment of a linear step, on the n(n+1)/2 independent entries of a symmetric matrix.

x+ = A x moves X = E[x x'] to A X A'. With svec(X) the upper triangle of X, entries off the diagonal times sqrt(2),

    svec(A X A') = S(A) svec(X),    S(A) of size n(n+1)/2.

S(A) has the spectral radius of A (x) A, and costs (n^2 / (n(n+1)/2))^3, nearly 8 times, less to decompose. The weights
sqrt(2) make svec an isometry and S(A') = S(A)'. S(A) leaves the positive semidefinite cone invariant, so the spectral
radius of a sum of such operators with weights >= 0 is itself an eigenvalue, with an eigenvector X >= 0 (Krein and Rutman).
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import symmetric
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from synthesis.lmi.blocks import triangle_by_rows

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


triangle = lru_cache(maxsize=64)(triangle_by_rows)


def svec(matrix: ArrayLike) -> FloatArray:
    """The independent entries (..., n(n+1)/2) of symmetric matrices (..., n, n).

    Raises AnalysisError for matrices that are not square, not finite or not symmetric.
    """
    return pack(symmetric("matrix", matrix))


def smat(vector: FloatArray) -> FloatArray:
    """Symmetric matrices (..., n, n) from their independent entries (..., n(n+1)/2). Raises AnalysisError for other lengths."""
    entries = np.asarray(vector, float)
    length = entries.shape[-1] if entries.ndim else 0
    size = int((np.sqrt(8.0 * length + 1.0) - 1.0) / 2.0 + 0.5)
    if not length or size * (size + 1) // 2 != length:
        raise AnalysisError(f"vector has {length} entries; a symmetric matrix of size n has n(n+1)/2")
    return unpack(entries, size)


def pack(matrix: FloatArray) -> FloatArray:
    """`svec` of matrices that are known to be symmetric."""
    rows, columns, weights = triangle(matrix.shape[-1])
    return np.asarray(matrix[..., rows, columns] * weights)


def unpack(vector: FloatArray, size: int) -> FloatArray:
    """`smat` with a known size."""
    rows, columns, weights = triangle(size)
    out = np.empty((*vector.shape[:-1], size, size))
    out[..., rows, columns] = vector / weights
    out[..., columns, rows] = out[..., rows, columns]
    return out


def lifted(A: FloatArray) -> FloatArray:
    """S(A) of shape (..., n(n+1)/2, n(n+1)/2) for square A (..., n, n), which is not checked.

    The entry of column (k, l), k < l, collects a_ik a_jl + a_il a_jk of (A (x) A); half of it on the diagonal k = l.
    """
    rows, columns, weights = triangle(A.shape[-1])
    first, second = A[..., rows, :], A[..., columns, :]
    out = first[..., :, rows] * second[..., :, columns] + first[..., :, columns] * second[..., :, rows]
    return np.asarray(out * (weights[:, None] / (weights * np.where(rows == columns, 2.0, 1.0))))


def spectral_radius(operator: FloatArray) -> FloatArray:
    """Largest modulus of the eigenvalues, shape (...)."""
    return np.asarray(np.abs(np.linalg.eigvals(operator)).max(axis=-1))
