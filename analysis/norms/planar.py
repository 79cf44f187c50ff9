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
from analysis.norms.compensated import determinant
from analysis.norms.stability import stability
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

    A (..., 2, 2), B (..., 2, m), C (..., p, 2) with p = 1 or m = 1. Unstable: inf at NaN, undecided
    (`HinfNorm`): NaN. Raises AnalysisError otherwise.
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
    found = stability(M.reshape(-1, 2, 2), discrete=False)
    stable, undecided = (answer.reshape(trace.shape) for answer in (found.stable, found.undecided))
    below = np.where(stable, (det - x) ** 2 + trace**2 * x, 1.0)
    norm = np.where(stable, np.sqrt((a * x + b) / below), np.where(undecided, np.nan, np.inf))
    return norm, np.where(stable, np.sqrt(x), np.nan)


def _invariants(A: ArrayLike) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Trace, determinant and ((a11 - a22)/2)^2 + a12 a21."""
    M = square("A", A)
    if M.shape[-1] != 2:
        raise AnalysisError(f"A has the shape {M.shape}; these closed forms are for two states")
    a, b, c, d = M[..., 0, 0], M[..., 0, 1], M[..., 1, 0], M[..., 1, 1]
    return a + d, determinant(a, b, c, d), 0.25 * (a - d) ** 2 + b * c
