r"""Bursty packet losses: mean-square stability over failure and recovery probabilities (Gilbert 1960, Elliott 1963).

The channel is good (received, A1) or bad (dropped, A0): f = Pr(bad next | good now), r = Pr(good next | bad now). Independent
drops with probability p are f = p, r = 1 - p. With A = S(A0), B = S(A1) an eigenvalue 1 of the second-moment operator means

    x = (1 - f) B x + r A y,    y = f B x + (1 - r) A y,

and, x eliminated (where r = 1 is stable, (1 - f) B is, so I - (1 - f) B is regular),

    det(I - A + r H A) = 0,    H = (I - B)(I - (1 - f) B)^-1.

In t = 1 - r this reads det(I - t K) = 0 with K = (I - A + H A)^-1 H A: for each f the boundary is one eigenvalue problem of size
n(n+1)/2. Going down from r = 1, stability is lost at the smallest t > 0, that is, the largest real eigenvalue of K.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import probability
from analysis.drops.balance import balanced
from analysis.drops.crossing import largest_real
from analysis.drops.frozen import CHECK, pair, stable_intervals
from analysis.drops.rational import exact_critical_recovery
from analysis.errors import AnalysisError
from analysis.markov.second_moment import lifted
from analysis.markov.system import LIFTED, MarkovJumpSystem, second_moment_operator
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

    >>> print(gilbert_elliott([[1.2]], [[0.5]], failure=0.1, recovery=0.5).verdict())
    certified
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

    >>> (stability_region([[1.2]], [[0.5]], [0.1], [0.1, 0.9]) < 1.0).tolist()
    [[False, True]]
    """
    f, r = np.atleast_1d(probability("failure", failure)), np.atleast_1d(probability("recovery", recovery))
    return gilbert_elliott(open_loop, closed_loop, f[:, None], r[None, :]).second_moment_radius()


def critical_recovery_probability(open_loop: ArrayLike, closed_loop: ArrayLike, failure: ArrayLike) -> FloatArray:
    """The boundary of the region: the recovery probability above which the system is mean-square stable.

    For pairs (..., n, n) and failure probabilities that broadcast with (...). 0 where every r in (0, 1] is stable, inf
    where r = 1 (one sample lost at a time) is not; `stable_recovery_intervals` then says whether some smaller r is. Where
    rounding would show in the answer it is computed in rational arithmetic for the entries as they are stored;
    `critical_recovery_interval` then says how far the rounding of the entries moves it.

    Raises AnalysisError for arguments that do not fit, probabilities outside [0, 1], or an ill-posed pair of more than 5 states.

    >>> round(float(critical_recovery_probability([[1.2]], [[0.5]], 0.1)), 4)
    0.3157
    """
    A0, A1 = balanced(*pair(open_loop, closed_loop))
    f = probability("failure", failure)
    try:
        shape = np.broadcast_shapes(A0.shape[:-2], A1.shape[:-2], f.shape)
    except ValueError:
        raise AnalysisError(f"failure {f.shape} does not broadcast with the pairs {A0.shape}, {A1.shape}") from None
    A0, A1 = (np.broadcast_to(X, (*shape, *X.shape[-2:])) for X in (A0, A1))
    A, B, f = lifted(A0), lifted(A1), np.broadcast_to(f, shape)
    always = gilbert_elliott(A0, A1, f, np.ones(shape)).radius_bounds()
    stable = always[1] < 1.0
    clear = stable | (always[0] >= 1.0)
    identity = np.eye(A.shape[-1])
    safe = np.where((stable & clear)[..., None, None], 1.0, 0.0)  # zero systems stand in where K is not needed
    A, B = A * safe, B * safe
    # H = (I - B)(I - (1 - f) B)^-1; the factors commute.
    inner = identity - (1.0 - f)[..., None, None] * B
    H = np.linalg.solve(inner, identity - B)
    pencil = identity - A + H @ A
    K = np.asarray(np.linalg.solve(pencil, H @ A), float)
    largest, doubtful = largest_real(K, np.linalg.cond(pencil) + np.linalg.cond(inner))
    crossing = stable & (largest > 1.0 + SURE)
    critical = np.array(np.where(stable, np.where(crossing, 1.0 - 1.0 / np.maximum(largest, 1.0), 0.0), np.inf))
    if crossing.any():
        radius = gilbert_elliott(A0, A1, f, np.where(crossing, critical, 1.0)).second_moment_radius()
        doubtful |= crossing & ~(np.abs(radius - 1.0) <= CHECK)
    for place in np.argwhere(~clear | (stable & doubtful)):
        at = tuple(place)
        critical[at] = exact_critical_recovery(A0[at], A1[at], float(f[at]))
    return critical


def stable_recovery_intervals(
    open_loop: ArrayLike, closed_loop: ArrayLike, failure: float
) -> tuple[tuple[float, float], ...]:
    """All recovery probabilities with radius below 1, as open intervals, for one pair (n, n) and one failure probability.

    The region need not reach r = 1: losing exactly one sample at a time can be worse than losing some in a row.
    Raises AnalysisError as `gilbert_elliott`.

    >>> [[round(end, 4) for end in interval] for interval in stable_recovery_intervals([[1.2]], [[0.5]], 0.1)]
    [[0.3157, 1.0]]
    """
    A0, A1 = balanced(*pair(open_loop, closed_loop))
    never, always = (gilbert_elliott(A0, A1, failure, r) for r in (0.0, 1.0))
    if never.batch_shape:
        raise AnalysisError(f"intervals are for one pair and one failure probability, not a batch {never.batch_shape}")
    sizes = [LIFTED * second_moment_operator(np.abs(s.modes), s.transition) for s in (never, always)]
    return stable_intervals(never.second_moment_operator, always.second_moment_operator, *sizes)
