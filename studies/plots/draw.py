"""Figures drawn by matplotlib, in one look: the only place that knows how."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import singledispatch
from itertools import product
from textwrap import fill
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure as Sheet
from matplotlib.patches import Rectangle

from studies.plots.figure import Axis, Figure, Panel, axis
from studies.plots.fit import LABEL, TITLE, along, fitted, places, upward
from studies.plots.marks import Band, Bars, Box, ColouredDots, Contours, ErrorBars, Level, Line, Map, Mark, Shade, Words

PATTERN: Mapping[str, Any] = {
    "solid": "-", "dashed": (0, (5, 2)), "dotted": (0, (1, 1.5)), "dash-dot": (0, (6, 1.5, 1, 1.5)),
    "long dash": (0, (8, 2, 2, 2, 2, 2)), "none": "",
}  # fmt: skip
LETTERS, SMALL_LETTERS = 12.5, 15.0  # of a title, and of a legend, fit into an inch
HANDLE = 0.45  # inches of a legend beside its words
STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "0.88",
    "legend.frameon": False,
    "legend.fontsize": 8,
    "svg.hashsalt": "gainsmith",  # otherwise the ids inside an SVG are random
}


@contextmanager
def look() -> Iterator[None]:
    """The common look; nothing needs a display."""
    with mpl.rc_context(STYLE):
        yield


def draw(figure: Figure) -> Sheet:
    """The figure as matplotlib has it."""
    with look():
        sheet = Sheet(figsize=figure.size, layout="constrained")
        rows = figure.rows
        across = max(len(row) for row in rows)
        grid = sheet.subplots(
            len(rows), across, squeeze=False, sharex=figure.share_x or False, sharey=figure.share_y or False,
            gridspec_kw={"width_ratios": figure.widths, "height_ratios": figure.heights},
        )  # fmt: skip
        widths, heights = places(figure)
        for i, j in product(range(len(rows)), range(across)):
            panel = rows[i][j] if j < len(rows[i]) else None
            if panel is None:
                grid[i, j].set_visible(False)
            else:
                _draw_panel(grid[i, j], panel, along(panel, widths[j]), upward(heights[i]))
        if figure.bar:
            meshes = [mesh for axes in sheet.axes for mesh in axes.collections if isinstance(mesh, QuadMesh)]
            sheet.colorbar(meshes[0], ax=sheet.axes, label=figure.bar, shrink=0.6, aspect=40)
        if figure.title:
            sheet.suptitle(fill(figure.title, int(LETTERS * figure.size[0])), x=0.01, ha="left", fontsize=10)
        if figure.legend:
            shown = {
                text: handle
                for axes in sheet.axes
                for handle, text in reversed(list(zip(*axes.get_legend_handles_labels(), strict=True)))
            }
            order = list(dict.fromkeys(text for axes in sheet.axes for text in axes.get_legend_handles_labels()[1]))
            columns = fitting_columns(order, figure.size[0], figure.columns)
            if order:
                sheet.legend([shown[text] for text in order], order, loc="outside lower center", ncols=columns)
        return sheet


def fitting_columns(labels: Sequence[str], width: float, most: int) -> int:
    """How many columns of a legend stay inside a sheet of so many inches, at most ``most``."""
    widest = HANDLE + max(map(len, labels), default=0) / SMALL_LETTERS
    return max(1, min(most, int(width / widest)))


def _draw_panel(axes: Any, panel: Panel, wide: float, high: float) -> None:
    axes.grid(visible=panel.grid)
    x, y = axis(panel.x), axis(panel.y)
    for name, given in (("x", x), ("y", y)):  # scales first: what is drawn on them may depend on it
        if given.scale != "linear":
            getattr(axes, f"set_{name}scale")(
                given.scale, **({"linthresh": given.linear} if given.scale == "symlog" else {})
            )
    for mark in panel.marks:
        draw_mark(mark, axes)
    _run(axes, "x", x, wide)
    _run(axes, "y", y, high)
    if panel.bare:
        axes.set_axis_off()
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    if panel.title:
        axes.set_title(fitted(panel.title, wide, TITLE), loc="left")
    if panel.legend:
        axes.legend(loc=panel.legend, ncols=panel.columns, title=panel.heading or None)


def _run(axes: Any, name: str, given: Axis, inches: float) -> None:
    getattr(axes, f"set_{name}label")(fitted(given.label, inches, LABEL))
    if given.ticks is not None:
        words = (
            list(given.ticks.values())
            if isinstance(given.ticks, Mapping)
            else [f"{tick:g}".replace("-", "−") for tick in given.ticks]
        )
        getattr(axes, f"set_{name}ticks")(list(given.ticks), words)
        getattr(axes, f"{name}axis").minorticks_off()
    if given.turned:
        axes.tick_params(axis=name, labelrotation=given.turned)
    if given.margin is not None:
        axes.margins(**{name: given.margin})
    if given.low is not None or given.high is not None:
        getattr(axes, f"set_{name}lim")(given.low, given.high)


@singledispatch
def draw_mark(mark: Mark, axes: Any) -> None:
    """Put one mark on matplotlib axes."""
    raise TypeError(f"{type(mark).__name__} is no mark of a figure")


@draw_mark.register
def _(mark: Line, axes: Any) -> None:
    lines = axes.plot(
        np.asarray(mark.x), np.asarray(mark.y), color=mark.color, linestyle=PATTERN[mark.dash], linewidth=mark.width,
        marker=mark.marker or None, markersize=mark.size, alpha=mark.alpha,
        markerfacecolor="white" if mark.hollow else mark.color, markeredgecolor=mark.edge or mark.color,
        drawstyle="steps-post" if mark.steps else "default",
    )  # fmt: skip
    if mark.label:
        lines[0].set_label(mark.label)


@draw_mark.register
def _(mark: Band, axes: Any) -> None:
    low, high = (np.broadcast_to(np.asarray(side, float), np.shape(mark.x)) for side in (mark.low, mark.high))
    axes.fill_between(
        np.asarray(mark.x), low, high, color=mark.color, alpha=mark.alpha, linewidth=0, label=mark.label or None
    )


@draw_mark.register
def _(mark: Level, axes: Any) -> None:
    look_of = {"color": mark.color, "linestyle": PATTERN[mark.dash], "linewidth": mark.width, "alpha": mark.alpha}
    label = mark.label or None
    if mark.y is not None:
        axes.axhline(mark.y, label=label, **look_of)
        label = None
    if mark.x is not None:
        axes.axvline(mark.x, label=label, **look_of)


@draw_mark.register
def _(mark: Shade, axes: Any) -> None:
    span = axes.axvspan if mark.along == "x" else axes.axhspan
    span(mark.low, mark.high, color=mark.color, alpha=mark.alpha, linewidth=0, label=mark.label or None)


@draw_mark.register
def _(mark: Words, axes: Any) -> None:
    axes.annotate(
        mark.text, (mark.x, mark.y), mark.offset, textcoords="offset points",
        xycoords="axes fraction" if mark.relative else "data", color=mark.color, fontsize=mark.size,
        ha=mark.horizontal, va=mark.vertical, rotation=mark.rotation,
    )  # fmt: skip


@draw_mark.register
def _(mark: Bars, axes: Any) -> None:
    known = {"color": mark.color, "label": mark.label or None, "alpha": mark.alpha}
    places, values = np.asarray(mark.places), np.asarray(mark.values, float)
    if mark.flat:
        bars = axes.barh(places, values, mark.width, left=mark.start, xerr=mark.errors, ecolor="0.25", **known)
    else:
        bars = axes.bar(places, values, mark.width, bottom=mark.start, yerr=mark.errors, ecolor="0.25", **known)
    if mark.numbers:
        for number in axes.bar_label(bars, fmt=mark.numbers, fontsize=7, padding=2):
            number.set_bbox(
                {"facecolor": "white", "edgecolor": "none", "pad": 0.6}
            )  # readable where a level crosses it


@draw_mark.register
def _(mark: ErrorBars, axes: Any) -> None:
    span = np.vstack([np.atleast_1d(np.asarray(side, float)) for side in (mark.below, mark.above)])
    axes.errorbar(
        mark.x, mark.y, **{"xerr" if mark.flat else "yerr": span}, fmt=mark.marker, color=mark.color, markersize=mark.size,
        linewidth=1.0, capsize=2.5, label=mark.label or None,
    )  # fmt: skip


@draw_mark.register
def _(mark: Map, axes: Any) -> None:
    mesh = axes.pcolormesh(
        np.asarray(mark.x), np.asarray(mark.y), np.asarray(mark.z), cmap=mark.colors, vmin=mark.low, vmax=mark.high,
        shading="gouraud" if mark.smooth else "nearest", rasterized=True,
    )  # fmt: skip
    if mark.label:
        axes.figure.colorbar(mesh, ax=axes, label=mark.label, pad=0.02)


@draw_mark.register
def _(mark: ColouredDots, axes: Any) -> None:
    shown = axes.scatter(
        np.asarray(mark.x), np.asarray(mark.y), c=np.asarray(mark.z), s=mark.size**2, linewidths=0, vmin=mark.low,
        vmax=mark.high, cmap=mark.colors, rasterized=True,
    )  # fmt: skip
    axes.figure.colorbar(shown, ax=axes, label=mark.label, extend="both", pad=0.02)


@draw_mark.register
def _(mark: Contours, axes: Any) -> None:
    x, y, z = (np.asarray(values) for values in (mark.x, mark.y, mark.z))
    if mark.filled:
        axes.contourf(x, y, z, levels=list(mark.levels), colors=[mark.color])
        return
    lines = axes.contour(
        x, y, z, levels=list(mark.levels), colors=[mark.color], linewidths=mark.width, linestyles=mark.dash
    )
    if mark.numbers:
        axes.clabel(lines, fmt=mark.numbers, fontsize=7)


@draw_mark.register
def _(mark: Box, axes: Any) -> None:
    (left, right), (low, high) = mark.x, mark.y
    axes.add_patch(
        Rectangle(
            (left, low), right - left, high - low, fill=False, edgecolor=mark.color, linewidth=mark.width,
            label=mark.label or None,
        )
    )  # fmt: skip
