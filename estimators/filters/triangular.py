"""Triangular factors over a batch, component axes first and the batch last: (n, k, b).

Many small matrices are fastest as few array operations over a long last axis; a few matrices go through LAPACK
elsewhere. Factors are lower triangular, and the signs of their columns are free.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from estimators.arrays import FloatArray
from estimators.errors import EstimatorError

FEW = 48  # batch entries up to which LAPACK is faster: 1.9 times for one; 4.8 times slower for 2000
_TINY = 1e-150
_SAFE = 1e-5  # relative pivot above which products lose less than a digit of eleven


def lower_factor(base: FloatArray, columns: FloatArray) -> FloatArray:
    """L (n, n, b) with L L' = base base' + columns columns'; no product is formed (Householder, row by row).

    Args:
        base: (n, n, b) lower triangular, or (n, n, 1) for all.
        columns: (n, k, b); overwritten.
    """
    n = base.shape[0]
    lower = np.array(np.broadcast_to(base, (n, n, columns.shape[2])))
    for k in range(n):
        row, diagonal = columns[k], lower[k, k]
        norm = np.einsum("kb,kb->b", row, row)
        norm += diagonal * diagonal
        np.sqrt(norm, norm)
        np.maximum(norm, _TINY, out=norm)
        beta = -np.copysign(norm, diagonal)
        scale = diagonal - beta
        if k + 1 < n:
            row /= scale
            below, rest = lower[k + 1 :, k], columns[k + 1 :]
            moved = np.einsum("jkb,kb->jb", rest, row)
            moved += below
            scale /= -beta
            moved *= scale
            below -= moved
            rest -= moved[:, None] * row
        lower[k, k] = beta
    return np.asarray(lower, dtype=np.float64)


def upper_factor(rows: FloatArray) -> FloatArray:
    """U (b, n, n), upper triangular, with U'U = rows'rows of (b, k, n)."""
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)


def right_divide(rows: FloatArray, lower: FloatArray, triangular: bool = False) -> FloatArray:
    """X (r, n, b) with X L = rows, by back substitution over the columns; `rows` is overwritten.

    With `triangular` the first n rows are a lower triangle, whose zeros are passed over.
    """
    inverse = 1.0 / np.einsum("kkb->kb", lower)
    for k in reversed(range(lower.shape[0])):
        part = rows[k if triangular else 0 :]
        column = part[:, k]
        if k + 1 < lower.shape[0]:
            column -= np.einsum("rjb,jb->rb", part[:, k + 1 :], lower[k + 1 :, k])
        column *= inverse[k]
    return rows


def left_divide(lower: FloatArray, rows: FloatArray, out: FloatArray | None = None) -> FloatArray:
    """X (n, k, b) with L X = rows, by forward substitution; `out` may hold the memory for it."""
    out = np.empty(rows.shape) if out is None else out
    inverse = 1.0 / np.einsum("kkb->kb", lower)
    np.multiply(rows[0], inverse[0], out[0])
    for k in range(1, lower.shape[0]):
        row = np.einsum("jb,jkb->kb", lower[k, :k], out[:k])
        np.subtract(rows[k], row, row)
        np.multiply(row, inverse[k], out[k])
    return out


def products(columns: FloatArray) -> Iterator[FloatArray]:
    """The columns of the lower triangle of columns columns', (n-k, b) for k = 0, 1, ..., from columns (n, k, b)."""
    for k in range(len(columns)):
        yield np.einsum("rjb,jb->rb", columns[k:], columns[k])


def summed_factor(
    matrix: FloatArray, base: FloatArray, columns: FloatArray, out: FloatArray | None = None
) -> FloatArray:
    """L (n, n, b) with L L' = matrix + columns columns', matrix = base base'; `columns` (n, k, b) is overwritten.

    `out` may hold the memory for it: what is above the diagonal stays there.

    A Cholesky factor of the sum costs a third of the orthogonal triangularisation and has its accuracy as long as no
    pivot is small against its diagonal entry; where one is, `lower_factor` does it.
    """
    lower = np.zeros((len(matrix), len(matrix), columns.shape[2])) if out is None else out
    for k, product in enumerate(products(columns)):
        np.add(product, matrix[k:, k], lower[k:, k])
    done = checked_factor(lower, np.einsum("kkb->kb", lower).copy(), lower)
    return lower if done else lower_factor(base, columns)


def cholesky(matrix: FloatArray, complaint: str) -> FloatArray:
    """L (n, n, b) of a positive definite matrix (n, n, b).

    Raises:
        EstimatorError: not positive definite, with that message.
    """
    lower = np.zeros(matrix.shape)
    if not checked_factor(matrix, np.einsum("kkb->kb", matrix), lower, 0.0):
        raise EstimatorError(complaint)
    return lower


def checked_factor(matrix: FloatArray, against: FloatArray, out: FloatArray, least: float = _SAFE) -> bool:
    """L L' = matrix (n, n, b) into the lower triangle of `out`, which may be the matrix itself.

    False where the square of a diagonal entry of L is not above `least` times its entry of `against` (n, b): L then
    lost too many digits, or means nothing.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        for k in range(len(matrix)):
            column = out[k:, k]
            if k:
                np.subtract(matrix[k:, k], np.einsum("rjb,jb->rb", out[k:, :k], out[k, :k]), column)
            elif out is not matrix:
                column[:] = matrix[:, 0]
            column *= 1.0 / np.sqrt(column[0])
        share = np.square(np.einsum("kkb->kb", out)) / against
    return bool(np.minimum.reduce(share, None) > least)  # NaN where a pivot was not positive: False


def semidefinite_factor(matrix: FloatArray, what: str, definite: bool = False) -> FloatArray:
    """L (..., n, n), lower triangular, with L L' = matrix (..., n, n), which may be singular unless `definite`.

    Raises:
        EstimatorError: not finite, not symmetric or indefinite; names `what`.
    """
    if not np.isfinite(matrix).all():
        raise EstimatorError(f"{what} is not finite")
    flipped = np.swapaxes(matrix, -1, -2)
    if not np.allclose(matrix, flipped, rtol=1e-9, atol=1e-12 * float(np.absolute(matrix).max(initial=0.0))):
        raise EstimatorError(f"{what} is not symmetric")
    try:
        return np.asarray(np.linalg.cholesky(matrix), dtype=np.float64)
    except np.linalg.LinAlgError:
        if definite:
            raise EstimatorError(
                f"{what} is not positive definite; give every channel a noise variance above zero"
            ) from None
        variance = np.einsum("...ii->...i", matrix)
        scale = np.sqrt(np.where(variance > 0, variance, 1.0))
        values, vectors = np.linalg.eigh(matrix / scale[..., None] / scale[..., None, :])
        if not (values >= -1e-9).all() or (variance < 0).any():
            raise EstimatorError(f"{what} is not positive semidefinite; lowest eigenvalue {values.min():.3g}") from None
        root = scale[..., None] * vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
        return upper_factor(root.swapaxes(-1, -2)).swapaxes(-1, -2)
