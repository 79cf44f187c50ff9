"""Panels, titles and legends that the pictures of a sweep share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from studies.plots.colours import BLUE, RED
from studies.sweeps.measure import Measure

LOW, HIGH, NOMINAL, WORST, BEST = BLUE, "#d1495b", "0.1", RED, "#4d9a2a"


def panels(count: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    """A figure of two columns with `count` panels of so many inches each."""
    columns = min(2, count)
    rows = -(-count // columns)
    figure = Figure(figsize=(width * columns, height * rows + 0.7), layout="constrained")
    FigureCanvasAgg(figure)
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for ax in axes[count:]:
        ax.set_visible(False)
    return figure, axes[:count]


def finished(figure: Figure, title: str, handles: Sequence[Any], labels: Sequence[str] | None = None) -> Figure:
    """Title, one legend below all panels, and a layout that does not depend on the file format."""
    figure.suptitle(title, fontsize=10, x=0.01, ha="left")
    if handles:
        names = list(labels) if labels is not None else [h.get_label() for h in handles]
        figure.legend(
            list(handles), names, loc="outside lower center", ncols=min(len(names), 4), frameon=False, fontsize=8
        )
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
    figure.set_layout_engine(None)  # laid out once: with an engine every file would be drawn twice
    return figure


def better(measure: Measure) -> str:
    """Which way is better, in words."""
    return "smaller is better" if measure.better == "smaller" else "larger is better"


def words(name: str) -> str:
    """A name without underscores."""
    return name.replace("_", " ")


def titled(measure: Measure) -> str:
    """Name and unit, for an axis."""
    return words(measure.name) + ("" if measure.unit == "1" else f" ({measure.unit})")
