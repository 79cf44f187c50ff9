"""Pictures of a sweep: tornado, worst case over the grid, the two parameters that matter most, before and after."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from studies.report.drive_plots import STYLE
from studies.report.sweep_comparison_plot import draw_before_after
from studies.report.sweep_panels import BEST, HIGH, LOW, NOMINAL, WORST, better, finished, panels, titled, words
from studies.sweeps.baseline import Baseline
from studies.sweeps.engine import SweepResult
from studies.sweeps.measure import Measure
from studies.sweeps.plot_data import Bar, Map, cloud, tornado, worst_map
from studies.sweeps.rows import Rows
from studies.sweeps.statistics import Statistic


def plot_sweep(
    result: SweepResult, folder: Path, before: Baseline | None = None, observers: Collection[str] | None = None
) -> list[Path]:
    """The pictures of some observers (default: all) and the comparison, as SVG and PNG; returns the files.

    The same sweep gives the same pictures.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    with mpl.rc_context(STYLE):
        for name, figure in _figures(result, before, observers):
            for suffix in ("svg", "png"):
                path = folder / f"{name}.{suffix}"
                figure.savefig(path, dpi=130, metadata={"Date": None} if suffix == "svg" else {})
                paths.append(path)
    return paths


def _figures(
    result: SweepResult, before: Baseline | None, observers: Collection[str] | None
) -> Iterator[tuple[str, Figure]]:
    for index, observer in enumerate(result.sweep.observers):
        if observers is not None and observer.name not in observers:
            continue
        rows = Rows(result.folder, index)
        bars = {m.name: tornado(rows, m) for m in rows.measures}
        if any(bars.values()):
            yield f"{observer.name}-tornado", draw_tornado(rows, bars)
        maps = {m.name: worst_map(result.folder, rows, index, m) for m in rows.measures}
        there = {name: found for name, found in maps.items() if found is not None}
        if there:
            yield f"{observer.name}-map", draw_maps(result, rows, there)
        drawn = draw_clouds(result, rows, bars) if len(rows.ranges) > 1 else None
        if drawn is not None:
            yield f"{observer.name}-scatter", drawn
    if before is not None:
        yield "before-after", draw_before_after(result, before)


def draw_tornado(rows: Rows, bars: dict[str, list[Bar]]) -> Figure:
    """One panel a measure: how far it moves when one parameter alone goes through its range."""
    shown = [m for m in rows.measures if bars[m.name]]
    figure, axes = panels(len(shown), 4.6, 0.5 + 0.42 * len(rows.ranges) + 0.9)
    for ax, measure in zip(axes, shown, strict=False):
        own = bars[measure.name][::-1]
        for place, bar in enumerate(own):
            for side, colour in ((bar.levels < 0.0, LOW), (bar.levels > 0.0, HIGH)):
                finite = side & np.isfinite(bar.values)
                if finite.any():
                    reach = bar.values[finite]
                    left, right = min(reach.min(), bar.nominal), max(reach.max(), bar.nominal)
                    ax.barh(place, right - left, left=left, height=0.6, color=colour, alpha=0.8)
            if not np.isfinite(bar.values).all():
                ax.annotate("unstable", (bar.nominal, place), fontsize=7, va="center")
        ax.axvline(own[0].nominal, color=NOMINAL, lw=0.9)
        ax.set_yticks(range(len(own)), [words(bar.parameter) for bar in own])
        ax.set_xlabel(titled(measure))
        ax.set_title(f"{words(measure.name)}: {better(measure)}", loc="left", fontsize=9)
        ax.use_sticky_edges = False  # bars may not end at the frame
        ax.margins(x=0.06)
    handles: list[Patch | Line2D] = [
        Patch(color=LOW, label="parameter below its nominal value"),
        Patch(color=HIGH, label="above"),
    ]
    handles.append(Line2D([], [], color=NOMINAL, lw=0.9, label="nominal"))
    return finished(figure, f"{rows.observer.name}: one parameter at a time, worst over the grid", handles)


