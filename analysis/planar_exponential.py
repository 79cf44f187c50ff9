r"""The exponential of stacks of 2 x 2 matrices and its integral, in closed form: no loop over the stack.

With M = m I + N, trace N = 0, N^2 = delta I, and alpha, beta of `estimators.phi`, with which the runtime observer advances:

    phi(M) = int_0^1 e^{M s} ds = alpha I + beta N,    e^M = I + M phi(M) = (1 + m alpha + delta beta) I + (alpha + m beta) N.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import square
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.phi import phi

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def planar_exponential(matrix: ArrayLike) -> FloatArray:
    """e^M for M (..., 2, 2); entries that overflow come out infinite.

    Raises AnalysisError for matrices that are not finite or not 2 x 2.
    """
    M, mean, delta, alpha, beta = _coefficients(matrix)
    with np.errstate(over="ignore", invalid="ignore"):
        return _combined(M, mean, 1.0 + mean * alpha + delta * beta, alpha + mean * beta)


def planar_phi(matrix: ArrayLike) -> FloatArray:
    """phi(M) for M (..., 2, 2), also where M is singular. Raises AnalysisError as `planar_exponential`."""
    M, mean, _, alpha, beta = _coefficients(matrix)
    with np.errstate(over="ignore", invalid="ignore"):
        return _combined(M, mean, alpha, beta)


def _coefficients(matrix: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """M, m, delta, alpha and beta."""
    M = square("matrix", matrix)
    if M.shape[-1] != 2:
        raise AnalysisError(f"matrix has the shape {M.shape}; the closed form is for (..., 2, 2), use scipy's expm")
    mean = 0.5 * (M[..., 0, 0] + M[..., 1, 1])
    half = 0.5 * (M[..., 0, 0] - M[..., 1, 1])
    delta = half * half + M[..., 0, 1] * M[..., 1, 0]
    with np.errstate(over="ignore", invalid="ignore"):
        alpha, beta = phi(np.atleast_1d(mean), np.atleast_1d(delta))
    return M, mean, delta, alpha.reshape(mean.shape), beta.reshape(mean.shape)


def _combined(M: FloatArray, mean: FloatArray, diagonal: FloatArray, slope: FloatArray) -> FloatArray:
    """diagonal I + slope N."""
    out = M * slope[..., None, None]
    out[..., 0, 0] = diagonal + slope * (M[..., 0, 0] - mean)
    out[..., 1, 1] = diagonal + slope * (M[..., 1, 1] - mean)
    out[np.isnan(out)] = np.inf  # e^m overflowed: inf - inf, or inf times an entry that is zero
    return out
