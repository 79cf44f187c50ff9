"""One observer on trial: simulated on the runtime at the cases in question, judged by intervals."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from estimators import GainSchedule
from studies.beyond.drop_tolerance.estimate import Interval, interval
from studies.beyond.drop_tolerance.population import START, simulate
from studies.beyond.drop_tolerance.prediction import joined, log_second_moment, natural_norm
from studies.beyond.drop_tolerance.questions import Kind, Question, questions
from studies.study import Scope
from synthesis.polynomials.matrix import FloatArray

MISS = 1e-3  # probability that any interval of one observer misses by chance
TOTAL_RUNS = 12_000  # of one case, over all seeds; a quarter when quick


@dataclass(frozen=True)
class Row:
    """A compared number; `expected` is its exact value at the simulated time, `predicted` the one that holds for ever."""

    kind: Kind
    place: float  # wheel speed in rad/s, or loss rate
    predicted: float
    expected: float
    found: Interval

    @property
    def agrees(self) -> bool:
        """The interval holds the exact value; a growth must in addition be seen to lie below 1."""
        return self.found.holds(self.expected) and (self.kind != "growth" or self.found.high < 1.0)


@dataclass(frozen=True)
class Trial:
    """All comparisons of one observer."""

    rows: tuple[Row, ...]

    def of(self, kind: Kind) -> tuple[Row, ...]:
        """The comparisons of one kind."""
        return tuple(row for row in self.rows if row.kind == kind)

    @property
    def agreeing(self) -> int:
        """How many comparisons agree."""
        return sum(row.agrees for row in self.rows)


def run_trial(schedule: GainSchedule, scope: Scope, seed: int, compared: GainSchedule | None = None) -> Trial:
    """Simulate `schedule` and compare with the prediction for `compared` (itself, unless a test asks otherwise)."""
    other = compared or schedule
    asked = questions(other, scope.quick)
    generator = np.random.default_rng(seed)
    rows = {}
    for steps in sorted({q.steps for q in asked}):
        group = [q for q in asked if q.steps == steps]
        for q, growth, exact in _simulated(schedule, other, group, scope, generator):
            rows[id(q)] = _row(q, interval(growth, steps, q.read, MISS / len(asked)), float(q.read(exact)))
    return Trial(tuple(rows[id(q)] for q in asked))


def _simulated(
    schedule: GainSchedule, compared: GainSchedule, asked: list[Question], scope: Scope, generator: np.random.Generator
) -> Iterator[tuple[Question, FloatArray, FloatArray]]:
    """Each question with its log growths over all samples (c, seeds), and exactly per sample (c,)."""
    steps, channel = asked[0].steps, joined([q.channel for q in asked])
    norm = natural_norm(compared, channel)
    start, end = log_second_moment(compared, channel, norm, START, steps)
    runs = max(TOTAL_RUNS // (scope.seeds * (4 if scope.quick else 1)), 2)
    seen = simulate(schedule, channel, norm, steps, scope.seeds, runs, generator) - start[:, None]
    first = 0
    for q in asked:
        part = slice(first, first + len(q.channel.speed))
        first = part.stop
        yield q, seen[part], (end - start)[part] / steps


def _row(question: Question, found: Interval, expected: float) -> Row:
    if question.logarithmic:
        found = Interval(math.exp(found.value), math.exp(found.low), math.exp(found.high))
        expected = math.exp(expected)
    return Row(question.kind, question.place, question.predicted, expected, found)