def draw_maps(result: SweepResult, rows: Rows, maps: dict[str, Map]) -> Figure:
    """Nominal, worst and best design over the scheduling parameter; below it, which corner of the box the worst one sits in."""
    figure = Figure(
        figsize=(4.7 * min(2, len(maps)), (2.5 + 0.22 * len(rows.ranges)) * -(-len(maps) // 2) + 0.6),
        layout="constrained",
    )
    FigureCanvasAgg(figure)
    outer = figure.add_gridspec(-(-len(maps) // 2), min(2, len(maps)))
    (box,) = rows.observer.plant.box
    measures = {m.name: m for m in rows.measures}
    for k, (name, found) in enumerate(maps.items()):
        inner = outer[k // 2, k % 2].subgridspec(2, 1, height_ratios=(2.2, 0.24 * len(rows.ranges)), hspace=0.08)
        top = figure.add_subplot(inner[0])
        top.fill_between(found.points, _capped(found.worst, found), _capped(found.best, found), color="0.9", lw=0)
        top.plot(found.points, _finite(found.worst), color=WORST, lw=1.4, label="worst design")
        top.plot(found.points, _finite(found.best), color=BEST, lw=1.2, label="best design")
        top.plot(found.points, _finite(found.nominal), color=NOMINAL, lw=1.2, label="nominal")
        unstable = ~np.isfinite(found.worst)
        if unstable.any():
            top.plot(
                found.points[unstable], np.full(unstable.sum(), _top(found)), "x", color=WORST, ms=4, label="unstable"
            )
        top.set_ylabel(titled(measures[name]), fontsize=8)
        top.set_title(f"{words(name)}: {better(measures[name])}", loc="left", fontsize=9)
        top.tick_params(labelbottom=False)
        top.set_xlim(found.points[0], found.points[-1])
        strip = figure.add_subplot(inner[1], sharex=top)
        edges = _edges(found.points)
        strip.pcolormesh(
            edges, np.arange(len(rows.ranges) + 1), found.position, cmap="RdBu_r", vmin=0, vmax=1, rasterized=True
        )
        strip.set_yticks(np.arange(len(rows.ranges)) + 0.5, [words(n) for n in rows.ranges], fontsize=7)
        strip.invert_yaxis()
        strip.grid(False)
        strip.set_xlabel(f"{words(box.name)} ({box.unit})")
        strip.set_xlim(found.points[0], found.points[-1])
    drawn = {label: handle for ax in figure.axes for handle, label in zip(*ax.get_legend_handles_labels(), strict=True)}
    handles, labels = list(drawn.values()), list(drawn)
    colours = mpl.colormaps["RdBu_r"]
    for share, text in ((0.0, "parameter at its lower end"), (0.5, "in the middle"), (1.0, "at its upper end")):
        handles.append(Patch(facecolor=colours(share), edgecolor="0.6", lw=0.5))
        labels.append(text)
    designs = result.sweep.designs(rows.observer)
    return finished(
        figure, f"{rows.observer.name}: worst of {designs} designs at every {words(box.name)}", handles, labels
    )


def draw_clouds(result: SweepResult, rows: Rows, bars: dict[str, list[Bar]]) -> Figure | None:
    """One panel a measure: random designs over the two parameters that matter most to it, coloured by the measure."""
    found = []
    for measure in rows.measures:
        names = _two(result, rows, measure, bars[measure.name])
        points = cloud(rows, measure, names)
        if points is not None:
            found.append((measure, points))
    if not found:
        return None
    figure, axes = panels(len(found), 4.4, 3.3)
    units = {v.name: v.unit for v in result.sweep.ranges[rows.observer.name]}
    for ax, (measure, points) in zip(axes, found, strict=False):
        order = np.argsort(measure.sign * points.values, kind="stable")  # the worst are drawn last, on top
        low, high = np.quantile(points.values, [0.005, 0.995])
        shade = ax.scatter(
            points.at[order, 0], points.at[order, 1], c=points.values[order], s=7, lw=0, vmin=low, vmax=high,
            cmap="viridis_r" if measure.better == "smaller" else "viridis", rasterized=True,
        )  # fmt: skip
        figure.colorbar(shade, ax=ax, label=titled(measure), extend="both")
        for axis, name in ((ax.xaxis, points.names[0]), (ax.yaxis, points.names[1])):
            axis.set_label_text(f"{words(name)} ({units[name]})")
        ax.set_title(f"{words(measure.name)}: {better(measure)}", loc="left", fontsize=9)
    return finished(figure, f"{rows.observer.name}: the two parameters that matter most (dark is worse)", [])


def _two(result: SweepResult, rows: Rows, measure: Measure, bars: list[Bar]) -> tuple[str, str]:
    """By total Sobol index, else by reach alone, else in order."""
    totals: dict[str, Statistic] = {
        f.name.removeprefix("total index "): f
        for f in result.summary.statistics
        if f.observer == rows.observer.name and f.measure == measure.name and f.name.startswith("total index ")
    }
    ranked = (
        sorted(totals, key=lambda name: -totals[name].value) or [bar.parameter for bar in bars] or list(rows.ranges)
    )
    return ranked[0], ranked[1]


def _finite(values: Any) -> Any:
    return np.where(np.isfinite(values), values, np.nan)


def _top(found: Map) -> float:
    curves = np.concatenate([found.worst, found.nominal, found.best])
    finite = curves[np.isfinite(curves)]
    return float(finite.max()) if len(finite) else 0.0


def _capped(values: Any, found: Map) -> Any:
    return np.where(np.isfinite(values), values, _top(found))


def _edges(points: Any) -> Any:
    middle = 0.5 * (points[1:] + points[:-1])
    return np.concatenate([points[:1], middle, points[-1:]])
