"""Figures of a sweep: tornado, worst case over the grid, the two parameters that matter most, before and after."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.sensitivity.designs import OneAtATimeDesign
from estimators.arrays import FloatArray
from studies.plots import Axis, Band, Bars, ColouredDots, Figure, Level, Line, Map, Mark, Panel, Shade, Words, dots
from studies.plots.colours import ABOVE, BELOW, BEST, DIVERGING, LOWER_END, MIDDLE, NOMINAL, UPPER_END, WORST
from studies.plots.save import save_figure
from studies.sweeps.baseline import Baseline
from studies.sweeps.engine import SweepResult
from studies.sweeps.evaluate import TIE
from studies.sweeps.measures import Measure
from studies.sweeps.store import Rows, SweepFolder
from studies.sweeps.tables import columns_of

MOST_POINTS = 3000
VALUES = {"nominal": "o", "median": "s", "quantile 95 %": "^", "quantile 99 %": "D", "worst": "X"}
"""Statistics of the comparison, with their markers."""


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


@dataclass(frozen=True)
class WorstMap:
    """Over the grid `points` (g,): the measure of the nominal design, of the worst and of the best.

    `position` (d, g) is where in its range the worst design has each parameter, from 0 (lower end) to 1.
    """

    points: FloatArray
    nominal: FloatArray
    worst: FloatArray
    best: FloatArray
    position: FloatArray


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


def worst_map(folder: SweepFolder, rows: Rows, observer: int, measure: Measure) -> WorstMap | None:
    """None for a measure without place on the grid, or a grid of more than one parameter."""
    grid = folder.sweep.grid(rows.observer)
    if len(grid.names) != 1:
        return None
    worst, best = np.full(len(grid), -np.inf), np.full(len(grid), np.inf)
    design = np.zeros(len(grid), np.int64)
    nominal: FloatArray | None = None
    for chunk in folder.of(observer):
        columns = columns_of(folder.envelope(chunk), ("measure", "worst", "design", "best"))
        own = np.array([name == measure.name for name in columns["measure"]], bool)
        if not own.any():
            return None
        signed = np.nan_to_num(measure.sign * columns["worst"][own], nan=-np.inf, posinf=np.inf, neginf=-np.inf)
        if nominal is None:
            nominal = columns["worst"][own]
        with np.errstate(invalid="ignore"):
            worse = (signed > worst + TIE * np.abs(worst)) | (np.isneginf(worst) & (signed > worst))
        worst[worse], design[worse] = signed[worse], columns["design"][own][worse]
        best = np.fmin(best, measure.sign * columns["best"][own])
    if nominal is None:
        return None
    position = _positions(folder, rows, design)
    return WorstMap(grid.points[:, 0], nominal, measure.sign * worst, measure.sign * best, position)


def _positions(folder: SweepFolder, rows: Rows, designs: Any) -> FloatArray:
    """Where in their ranges the parameters of some designs are, (d, g)."""
    ranges = folder.sweep.ranges[rows.observer.name]
    out = np.full((len(ranges), len(designs)), np.nan)
    for _, first, columns in rows.columns(rows.ranges):
        count = len(columns[rows.ranges[0]])
        inside = (designs >= first) & (designs < first + count)
        for i, v in enumerate(ranges):
            out[i, inside] = (columns[v.name][designs[inside] - first] - v.low) / (v.high - v.low)
    return out


def cloud(rows: Rows, measure: Measure, names: tuple[str, str]) -> tuple[FloatArray, FloatArray] | None:
    """Random designs, evenly thinned: two parameters (k, 2) and the measure (k,).

    None without random designs or for designs that all have no value.
    """
    total = sum(len(columns[measure.name]) for _, _, columns in rows.columns([measure.name], random=True))
    step = max(1, -(-total // MOST_POINTS))
    at, values, seen = [], [], 0
    for _, _, columns in rows.columns([*names, measure.name], random=True):
        kept = np.flatnonzero((np.arange(len(columns[measure.name])) + seen) % step == 0)
        seen += len(columns[measure.name])
        at.append(np.stack([columns[name][kept] for name in names], axis=1))
        values.append(columns[measure.name][kept])
    if not values:
        return None
    found, where = np.concatenate(values), np.concatenate(at)
    finite = np.isfinite(found)
    return (where[finite], found[finite]) if finite.any() else None


def plot_sweep(
    result: SweepResult, folder: Path, before: Baseline | None = None, observers: Collection[str] | None = None
) -> list[Path]:
    """The pictures of some observers (default: all) and the comparison, as SVG and PNG; returns the files.

    The same sweep gives the same pictures.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = []
    for figure in figures(result, before, observers):
        save_figure(figure, folder)
        names.append(figure.name)
    return [folder / f"{name}.{suffix}" for name in names for suffix in ("svg", "png")]


