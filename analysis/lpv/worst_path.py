"""A search for bad parameter trajectories: periodic paths along which inputs are amplified most, or the state falls most slowly.

Paths of KNOTS knots at equal distances, first simple ones of many periods (back and forth, each parameter alone and all
together, with shifts), then the best of them improved by a simplex search over period, ratio of its halves, knots and carrier.
Floats: what counts is proved afterwards.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product

import numpy as np
from scipy.optimize import minimize

from analysis.lpv.lifted import lift, worst_input
from analysis.lpv.question import Searched
from analysis.lpv.trajectory import Path, admissible
from estimators.arrays import FloatArray
from synthesis.polynomials.rational import as_float

KNOTS = 8
PARTS = 4  # intervals of a piece during the search
PERIODS = 7
REFINED, EVALUATIONS = 2, 160
MOST_SAMPLES = 64  # of a period in discrete time

Score = Callable[[Path, float], float]


def gain_of(question: Searched) -> Score:
    """The ratio of output to input norm along a path; -inf where it cannot be had."""

    def score(path: Path, frequency: float) -> float:
        lifted = lift(question, path, frequency, PARTS)
        return -np.inf if lifted is None else worst_input(lifted)[0]

    return score


def growth_of(question: Searched) -> Score:
    """The growth rate of the state along a path, 1/s or 1/sample."""

    def score(path: Path, _: float) -> float:
        lifted = lift(question, path, 0.0, 1)
        if lifted is None:
            return -np.inf
        radius = np.abs(np.linalg.eigvals(lifted.monodromy)).max()
        return float(np.log(max(radius, 1e-300)) / lifted.length.sum())

    return score


def worst_path(
    question: Searched, score: Score, carriers: tuple[float, ...], place: FloatArray, evaluations: int = EVALUATIONS
) -> tuple[Path, float]:
    """The path and carrier frequency with the best score found; `place` is the worst frozen one, which some paths stay near."""
    tried = [
        (score(path, carrier), path, carrier)
        for path in simple_paths(question, place) for carrier in carriers
    ]  # fmt: skip
    tried.sort(key=lambda entry: -entry[0])
    best = tried[0]
    for entry in tried[: REFINED if np.isfinite(best[0]) else 0]:
        found = _refined(question, score, entry, evaluations)
        if found[0] > best[0]:
            best = found
    return best[1], best[2]


def simple_paths(question: Searched, place: FloatArray) -> Iterator[Path]:
    """Back and forth, each parameter alone (the others at `place`) and all together, with shifts, for every period."""
    axes = question.axes
    count = len(axes)
    phases = np.arange(KNOTS) / KNOTS
    wave = np.array(
        [np.sign(np.sin(2 * np.pi * phases + 0.1)) if axis.may_jump else _triangle(phases) for axis in axes]
    )
    shifts = [(0, *rest) for rest in product((0, KNOTS // 4, KNOTS // 2), repeat=min(count - 1, 2))]
    shapes = []
    for shift in shifts:
        full = (*shift, *(0,) * (count - len(shift)))
        shapes.append(np.array([np.roll(row, k) for row, k in zip(wave, full, strict=True)]).T)
    for i in range(count if count > 1 else 0):
        alone = np.tile(place, (KNOTS, 1))
        alone[:, i] = wave[i]
        shapes.append(alone)
    for shape in shapes:
        for period in periods(question):
            yield admissible(shape, np.full(KNOTS, period / KNOTS), axes, question.half_spaces)


def _triangle(phase: FloatArray) -> FloatArray:
    return np.asarray(1.0 - 4.0 * np.abs(phase - 0.5))


def periods(question: Searched) -> list[float]:
    """From a fraction of the fastest time scale to many of the slowest: of poles, and of the way through every range and back."""
    if question.discrete:
        steps = [k for k in (1, 2, 4, 8, 16) if k * KNOTS <= MOST_SAMPLES]
        steps += [round(way / KNOTS) for way in _ways(question) if KNOTS <= way <= 10 * MOST_SAMPLES]
        return [float(step * KNOTS) for step in dict.fromkeys(steps)]
    centre = question.frozen(np.zeros((1, len(question.axes))))[0][0]
    poles = np.abs(np.linalg.eigvals(centre))
    poles = poles[poles > 0.0]
    scales = [2.0 * np.pi / x for x in poles] or [1.0]
    ways = _ways(question)
    low, high = 0.2 * min(scales), 4.0 * max(scales)
    return [float(x) for x in (*np.geomspace(low, high, PERIODS), *ways, *(2.0 * way for way in ways))]


def _ways(question: Searched) -> list[float]:
    """Times through the ranges and back, of parameters that take any."""
    found = []
    for axis in question.axes:
        low, high = axis.rate_low, axis.rate_high
        if low is not None and high is not None and low < 0 < high:
            found.append(2.0 * as_float(axis.half / high - axis.half / low))
    return found


def _refined(
    question: Searched, score: Score, entry: tuple[float, Path, float], evaluations: int
) -> tuple[float, Path, float]:
    """A simplex search from one path; the rounds of a search have no part in any bound."""
    _, path, carrier = entry
    shape, axes = path.knots.shape, question.axes
    half = np.where(np.arange(KNOTS) < KNOTS // 2, 1.0, -1.0)  # of the period

    def path_of(x: FloatArray) -> tuple[Path, float]:
        durations = path.durations
        if not question.discrete:
            durations = durations * np.exp(np.clip(x[0], -1.5, 1.5)) * (1.0 + 0.9 * np.tanh(x[1]) * half)
        return admissible(x[3:].reshape(shape), durations, axes, question.half_spaces), carrier + float(
            x[2]
        ) / path.period

    def cost(x: FloatArray) -> float:
        value = score(*path_of(x))
        return -value if np.isfinite(value) else (-1e300 if value > 0 else 1e300)

    start = np.concatenate([[0.0, 0.0, 0.0], path.knots.ravel()])
    moves = np.concatenate([[0.4, 0.3, 0.5], np.where(path.knots.ravel() < 0.0, 0.3, -0.3)])
    simplex = np.vstack([start, start + np.diag(moves)])
    found = minimize(cost, start, method="Nelder-Mead", options={"maxfev": evaluations, "initial_simplex": simplex})
    return -float(found.fun), *path_of(np.asarray(found.x))
