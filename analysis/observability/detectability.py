"""Is a held pair detectable (stabilizable)? Certified by a gain, refuted by a hidden mode, or undecided at its precision."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.observability.exact_hidden import hidden_is_stable
from analysis.observability.growing_part import growing_mode, least_seen
from analysis.observability.hautus_distance import Region, below, least
from analysis.observability.pair_balance import balanced_pair
from analysis.observability.pairs import driven_pair, observed_pair, unit_pair, without_dust
from analysis.observability.staircase import rounding_tolerance, separate
from analysis.observability.witness_gain import witness_gain
from estimators.arrays import ComplexArray, FloatArray
from estimators.display import Display
from synthesis.lmi.result import Verdict

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

EXACT_STATES = 16  # exact rationals grow with every power of A
SPREAD = 2.0**10  # beyond it states differ in their units, and their errors with them
EVALUATIONS = 20_000  # of a smallest singular value, where no gain gives a proof


@dataclass(frozen=True, repr=False)
class Detectability(Display):
    r"""The verdict on a pair whose entries are known to the relative `precision`, and what shows it.

    CERTIFIED: `gain` L (n, m; K (m, n) for stabilizability) makes A - L C (A - B K) stable, and keeps doing so under every change
    of relative size `precision`; None where the distance alone shows that every such pair has one. REFUTED: the numbers as they
    stand, in exact arithmetic, have a hidden mode that does not decay (`exact`); or a pair within the precision hides a part
    of the state of which a mode grows whatever the rounding. INCONCLUSIVE: undecided at this precision: a mode that does not
    decay is hidden, or a hidden mode is on the border of stability, in some pair within it, or no proof was found (`reason`).

    `lower` and `upper` enclose the distance to an undetectable pair relative to |A| and |C|, in balanced units; `mode` attains
    the upper one. `hidden_modes` (1/s or per sample) are those of what the staircase form leaves at this precision.
    """

    verdict: Verdict
    reason: str
    lower: float
    upper: float
    mode: complex
    hidden_modes: ComplexArray
    precision: float
    gain: FloatArray | None
    exact: bool

    def summary(self) -> tuple[str, ...]:
        """Verdict, distance and the mode that is seen least."""
        return (
            f"Detectability: {self.verdict} ({self.reason})",
            f"relative distance: {self.lower:.3g} to {self.upper:.3g} at the mode {_name(self.mode)}",
            f"hidden modes at this precision: {', '.join(map(_name, self.hidden_modes)) or 'none'}",
            f"relative precision of the data: {self.precision:.2g}",
        )


def detectable(
    A: Any, C: ArrayLike | None = None, discrete: bool | None = None, precision: float | None = None
) -> Detectability:
    r"""Can an observer of A (n, n), C (m, n), or of a system object, be stable: is every mode seen that does not decay?

    A mode decays if Re z < 0, or |z| < 1 in discrete time: an integrator does not. `precision` is the relative error of the
    entries, or beside the largest one where states are less than a thousand apart in size; default 8 n eps, numbers that are
    exact but for rounding. Units are balanced first (`pair_balance`).
    Raises AnalysisError for shapes that do not fit, values not finite, several pairs at once and a precision outside (0, 1).

    >>> unstable = [[1.0, 0.0], [0.0, -2.0]]
    >>> print(detectable(unstable, [[1.0, 1.0]]).verdict, detectable(unstable, [[0.0, 1.0]]).verdict)
    certified refuted
    >>> print(detectable(unstable, [[1e-17, 1.0]]).verdict)
    inconclusive
    """
    A, C, time = observed_pair(A, C, discrete)
    return _decide(A, C, time, precision)


def stabilizable(
    A: Any, B: ArrayLike | None = None, discrete: bool | None = None, precision: float | None = None
) -> Detectability:
    """Can a state feedback of A (n, n), B (n, m) be stable: is every mode reached that does not decay? Dual to `detectable`.

    >>> print(stabilizable([[1.0, 0.0], [0.0, -2.0]], [[1.0], [0.0]]).verdict)
    certified
    """
    A, B, time = driven_pair(A, B, discrete)
    return _decide(A, B, time, precision, dual=True)


def _decide(A: FloatArray, C: FloatArray, discrete: bool, precision: float | None, dual: bool = False) -> Detectability:
    if A.ndim != 2:
        raise AnalysisError(f"A has the shape {A.shape}; give one pair (n, n), or ask hautus_test for a stack")
    used = rounding_tolerance(A.shape[-1]) if precision is None else precision
    if not 0.0 < used < 1.0:
        raise AnalysisError(f"precision = {precision} must lie between 0 and 1; it is the relative error of the data")
    found = _at_precision(A, C, discrete, used, dual)
    clean = without_dust(A, C)
    if found.verdict is Verdict.CERTIFIED and not all(map(np.array_equal, clean, (A, C))):
        other = _at_precision(*clean, discrete, used, dual)
        if other.verdict is not Verdict.CERTIFIED:
            why = "undecided at this precision: entries below rounding beside their neighbours decide; without them"
            reason = f"{why} {other.reason}"
            return replace(other, verdict=Verdict.INCONCLUSIVE, reason=reason, exact=False)
    return found


def _at_precision(A: FloatArray, C: FloatArray, discrete: bool, precision: float, dual: bool) -> Detectability:
    region = Region.OUTSIDE if discrete else Region.RIGHT
    near_A, near_C, units, outputs = balanced_pair(A, C)
    unit_A, unit_C, size = unit_pair(near_A, near_C)
    scale, outer = float(size[0, 0]), unit_C * size  # the outputs of the size of A, so that one level serves both
    level = precision * scale * float(np.hypot(np.linalg.norm(unit_A), np.linalg.norm(unit_C)))
    parts = separate(unit_A[None], unit_C[None], level / scale)
    hidden = parts.transform[0][:, len(A) - int(parts.hidden[0]) :]
    modes = np.linalg.eigvals(hidden.T @ near_A @ hidden).astype(complex)
    upper, mode = least(near_A, outer, region, modes)
    lower, gain, exact = 0.0, None, False
    what = f"the mode {_name(mode)} is not {'reached' if dual else 'seen'}"
    # Data that was rounded beside its largest entry, not entry by entry, has larger errors in balanced units.
    safe = level * min(float(units.max() / units.min()), SPREAD)
    if upper > safe:
        lower, gain = witness_gain(near_A, outer, discrete, enough=10.0 * safe)
        if lower <= safe:
            lower, gain = max(lower, below(near_A, outer, region, upper, 0.5, EVALUATIONS)[0]), None
    if lower > safe:
        verdict = Verdict.CERTIFIED
        reason = f"{'the distance' if gain is None else 'the gain'} shows it for every pair within the precision"
    elif len(A) <= EXACT_STATES and not hidden_is_stable(A, C, discrete):
        verdict, exact, reason = Verdict.REFUTED, True, f"{what} and does not decay, in exact arithmetic"
    elif (
        grows := growing_mode(near_A, outer, [hidden, *least_seen(near_A, outer, mode)], discrete, level)
    ) is not None:
        verdict = Verdict.REFUTED
        reason = f"the mode {_name(grows)} is hidden to within the precision and grows whatever the rounding"
    else:
        verdict = Verdict.INCONCLUSIVE
        why = f"{what} in a pair within it" if upper <= safe else "no proof was found on either side"
        reason = f"undecided at this precision: {why}"
    if gain is not None:  # back to the units that were given
        gain = units[:, None] * gain * outputs * scale / (float(np.linalg.norm(near_C, 2)) or 1.0)
        gain = gain.T if dual else gain
    return Detectability(verdict, reason, min(lower, upper) / scale, upper / scale, mode, modes, precision, gain, exact)


def _name(mode: complex) -> str:
    return f"{mode.real:.6g}" if mode.imag == 0.0 else f"{mode:.6g}"
