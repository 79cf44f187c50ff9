"""How far a pair is from one with a mode that is not seen (not reached): two sides of the distance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.observability.hautus_distance import Region, below, descend, least
from analysis.observability.pairs import EPSILON, driven_pair, observed_pair
from analysis.observability.witness_gain import witness_gain
from estimators.arrays import FloatArray
from estimators.display import Display

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

GAP = 0.01
EVALUATIONS = 40_000  # at most, of the smallest singular value


@dataclass(frozen=True, repr=False)
class HiddenModeDistance(Display):
    r"""lower <= min over z of sigma_min [A - z I; C] <= upper, which is attained at z = `mode` (1/s or per sample) [Eising1984].

    That minimum is the least spectral norm of a change (E, G), complex numbers allowed, for which (A + E, C + G) has a hidden
    mode in the region; with real changes it is no less. Absolute, in the units of the given matrices: scale states and outputs
    by their typical sizes first. `rounding` is the size below which the matrices as floats say nothing.
    """

    lower: float
    upper: float
    mode: complex
    rounding: float


def distance_to_unobservability(
    A: Any, C: ArrayLike | None = None, gap: float = GAP, evaluations: int = EVALUATIONS
) -> HiddenModeDistance:
    """Over all z, for A (n, n), C (m, n) or a system object; ends at a relative `gap` of the sides or at `evaluations`.

    Lower bounds by subdivision (sigma_min is Lipschitz with constant 1) and by gains that keep a loop stable (`witness_gain`).
    Raises AnalysisError for several pairs at once, shapes that do not fit, and a gap outside (0, 1).

    >>> found = distance_to_unobservability([[1.0, 0.0], [0.0, -2.0]], [[1.0, 0.01]])
    >>> found.lower <= found.upper <= 0.01
    True
    """
    A, C, _ = observed_pair(A, C, False if getattr(A, "dt", 0) is None else None)
    return bracket(A, C, Region.PLANE, gap, evaluations)


def distance_to_undetectability(
    A: Any, C: ArrayLike | None = None, discrete: bool | None = None, gap: float = GAP, evaluations: int = EVALUATIONS
) -> HiddenModeDistance:
    """Over the modes that do not decay: Re z >= 0, or |z| >= 1 in discrete time.

    >>> found = distance_to_undetectability([[1.0, 0.0], [0.0, -2.0]], [[0.01, 1.0]])
    >>> 0.0 < found.lower <= found.upper <= 0.01  # the unstable state is hardly seen
    True
    """
    A, C, time = observed_pair(A, C, discrete)
    return bracket(A, C, Region.OUTSIDE if time else Region.RIGHT, gap, evaluations)


def distance_to_uncontrollability(
    A: Any, B: ArrayLike | None = None, gap: float = GAP, evaluations: int = EVALUATIONS
) -> HiddenModeDistance:
    """min over all z of sigma_min [A - z I, B], for A (n, n), B (n, m) or a system object.

    >>> found = distance_to_uncontrollability([[1.0, 0.0], [0.0, -2.0]], [[1.0], [0.01]])
    >>> 0.0 < found.lower <= found.upper <= 0.01
    True
    """
    A, B, _ = driven_pair(A, B, False if getattr(A, "dt", 0) is None else None)
    return bracket(A, B, Region.PLANE, gap, evaluations)


def distance_to_unstabilizability(
    A: Any, B: ArrayLike | None = None, discrete: bool | None = None, gap: float = GAP, evaluations: int = EVALUATIONS
) -> HiddenModeDistance:
    """The same over the modes that do not decay.

    >>> found = distance_to_unstabilizability([[1.0, 0.0], [0.0, -2.0]], [[0.01], [1.0]])
    >>> 0.0 < found.lower <= found.upper <= 0.01
    True
    """
    A, B, time = driven_pair(A, B, discrete)
    return bracket(A, B, Region.OUTSIDE if time else Region.RIGHT, gap, evaluations)


def bracket(A: FloatArray, C: FloatArray, region: Region, gap: float, evaluations: int) -> HiddenModeDistance:
    """Both sides for one pair A (n, n), C (m, n)."""
    if A.ndim != 2:
        raise AnalysisError(f"A has the shape {A.shape}; a distance is found for one pair (n, n) at a time")
    if not 0.0 < gap < 1.0:
        raise AnalysisError(f"gap = {gap} must lie between 0 and 1; it is relative to the distance")
    size = float(np.linalg.norm(np.concatenate([A, C]), 2))
    if size == 0.0:
        return HiddenModeDistance(0.0, 0.0, complex(region.nearest(np.zeros(1, complex))[0]), 0.0)
    rounding = 8.0 * len(A) * EPSILON * size
    upper, mode = least(A, C, region)
    if upper <= rounding:
        return HiddenModeDistance(0.0, upper, mode, rounding)
    lower, found, better = below(A, C, region, upper, gap, evaluations)
    if better is not None:
        upper, mode = min((found, better), descend(A, C, region, np.array([better])), key=lambda pair: pair[0])
    lower = max(lower - rounding, 0.0)
    if lower < (1.0 - 2.0 * gap) * upper:  # hidden modes of high order: subdivision runs out before it is that near
        lower = max(lower, _by_gain(A, C, region))
    return HiddenModeDistance(min(lower, upper), upper, mode, rounding)


def _by_gain(A: FloatArray, C: FloatArray, region: Region) -> float:
    """Detectability of (A, C) covers the modes with Re z >= 0, that of (-A, C) the others."""
    found = witness_gain(A, C, region is Region.OUTSIDE)[0]
    return min(found, witness_gain(-A, C, False)[0]) if region is Region.PLANE else found
