"""Prediction against the runtime observer: cases around every predicted number, simulated and read as intervals."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from scipy.stats import t as student

from estimators import GainSchedule
from estimators.arrays import FloatArray
from studies.beyond.drop_tolerance import prediction
from studies.beyond.drop_tolerance.observers import NAMES, PACKAGE, QUICK, SPEED_LABEL, observer
from studies.beyond.drop_tolerance.population import EVERY, START, simulate
from studies.beyond.drop_tolerance.prediction import LONGEST_BURST, Channel, critical
from studies.papers.topic import Topic
from studies.plots import Axis, Band, ErrorBars, Figure, Line, Mark, Panel, Words, dots
from studies.plots.colours import BLUE, GREEN, GREY, RED
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
MISS = 1e-3  # probability that any interval of one observer misses by chance
TOTAL_RUNS = 12_000  # of one case, over all seeds; a quarter when quick
NEAR_ONE = 0.97  # a critical probability above this leaves no room for a bracket; growth at HIGH_DROP is asked instead
HIGH_DROP = 0.95
LOSS_RATES = (0.5, 0.35, 0.2)
MOST_BURST = 60.0  # samples; the simulated time must hold some bursts
SHORT, LONG = 48, 160  # samples: as few as tell the growth, as the spread over seeds grows with time
STRETCH = 0.25  # of the logarithm of a burst length, to either side
THREE = np.array([-1.0, 0.0, 1.0])
Kind = Literal["drop", "growth", "burst"]
QUANTITIES: dict[Kind, str] = {
    "drop": "critical drop probability at a wheel speed [rad/s]",
    "growth": f"growth of the second moment a sample at {HIGH_DROP:.0%} drops, at a wheel speed [rad/s]",
    "burst": "critical mean burst [samples] at a loss rate [1]",
}


class Interval(NamedTuple):
    """An estimate with the ends of its interval."""

    value: float
    low: float
    high: float

    def holds(self, expected: float) -> bool:
        """Whether the interval contains `expected` (never for NaN)."""
        return self.low <= expected <= self.high


def crossing(places: FloatArray, growth: FloatArray) -> FloatArray:
    """Where the parabola through three equally spaced places (3,) with log growths (..., 3) rises through 0; NaN if nowhere."""
    middle, step, c = places[1], places[2] - places[1], growth[..., 1]
    b, a = 0.5 * (growth[..., 2] - growth[..., 0]), 0.5 * (growth[..., 2] + growth[..., 0]) - c
    with np.errstate(invalid="ignore", divide="ignore"):
        rise = np.sqrt(b * b - 4.0 * a * c)
        return np.asarray(middle + step * np.where(b + rise > 0.0, -2.0 * c / (b + rise), np.nan))


def interval(growth: FloatArray, steps: int, measure: Callable[[FloatArray], FloatArray], level: float) -> Interval:
    """`measure` of the log growths per sample (..., c) as a number, with a Student interval of the jackknife over seeds.

    `growth` (c, seeds) is the log of the growth of E h over `steps` samples, as each seed sees it. The mean over seeds is
    taken of the growth itself, which the simulation estimates without bias. `level` is the probability that the
    interval misses.
    """
    top = growth.max(axis=-1, keepdims=True)
    scaled, n = np.exp(growth - top), growth.shape[-1]
    total = scaled.sum(axis=-1, keepdims=True)
    whole, left_out = (np.moveaxis((np.log(m) + top) / steps, 0, -1) for m in (total / n, (total - scaled) / (n - 1)))
    value, parts = float(measure(whole)[0]), measure(left_out)
    error = float(np.sqrt((n - 1) / n * ((parts - parts.mean()) ** 2).sum()))
    half = float(student.ppf(1.0 - 0.5 * level, n - 1)) * error
    return Interval(value, value - half, value + half)


@dataclass(frozen=True)
class Question:
    """A predicted number and its simulated cases: three values `at` around it, or one case whose growth is read."""

    kind: Kind
    place: float  # wheel speed in rad/s, or loss rate
    predicted: float
    channel: Channel
    at: FloatArray | None = None
    steps: int = SHORT  # simulated samples

    def read(self, growth: FloatArray) -> FloatArray:
        """The number, or its logarithm for growths and bursts, from the log growths per sample of the cases (..., c)."""
        return np.asarray(growth[..., 0]) if self.at is None else crossing(self.at, growth)


def questions(schedule: GainSchedule, quick: bool) -> list[Question]:
    """Critical drop probabilities at four wheel speeds and critical bursts at the worst of them.

    The wheel speeds: standstill, one and two thirds of the way to harmless speed, half-way from there to the end of the range.
    Where every loss is survived, the growth of the second moment at 95 % drops stands in for a critical probability.
    """
    start, end = prediction.harmless_from(schedule), schedule.parameter.max
    speeds = np.array([schedule.parameter.min, start / 3.0, 2.0 * start / 3.0, 0.5 * (start + end)])
    limits = critical(schedule, speeds)
    asked = []
    for speed, p in zip(speeds.tolist(), limits.tolist(), strict=True):
        if p > NEAR_ONE:
            asked.append(Question("growth", speed, 1.0, prediction.independent_drops(speed, HIGH_DROP)))
        else:
            at = p + min(0.05, 0.4 * (1.0 - p)) * THREE
            asked.append(Question("drop", speed, p, prediction.independent_drops(speed, at), at))
    worst, rates = float(speeds[limits.argmin()]), LOSS_RATES[:2] if quick else LOSS_RATES
    for rate, length in zip(rates, prediction.critical_bursts(schedule, worst, rates), strict=True):
        if length is not None and length < MOST_BURST and rate / (1.0 - rate) < length * np.exp(-STRETCH):
            at = np.log(length) + STRETCH * THREE
            steps = EVERY * round(min(max(4.0 * length, SHORT), LONG) / EVERY)
            asked.append(Question("burst", rate, length, prediction.bursts(worst, rate, np.exp(at)), at, steps))
    return asked


@dataclass(frozen=True)
class Row:
    """A compared number: `expected` is its exact value at the simulated time, the predicted one holds for ever."""

    question: Question
    expected: float
    found: Interval

    @property
    def agrees(self) -> bool:
        """The interval holds the exact value; a growth must in addition be seen to lie below 1."""
        return self.found.holds(self.expected) and (self.question.kind != "growth" or self.found.high < 1.0)


@dataclass(frozen=True)
class Trial:
    """All comparisons of one observer."""

    rows: tuple[Row, ...]

    def of(self, kind: Kind) -> tuple[Row, ...]:
        """The comparisons of one kind."""
        return tuple(row for row in self.rows if row.question.kind == kind)

    @property
    def agreeing(self) -> int:
        """How many comparisons agree."""
        return sum(row.agrees for row in self.rows)


def run_trial(schedule: GainSchedule, scope: Scope, seed: int, compared: GainSchedule | None = None) -> Trial:
    """Simulate `schedule` and compare with the prediction for `compared` (itself, unless a test asks otherwise)."""
    other = compared or schedule
    asked = questions(other, scope.quick)
    generator = np.random.default_rng(seed)
    runs = max(TOTAL_RUNS // (scope.seeds * (4 if scope.quick else 1)), 2)
    rows: dict[int, Row] = {}
    for steps in sorted({q.steps for q in asked}):
        group = [k for k, q in enumerate(asked) if q.steps == steps]
        channel = prediction.joined([asked[k].channel for k in group])
        norm = prediction.natural_norm(other, channel)
        start, end = prediction.log_second_moment(other, channel, norm, START, steps)
        seen = simulate(schedule, channel, norm, steps, scope.seeds, runs, generator) - start[:, None]
        first = 0
        for k in group:
            q, part = asked[k], slice(first, first + len(asked[k].channel.speed))
            first = part.stop
            found = interval(seen[part], steps, q.read, MISS / len(asked))
            expected = float(q.read((end - start)[part] / steps))
            if q.kind != "drop":
                found, expected = Interval(*map(math.exp, found)), math.exp(expected)
            rows[k] = Row(q, expected, found)
    return Trial(tuple(rows[k] for k in range(len(asked))))


def comparison(name: str, scope: Scope) -> PartResult:
    """All comparisons of the observer `name`, with empty cells for ends that no seed could give."""
    tested = observer(name)
    schedule, trial = tested.schedule, run_trial(tested.schedule, scope, NAMES.index(name))
    rows: list[list[Cell]] = []
    for row in (row for kind in QUANTITIES for row in trial.of(kind)):
        known = (end if math.isfinite(end) else None for end in row.found)
        rows.append([QUANTITIES[row.question.kind], row.question.place, row.expected, *known, row.agrees])
    confidence = f"{1.0 - MISS:.1%}"
    table = Table(
        f"comparison-{name}",
        f"{tested.title}: predictions of the analysis against the runtime observer, {scope.seeds} seeds. Intervals hold all "
        f"rows at once with {confidence} confidence; growth must also lie below 1.",
        ("quantity", "place", "predicted", "simulated", "low", "high", "interval holds prediction"), rows,
    )  # fmt: skip
    drops = trial.of("drop")
    worst = min(drops, key=lambda row: row.question.predicted).question.place if drops else schedule.parameter.min
    figure = Figure(
        f"drop-tolerance-{name}",
        f"{tested.title}. Left: critical drop probability of the force over the wheel speed, predicted (line) and measured on "
        f"the runtime observer (points, {scope.seeds} seeds); triangles: wheel speeds at which the mean square of the error was "
        f"seen to fall with {HIGH_DROP:.0%} of the samples lost. Right: at {worst:g} rad/s, the mean length of loss bursts up "
        "to which the mean square falls, over the share of lost samples (Gilbert-Elliott channel, one sample is "
        f"{tested.step:g} ms); dotted: independent losses; grey: lengths that no channel has. Bars hold all points at once with "
        f"{confidence} confidence.",
        "Left: a line rising to 1 with points on it. Right: a falling boundary between stable and unstable with points on it. "
        f"{trial.agreeing} of {len(trial.rows)} points agree.",
        [_drop_panel(schedule, trial), _burst_panel(schedule, trial, worst)], (9.2, 3.9),
    )  # fmt: skip
    all_hold = trial.agreeing == len(trial.rows)
    note = (
        f"{tested.title}: {'prediction confirmed' if all_hold else 'PREDICTION NOT CONFIRMED'}. {trial.agreeing} of "
        f"{len(trial.rows)} intervals from {scope.seeds} seeds of the runtime observer hold the predicted value "
        f"(simultaneous confidence {confidence}: if the prediction is right, all do with at least this probability)."
    )
    measures = {"comparisons": float(len(trial.rows)), "agreeing": float(trial.agreeing)}
    return PartResult((), [table], [figure], [note], measures)


for each in NAMES:
    title = f"Prediction against runtime: {each.replace('-', ' ')}"
    TOPIC.part(f"observer-{each}", title, 5.5, quick=each in QUICK)(partial(comparison, each))


def _measured(rows: Sequence[Row]) -> list[Mark]:
    if not rows:
        return []
    place, value, low, high = np.array([[row.question.place, *row.found] for row in rows]).T
    return [ErrorBars(place, value, value - low, high - value, "runtime observer", RED)]


def _drop_panel(schedule: GainSchedule, trial: Trial) -> Panel:
    end = min(schedule.parameter.max, max(3.0 * prediction.harmless_from(schedule), 4.0))
    grid = np.linspace(schedule.parameter.min, end, 301)
    limit = critical(schedule, grid)
    marks: list[Mark] = [Line(grid, limit, "predicted", BLUE, width=1.8), *_measured(trial.of("drop"))]
    places = [row.question.place for row in trial.of("growth") if row.agrees]
    far = [place for place in places if place > end]
    if places:
        at = [place for place in places if place <= end] + [0.97 * end] * bool(far)
        marks.append(dots(at, [HIGH_DROP] * len(at), f"falls at {HIGH_DROP:.0%} drops", GREEN, "^", 6))
    if far:
        marks.append(Words(0.97 * end, HIGH_DROP, f"{far[0]:.0f} rad/s →", GREEN, 7.5, (-4, -13), "right"))
    room = 1.0 - min([*(row.found.low for row in trial.of("drop")), float(limit.min())])
    y = Axis("critical drop probability [1]", max(0.0, 0.98 - 1.5 * room), 1.005 + 0.06 * room)
    return Panel(marks, Axis(SPEED_LABEL, -0.02 * end, end), y, legend="lower right")


def _burst_panel(schedule: GainSchedule, trial: Trial, speed: float) -> Panel:
    loss, edge = prediction.boundary(schedule, speed)
    rates = np.linspace(0.001, 0.99, 400)
    marks: list[Mark] = [
        Line(loss, edge, "predicted boundary", BLUE, width=1.8),
        Band(loss, edge, LONGEST_BURST, color=RED, alpha=0.1),
    ]
    if len(loss) and edge[-1] < LONGEST_BURST:  # the boundary ends on the shortest bursts there are: beyond, all grow
        beyond = np.linspace(loss[-1], 0.99, 100)
        marks.append(Band(beyond, beyond / (1.0 - beyond), LONGEST_BURST, color=RED, alpha=0.1))
    marks += [
        Band(rates, 0.5, np.maximum(rates / (1.0 - rates), 1.0), color="0.85", alpha=1.0),
        Line(rates, 1.0 / (1.0 - rates), "independent losses", GREY, "dotted", 1.0),
        *_measured(trial.of("burst")),
        Words(0.40, 130.0, "grows", RED, 9.0),
        Words(0.08, 2.2, "falls", BLUE, 9.0),
    ]
    y = Axis("mean burst length [samples]", 0.8, LONGEST_BURST, "log")
    return Panel(marks, Axis("share of lost samples [1]", 0.0, 1.0), y, legend="upper right")
