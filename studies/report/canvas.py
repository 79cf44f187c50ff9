"""A blank figure in the look of the reports, and the dashes of lines that the figures share."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.plots.save import drawing_style

DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (6, 1.5, 1, 1.5)))


def canvas(width: float, height: float, rows: int = 1, columns: int = 1, **shared: Any) -> tuple[Figure, Any]:
    """A figure of this size in inches and its axes (rows, columns) as an array."""
    with drawing_style():
        figure = Figure(figsize=(width, height), layout="constrained")
        axes = figure.subplots(rows, columns, squeeze=False, **shared)
    return figure, axes


def label(axes: Axes, x: str, y: str, title: str = "") -> None:
    """Axis labels with units, and a title at the left."""
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    if title:
        axes.set_title(title, loc="left", fontsize=9.5)


def legend(target: Any, **options: Any) -> None:
    """A small legend without a frame; for a figure below all panels, where it covers nothing."""
    if isinstance(target, Figure):
        handles: dict[str, Any] = {}
        for axes in target.axes:
            for handle, text in zip(*axes.get_legend_handles_labels(), strict=True):
                handles.setdefault(text, handle)
        options = {"loc": "outside lower center", "ncols": 4, **options}
        target.legend(handles.values(), handles.keys(), frameon=False, fontsize=8, **options)
    else:
        target.legend(**{"frameon": False, "fontsize": 8, "loc": "best", **options})


def grid(low: float, high: float, points: int) -> npt.NDArray[np.float64]:
    """Evenly spaced values, both ends included."""
    return np.linspace(low, high, points)
