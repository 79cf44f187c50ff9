"""The numbers of a sweep as tables: what was asked, quantiles, worst points, Sobol indices, the gate."""

from __future__ import annotations

import math
from collections.abc import Sequence

from studies.sentence import shown
from studies.study import Table
from studies.sweeps.gate import HEADINGS, Comparison
from studies.sweeps.labels import words
from studies.sweeps.measures import Measure
from studies.sweeps.observer import Observer
from studies.sweeps.summary import Summary
from studies.sweeps.sweep import Sweep

QUANTILES = ("nominal", "median", "quantile 95 %", "quantile 99 %", "worst")
DIGITS = 5
NOTHING = 1e-9  # a share: less is rounding


def asked_tables(sweep: Sweep) -> list[Table]:
    """Measures with their limits and tolerances, designs, and the range of every parameter of every observer."""
    measures = [
        (
            words(m.name),
            m.unit,
            m.better,
            shown(m.limit),
            shown(100.0 * sweep.tolerances.get(m.name, sweep.tolerance), 3),
        )
        for m in sweep.measures
    ]
    first = sweep.observers[0]
    designs = [(stage.kind, sweep.rows(first, stage), getattr(stage, "seed", None)) for stage in sweep.stages]
    ranges = [
        (observer.name, words(v.name), shown(v.nominal, DIGITS), shown(v.low, DIGITS), shown(v.high, DIGITS), v.unit)
        for observer in sweep.observers
        for v in sweep.ranges[observer.name]
    ]
    said = "What was measured. A loss is a share of the distance from the value at which the measure becomes worthless."
    return [
        Table("measures", said, ("measure", "unit", "better", "worthless at", "tolerated loss [%]"), measures),
        Table("designs", f"Designs of '{first.name}'.", ("kind", "designs", "seed"), designs),
        Table(
            "ranges",
            "What was varied, and how far.",
            ("observer", "parameter", "nominal", "from", "to", "unit"),
            ranges,
        ),
    ]


def quantile_table(sweep: Sweep, summary: Summary, observer: Observer) -> Table:
    """Over the random designs: the value that so many of them are at least as good as; the worst of all designs."""
    rows = []
    for measure in sweep.measures:
        found = [summary.of(observer.name, measure.name, name) for name in QUANTILES]
        values = [None if f is None else shown(f.value, DIGITS) for f in found]
        nominal, worst = found[0], found[-1]
        loss = None if nominal is None or worst is None else percent(measure.loss(nominal.value, worst.value))
        rows.append((words(measure.name), measure.unit, *values, loss))
    caption = (
        "Nominal, quantiles over the random designs (so many are at least as good), and the worst of all designs, each at its "
        "worst place of the grid. Lost: how much of the nominal distance to worthlessness is gone at the worst design."
    )
    columns = ("measure", "unit", "nominal", "median", "95 %", "99 %", "worst", "lost [%]")
    return Table(f"quantiles-{observer.name}", caption, columns, rows)


def worst_table(sweep: Sweep, summary: Summary, observer: Observer) -> Table:
    """Where the worst design of each measure sits."""
    ranges, grid = sweep.ranges[observer.name], observer.plant.box
    named = [*((v.name, v.unit) for v in ranges), *((p.name, p.unit) for p in grid)]
    rows = []
    for measure in sweep.measures:
        worst = summary.of(observer.name, measure.name, "worst")
        if worst is not None:
            at = [worst.at.get(name) for name, _ in named]
            places = [None if value is None else shown(value, DIGITS) for value in at]
            rows.append((words(measure.name), f"{shown(worst.value, DIGITS)}{unit_of(measure)}", *places))
    columns = ("measure", "worst", *(f"{words(name)} [{unit.removesuffix('/(1)')}]" for name, unit in named))
    return Table(f"worst-{observer.name}", "Worst points: the design and the place of the grid.", columns, rows)


def index_table(sweep: Sweep, summary: Summary, observer: Observer) -> Table:
    """First-order and total Sobol index of every parameter with the half-width of 95 % confidence."""
    rows = []
    for measure in (m for m in sweep.measures if varies(summary, observer, m)):
        for v in sweep.ranges[observer.name]:
            found = [
                summary.of(observer.name, measure.name, f"{kind} index {v.name}") for kind in ("first-order", "total")
            ]
            if None not in found:
                cells = [f"{_share(f.value)} ± {_share(f.confidence or 0.0)}" for f in found if f is not None]
                rows.append((spread_of(measure), words(v.name), *cells))
    caption = (
        "Sobol indices: the share of the variance that a parameter has alone, and with all that it takes part in; a share has no "
        "unit. Behind ± is half the width of the 95 % confidence interval."
    )
    return Table(
        f"indices-{observer.name}", caption, ("variance of", "parameter", "first order [1]", "total [1]"), rows
    )


def gate_table(compared: Sequence[Comparison]) -> Table:
    """Every statistic that the baseline knows."""
    rows = [(*c.cells[:6], f"{shown(100.0 * c.tolerance, 3)} %", c.state, *c.cells[6:]) for c in compared]
    columns = ("observer", *HEADINGS[1:6], "tolerance", "state", *HEADINGS[6:])
    return Table("gate", "Every statistic beside the baseline.", columns, rows)


def unit_of(measure: Measure) -> str:
    """Behind a number; a pure number has none."""
    return "" if measure.unit == "1" else f" {measure.unit}"


def spread_of(measure: Measure) -> str:
    """What the variance is taken of: a measure that may be infinite goes in as its reciprocal."""
    return words(measure.name) if measure.variance == "value" else f"1 / {words(measure.name)}"


def varies(summary: Summary, observer: Observer, measure: Measure) -> bool:
    """Whether the worst design differs from the nominal one by more than rounding: else shares of a variance mean nothing."""
    nominal, worst = (summary.of(observer.name, measure.name, name) for name in ("nominal", "worst"))
    return nominal is None or worst is None or not abs(measure.loss(nominal.value, worst.value)) < NOTHING


def _share(value: float) -> str:
    """Of a variance: four digits behind the point."""
    return f"{round(value, 4) + 0.0:.4f}".replace("-", "−")


def percent(share: float) -> str:
    """A share in per cent."""
    return "0" if abs(share) < NOTHING else shown(100.0 * share, 3) if math.isfinite(share) else "all"
