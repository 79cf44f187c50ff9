"""What changed against a baseline: every statistic of every observer, and in words where nothing did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import Literal

import numpy as np

from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Shade, Words, dots
from studies.plots.colours import ABOVE, BELOW, NOMINAL
from studies.sweeps.baseline import Baseline
from studies.sweeps.engine import SweepResult
from studies.sweeps.labels import paneled, words
from studies.sweeps.measures import Measure
from studies.sweeps.summary import number

STATISTICS = {"nominal": "o", "median": "s", "quantile 95 %": "^", "quantile 99 %": "D", "worst": "X"}
"""With their markers; in this order from the top of a row to its foot."""
ROUNDING = 1e-3  # per cent: less is how a baseline rounds its numbers
NAME = 18  # letters of an observer in a line
WRITTEN = ("nominal", "quantile 99 %", "worst")  # of what did not change
COLUMNS: tuple[tuple[float, Literal["left", "right"]], ...] = (
    (0.0, "left"),
    (0.6, "right"),
    (0.83, "right"),
    (1.0, "right"),
)
MOST_NUMBERS = 12  # written in a panel, the largest changes first


@dataclass(frozen=True)
class Change:
    """A statistic of the observer in row ``place``: ``percent`` of its distance to worthlessness won, lost if negative."""

    place: int
    name: str
    percent: float
    value: float
    unit: str

    @property
    def y(self) -> float:
        """Where it is drawn: the statistics of an observer stand below each other."""
        return self.place + 0.15 * (list(STATISTICS).index(self.name) - 2)


def change_figure(result: SweepResult, before: Baseline) -> Figure:
    """One panel a measure, one row an observer; the title counts."""
    found = {measure.name: _changes(result, before, measure) for measure in result.sweep.measures}
    all_of_them = [change for changes in found.values() for change in changes]
    moved = sum(abs(change.percent) > ROUNDING for change in all_of_them)
    says = (
        f"{moved} of {len(all_of_them)} statistics moved"
        if moved
        else f"all {len(all_of_them)} statistics are unchanged"
    )
    panels = [change_panel(result, measure, found[measure.name]) for measure in result.sweep.measures]
    height = 1.3 + 0.55 * len(result.sweep.observers) if moved else 0.6 + 0.28 * len(result.sweep.observers)
    title = f"Sweep {result.sweep.name} against its baseline: {says}"
    return paneled("before-after", title, panels, 5.6, height)


def _changes(result: SweepResult, before: Baseline, measure: Measure) -> list[Change]:
    changes = []
    for place, observer in enumerate(result.sweep.observers):
        for name in STATISTICS:
            old, new = (s.of(observer.name, measure.name, name) for s in (before.summary, result.summary))
            if old is not None and new is not None:
                percent = -100.0 * measure.loss(old.value, new.value)
                changes.append(Change(place, name, percent, new.value, new.unit))
    return changes


def change_panel(result: SweepResult, measure: Measure, changes: Sequence[Change]) -> Panel:
    """The changes of one measure, or its values where none moved."""
    tolerance = 100.0 * result.sweep.tolerances.get(measure.name, result.sweep.tolerance)
    moved = [change for change in changes if abs(change.percent) > ROUNDING]
    shrunk = sum(change.percent < -tolerance for change in changes)
    names = [s.name for s in result.sweep.observers]
    if not moved:
        return _unchanged(measure, names, changes)
    y = Axis("", len(names) - 0.5, -0.5, ticks={k: fill(name, NAME) for k, name in enumerate(names)})
    reach = max([2.0 * tolerance, *(abs(change.percent) for change in moved if np.isfinite(change.percent))])
    marks: list[Mark] = [
        Shade(-tolerance, 0.0, "x", "tolerance", "0.92", 1.0),
        Level(x=0.0, color=NOMINAL, width=0.9),
        *(dots([], [], name, "0.4", marker) for name, marker in STATISTICS.items()),
        dots([], [], "shrunk beyond tolerance", ABOVE),
    ]
    for change in changes:
        shown = float(np.clip(change.percent, -1.15 * reach, 1.15 * reach))
        colour = ABOVE if change.percent < -tolerance else BELOW
        marks.append(Line([0.0, shown], [change.y, change.y], color="0.75", width=1.2))
        marks.append(dots(shown, change.y, color=colour, marker=STATISTICS[change.name], size=4.0))
    for change in sorted(moved, key=lambda change: -abs(change.percent))[:MOST_NUMBERS]:
        right = change.percent > 0.0
        shown = float(np.clip(change.percent, -1.15 * reach, 1.15 * reach))
        text = f"{change.percent:+.3g}".replace("-", "−")
        side: Literal["left", "right"] = "left" if right else "right"
        aside = (5.0 if right else -5.0, 0.0)
        marks.append(Words(shown, change.y, text, size=6.5, offset=aside, horizontal=side, vertical="center"))
    wide = reach > 10.0 * tolerance > 0.0
    room = 12.0 if wide else 1.5  # for the numbers
    x = Axis(
        "change [%], left is worse", -room * reach, room * reach, "symlog" if wide else "linear", linear=2.0 * tolerance
    )
    return Panel(marks, x, y, f"{words(measure.name)}: {shrunk} shrank, {len(moved)} moved")


def _unchanged(measure: Measure, names: Sequence[str], changes: Sequence[Change]) -> Panel:
    """In words: what each observer has still."""
    unit = "" if measure.unit == "1" else f" [{measure.unit}]"
    lines: list[tuple[str, ...]] = [("", *WRITTEN)]
    for place, observer in enumerate(names):
        values = {change.name: number(change.value, 4).replace("-", "−") for change in changes if change.place == place}
        lines.append((observer, *(values.get(name, "") for name in WRITTEN)))
    marks: list[Mark] = [
        Words(x, 1.0 - (row + 0.5) / len(lines), text, size=8.0, relative=True, horizontal=side, vertical="center")
        for row, line in enumerate(lines)
        for text, (x, side) in zip(line, COLUMNS, strict=True)
        if text
    ]
    return Panel(marks, title=f"{words(measure.name)}{unit}: all {len(changes)} statistics are unchanged", bare=True)
