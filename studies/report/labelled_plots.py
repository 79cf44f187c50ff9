"""Figures of labelled arrays: lines over a numeric axis, bars over a worded one."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from analysis.labelled import Axis, LabelledArray
from estimators.errors import GainsmithError

mpl.use("Agg")
import matplotlib.pyplot as plt

MOST_SERIES = 12


def plot_labelled(array: LabelledArray, path: Path) -> Path:
    """Draw an array of one or two axes and save it; the ending of `path` (svg, png, pdf) chooses the format.

    The numeric axis runs along x, the other one gives the series; with words alone, bars. Raises GainsmithError for
    more than two axes or more series than can be told apart: take a part with `LabelledArray.at` first.
    """
    if not 1 <= len(array.axes) <= 2:
        raise GainsmithError(
            f"'{array.name}' has {len(array.axes)} axes; one or two can be drawn, choose with .at(...)"
        )
    numeric = [axis for axis in array.axes if np.issubdtype(np.asarray(axis.labels).dtype, np.number)]
    along = max(numeric, key=lambda axis: len(axis.labels)) if numeric else array.axes[0]
    place = array.axes.index(along)
    values = np.moveaxis(array.values, place, 0).reshape(len(along.labels), -1)
    series = [axis for axis in array.axes if axis is not along]
    names = [f"{label}" for label in series[0].labels] if series else [array.name]
    if len(names) > MOST_SERIES:
        raise GainsmithError(f"'{array.name}' has {len(names)} series; at most {MOST_SERIES} can be told apart")
    figure, axis = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
    for k, (name, column) in enumerate(zip(names, values.T, strict=True)):
        if numeric:
            axis.plot(along.labels, column, lw=1.5, label=name)
        else:
            width = 0.8 / len(names)
            axis.bar(np.arange(len(column)) + (k - 0.5 * (len(names) - 1)) * width, column, width, label=name)
    if not numeric:
        axis.set_xticks(np.arange(len(along.labels)), [str(label) for label in along.labels])
        axis.axhline(0.0, color="black", lw=0.8)
    axis.set_xlabel(_titled(along))
    axis.set_ylabel(array.name.replace("_", " ") + ("" if array.unit == "1" else f" [{array.unit}]"))
    axis.grid(alpha=0.3)
    if series:
        axis.legend(title=_titled(series[0]), frameon=False, fontsize=8)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)
    plt.close(figure)
    return path


def _titled(axis: Axis) -> str:
    return axis.name.replace("_", " ") + ("" if axis.unit == "1" else f" [{axis.unit}]")
