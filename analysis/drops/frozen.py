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
from analysis.drops.planar import critical_planar
from analysis.errors import AnalysisError
from analysis.markov.second_moment import lifted, spectral_radius
from estimators.arrays import FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# A real eigenvalue of a non-symmetric matrix comes out with an imaginary part of up to the square root of the rounding
# error where it is nearly double.
REAL = 1e-6
# How far the radius at the answer may lie from 1 before the answer is refused.
CHECK = 1e-6
ENDS = 1e-11  # crossings nearer to 0 or 1 than this are the ends themselves
SINGULAR = 1e14  # condition from which a matrix counts as singular


def drop_radius(open_loop: ArrayLike, closed_loop: ArrayLike, probabilities: ArrayLike) -> FloatArray:
    """Spectral radius of M(p), P3 Fig. 8; all arguments broadcast over leading axes.

    Raises AnalysisError for matrices that do not fit or probabilities outside [0, 1].
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
    dropped loop is stable).

    Raises AnalysisError for matrices that are not square, not finite or do not fit, or if an answer fails its check.
    """
    A0, A1 = balanced(*pair(open_loop, closed_loop))
    if A0.shape[-1] == 2:
        return critical_planar(A0, A1)
    A, B = lifted(A0), lifted(A1)
    A, B = np.broadcast_arrays(A, B)
    stable = spectral_radius(A1) < 1.0
    stable = np.broadcast_to(stable, A.shape[:-2])
    identity = np.eye(A.shape[-1])
    left = np.where(stable[..., None, None], identity - B, identity)  # a placeholder where the answer is 0 anyway
    mu = np.linalg.eigvals(np.linalg.solve(left, A - B))
    real = np.abs(mu.imag) <= REAL * np.abs(mu)
    largest = np.where(real, mu.real, 0.0).max(axis=-1)
    p = np.where(stable, 1.0 / np.maximum(largest, 1.0), 0.0)
    _check(A, B, p, crossing=stable & (largest > 1.0))
    return np.asarray(p)


def _check(
    A: FloatArray, B: FloatArray, p: FloatArray, crossing: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
) -> None:
    """Refuse an answer at which the radius is not 1: the eigenvalues of K were too ill-conditioned."""
    if not crossing.any():
        return
    at = p[crossing][:, None, None]
    radius = spectral_radius(at * A[crossing] + (1.0 - at) * B[crossing])
    worst = int(np.abs(radius - 1.0).argmax())
    if not abs(radius[worst] - 1.0) <= CHECK:
        place = [int(i) for i in np.argwhere(crossing)[worst]]
        raise AnalysisError(
            f"critical drop probability of pair {place}: the radius at p = {at[worst, 0, 0]:.6g} is {radius[worst]:.9g}, not 1; "
            "balanced, the pair is still nearly defective, and "
            "the rounding of its entries alone moves the answer: bracket it with drop_radius"
        )


def mean_square_stable_intervals(open_loop: ArrayLike, closed_loop: ArrayLike) -> tuple[tuple[float, float], ...]:
    """All drop probabilities with radius below 1, as open intervals (relative to [0, 1]), for one pair (n, n).

    The ends are 0, 1 or eigenvalue crossings; between neighbouring crossings the radius cannot pass 1, so one value decides.
    Raises AnalysisError as `critical_drop_probability`, and for stacks.
    """
    A0, A1 = pair(open_loop, closed_loop)
    if A0.ndim != 2 or A1.ndim != 2:
        raise AnalysisError(f"intervals are for one pair of matrices, not stacks {A0.shape}, {A1.shape}")
    A0, A1 = balanced(A0, A1)
    return stable_intervals(lifted(A1), lifted(A0))


def stable_intervals(first: FloatArray, last: FloatArray) -> tuple[tuple[float, float], ...]:
    """Open intervals of x in [0, 1] on which the radius of (1 - x) first + x last is below 1, for cone-preserving operators."""
    cuts = [0.0, *crossings(first, last), 1.0]
    pieces: list[tuple[float, float]] = []
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
    """Both stacks, checked."""
    A0, A1 = square("open_loop", open_loop), square("closed_loop", closed_loop)
    same_size("open_loop", A0, "closed_loop", A1)
    leading({"open_loop": A0, "closed_loop": A1})
    return A0, A1
