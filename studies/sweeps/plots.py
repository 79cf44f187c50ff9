"""Figures of a sweep: worst case over the grid, the two parameters that matter most, and the files of all of them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from studies.plots import Axis, Band, ColouredDots, Figure, Line, Map, Mark, Panel, dots
from studies.plots.colours import ALONG, BEST, LOWER_END, MIDDLE, NOMINAL, UPPER_END, WORST
from studies.plots.save import save_figure
from studies.sweeps.baseline import Baseline
from studies.sweeps.change import change_figure
from studies.sweeps.engine import SweepResult
from studies.sweeps.evaluate import TIE
from studies.sweeps.labels import better, paneled, titled, words
from studies.sweeps.measures import Measure
from studies.sweeps.store import Rows, SweepFolder
from studies.sweeps.tables import columns_of
from studies.sweeps.tornado import Bar, tornado, tornado_figure

MOST_POINTS = 3000


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
        yield change_figure(result, before)


def map_figure(result: SweepResult, rows: Rows, maps: Sequence[tuple[Measure, WorstMap]]) -> Figure:
    """Nominal, worst and best design over the scheduling parameter; below it, which corner of the box the worst one sits in."""
    (box,) = rows.observer.plant.box
    d, across = len(rows.ranges), min(2, len(maps))
    grid: list[list[Panel]] = []
    for k in range(0, len(maps), across):
        pair = maps[k : k + across]
        grid.append([_envelope(measure, found) for measure, found in pair])
        grid.append([_position(rows, found, f"{words(box.name)} [{box.unit}]") for _, found in pair])
    heights = 2.5 + 0.22 * d
    title = f"{rows.observer.name}: worst of {result.sweep.designs(rows.observer)} designs at every {words(box.name)}"
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
        Line(found.points, finite(found.worst), "worst design", WORST, width=1.6),
        Line(found.points, finite(found.best), "best design", BEST, "dashed", 1.4),
        Line(found.points, finite(found.nominal), "nominal", NOMINAL, "dotted", 1.6),
    ]
    unstable = found.points[~np.isfinite(found.worst)]
    if len(unstable):
        marks.append(dots(unstable, np.full(len(unstable), top), "unstable", WORST, "x", 4.0))
    return Panel(marks, Axis("", found.points[0], found.points[-1]), titled(measure), better(measure))


def _position(rows: Rows, found: WorstMap, label: str) -> Panel:
    """Where in its range the worst design has each parameter, as colours."""
    d = len(rows.ranges)
    marks: list[Mark] = [Map(found.points, np.arange(d), found.position, "", ALONG, 0.0, 1.0, smooth=False)]
    for name, colour in (
        ("parameter at its lower end", LOWER_END), ("in the middle", MIDDLE), ("at its upper end", UPPER_END),
    ):  # fmt: skip
        marks.append(dots([], [], name, colour, "s", 7.0, edge="0.6"))
    x = Axis(label, found.points[0], found.points[-1])
    return Panel(marks, x, Axis("", d - 0.5, -0.5, ticks=dict(enumerate(map(words, rows.ranges)))), grid=False)


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
        marks = [ColouredDots(x, y, values[order], titled(measure), colours, low, high)]
        across, up = (f"{words(name)} [{units[name]}]" for name in names)
        panels.append(Panel(marks, across, up, better(measure)))
    if not panels:
        return None
    title = f"{rows.observer.name}: the two parameters that matter most (dark is worse)"
    return paneled(f"{rows.observer.name}-scatter", title, panels, 4.4, 3.3)


def _two(result: SweepResult, rows: Rows, measure: Measure, bars: list[Bar]) -> tuple[str, str]:
    """By total Sobol index, else by reach alone, else in order."""
    totals = {
        f.name.removeprefix("total index "): f.value
        for f in result.summary.statistics
        if f.observer == rows.observer.name and f.measure == measure.name and f.name.startswith("total index ")
    }
    ranked = sorted(totals, key=lambda name: -totals[name]) or [bar.parameter for bar in bars] or list(rows.ranges)
    return ranked[0], ranked[1]