def figures(result: SweepResult, before: Baseline | None, observers: Collection[str] | None) -> Iterator[Figure]:
    """What `plot_sweep` writes."""
    for index, observer in enumerate(result.sweep.observers):
        if observers is not None and observer.name not in observers:
            continue
        rows = Rows(result.folder, index)
        bars = {m.name: tornado(rows, m) for m in rows.measures}
        if any(bars.values()):
            yield tornado_figure(rows, bars)
        maps = [(m, found) for m in rows.measures if (found := worst_map(result.folder, rows, index, m)) is not None]
        if maps:
            yield map_figure(result, rows, maps)
        scatter = scatter_figure(result, rows, bars) if len(rows.ranges) > 1 else None
        if scatter is not None:
            yield scatter
    if before is not None:
        yield before_after_figure(result, before)


def tornado_figure(rows: Rows, bars: Mapping[str, list[Bar]]) -> Figure:
    """One panel a measure: how far it moves when one parameter alone goes through its range."""
    shown = [(m, bars[m.name][::-1]) for m in rows.measures if bars[m.name]]
    title = f"{rows.observer.name}: one parameter at a time, worst over the grid"
    panels, height = [_tornado(*each) for each in shown], 1.4 + 0.42 * len(rows.ranges)
    return _figure(f"{rows.observer.name}-tornado", title, panels, 4.6, height)


def _tornado(measure: Measure, bars: Sequence[Bar]) -> Panel:
    marks: list[Mark] = [Level(x=bars[0].nominal, label="nominal", color=NOMINAL, width=0.9)]
    ends = [bars[0].nominal]
    for label, colour, side in (
        ("parameter below its nominal value", BELOW, -1.0), ("above", ABOVE, 1.0),
    ):  # fmt: skip
        spans = []
        for place, bar in enumerate(bars):
            reach = bar.values[(side * bar.levels > 0.0) & np.isfinite(bar.values)]
            if len(reach):
                spans.append((place, min(reach.min(), bar.nominal), max(reach.max(), bar.nominal)))
        if spans:
            places, left, right = np.array(spans).T
            marks.append(Bars(places, right - left, label, colour, 0.6, flat=True, start=left, alpha=0.8))
            ends += [*left, *right]
    for place, bar in enumerate(bars):
        if not np.isfinite(bar.values).all():
            marks.append(Words(bar.nominal, place, "unstable", size=7.0, vertical="center"))
    room = 0.06 * (max(ends) - min(ends)) or None  # bars may not end at the frame
    x = Axis(_titled(measure), room and min(ends) - room, room and max(ends) + room)
    y = Axis(ticks={place: _words(bar.parameter) for place, bar in enumerate(bars)})
    return Panel(marks, x, y, _better(measure))


