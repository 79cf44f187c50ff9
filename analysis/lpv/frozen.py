"""Parameters that stand still: where the frozen system is worst. Floats; what counts is proved elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from flint import fmpq_mat

from analysis.lpv.question import Question, Searched
from analysis.norms.hinf import hinf_norm, stability_margin
from estimators.arrays import FloatArray
from synthesis.polynomials.half_spaces import faces_of
from synthesis.polynomials.rational import rational
from synthesis.polynomials.stable import is_hurwitz, is_schur

POINTS = {0: 1, 1: 65, 2: 17, 3: 9}  # along every parameter
FEWEST, HALVINGS, CLIMBS = 3, 20, 3


def climb(question: Searched, value: Callable[[FloatArray], FloatArray]) -> tuple[FloatArray, float]:
    """The scaled place u where a function of places (g, p) is largest on a grid, moved uphill by steps that are halved."""
    count = len(question.axes)
    line = np.linspace(-1.0, 1.0, POINTS.get(count, FEWEST))
    grid = np.array(list(product(line, repeat=count)), float).reshape(-1, count)
    faces = faces_of(question.half_spaces)
    if faces is not None:
        grid = faces.drawn_in(faces.on_lines([line] * count))
    found = value(grid)
    best, most = grid[0], -np.inf
    for index in np.argsort(-found, kind="stable")[:CLIMBS]:
        place, height, step = grid[index], float(found[index]), 1.0 / (len(line) or 1)
        for _ in range(HALVINGS):
            moves = np.concatenate([np.eye(count), -np.eye(count)]) * step
            tried = np.clip(place + moves, -1.0, 1.0)
            tried = tried if faces is None else faces.drawn_in(tried)
            heights = value(tried) if count else np.array([-np.inf])
            if heights.max() > height:
                place, height = tried[int(heights.argmax())], float(heights.max())
            else:
                step *= 0.5
        if height > most:
            best, most = place, height
    return best, most


def largest_gain(question: Searched) -> tuple[FloatArray, float, float]:
    """Place u, gain and its frequency of the frozen H-infinity norm; inf where a pole is not stable."""

    def norm(u: FloatArray) -> FloatArray:
        return hinf_norm(*question.frozen(u), discrete=question.discrete, tolerance=1e-6).norm

    place, gain = climb(question, norm)
    peak = hinf_norm(*question.frozen(place[None]), discrete=question.discrete)
    frequency = float(peak.frequency[0])
    return place, gain, frequency if np.isfinite(frequency) else 0.0


def slowest_decay(question: Searched) -> tuple[FloatArray, float]:
    """Place u and decay rate (1/s or 1/sample) of the frozen pole that falls most slowly."""

    def margin(u: FloatArray) -> FloatArray:
        found = stability_margin(question.frozen(u)[0], discrete=question.discrete)
        return np.asarray(np.log(np.maximum(1.0 + found, 1e-300)) if question.discrete else found)

    place, growth = climb(question, margin)
    return place, -growth


def unstable(question: Question, u: FloatArray) -> bool:
    """Whether the frozen system at u certainly has a pole that is not stable; exact."""
    point = [rational(float(x)) for x in u]
    below = question.exact["denominator"].at(point)[0, 0]
    A: fmpq_mat = question.exact["A"].at(point) * (1 / below)
    return (is_schur(A) if question.discrete else is_hurwitz(A)) is False
