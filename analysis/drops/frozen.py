r"""Packet drops: the drop probability at which mean-square stability is lost, exactly (P3 (24), (25), Fig. 7).

    e+ = A0 e with probability p (dropped),  A1 e with probability 1 - p (received),
    M(p) = p S(A0) + (1 - p) S(A1)  moves the second moment,  mean-square stable if and only if radius of M(p) < 1.

The radius is continuous in p and an eigenvalue of M(p) itself (Krein and Rutman), so on the way up from p = 0 it reaches 1 for
the first time at the smallest p in (0, 1] at which det(I - M(p)) = 0. With A = S(A0), B = S(A1) and the received loop stable,
I - B is regular and

    det(I - B - p (A - B)) = det(I - B) det(I - p K),    K = (I - B)^-1 (A - B),

so p = 1 / mu for the largest real eigenvalue mu of K: one eigenvalue problem, no search. The radius is not monotone in p: it
can exceed 1 and return to 1 at p = 1, where an integrator in A0 puts an exact eigenvalue 1; two stable loops can be unstable
in between; two unstable ones stable. `mean_square_stable_intervals` gives the whole answer.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import leading, probability, same_size, square
from analysis.drops.balance import balanced
from analysis.drops.crossing import REAL, largest_real
from analysis.drops.planar import critical_planar
from analysis.drops.rational import exact_critical_drop
from analysis.drops.regions import Interval, regions
from analysis.errors import AnalysisError
from analysis.markov.enclosure import DATA, enclosed
from analysis.markov.second_moment import lifted, spectral_radius
from analysis.markov.system import LIFTED
from analysis.mode_objects import state_matrices
from estimators.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

CHECK = 1e-6  # how far the radius at an answer may lie from 1
ENDS = 1e-11  # crossings nearer to 0 or 1 than this are the ends themselves
SINGULAR = 1e14  # condition from which a matrix counts as singular


def drop_radius(open_loop: ArrayLike, closed_loop: ArrayLike, probabilities: ArrayLike) -> FloatArray:
    """Spectral radius of M(p), P3 Fig. 8; all arguments broadcast over leading axes.

    Raises AnalysisError for matrices that do not fit or probabilities outside [0, 1].

    >>> drop_radius([[1.2]], [[0.5]], [0.0, 1.0]).round(4).tolist()  # 0.5^2 and 1.2^2
    [0.25, 1.44]
    """
    A0, A1 = pair(open_loop, closed_loop)
    p = probability("probabilities", probabilities)[..., None, None]
    try:
        return spectral_radius(p * lifted(A0) + (1.0 - p) * lifted(A1))
    except ValueError as error:
        raise AnalysisError(f"probabilities of shape {p.shape[:-2]} do not broadcast: {error}") from None


def critical_drop_probability(open_loop: ArrayLike, closed_loop: ArrayLike) -> FloatArray:
    """Smallest p in (0, 1] at which the radius of M(p) reaches 1, for stacks of pairs (..., n, n); exact up to rounding.

    0 where the received loop is not stable by itself. 1 where every p < 1 is mean-square stable (then p = 1 is too, if the
    dropped loop is stable). Where rounding would show in the answer (nearly defective or marginal pairs) it is computed in
    rational arithmetic for the entries as they are stored; `critical_drop_interval` then says how far the rounding of the
    entries moves it.

    Raises AnalysisError for matrices that are not square, not finite or do not fit, or for an ill-posed pair of more than 8
    states.

    >>> round(float(critical_drop_probability([[1.2]], [[0.5]])), 4)  # p 1.2^2 + (1 - p) 0.5^2 = 1
    0.6303
    """
    A0, A1 = np.broadcast_arrays(*balanced(*pair(open_loop, closed_loop)))
    p, open_ = critical_planar(A0, A1) if A0.shape[-1] == 2 else _by_eigenvalues(A0, A1)
    p = np.array(p)
    for place in np.argwhere(open_):
        at = tuple(place)
        p[at] = exact_critical_drop(A0[at], A1[at])
    return p


def _by_eigenvalues(A0: FloatArray, A1: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Critical probabilities (...), and where rounding would show in them."""
    A, B = lifted(A0), lifted(A1)
    inner = enclosed(A1, DATA * np.abs(A1))
    stable = inner.upper < 1.0
    clear = stable | (inner.lower >= 1.0)
    identity = np.eye(A.shape[-1])
    clear &= ~stable | (np.linalg.slogdet(identity - B)[0] != 0.0)
    left = np.where((stable & clear)[..., None, None], identity - B, identity)  # a placeholder where K is not needed
    largest, doubtful = largest_real(np.asarray(np.linalg.solve(left, A - B), float), np.linalg.cond(left))
    p = np.where(stable, 1.0 / np.maximum(largest, 1.0), 0.0)
    return p, ~clear | (stable & doubtful)


