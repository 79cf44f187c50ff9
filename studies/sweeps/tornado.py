"""The tornado of a sweep: how far a measure moves when one parameter alone goes through its range."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from analysis.sensitivity.designs import OneAtATimeDesign
from estimators.arrays import FloatArray
from studies.plots import Axis, Bars, Figure, Level, Mark, Panel, Words
from studies.plots.colours import ABOVE, BELOW, NOMINAL
from studies.sweeps.labels import better, paneled, titled, words
from studies.sweeps.measures import Measure
from studies.sweeps.store import Rows

SIDES = (("parameter below nominal", BELOW, -1.0, 0.2), ("parameter above nominal", ABOVE, 1.0, -0.2))
"""Label, colour, sign of the levels, and the place of the bar in its row: side by side, neither hides the other."""
NOTHING = 1e-9  # a share of the nominal value: less is rounding
LEAST_DIGITS, MOST_DIGITS = 4, 9  # of the number at a bar, and as many as tell it from the nominal value
LEAST_TICKS = 3


@dataclass(frozen=True)
class Bar:
    """One parameter alone: its relative `levels` and the measure (worst over the grid) there; `nominal` in the middle."""

    parameter: str
    levels: FloatArray
    values: FloatArray
    nominal: float

    @property
    def reach(self) -> float:
        """The largest deviation; infinite ones count most."""
        return float(np.abs(self.values - self.nominal).max())


def tornado(rows: Rows, measure: Measure) -> list[Bar]:
    """One bar a parameter, the longest first; empty without a one-at-a-time stage."""
    nominal: float | None = None
    values, at = [], []
    alone = next((stage for stage in rows.stages if isinstance(stage, OneAtATimeDesign)), None)
    for stage, _, columns in rows.columns([*rows.ranges, measure.name]):
        if nominal is None:
            nominal = float(columns[measure.name][0])
            centre = np.array([float(columns[name][0]) for name in rows.ranges])
        if stage is alone:
            values.append(columns[measure.name])
            at.append(np.stack([columns[name] for name in rows.ranges], axis=1))
    if nominal is None or not values:
        return []
    found, where = np.concatenate(values).reshape(len(rows.ranges), -1), np.concatenate(at)
    where = where.reshape(len(rows.ranges), -1, len(rows.ranges))
    bars = [
        Bar(name, where[i, :, i] / centre[i] - 1.0 if centre[i] else where[i, :, i], found[i], nominal)
        for i, name in enumerate(rows.ranges)
        if not np.isnan(found[i]).any()
    ]
    return sorted(bars, key=lambda bar: -bar.reach)


def tornado_figure(rows: Rows, bars: Mapping[str, list[Bar]]) -> Figure:
    """One panel a measure; a bar for either side of every parameter, the measure written at its end."""
    shown = [(m, bars[m.name][::-1]) for m in rows.measures if bars[m.name]]
    title = f"{rows.observer.name}: one parameter at a time, worst over the grid"
    panels, height = [tornado_panel(*each) for each in shown], 1.5 + 0.5 * len(rows.ranges)
    return paneled(f"{rows.observer.name}-tornado", title, panels, 4.8, height)


def tornado_panel(measure: Measure, bars: Sequence[Bar]) -> Panel:
    """Bars that lie, the last one on top."""
    nominal = bars[0].nominal
    marks: list[Mark] = [Level(x=nominal, label="nominal", color=NOMINAL, width=0.9)]
    notes: list[Mark] = []
    ends = [nominal]
    for label, colour, side, offset in SIDES:
        places, left, right = [], [], []
        for place, bar in enumerate(bars):
            values = bar.values[(side * bar.levels > 0.0) & np.isfinite(bar.values)]
            if len(values):
                low, high = min(float(values.min()), nominal), max(float(values.max()), nominal)
                places.append(place + offset)
                left.append(low)
                right.append(high)
                notes += _numbers(low, high, nominal, place + offset)
        if places:
            spans = np.array([left, right])
            marks.append(Bars(places, spans[1] - spans[0], label, colour, 0.36, flat=True, start=spans[0]))
            ends += [*left, *right]
    for place, bar in enumerate(bars):
        if not np.isfinite(bar.values).all():
            notes.append(_note(nominal, place, "unstable", 1.0))
    span = max(ends) - min(ends)
    room = 0.24 * span if span > NOTHING * abs(nominal) else 0.1 * abs(nominal) or 1.0  # numbers stand beside the bars
    low, high = min(ends) - room, max(ends) + room
    x = Axis(f"{titled(measure)}, nominal {_digits(nominal, LEAST_DIGITS)}", low, high, ticks=round_ticks(low, high))
    y = Axis(ticks={place: words(bar.parameter) for place, bar in enumerate(bars)}, low=-0.6, high=len(bars) - 0.4)
    return Panel([*marks, *notes], x, y, better(measure))


def _numbers(low: float, high: float, nominal: float, place: float) -> list[Mark]:
    """The measure at the ends of a bar that leave the nominal value."""
    moved = [(end, sign) for end, sign in ((low, -1.0), (high, 1.0)) if abs(end - nominal) > NOTHING * abs(nominal)]
    return [_note(end, place, told_apart(end, nominal), sign) for end, sign in moved] or [
        _note(nominal, place, "no change", 1.0)
    ]


def told_apart(value: float, nominal: float) -> str:
    """In four significant digits, or as many as it takes to read another number than the nominal one."""
    counts = range(LEAST_DIGITS, MOST_DIGITS)
    digits = next((n for n in counts if _digits(value, n) != _digits(nominal, n)), MOST_DIGITS)
    return _digits(value, digits)


def _digits(value: float, digits: int) -> str:
    return f"{value:.{digits}g}".replace("-", "−")


def _note(x: float, place: float, text: str, sign: float) -> Words:
    side: Literal["left", "right"] = "left" if sign > 0.0 else "right"
    return Words(x, place, text, size=6.5, offset=(3.0 * sign, 0.0), horizontal=side, vertical="center")


def round_ticks(low: float, high: float) -> list[float]:
    """Round values inside, as few as there can be from three on, far enough apart for their digits."""
    unit = 10.0 ** np.floor(np.log10((high - low) / 2.0))
    for step in (factor * unit for factor in (5.0, 2.5, 2.0, 1.0, 0.5)):
        places = np.arange(np.ceil(low / step), np.floor(high / step) + 1.0)
        if len(places) >= LEAST_TICKS:
            break
    return [float(f"{place * step:.12g}") for place in places]
