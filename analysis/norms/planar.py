r"""Margin and H-infinity norm of stacks of systems with two states, in closed form: no eigenvalue problem, no search.

With tau = tr A, d = det A and adj A = tau I - A, a channel of one output or one input has entries (alpha_k s - beta_k)/(s^2 -
tau s + d), alpha = C B, beta = C adj(A) B, so its squared gain at x = omega^2 is

    f(x) = (a x + b)/(x^2 + p x + d^2),    a = |alpha|^2, b = |beta|^2, p = tau^2 - 2 d,

and f'(x) = 0 is a x^2 + 2 b x - (a d^2 - b p) = 0, whose only root x >= 0 is the peak.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.checks import as_stack, leading, square
from analysis.errors import AnalysisError
from analysis.state_space import given_system
from estimators.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def planar_margin(A: Any) -> FloatArray:
    """max Re lambda(A) of A (..., 2, 2) or a continuous system object, as `stability_margin`. Raises AnalysisError for others."""
    A, *_, discrete = given_system(A)
    if discrete:
        raise AnalysisError("this closed form is for continuous systems; use stability_margin")
    trace, det, delta = _invariants(A)
    root = np.sqrt(np.maximum(delta, 0.0))
    half = 0.5 * trace
    # the smaller of two negative real poles from the product of both: half + root would cancel
    low = half - root
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where((delta > 0.0) & (half < 0.0), det / low, half + root)


def planar_hinf_norm(A: Any, B: ArrayLike | None = None, C: ArrayLike | None = None) -> tuple[FloatArray, FloatArray]:
    r"""sup_w |C (j w I - A)^-1 B| and the frequency in rad/s at which it is attained, as `analysis.norms.hinf_norm`.

    A (..., 2, 2), B (..., 2, m), C (..., p, 2) with p = 1 or m = 1. Unstable: inf at NaN. Raises AnalysisError otherwise.
    """
    A, B, C, D, discrete = given_system(A, B, C)
    if B is None or C is None or discrete or (D is not None and np.any(D)):
        raise AnalysisError("this closed form is for continuous systems with B, C and D = 0; use hinf_norm")
    b_, c_ = as_stack("B", B), as_stack("C", C)
    if b_.shape[-2] != 2 or c_.shape[-1] != 2 or min(b_.shape[-1], c_.shape[-2]) != 1:
        raise AnalysisError(f"B {b_.shape} and C {c_.shape} need two states and one input or one output; use hinf_norm")
    trace, det, _ = _invariants(A)
    M = np.asarray(A, float)
    leading({"A": M, "B": b_, "C": c_})
    through, seen = c_ @ b_, c_ @ (M @ b_)
    a = (through**2).sum(axis=(-2, -1))
    b = ((trace[..., None, None] * through - seen) ** 2).sum(axis=(-2, -1))
    p, q = trace**2 - 2.0 * det, det**2
    rise = np.maximum(a * q - b * p, 0.0)
    scale = b + np.sqrt(b * b + a * rise)
    x = np.where(rise > 0.0, rise / np.where(scale > 0.0, scale, 1.0), 0.0)
    stable = (trace < 0.0) & (det > 0.0)
    below = np.where(stable, (det - x) ** 2 + trace**2 * x, 1.0)
    norm = np.where(stable, np.sqrt((a * x + b) / below), np.inf)
    return norm, np.where(stable, np.sqrt(x), np.nan)


def _invariants(A: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Trace, determinant and ((a11 - a22)/2)^2 + a12 a21."""
    M = square("A", A)
    if M.shape[-1] != 2:
        raise AnalysisError(f"A has the shape {M.shape}; these closed forms are for two states")
    cross = M[..., 0, 1] * M[..., 1, 0]
    delta = 0.25 * (M[..., 0, 0] - M[..., 1, 1]) ** 2 + cross
    return M[..., 0, 0] + M[..., 1, 1], M[..., 0, 0] * M[..., 1, 1] - cross, delta


def determinant(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """a d - b c of arrays, to the last digits even where the products cancel."""
    return expanded(a, b, c, d, 0, 0)


def expanded(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, one: int, trace: int) -> FloatArray:
    """one + trace (a + d) + a d - b c of arrays: products and sums with their rounding errors [Dekker1971]."""
    first, first_error = _product(a, d)
    second, second_error = _product(-b, c)
    total, error = _sum(first, second)
    error = error + (first_error + second_error)
    if one or trace:
        for term in (trace * a, trace * d, np.full_like(a, float(one))) if trace else (np.full_like(a, float(one)),):
            total, more = _sum(total, term)
            error = error + more
    return total + error


def _sum(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    total = x + y
    part = total - x
    return total, (x - (total - part)) + (y - part)


def _product(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    product = x * y
    x_high, y_high = _head(x), _head(y)
    x_low, y_low = x - x_high, y - y_high
    error = x_low * y_low - (((product - x_high * y_high) - x_low * y_high) - x_high * y_low)
    return product, np.where(np.isfinite(error), error, 0.0)


def _head(x: FloatArray) -> FloatArray:
    """The upper half of the digits."""
    scaled = 134217729.0 * x  # 2^27 + 1
    return scaled - (scaled - x)
