r"""Worst-case gain under real parametric uncertainty: the largest H-infinity norm over a set of constant parameters.

From above the polynomial |chi(jw)|^2 det(g^2 I - G*G) is proved positive on the set and on all frequencies together: frequency
is one more parameter, w^2 = centre (1 + v)/(1 - v) with v in [-1, 1], so that nothing can hide between the points of a grid.
From below one member of the family, its gain at one frequency enclosed in balls.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from flint import fmpq, fmpq_mat

from analysis.checks import positive
from analysis.errors import AnalysisError
from analysis.exact import is_positive
from analysis.lpv.frozen import largest_gain, unstable
from analysis.lpv.norms import proved_frozen_gain
from analysis.lpv.question import Inputs, Question, ask, require_channel
from analysis.norms.hinf import hinf_norm
from analysis.uncertainty.polynomials import Family, over_frequencies
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.certificate.rounding import round_up
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.box_decision import Decision, all_positive
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.half_spaces import centre_of, corners_of, faces_of
from synthesis.polynomials.rational import as_float, rational

ROOM = (1.0, 5.0, 25.0, 100.0, 1000.0)  # times the tolerance above the lower bound, until a proof holds
EXCHANGES = 12
HALVINGS = 20
LEVEL_DIGITS = 8


@dataclass(frozen=True, repr=False)
class WorstCaseGain(Display):
    """lower <= max over the set of the H-infinity norm <= upper.

    At `witness` (name: value) and `frequency` rad/s it is at least `lower`.
    """

    shown_units: ClassVar = {"frequency": "rad/s"}

    lower: float
    upper: float
    witness: Mapping[str, float]
    frequency: float

    def below(self, level: float) -> Verdict:
        """Whether every member has a gain of at most `level`."""
        if self.upper <= level:
            return Verdict.CERTIFIED
        return Verdict.REFUTED if self.lower > level else Verdict.INCONCLUSIVE


def worst_case_gain(
    model: LpvModel, inputs: Inputs | None = None, outputs: Sequence[str] | None = None, tolerance: float = 1e-3
) -> WorstCaseGain:
    """The worst gain of x' = A(p) x + B(p) w, z = C(p) x + D(p) w over constant p in the set of the model's parameters.

    Inputs and outputs as in `lpv_l2_gain`; rate bounds play no part. `tolerance` is the relative gap that is aimed at. A family
    with a member that is not stable has the gain inf. `upper` is inf where no proof was found. Raises AnalysisError for unknown
    names and for a tolerance that is not positive.

    >>> import sympy as sp
    >>> model = LpvModel(
    ...     name="lag", source="example", states=(Signal("x", "1"),), inputs=(Signal("u", "1"),), outputs=(Signal("y", "1"),),
    ...     parameters=(SchedulingParameter("p", "1/s", 1.0, 2.0, -1.0, 1.0),),
    ...     A=sp.Matrix([[-sp.Symbol("p")]]), B=sp.Matrix([[1]]), C=sp.Matrix([[1]]),
    ... )
    >>> found = worst_case_gain(model)
    >>> round(found.lower, 2), round(found.upper, 2)  # at p = 1
    (1.0, 1.0)
    """
    question = ask(model, inputs, outputs)
    require_channel(question)
    tolerance = positive("tolerance", tolerance)
    count = len(question.axes)
    place, _, frequency = largest_gain(question)
    family = Family(question)
    stable = _positive(question, [*family.stability(), question.exact["denominator"]], count)
    bad = place if stable.fails_at is None else _floats(stable.fails_at)
    if unstable(question, bad):
        return WorstCaseGain(np.inf, np.inf, _values(question, bad), 0.0)
    lower = proved_frozen_gain(question, place, frequency)
    if not stable.positive or unstable(question, _floats(_member(question))):
        return WorstCaseGain(lower, np.inf, _values(question, place), frequency)
    if not lower > 0.0:
        raise AnalysisError(
            f"model '{model.name}': no input reaches an output anywhere in the ranges; there is no gain to bound"
        )
    coefficients = family.gain()
    for _ in range(EXCHANGES):
        better = None
        for room in ROOM:
            level = round_up(lower * (1.0 + room * tolerance), LEVEL_DIGITS)
            found = _decide(question, family, coefficients, level, frequency)
            if found.positive:
                return WorstCaseGain(lower, level, _values(question, place), frequency)
            if found.fails_at is not None:
                better = _climbed(question, _floats(found.fails_at[:-1]))
                break
        if better is None:
            break
        gain = proved_frozen_gain(question, better[0], better[1])
        if not gain > lower:
            break
        place, frequency, lower = better[0], better[1], gain
    return WorstCaseGain(lower, np.inf, _values(question, place), frequency)


def _decide(question: Question, family: Family, coefficients: list[object], level: float, frequency: float) -> Decision:
    """Whether every gain is below the level, for a family that is stable everywhere."""
    count = len(question.axes)
    square = rational(level) ** 2
    if not _static_gain_below(question, square):
        return Decision(False, (fmpq(0),) * (count + 1))
    in_u = [family.in_parameters(c, square) for c in coefficients]
    A = question.frozen(_floats(_member(question))[None])[0][0]
    scale = frequency or float(np.abs(np.linalg.eigvals(A)).max()) or 1.0
    whole = over_frequencies(in_u, rational(float(2.0 ** np.round(np.log2(scale)))) ** 2)
    return _positive(question, [whole], count + 1)


def _positive(question: Question, polynomials: list[PolynomialMatrix], count: int) -> Decision:
    """On the whole set of the parameters, which are the first variables; the others lie in [-1, 1]."""
    half_spaces = tuple(half_space.among(count) for half_space in question.half_spaces)
    return all_positive(polynomials, [fmpq(0)] * count, [fmpq(1)] * count, half_spaces)


def _member(question: Question) -> tuple[fmpq, ...]:
    """The middle of the ranges, or of the corners of what inequalities leave of them: the set is convex."""
    zeros, ones = ((fmpq(x),) * len(question.axes) for x in (0, 1))
    return centre_of(corners_of(zeros, ones, question.half_spaces)) if question.half_spaces else zeros


def _static_gain_below(question: Question, square: fmpq) -> bool:
    """Whether one member at rest is on the right side: g^2 I - G(0)'G(0) > 0, exactly."""
    A, B, C, D, below = (question.exact[key].at(_member(question)) for key in ("A", "B", "C", "D", "denominator"))
    G = (D - C * A.solve(B)) * (1 / below[0, 0])
    m = G.ncols()
    level = fmpq_mat(m, m, [square if i == j else fmpq(0) for i in range(m) for j in range(m)])
    return is_positive(level - G.transpose() * G)


def _climbed(question: Question, u: FloatArray) -> tuple[FloatArray, float]:
    """A place near by with a larger norm, and the frequency of its peak."""
    step, count, faces = 0.25, len(u), faces_of(question.half_spaces)
    gain = float(hinf_norm(*question.frozen(u[None])).norm[0])
    for _ in range(HALVINGS):
        moves = np.clip(u + np.concatenate([np.eye(count), -np.eye(count)]) * step, -1.0, 1.0)
        moves = moves if faces is None else faces.drawn_in(moves)
        gains = hinf_norm(*question.frozen(moves)).norm
        if gains.max() > gain:
            u, gain = moves[int(gains.argmax())], float(gains.max())
        else:
            step *= 0.5
    frequency = float(hinf_norm(*question.frozen(u[None])).frequency[0])
    return u, frequency if np.isfinite(frequency) else 0.0


def _floats(point: tuple[fmpq, ...]) -> FloatArray:
    return np.array([as_float(x) for x in point])


def _values(question: Question, u: FloatArray) -> dict[str, float]:
    return dict(zip((axis.name for axis in question.axes), question.physical(u).tolist(), strict=True))
