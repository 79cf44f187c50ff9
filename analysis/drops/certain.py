"""Answers about packet drops that hold for every pair of matrices within rounding of the given one, and say where they end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import probability
from analysis.drops.balance import balanced
from analysis.drops.frozen import critical_drop_probability, pair
from analysis.drops.gilbert_elliott import critical_recovery_probability, gilbert_elliott
from analysis.drops.rational import LARGEST
from analysis.drops.reach import Family, stable_until, unstable_from
from analysis.drops.regions import Regions, regions
from analysis.errors import AnalysisError
from analysis.markov.enclosure import DATA, EPS
from analysis.markov.regular import radius_verdicts
from analysis.markov.second_moment import lifted
from analysis.markov.system import second_moment_operator
from estimators.arrays import AnyArray, FloatArray
from estimators.display import Display
from synthesis.lmi.result import Verdict

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

MOST_ERROR = 1e-2


@dataclass(frozen=True, repr=False)
class CriticalInterval(Display):
    """lower <= critical probability <= upper for every pair within the error; `exact` for the entries as they are stored.

    `exact` is NaN where exact fractions would take too long.
    """

    lower: float
    upper: float
    exact: float


def drop_verdict(
    open_loop: ArrayLike, closed_loop: ArrayLike, probabilities: ArrayLike, relative: float = DATA
) -> Verdict | AnyArray:
    """CERTIFIED: mean-square stable at this drop probability, REFUTED: not, INCONCLUSIVE: undecided at this precision.

    For every pair whose entries differ from the given ones by no more than the part `relative` of their size (rounding to the
    nearest float unless said otherwise). Arguments broadcast as in `drop_radius`; one verdict, or an object array.
    Raises AnalysisError as `drop_radius`, or for a `relative` outside [0, 0.01].

    >>> [str(drop_verdict([[1.2]], [[0.5]], p, relative=0.01)) for p in (0.5, 0.63, 0.7)]
    ['certified', 'inconclusive', 'refuted']
    """
    share = _share(relative)
    A0, A1 = balanced(*pair(open_loop, closed_loop))
    p = probability("probabilities", probabilities)[..., None, None]
    try:
        operator, size = (
            p * a + (1.0 - p) * b for a, b in ((lifted(A0), lifted(A1)), (lifted(abs(A0)), lifted(abs(A1))))
        )
    except ValueError as error:
        raise AnalysisError(f"probabilities of shape {p.shape[:-2]} do not broadcast: {error}") from None
    return radius_verdicts(operator, share * size)


def drop_regions(open_loop: ArrayLike, closed_loop: ArrayLike, relative: float = DATA) -> Regions:
    """All drop probabilities of one pair (n, n), sorted into stable, unstable and undecided for every pair within `relative`.

    Raises AnalysisError for stacks, matrices that do not fit, or a `relative` outside [0, 0.01].

    >>> found = drop_regions([[1.2]], [[0.5]], relative=1e-3)
    >>> len(found.stable), len(found.undecided), len(found.unstable)
    (1, 1, 1)
    """
    A0, A1 = _one_pair(open_loop, closed_loop)
    share = _share(relative)
    return regions(lifted(A1), lifted(A0), share * lifted(np.abs(A1)), share * lifted(np.abs(A0)))


def critical_drop_interval(open_loop: ArrayLike, closed_loop: ArrayLike, relative: float = DATA) -> CriticalInterval:
    """Where `critical_drop_probability` of every pair within `relative` of one pair (n, n) lies. Raises as `drop_regions`.

    An interval that reaches 1 says that some pair within the error may be stable for every p below 1.

    >>> found = critical_drop_interval([[1.2]], [[0.5]], relative=1e-3)
    >>> bool(found.lower < 0.75 / 1.19 < found.upper)
    True
    """
    A0, A1 = _one_pair(open_loop, closed_loop)
    found = drop_regions(A0, A1, relative)
    share, exact = (
        _share(relative),
        float(critical_drop_probability(A0, A1)) if _unknowns(A0) <= LARGEST else float("nan"),
    )
    received, dropped = (share * lifted(np.abs(A)) for A in (A1, A0))
    family = Family(lifted(A1), lifted(A0), received, dropped, len(A0), 1)
    lower, upper = _narrowed(family, found, exact)
    return CriticalInterval(lower, upper, exact)


def recovery_regions(open_loop: ArrayLike, closed_loop: ArrayLike, failure: float, relative: float = DATA) -> Regions:
    """All recovery probabilities of one pair (n, n) at one failure probability, sorted as by `drop_regions`; raises as it
    does.

    >>> found = recovery_regions([[1.2]], [[0.5]], failure=0.1, relative=1e-3)
    >>> len(found.unstable), len(found.undecided), len(found.stable)
    (1, 1, 1)
    """
    family = _bursts(open_loop, closed_loop, failure, relative)
    found = regions(family.first, family.last, family.first_error, family.last_error)
    stable, unstable, undecided = (
        tuple((1.0 - b, 1.0 - a) for a, b in reversed(part)) for part in (found.stable, found.unstable, found.undecided)
    )
    return Regions(stable, unstable, undecided)


def critical_recovery_interval(
    open_loop: ArrayLike, closed_loop: ArrayLike, failure: float, relative: float = DATA
) -> CriticalInterval:
    """Where `critical_recovery_probability` of every pair within `relative` lies; an upper end of inf if r = 1 may be
    unstable.

    >>> found = critical_recovery_interval([[1.2]], [[0.5]], failure=0.1, relative=1e-3)
    >>> found.lower < float(critical_recovery_probability([[1.2]], [[0.5]], 0.1)) < found.upper
    True
    """
    family = _bursts(open_loop, closed_loop, failure, relative)
    found = regions(family.first, family.last, family.first_error, family.last_error)
    exact = float("nan")
    if len(family.first) <= LARGEST:
        exact = float(critical_recovery_probability(open_loop, closed_loop, failure))
    lower, upper = _narrowed(family, found, 1.0 - exact)
    ends = (np.inf if upper == 0.0 else 1.0 - upper, np.inf if lower == 0.0 else 1.0 - lower)
    return CriticalInterval(float(ends[0]), float(ends[1]), exact)


def _narrowed(family: Family, found: Regions, crossing: float) -> tuple[float, float]:
    """Certain bounds of the first crossing on the way up from 0, from regions and from a value that is near it."""
    lower = found.stable[0][1] if found.stable and found.stable[0][0] == 0.0 else 0.0
    upper = found.unstable[0][0] if found.unstable else 1.0
    if 0.0 < lower < crossing < upper:
        return stable_until(family, lower, crossing), unstable_from(family, crossing, upper)
    return lower, upper


def _bursts(open_loop: ArrayLike, closed_loop: ArrayLike, failure: float, relative: float) -> Family:
    """From recovery 1 at x = 0 to recovery 0 at x = 1."""
    A0, A1 = _one_pair(open_loop, closed_loop)
    always, never = (gilbert_elliott(A0, A1, failure, r) for r in (1.0, 0.0))
    if never.batch_shape:
        raise AnalysisError(f"regions are for one failure probability, not a batch {never.batch_shape}")
    first, last = (_share(relative) * second_moment_operator(np.abs(s.modes), s.transition) for s in (always, never))
    return Family(always.second_moment_operator, never.second_moment_operator, first, last, len(A0), 2)


def _one_pair(open_loop: ArrayLike, closed_loop: ArrayLike) -> tuple[FloatArray, FloatArray]:
    A0, A1 = pair(open_loop, closed_loop)
    if A0.ndim != 2 or A1.ndim != 2:
        raise AnalysisError(f"this is for one pair of matrices, not stacks {A0.shape}, {A1.shape}")
    return balanced(A0, A1)


def _share(relative: float) -> float:
    """Relative error of an entry of the operator: two factors within `relative`, a weight, and the rounding of their products."""
    if not 0.0 <= relative <= MOST_ERROR:
        raise AnalysisError(f"relative = {relative} must lie between 0 and {MOST_ERROR}")
    return 2.0 * relative + relative**2 + 8.0 * EPS


def _unknowns(A: FloatArray) -> int:
    return len(A) * (len(A) + 1) // 2