def map_figure(result: SweepResult, rows: Rows, maps: Sequence[tuple[Measure, WorstMap]]) -> Figure:
    """Nominal, worst and best design over the scheduling parameter; below it, which corner of the box the worst one sits in."""
    (box,) = rows.observer.plant.box
    d, across = len(rows.ranges), min(2, len(maps))
    grid: list[list[Panel]] = []
    for k in range(0, len(maps), across):
        pair = maps[k : k + across]
        grid.append([_envelope(measure, found) for measure, found in pair])
        grid.append([_position(rows, found, f"{_words(box.name)} ({box.unit})") for _, found in pair])
    heights = 2.5 + 0.22 * d
    title = f"{rows.observer.name}: worst of {result.sweep.designs(rows.observer)} designs at every {_words(box.name)}"
    return Figure(
        f"{rows.observer.name}-map",
        title,
        "Curves of the worst, best and nominal design, above a strip of colours for the place of each parameter.",
        grid,
        size=(4.7 * across, heights * len(grid) / 2 + 0.6), legend="below", heights=(2.2, 0.24 * d) * (len(grid) // 2),
        title=title,
    )  # fmt: skip


def _envelope(measure: Measure, found: WorstMap) -> Panel:
    curves = np.concatenate([found.worst, found.nominal, found.best])
    top = float(curves[np.isfinite(curves)].max(initial=-np.inf))
    top = top if np.isfinite(top) else 0.0

    def finite(values: FloatArray, instead: float = np.nan) -> FloatArray:
        return np.where(np.isfinite(values), values, instead)

    marks: list[Mark] = [
        Band(found.points, finite(found.worst, top), finite(found.best, top), color="0.9", alpha=1.0),
        Line(found.points, finite(found.worst), "worst design", WORST, width=1.4),
        Line(found.points, finite(found.best), "best design", BEST, width=1.2),
        Line(found.points, finite(found.nominal), "nominal", NOMINAL, width=1.2),
    ]
    unstable = found.points[~np.isfinite(found.worst)]
    if len(unstable):
        marks.append(dots(unstable, np.full(len(unstable), top), "unstable", WORST, "x", 4.0))
    return Panel(marks, Axis("", found.points[0], found.points[-1]), _titled(measure), _better(measure))


def _position(rows: Rows, found: WorstMap, label: str) -> Panel:
    """Where in its range the worst design has each parameter, as colours."""
    d = len(rows.ranges)
    marks: list[Mark] = [Map(found.points, np.arange(d), found.position, "", DIVERGING, 0.0, 1.0, smooth=False)]
    for name, colour in (
        ("parameter at its lower end", LOWER_END), ("in the middle", MIDDLE), ("at its upper end", UPPER_END),
    ):  # fmt: skip
        marks.append(dots([], [], name, colour, "s", 7.0, edge="0.6"))
    x = Axis(label, found.points[0], found.points[-1])
    return Panel(marks, x, Axis("", d - 0.5, -0.5, ticks=dict(enumerate(map(_words, rows.ranges)))), grid=False)


def scatter_figure(result: SweepResult, rows: Rows, bars: Mapping[str, list[Bar]]) -> Figure | None:
    """One panel a measure: random designs over the two parameters that matter most to it, coloured by the measure."""
    units = {v.name: v.unit for v in result.sweep.ranges[rows.observer.name]}
    panels = []
    for measure in rows.measures:
        names = _two(result, rows, measure, bars[measure.name])
        found = cloud(rows, measure, names)
        if found is None:
            continue
        at, values = found
        order = np.argsort(measure.sign * values, kind="stable")  # the worst are drawn last, on top
        low, high = (float(end) for end in np.quantile(values, [0.005, 0.995]))
        colours = "viridis_r" if measure.better == "smaller" else "viridis"
        x, y = at[order].T
        marks = [ColouredDots(x, y, values[order], _titled(measure), colours, low, high)]
        across, up = (f"{_words(name)} ({units[name]})" for name in names)
        panels.append(Panel(marks, across, up, _better(measure)))
    if not panels:
        return None
    title = f"{rows.observer.name}: the two parameters that matter most (dark is worse)"
    return _figure(f"{rows.observer.name}-scatter", title, panels, 4.4, 3.3)


def _two(result: SweepResult, rows: Rows, measure: Measure, bars: list[Bar]) -> tuple[str, str]:
    """By total Sobol index, else by reach alone, else in order."""
    totals = {
        f.name.removeprefix("total index "): f.value
        for f in result.summary.statistics
        if f.observer == rows.observer.name and f.measure == measure.name and f.name.startswith("total index ")
    }
    ranked = sorted(totals, key=lambda name: -totals[name]) or [bar.parameter for bar in bars] or list(rows.ranges)
    return ranked[0], ranked[1]


def before_after_figure(result: SweepResult, before: Baseline) -> Figure:
    """One panel a measure, one row an observer: how much of its distance to worthlessness each statistic won or lost."""
    panels = [_changes(result, before, measure) for measure in result.sweep.measures]
    title = f"Sweep {result.sweep.name}: after, against the baseline"
    return _figure("before-after", title, panels, 4.8, 1.0 + 0.42 * len(result.sweep.observers))


def _changes(result: SweepResult, before: Baseline, measure: Measure) -> Panel:
    tolerance = 100.0 * result.sweep.tolerances.get(measure.name, result.sweep.tolerance)
    changes = []
    for place, observer in enumerate(result.sweep.observers):
        for name in VALUES:
            old, new = (s.of(observer.name, measure.name, name) for s in (before.summary, result.summary))
            if old is not None and new is not None:
                changes.append((place, name, -100.0 * measure.loss(old.value, new.value)))
    reach = max([2.0 * tolerance, *(abs(change) for *_, change in changes if np.isfinite(change))])
    marks: list[Mark] = [
        Shade(-tolerance, 0.0, "x", "tolerance", "0.92", 1.0),
        Level(x=0.0, color=NOMINAL, width=0.9),
        *(dots([], [], name, "0.4", marker) for name, marker in VALUES.items()),
        dots([], [], "shrunk", ABOVE),
    ]
    for place, name, change in changes:
        shown = float(np.clip(change, -1.15 * reach, 1.15 * reach))
        marks += [
            Line([0.0, shown], [place, place], color="0.75", width=1.2),
            dots(shown, place, color=ABOVE if change < -tolerance else BELOW, marker=VALUES[name]),
        ]
    wide = reach > 10.0 * tolerance > 0.0
    label, names = "change against the baseline (%): left is worse", [s.name for s in result.sweep.observers]
    x = Axis(label, -1.3 * reach, 1.3 * reach, "symlog" if wide else "linear", linear=2.0 * tolerance)
    y = Axis("", len(names) - 0.5, -0.5, ticks=dict(enumerate(names)))
    return Panel(marks, x, y, _words(measure.name))


def _figure(name: str, title: str, panels: Sequence[Panel], width: float, height: float) -> Figure:
    """Panels of so many inches in two columns, with one legend below all."""
    across = min(2, len(panels))
    rows = [panels[k : k + across] for k in range(0, len(panels), across)]
    shown = f"{title}: {', '.join(panel.title for panel in panels)}"
    size = (width * across, height * len(rows) + 0.7)
    return Figure(name, title, shown, rows, size=size, legend="below", title=title)


def _better(measure: Measure) -> str:
    """The name, and which way is better."""
    return f"{_words(measure.name)}: {measure.better} is better"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _titled(measure: Measure) -> str:
    """Name and unit, for an axis."""
    return _words(measure.name) + ("" if measure.unit == "1" else f" ({measure.unit})")
