r"""Robust stability margin under real parametric uncertainty: the largest box of parameters in which the system is stable.

    k* = sup { k : A(p) is stable for all |p_i - middle_i| <= k half_i }
 and 1/k* is the peak over frequencies of the structured singular value for real repeated blocks, where A is a linear fractional
function of the parameters. From below by positivity of polynomials on the box (`analysis.uncertainty.polynomials`): for all
frequencies at once, and without the conservatism of scalings. From above by one member of the family with a pole that is
certainly not stable.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from flint import fmpq

from analysis.checks import positive
from analysis.errors import AnalysisError
from analysis.lpv.frozen import unstable
from analysis.lpv.question import Question, ask, require_box
from analysis.uncertainty.polynomials import Family
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.box_decision import all_positive
from synthesis.polynomials.rational import as_float, rational

FARTHEST = 1000.0  # times the ranges: no witness is looked for beyond
RAYS, SCALES = 96, 80
ROUNDS, HALVINGS, CLIMBS = 30, 24, 2
NUDGES = (0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3)  # beyond the border, until the sign is certain
SHRINKS = (1.0, 0.99, 0.95, 0.9, 0.75, 0.5, 0.2, 0.05)
EXCHANGES, PULLS = 20, 80


@dataclass(frozen=True, repr=False)
class RobustStabilityMargin(Display):
    """lower <= k* <= upper: the whole box grown `lower` times is stable, `witness`, in that grown `upper` times, is not."""

    lower: float
    upper: float
    witness: Mapping[str, float] | None

    @property
    def structured_singular_value(self) -> tuple[float, float]:
        """Bounds of the peak of mu, 1/upper and 1/lower."""
        return 1.0 / self.upper, 1.0 / self.lower if self.lower > 0.0 else np.inf

    @property
    def verdict(self) -> Verdict:
        """Whether the system is stable in the ranges as they are (k* >= 1)."""
        if self.lower >= 1.0:
            return Verdict.CERTIFIED
        return Verdict.REFUTED if self.upper <= 1.0 else Verdict.INCONCLUSIVE


def robust_stability_margin(
    model: LpvModel, tolerance: float = 1e-3, discrete: bool = False, farthest: float = 100.0
) -> RobustStabilityMargin:
    """The margin of x' = A(p) x (or x+) over constant p, about the middle of the ranges.

    `tolerance` is the relative gap that is aimed at. Nothing is looked for beyond `farthest` times the ranges: a system that is
    stable there has this number as lower bound and inf as upper. Raises AnalysisError if the middle is not stable, for no
    parameters, for constraints between them (what grows is the box about the middle, which a set need not hold), and for numbers
    that are not positive. Sources: de Gaston, Safonov 1988 (the margin); Zettler, Garloff 1998
    (Bernstein expansion of Hurwitz determinants).

    >>> import sympy as sp
    >>> model = LpvModel(
    ...     name="lag", source="example", states=(Signal("x", "1"),), inputs=(Signal("u", "1"),), outputs=(Signal("y", "1"),),
    ...     parameters=(SchedulingParameter("p", "1/s", 1.0, 2.0, -1.0, 1.0),),
    ...     A=sp.Matrix([[-sp.Symbol("p")]]), B=sp.Matrix([[1]]), C=sp.Matrix([[1]]),
    ... )
    >>> found = robust_stability_margin(model)
    >>> found.lower <= 3.0 <= found.upper * 1.001  # p = 1.5 + 3 * 0.5 * (-1) = 0
    True
    """
    question = ask(model, (), None, discrete)
    require_box(question)
    tolerance, farthest = positive("tolerance", tolerance), min(positive("farthest", farthest), FARTHEST)
    count = len(question.axes)
    if not count:
        raise AnalysisError(f"model '{model.name}' has no parameters; see stability_margin")
    centre = np.zeros(count)
    if _margin(question, centre[None])[0] >= 0.0:
        raise AnalysisError(f"model '{model.name}' is not stable in the middle of its ranges; there is no box about it")
    polynomials = [*Family(question).stability(), question.exact["denominator"]]
    place = _nearest(question, farthest)
    witness = None if place is None else _certain(question, place)
    upper = np.inf if witness is None else float(np.abs(witness).max())
    lower = 0.0
    for _ in range(EXCHANGES):
        goal = min(upper * (1.0 - 0.5 * tolerance), farthest)
        better = None
        for share in SHRINKS:
            scale = goal * share
            if scale <= lower:
                break
            found = all_positive(polynomials, [fmpq(0)] * count, [rational(scale)] * count)
            if found.positive:
                lower = scale
                break
            if found.fails_at is not None:
                better = _certain(question, _pulled(question, np.array([as_float(x) for x in found.fails_at])))
                break
        if better is None or not np.abs(better).max() < upper:
            break
        witness, upper = better, float(np.abs(better).max())
    values = (
        None
        if witness is None
        else dict(zip((a.name for a in question.axes), question.physical(witness).tolist(), strict=True))
    )
    return RobustStabilityMargin(lower, upper, values)


def _margin(question: Question, u: FloatArray) -> FloatArray:
    """How far the slowest pole is beyond the border, at places (g, p)."""
    poles = np.linalg.eigvals(question.frozen(u)[0])
    return np.asarray(np.abs(poles).max(axis=-1) - 1.0 if question.discrete else poles.real.max(axis=-1))


def _nearest(question: Question, farthest: float) -> FloatArray | None:
    """A place on the border of stability with a small largest |u_i|, in floats; None if no ray meets one."""
    count = len(question.axes)
    rays = np.array(list(product((-1.0, 1.0), repeat=count)) if count <= 8 else [[1.0] * count, [-1.0] * count])
    more = np.random.default_rng(1988).uniform(-1.0, 1.0, (RAYS, count))
    rays = np.concatenate([rays, np.eye(count), -np.eye(count), more / np.abs(more).max(axis=1, keepdims=True)])
    reach = _reach(question, rays, farthest)
    best, ray = np.inf, None
    for index in np.argsort(reach, kind="stable")[:CLIMBS]:
        if not np.isfinite(reach[index]):
            break
        here, length, step = rays[index], float(reach[index]), 0.5
        for _ in range(ROUNDS):
            moves = np.clip(here + np.concatenate([np.eye(count), -np.eye(count)]) * step, -1.0, 1.0)
            size = np.abs(moves).max(axis=1)
            moves = moves[size > 0.0] / size[size > 0.0, None]
            lengths = _reach(question, moves, farthest)
            if lengths.min() < length:
                here, length = moves[int(lengths.argmin())], float(lengths.min())
            else:
                step *= 0.5
        if length < best:
            best, ray = length, here
    return None if ray is None else best * ray


def _reach(question: Question, rays: FloatArray, farthest: float) -> FloatArray:
    """The first scale on every ray (g, p) at which a pole is not stable, inf if none is met.

    Poles at infinity end a ray, too.
    """
    scales = np.concatenate([[0.0], np.geomspace(1e-3, farthest, SCALES)])
    with np.errstate(all="ignore"):
        at = scales[:, None, None] * rays
        margins = _safe_margin(question, at.reshape(-1, rays.shape[1])).reshape(len(scales), len(rays))
    beyond = margins >= 0.0
    first = beyond.argmax(axis=0)
    met = beyond.any(axis=0)
    low, high = scales[np.maximum(first - 1, 0)], scales[first]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        out = _safe_margin(question, middle[:, None] * rays) >= 0.0
        low, high = np.where(out, low, middle), np.where(out, middle, high)
    return np.where(met, high, np.inf)


def _safe_margin(question: Question, u: FloatArray) -> FloatArray:
    """`_margin`; a place without finite matrices, or beyond a zero of the denominator, is not a member of the family: -inf."""
    with np.errstate(all="ignore"):
        A = question.frozen(u)[0]
    good = np.isfinite(A).all(axis=(-2, -1))
    out = np.full(len(u), -np.inf)
    if good.any():
        out[good] = _margin(question, u[good])
    return out


def _pulled(question: Question, place: FloatArray) -> FloatArray:
    """From a place that is not stable to one nearer to the middle, by steps that are halved: holes may be too small for rays."""
    count, step = len(place), 0.25
    ways = np.array(list(product((-1.0, 0.0, 1.0), repeat=count))) if count <= 4 else np.eye(count)
    for _ in range(PULLS):
        tried = np.concatenate([place + step * ways, place - step * ways, place[None] * (1.0 - step)])
        size = np.abs(tried).max(axis=1)
        nearer = (size < np.abs(place).max()) & (_safe_margin(question, tried) >= 0.0)
        if nearer.any():
            place = tried[int(np.where(nearer, size, np.inf).argmin())]
        else:
            step *= 0.5
    return place


def _certain(question: Question, place: FloatArray) -> FloatArray | None:
    """A place a little beyond the border where a pole certainly is not stable, exactly."""
    for nudge in NUDGES:
        tried = place * (1.0 + nudge)
        if unstable(question, tried):
            return tried
    return None
