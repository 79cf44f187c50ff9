"""Figures of a sweep for its page: the shares of the variance of every measure."""

from __future__ import annotations

import numpy as np

from studies.plots import Axis, Bars, Figure, Mark, Panel
from studies.plots.colours import BLUE, ORANGE
from studies.report.sweep_tables import spread_of, varies
from studies.sweeps.labels import paneled, words
from studies.sweeps.measures import Measure
from studies.sweeps.observer import Observer
from studies.sweeps.summary import Summary
from studies.sweeps.sweep import Sweep

DIGITS = 3  # behind the point
ROOM, LITTLE = 0.22, 0.02  # of the axis, beside the bars
KINDS = (("total", "total index, 95 % confidence", BLUE, 0.2), ("first-order", "first-order index", ORANGE, -0.2))


def index_figure(sweep: Sweep, summary: Summary, observer: Observer) -> Figure | None:
    """One panel a measure, two bars a parameter, the largest total index on top; None without indices."""
    panels = [p for m in sweep.measures if (p := _panel(sweep, summary, observer, m)) is not None]
    title = f"{observer.name}: which parameters the variance comes from"
    height = 1.2 + 0.42 * len(sweep.ranges[observer.name])
    return paneled(f"{observer.name}-indices", title, panels, 4.8, height) if panels else None


def _panel(sweep: Sweep, summary: Summary, observer: Observer, measure: Measure) -> Panel | None:
    names = [v.name for v in sweep.ranges[observer.name]]
    totals = {
        n: f.value for n in names if (f := summary.of(observer.name, measure.name, f"total index {n}")) is not None
    }
    if not totals or not varies(summary, observer, measure):
        return None
    order = sorted(totals, key=lambda name: totals[name])
    marks: list[Mark] = []
    ends = [0.0, 1.0]
    for kind, label, colour, offset in KINDS:
        found = [summary.of(observer.name, measure.name, f"{kind} index {name}") for name in order]
        values = np.array([np.nan if f is None else f.value for f in found])
        widths = np.array([0.0 if f is None else f.confidence or 0.0 for f in found])
        values = np.where(np.abs(values) < 0.5 * 10.0**-DIGITS, 0.0, values)  # an estimate of nothing may be −1e-7
        places = np.arange(len(order)) + offset
        marks.append(
            Bars(
                places,
                values,
                label,
                colour,
                0.36,
                flat=True,
                errors=np.array([widths, widths]),
                numbers=f"%.{DIGITS}f",
            )
        )
        ends += [float(np.nanmin(values - widths)), float(np.nanmax(values + widths))]
    low = min(ends) - ROOM if min(ends) < -LITTLE else -LITTLE  # room for numbers on both sides
    x = Axis("share of the variance [1]", low, max(ends) + ROOM, ticks=(0.0, 0.25, 0.5, 0.75, 1.0))
    y = Axis("", -0.6, len(order) - 0.4, ticks={place: words(name) for place, name in enumerate(order)})
    return Panel(marks, x, y, spread_of(measure))
