"""Figures of labelled arrays: lines over a numeric axis, bars over a worded one."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from analysis.labelled import Axis as LabelledAxis
from analysis.labelled import LabelledArray
from estimators.errors import GainsmithError
from studies.plots.figure import Axis, Figure, Panel
from studies.plots.marks import ZERO, Bars, Line, Mark
from studies.plots.save import save_as

MOST_SERIES = 12


def plot_labelled(array: LabelledArray, path: Path) -> Path:
    """Draw an array of one or two axes and save it; the ending of `path` (svg, png, pdf) chooses the format.

    The numeric axis runs along x, the other one gives the series; with words alone, bars. Raises GainsmithError for
    more than two axes or more series than can be told apart: take a part with `LabelledArray.at` first.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    save_as(labelled_figure(array), path)
    return path


def labelled_figure(array: LabelledArray) -> Figure:
    """The figure of `plot_labelled`."""
    if not 1 <= len(array.axes) <= 2:
        raise GainsmithError(
            f"'{array.name}' has {len(array.axes)} axes; one or two can be drawn, choose with .at(...)"
        )
    numeric = [axis for axis in array.axes if np.issubdtype(np.asarray(axis.labels).dtype, np.number)]
    along = max(numeric, key=lambda axis: len(axis.labels)) if numeric else array.axes[0]
    values = np.moveaxis(array.values, array.axes.index(along), 0).reshape(len(along.labels), -1)
    series = [axis for axis in array.axes if axis is not along]
    names = [f"{label}" for label in series[0].labels] if series else [array.name]
    if len(names) > MOST_SERIES:
        raise GainsmithError(f"'{array.name}' has {len(names)} series; at most {MOST_SERIES} can be told apart")
    marks: list[Mark] = [] if numeric else [ZERO]
    width, places = 0.8 / len(names), np.arange(len(along.labels))
    for k, (name, column) in enumerate(zip(names, values.T, strict=True)):
        colour = f"C{k}"  # matplotlib's own cycle: more series than our colours can tell apart
        if numeric:
            marks.append(Line(along.labels.astype(float), column, name, colour))
        else:
            marks.append(Bars(places + (k - 0.5 * (len(names) - 1)) * width, column, name, colour, width))
    title = array.name.replace("_", " ")
    return Figure(
        array.name,
        f"{title} over {_titled(along)}",
        f"{'Lines' if numeric else 'Bars'} of {title} over {_titled(along)}.",
        Panel(
            marks,
            Axis(_titled(along), ticks=None if numeric else dict(enumerate(map(str, along.labels)))),
            title + ("" if array.unit == "1" else f" [{array.unit}]"),
            legend="best" if series else "",
            heading=_titled(series[0]) if series else "",
        ),
        size=(6.4, 3.8),
    )


def _titled(axis: LabelledAxis) -> str:
    return axis.name.replace("_", " ") + ("" if axis.unit == "1" else f" [{axis.unit}]")
