"""One observer: predicted curves, simulated points, and whether they agree."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from studies.beyond.drop_tolerance.observers import NAMES, Observer, observer
from studies.beyond.drop_tolerance.prediction import (
    LONGEST_BURST,
    boundary,
    critical,
    harmless_from,
)
from studies.beyond.drop_tolerance.questions import HIGH_DROP
from studies.beyond.drop_tolerance.trial import MISS, Row, Trial, run_trial
from studies.papers.resilient_velocity.ink import SPEED_LABEL, sheet
from studies.plots.colours import BLUE, GREEN, GREY, RED
from studies.study import Cell, Drawing, PartResult, Scope, Table


def part(name: str) -> Callable[[Scope], PartResult]:
    """The part of the study for one observer."""

    def run(scope: Scope) -> PartResult:
        tested = observer(name)
        trial = run_trial(tested.schedule, scope, NAMES.index(name))
        return PartResult(
            (),
            [table(tested, trial, scope)],
            [drawing(tested, trial, scope)],
            [note(tested, trial, scope)],
            {"comparisons": float(len(trial.rows)), "agreeing": float(trial.agreeing)},
        )

    return run


def note(tested: Observer, trial: Trial, scope: Scope) -> str:
    """The verdict in words."""
    all_hold = trial.agreeing == len(trial.rows)
    return (
        f"{tested.title}: {'prediction confirmed' if all_hold else 'PREDICTION NOT CONFIRMED'}. {trial.agreeing} of "
        f"{len(trial.rows)} intervals from {scope.seeds} seeds of the runtime observer hold the predicted value "
        f"(simultaneous confidence {1.0 - MISS:.1%}: if the prediction is right, all do with at least this "
        "probability)."
    )


def table(tested: Observer, trial: Trial, scope: Scope) -> Table:
    """All comparisons as rows."""
    rows: list[tuple[Cell, ...]] = []
    kinds: list[tuple[str, tuple[Row, ...]]] = [
        ("critical drop probability at a wheel speed [rad/s]", trial.of("drop")),
        (
            f"growth of the second moment a sample at {HIGH_DROP:.0%} drops, at a wheel speed [rad/s]",
            trial.of("growth"),
        ),
        ("critical mean burst [samples] at a loss rate [1]", trial.of("burst")),
    ]
    for what, group in kinds:
        rows += [
            (what, r.place, r.expected, *map(_known, (r.found.value, r.found.low, r.found.high)), r.agrees)
            for r in group
        ]
    return Table(
        f"comparison-{tested.name}",
        f"{tested.title}: predictions of the analysis against the runtime observer, {scope.seeds} seeds. "
        f"Intervals hold all rows at once with {1.0 - MISS:.1%} confidence; growth must also lie below 1.",
        ("quantity", "place", "predicted", "simulated", "low", "high", "interval holds prediction"),
        rows,
    )


def _known(value: float) -> float | None:
    """An empty cell for an end that no seed could give."""
    return value if math.isfinite(value) else None


def drawing(tested: Observer, trial: Trial, scope: Scope) -> Drawing:
    """Left: critical drop probability over wheel speed. Right: critical burst over loss rate."""
    figure = sheet(9.2, 3.9)
    left, right = figure.subplots(1, 2)
    _drop_panel(left, tested, trial)
    worst = (
        min(trial.of("drop"), key=lambda r: r.predicted).place if trial.of("drop") else tested.schedule.parameter.min
    )
    _burst_panel(right, tested, trial, worst)
    step = 1e3 * tested.schedule.sample_time
    return Drawing(
        f"drop-tolerance-{tested.name}",
        f"{tested.title}. Left: critical drop probability of the force over the wheel speed, predicted (line) and "
        f"measured on the runtime observer (points, {scope.seeds} seeds); triangles: wheel speeds at which the mean "
        f"square of the error was seen to fall with {HIGH_DROP:.0%} of the samples lost. Right: at {worst:g} rad/s, "
        "the mean length of loss bursts up to which the mean square falls, over the share of lost samples "
        f"(Gilbert-Elliott channel, one sample is {step:g} ms); dotted: independent losses; grey: lengths that no "
        f"channel has. Bars hold all points at once with {1.0 - MISS:.1%} confidence.",
        "Left: a line rising to 1 with points on it. Right: a falling boundary between stable and unstable with "
        f"points on it. {trial.agreeing} of {len(trial.rows)} points agree.",
        figure,
    )


def _bars(axis: Axes, rows: tuple[Row, ...], colour: str, label: str) -> None:
    if rows:
        value = np.array([r.found.value for r in rows])
        ends = np.array([[r.found.low for r in rows], [r.found.high for r in rows]])
        places = [r.place for r in rows]
        axis.errorbar(
            places, value, yerr=np.abs(ends - value), fmt="o", ms=4, color=colour, capsize=3, lw=1.2, label=label
        )


def _drop_panel(axis: Axes, tested: Observer, trial: Trial) -> None:
    start = harmless_from(tested.schedule)
    end = min(tested.schedule.parameter.max, max(3.0 * start, 4.0))
    grid = np.linspace(tested.schedule.parameter.min, end, 301)
    axis.plot(grid, critical(tested.schedule, grid), color=BLUE, lw=1.8, label="predicted")
    _bars(axis, trial.of("drop"), RED, "runtime observer")
    good = [r.place for r in trial.of("growth") if r.agrees and r.place <= end]
    far = [r.place for r in trial.of("growth") if r.agrees and r.place > end]
    if good:
        axis.plot(good, [HIGH_DROP] * len(good), "^", color=GREEN, ms=6, label=f"falls at {HIGH_DROP:.0%} drops")
    if far:
        axis.plot(
            [0.97 * end], [HIGH_DROP], "^", color=GREEN, ms=6, label=None if good else f"falls at {HIGH_DROP:.0%} drops"
        )
        axis.annotate(
            f"{far[0]:.0f} rad/s →",
            (0.97 * end, HIGH_DROP),
            (-4, -13),
            textcoords="offset points",
            fontsize=7.5,
            color=GREEN,
            ha="right",
        )
    lowest = min([*(r.found.low for r in trial.of("drop")), float(critical(tested.schedule, grid).min())])
    axis.set_ylim(max(0.0, lowest - 0.5 * (1.0 - lowest) - 0.02), 1.0 + 0.06 * (1.0 - lowest) + 0.005)
    axis.set_xlim(-0.02 * end, end)
    axis.set_xlabel(SPEED_LABEL)
    axis.set_ylabel("critical drop probability [1]")
    axis.legend(loc="lower right")


def _burst_panel(axis: Axes, tested: Observer, trial: Trial, speed: float) -> None:
    loss, edge = boundary(tested.schedule, speed)
    axis.plot(loss, edge, color=BLUE, lw=1.8, label="predicted boundary")
    axis.fill_between(loss, edge, LONGEST_BURST, color=RED, alpha=0.10, lw=0)
    rates = np.linspace(0.001, 0.99, 400)
    if len(loss) and edge[-1] < LONGEST_BURST:  # the boundary ends on the shortest bursts there are: beyond, all grow
        beyond = np.linspace(loss[-1], 0.99, 100)
        axis.fill_between(beyond, beyond / (1.0 - beyond), LONGEST_BURST, color=RED, alpha=0.10, lw=0)
    axis.fill_between(rates, 0.5, np.maximum(rates / (1.0 - rates), 1.0), color="0.85", lw=0)
    axis.plot(rates, 1.0 / (1.0 - rates), color=GREY, lw=1.0, ls=":", label="independent losses")
    _bars(axis, trial.of("burst"), RED, "runtime observer")
    axis.set_yscale("log")
    axis.set_ylim(0.8, LONGEST_BURST)
    axis.set_xlim(0.0, 1.0)
    axis.set_xlabel("share of lost samples [1]")
    axis.set_ylabel("mean burst length [samples]")
    axis.annotate("grows", (0.40, 130.0), color=RED, fontsize=9)
    axis.annotate("falls", (0.08, 2.2), color=BLUE, fontsize=9)
    axis.legend(loc="upper right")