def mean_square_stable_intervals(open_loop: ArrayLike, closed_loop: ArrayLike) -> tuple[tuple[float, float], ...]:
    """All drop probabilities with radius below 1, as open intervals (relative to [0, 1]), for one pair (n, n).

    The ends are 0, 1 or eigenvalue crossings; between neighbouring crossings the radius cannot pass 1, so one value decides.
    Raises AnalysisError as `critical_drop_probability`, and for stacks.

    >>> [[round(end, 4) for end in interval] for interval in mean_square_stable_intervals([[1.2]], [[0.5]])]
    [[0.0, 0.6303]]
    """
    A0, A1 = pair(open_loop, closed_loop)
    if A0.ndim != 2 or A1.ndim != 2:
        raise AnalysisError(f"intervals are for one pair of matrices, not stacks {A0.shape}, {A1.shape}")
    A0, A1 = balanced(A0, A1)
    sizes = (LIFTED * lifted(np.abs(A)) for A in (A1, A0))
    return stable_intervals(lifted(A1), lifted(A0), *sizes)


def stable_intervals(
    first: FloatArray, last: FloatArray, first_error: FloatArray, last_error: FloatArray
) -> tuple[Interval, ...]:
    """Open intervals of x in [0, 1] on which the radius of (1 - x) first + x last is below 1, for cone-preserving operators.

    Where computed ends leave the cells in which rounding of the data lets them lie (`analysis.drops.regions`), the
    intervals are those that are stable for all data within the errors.
    """
    found, sure = _float_intervals(first, last), regions(first, last, first_error, last_error)
    held = all(any(a <= low and high <= b for a, b in found) for low, high in sure.stable)
    apart = all(b <= low or high <= a for low, high in sure.unstable for a, b in found)
    return found if held and apart else sure.stable


def _float_intervals(first: FloatArray, last: FloatArray) -> tuple[Interval, ...]:
    cuts = [0.0, *crossings(first, last), 1.0]
    pieces: list[Interval] = []
    for low, high in pairwise(cuts):
        middle, touch = (spectral_radius((1.0 - x) * first + x * last) for x in (0.5 * (low + high), low))
        if middle < 1.0:
            # Eigenvalues other than the largest may pass 1 only above it, so a cut inside a stable stretch is rounding.
            if pieces and pieces[-1][1] == low and touch < 1.0 - CHECK:
                pieces[-1] = (pieces[-1][0], high)
            else:
                pieces.append((low, high))
    return tuple(pieces)


def crossings(first: FloatArray, last: FloatArray) -> list[float]:
    """Every x inside (0, 1) at which (1 - x) first + x last has an eigenvalue 1, in order."""
    identity = np.eye(first.shape[-1])
    # I - first may be singular here: expand about the best conditioned of a few points inside (0, 1). All are singular only if
    # every x is a crossing.
    shifts = np.array([0.5, 0.31, 0.73, 0.11, 0.93])
    pencils = identity - (1.0 - shifts)[:, None, None] * first - shifts[:, None, None] * last
    condition = np.linalg.cond(pencils)
    best = int(condition.argmin())
    if not condition[best] < SINGULAR:
        return []  # an eigenvalue 1 everywhere: the radius is never below 1
    mu = np.linalg.eigvals(np.linalg.solve(pencils[best], last - first))  # det(I - (x - shift) K) = 0
    mu = mu[(np.abs(mu.imag) <= REAL * np.abs(mu)) & (mu.real != 0.0)].real
    found = shifts[best] + 1.0 / mu
    return sorted({float(x) for x in found if ENDS < x < 1.0 - ENDS})


def pair(open_loop: ArrayLike, closed_loop: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Both stacks, checked; discrete-time objects with A and dt give their A."""
    first, second = (state_matrices(loop, discrete=True)[0] for loop in (open_loop, closed_loop))
    A0, A1 = square("open_loop", first), square("closed_loop", second)
    same_size("open_loop", A0, "closed_loop", A1)
    leading({"open_loop": A0, "closed_loop": A1})
    return A0, A1
