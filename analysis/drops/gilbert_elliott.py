r"""Bursty packet losses: mean-square stability over failure and recovery probabilities (Gilbert 1960, Elliott 1963).

The channel is good (received, A1) or bad (dropped, A0): f = Pr(bad next | good now), r = Pr(good next | bad now). Independent
drops with probability p are f = p, r = 1 - p. With A = S(A0), B = S(A1) an eigenvalue 1 of the second-moment operator means

    x = (1 - f) B x + r A y,    y = f B x + (1 - r) A y,

and, x eliminated (the received loop is stable, so I - (1 - f) B is regular),

    det(I - A + r H A) = 0,    H = (I - B)(I - (1 - f) B)^-1.

In t = 1 - r this reads det(I - t K) = 0 with K = (I - A + H A)^-1 H A: for each f the boundary is one eigenvalue problem of size
n(n+1)/2. Going down from r = 1, stability is lost at the smallest t > 0, that is, the largest real eigenvalue of K.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import probability
from analysis.drops.balance import balanced
from analysis.drops.frozen import CHECK, REAL, pair, stable_intervals
from analysis.errors import AnalysisError
from analysis.markov.second_moment import lifted, spectral_radius
from analysis.markov.system import MarkovJumpSystem, second_moment_operator
from estimators.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# An integrator in the dropped loop puts an exact eigenvalue at r = 0: rounding must not turn it into a boundary.
SURE = 1e-12


def gilbert_elliott(
    open_loop: ArrayLike, closed_loop: ArrayLike, failure: ArrayLike, recovery: ArrayLike
) -> MarkovJumpSystem:
    """The jump system with mode 0 good (closed_loop) and mode 1 bad (open_loop); all arguments broadcast.

    Raises AnalysisError for matrices that do not fit or probabilities outside [0, 1].
    """
    A0, A1 = pair(open_loop, closed_loop)
    A0, A1 = np.broadcast_arrays(A0, A1)
    f, r = probability("failure", failure), probability("recovery", recovery)
    try:
        f, r = np.broadcast_arrays(f, r)
    except ValueError:
        raise AnalysisError(f"failure {f.shape} and recovery {r.shape} do not broadcast") from None
    transition = np.stack([np.stack([1.0 - f, f], axis=-1), np.stack([r, 1.0 - r], axis=-1)], axis=-2)
    return MarkovJumpSystem(np.stack([A1, A0], axis=-3), transition)


def stability_region(
    open_loop: ArrayLike, closed_loop: ArrayLike, failure: ArrayLike, recovery: ArrayLike
) -> FloatArray:
    """Second-moment radius (f, r) over a grid of failure (f,) and recovery (r,) probabilities, for one pair (n, n).

    Below 1 is mean-square stable. Raises AnalysisError as `gilbert_elliott`.
    """
    f, r = np.atleast_1d(probability("failure", failure)), np.atleast_1d(probability("recovery", recovery))
    return gilbert_elliott(open_loop, closed_loop, f[:, None], r[None, :]).second_moment_radius()


def critical_recovery_probability(open_loop: ArrayLike, closed_loop: ArrayLike, failure: ArrayLike) -> FloatArray:
    """The boundary of the region: the recovery probability above which the system is mean-square stable.

    For pairs (..., n, n) and failure probabilities that broadcast with (...). 0 where every r in (0, 1] is stable, inf where
    r = 1 (one sample lost at a time) is not, or the received loop itself is not; `stable_recovery_intervals` then says whether
    some smaller r is.

    Raises AnalysisError for arguments that do not fit, probabilities outside [0, 1], or an answer that fails its check.
    """
    A0, A1 = balanced(*pair(open_loop, closed_loop))
    f = probability("failure", failure)
    try:
        shape = np.broadcast_shapes(A0.shape[:-2], A1.shape[:-2], f.shape)
    except ValueError:
        raise AnalysisError(f"failure {f.shape} does not broadcast with the pairs {A0.shape}, {A1.shape}") from None
    d = A0.shape[-1] * (A0.shape[-1] + 1) // 2
    A, B = (np.broadcast_to(lifted(X), (*shape, d, d)) for X in (A0, A1))
    f = np.broadcast_to(f, shape)
    stable = spectral_radius(B) < 1.0
    stable &= spectral_radius(_operator(A0, A1, f, np.ones(shape))) < 1.0
    identity = np.eye(A.shape[-1])
    safe = np.where(stable[..., None, None], 1.0, 0.0)  # zero systems stand in where the answer is inf anyway
    A, B = A * safe, B * safe
    # H = (I - B)(I - (1 - f) B)^-1; the factors commute.
    H = np.linalg.solve(identity - (1.0 - f)[..., None, None] * B, identity - B)
    mu = np.linalg.eigvals(np.linalg.solve(identity - A + H @ A, H @ A))
    real = (np.abs(mu.imag) <= REAL * np.abs(mu)) & (mu.real > 1.0 + SURE)
    largest = np.where(real, mu.real, 1.0).max(axis=-1)
    critical = np.where(stable, 1.0 - 1.0 / largest, np.inf)
    crossing = stable & (largest > 1.0)
    if crossing.any():
        radius = spectral_radius(_operator(A0, A1, f, np.where(crossing, critical, 1.0)))[crossing]
        if not (np.abs(radius - 1.0) <= CHECK).all():
            raise AnalysisError(
                f"critical recovery probability: the radius at an answer is {radius[np.abs(radius - 1.0).argmax()]:.9g}, not 1; "
                "balanced, the pair is still nearly defective, and "
                "the rounding of its entries alone moves the answer: bracket it with stability_region"
            )
    return np.asarray(critical)


def stable_recovery_intervals(
    open_loop: ArrayLike, closed_loop: ArrayLike, failure: float
) -> tuple[tuple[float, float], ...]:
    """All recovery probabilities with radius below 1, as open intervals, for one pair (n, n) and one failure probability.

    The region need not reach r = 1: losing exactly one sample at a time can be worse than losing some in a row.
    Raises AnalysisError as `gilbert_elliott`.
    """
    A0, A1 = balanced(*pair(open_loop, closed_loop))
    never, always = (gilbert_elliott(A0, A1, failure, r) for r in (0.0, 1.0))
    if never.batch_shape:
        raise AnalysisError(f"intervals are for one pair and one failure probability, not a batch {never.batch_shape}")
    return stable_intervals(never.second_moment_operator, always.second_moment_operator)


def _operator(A0: FloatArray, A1: FloatArray, failure: FloatArray, recovery: FloatArray) -> FloatArray:
    system = gilbert_elliott(A0, A1, failure, recovery)
    return second_moment_operator(system.modes, system.transition)
