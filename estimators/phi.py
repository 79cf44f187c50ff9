"""The integral of the exponential of 2 x 2 matrices, in closed form and without singular cases.

For M = m I + N with trace N = 0, Cayley-Hamilton gives N^2 = delta I, so every function of M is a combination of I, N:

    e^M     = e^m (cosh(r) I + sinh(r)/r N),                     r = sqrt(delta)
    phi(M)  = int_0^1 e^(M s) ds = alpha I + beta N,             e^M = I + M phi(M)
    alpha   = (m (e^m cosh(r) - 1) - delta e^m sinh(r)/r) / (m^2 - delta)
    beta    = (m e^m sinh(r)/r - (e^m cosh(r) - 1)) / (m^2 - delta)

cosh(r) and sinh(r)/r are entire functions of delta: double and complex poles need no case of their own. Only where
det M = m^2 - delta nearly vanishes (an integrator, such as the kinematics without correction) the quotients lose
digits; there either delta is near m^2, so that the eigenvalues m +- r are real, or both are small. Far apart, they give
the divided difference of (e^x - 1)/x; close together they are small, and the Taylor series of phi converges at once.
"""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np

from estimators.arrays import FloatArray

Number = TypeVar("Number", float, FloatArray)
_SERIES_LIMIT = 4.0  # |delta| up to which the series of sinh(r/2)/(r/2) below is exact to float64
_SERIES = [1.0 / math.factorial(2 * k + 1) for k in range(9)]
_WEAK, _TINY = 4e-3, 1e-5  # the quotients lose more than 2 to 3 digits up to |det M| = _WEAK m^2 + _TINY
_APART = 0.1  # r from which the eigenvalues are far enough apart for a divided difference
_TAYLOR = [1.0 / math.factorial(k) for k in range(13, 0, -1)]


def phi(mean: Number, delta: Number) -> tuple[Number, Number]:
    """alpha and beta of the matrices with m = `mean`: of one, in plain numbers, or of many, in arrays."""
    if isinstance(mean, np.ndarray) or isinstance(delta, np.ndarray):
        mean, delta = np.broadcast_arrays(mean, delta)  # one of them may be the same for all
        alpha, beta = _arrays(mean.ravel(), delta.ravel())
        return alpha.reshape(mean.shape), beta.reshape(mean.shape)
    square = mean * mean
    det = square - delta
    root = math.sqrt(abs(delta))
    if abs(det) <= _WEAK * square + _TINY:
        if root > _APART:
            upper, lower = _quotient(mean + root), _quotient(mean - root)
            return 0.5 * (upper + lower), 0.5 * (upper - lower) / root
        a = b = 0.0
        for term in _TAYLOR:  # Horner: phi <- M phi + 1/k!
            a, b = mean * a + delta * b + term, a + mean * b
        return a, b
    if delta > 0:  # m and r meet in one exponent, so that nothing overflows on the way
        cosh = 0.5 * (math.expm1(mean + root) + math.expm1(mean - root))
        sinch = -0.5 * math.exp(mean + root) * math.expm1(-2.0 * root) / root
    else:
        cosh = math.expm1(mean) * math.cos(root) - 2.0 * math.sin(0.5 * root) ** 2
        sinch = math.exp(mean) * (math.sin(root) / root if root else 1.0)
    return (mean * cosh - delta * sinch) / det, (mean * sinch - cosh) / det


def phi_of(matrices: FloatArray) -> FloatArray:
    """phi(M) of 2 x 2 matrices (..., 2, 2); e^M = I + M phi(M)."""
    M = np.asarray(matrices, dtype=np.float64)
    mean = 0.5 * (M[..., 0, 0] + M[..., 1, 1])
    N = M - mean[..., None, None] * np.eye(2)
    alpha, beta = map(np.asarray, phi(mean, (N @ N)[..., 0, 0]))
    out: FloatArray = alpha[..., None, None] * np.eye(2) + beta[..., None, None] * N
    return out


def _arrays(mean: FloatArray, delta: FloatArray) -> tuple[FloatArray, FloatArray]:
    small = np.maximum.reduce(np.absolute(delta), initial=0.0) <= _SERIES_LIMIT
    cosh, sinch = (_series if small else _hyperbolic)(mean, delta)
    square = mean * mean
    det = square - delta
    strong = np.absolute(det) > _WEAK * square + _TINY
    if strong.all():
        return (mean * cosh - delta * sinch) / det, (mean * sinch - cosh) / det
    safe, weak = np.where(strong, det, 1.0), np.flatnonzero(~strong)
    alpha, beta = (mean * cosh - delta * sinch) / safe, (mean * sinch - cosh) / safe
    alpha[weak], beta[weak] = _weak(mean[weak], delta[weak])
    return alpha, beta


def _series(mean: FloatArray, delta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """e^m cosh(r) - 1 and e^m sinh(r)/r, from s = sinh(r/2)/(r/2) as a power series in delta/4.

    cosh(r) - 1 = 2 sinh^2(r/2) and sinh(r)/r = s cosh(r/2) keep all digits where delta is small; cosh(r/2) is positive,
    for where it is cos(|r|/2), |r| <= 2.
    """
    quarter = delta * 0.25
    s = quarter * _SERIES[-1]
    for term in _SERIES[-2:0:-1]:
        s = (s + term) * quarter
    s = s + 1.0
    square, risen = s * s * quarter, np.expm1(mean)  # sinh^2(r/2)
    growth = risen + 1.0
    return 2.0 * square * growth + risen, s * np.sqrt(square + 1.0) * growth


def _hyperbolic(mean: FloatArray, delta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """e^m cosh(r) - 1 and e^m sinh(r)/r for any delta, as in `phi`."""
    root = np.sqrt(np.abs(delta))
    real = delta > 0
    width, angle = np.where(real, root, 0.0), np.where(real, 0.0, root)
    cosh = np.where(
        real,
        0.5 * (np.expm1(mean + width) + np.expm1(mean - width)),
        np.expm1(mean) * np.cos(angle) - 2.0 * np.sin(0.5 * angle) ** 2,
    )
    slope = np.where(real, -0.5 * np.expm1(-2.0 * width), np.sin(angle)) / np.where(root > 0, root, 1.0)
    return cosh, np.exp(mean + width) * np.where(root > 0, slope, 1.0)


def _weak(mean: FloatArray, delta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """alpha and beta where det M nearly vanishes, as in `phi`."""
    root = np.sqrt(np.maximum(delta, 0.0))
    far = root > _APART
    alpha, beta = np.zeros_like(mean), np.zeros_like(mean)
    for term in _TAYLOR:
        alpha, beta = mean * alpha + delta * beta + term, alpha + mean * beta
    upper, lower = _quotients(mean[far] + root[far]), _quotients(mean[far] - root[far])
    alpha[far], beta[far] = 0.5 * (upper + lower), 0.5 * (upper - lower) / root[far]
    return alpha, beta


def _quotient(x: float) -> float:
    """(e^x - 1)/x, 1 at 0."""
    return math.expm1(x) / x if x else 1.0


def _quotients(x: FloatArray) -> FloatArray:
    """(e^x - 1)/x, 1 at 0."""
    zero = x == 0
    safe: FloatArray = np.where(zero, 1.0, x)
    return np.where(zero, 1.0, np.expm1(safe) / safe)
