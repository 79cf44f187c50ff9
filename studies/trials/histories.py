"""Pieces of figures that trials share: truth and estimates over time, states as a background, errors as dots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Literal

import numpy as np

from estimators.arrays import FloatArray
from studies.plots import Axis, Band, Dash, ErrorBars, Figure, Line, Mark, Panel, Shade
from studies.plots.colours import SETTINGS, TRUTH
from studies.trials.accuracy import Spread

BAND = (2.5, 97.5)  # percentiles over the sensor draws
BANDS = "Lines: first sensor draw; bands: 95 % of all draws."


def truth_line(time: FloatArray, truth: FloatArray) -> Line:
    """The truth (n,), wide: the first mark, so that estimates lie above it."""
    return Line(time, truth, "truth", TRUTH, width=2.0, alpha=0.8)


def estimate_lines(
    time: FloatArray, estimate: FloatArray, label: str, color: str, dash: Dash = "solid", width: float = 0.9
) -> list[Mark]:
    """First draw of (S, n) as a line, all draws as a band."""
    line = Line(time, estimate[0], label, color, dash, width)
    if len(estimate) == 1:
        return [line]
    low, high = np.percentile(estimate, BAND, axis=0)
    return [line, Band(time, low, high, color=color, alpha=0.18)]


def setting_lines(time: FloatArray, estimates: Iterable[FloatArray], labels: Sequence[str]) -> list[Mark]:
    """The estimates (S, n) of up to three settings of one estimator."""
    shown = zip(estimates, labels, SETTINGS, strict=False)
    return [mark for value, label, color in shown for mark in estimate_lines(time, value, label, color)]


def history(
    name: str, caption: str, alternative: str, panels: Sequence[Panel], size: tuple[float, float], columns: int = 1,
    share_y: Literal["", "row", "all"] = "", legend: Literal["", "below"] = "",
) -> Figure:  # fmt: skip
    """Panels in rows over one time, which is named under the last ones."""
    last = len(panels) - columns
    named = [replace(p, x=Axis("time [s]" if k >= last else "", margin=0.01)) for k, p in enumerate(panels)]
    rows = [named[k : k + columns] for k in range(0, len(named), columns)]
    return Figure(name, caption, alternative, rows, size, legend, share_x="all", share_y=share_y)


def backgrounds(
    time: FloatArray, state: FloatArray, looks: Sequence[tuple[str, str] | None], alpha: float = 1.0
) -> list[Mark]:
    """Stripes by the ``state`` (n,) of every sample, 0, 1, ...: label and colour of each state, None without one."""
    found, unnamed, step = list[Mark](), set(looks), time[1] - time[0]
    for begin, end in pairwise([0, *(np.flatnonzero(np.diff(state)) + 1), len(state)]):
        look = looks[int(state[begin])]
        if look is not None:
            label = look[0] if look in unnamed else ""
            found.append(Shade(time[begin], time[end - 1] + step, "x", label, look[1], alpha))
            unnamed.discard(look)
    return found


def error_dots(rows: Sequence[Mapping[str, Spread]], looks: Mapping[str, tuple[str, str]]) -> list[Mark]:
    """Means with their intervals, row below row; within a row one below the other in the order of ``looks``: marker, colour."""
    found: list[Mark] = []
    for who, (marker, color) in looks.items():
        at = [k for k, row in enumerate(rows) if who in row]
        mean, low, high = (np.array([getattr(rows[k][who], end) for k in at]) for end in ("mean", "low", "high"))
        heights = dot_heights(at, who, looks)
        found.append(ErrorBars(mean, heights, mean - low, high - mean, who, color, marker, 5.0, flat=True))
    return found


def dot_heights(rows: Sequence[int], who: str, looks: Mapping[str, tuple[str, str]]) -> FloatArray:
    """Where `error_dots` puts ``who`` in the ``rows``."""
    return np.array(rows) + 0.7 / len(looks) * (list(looks).index(who) - 0.5 * (len(looks) - 1))


def row_axis(names: Sequence[str]) -> Axis:
    """The names of the rows of `error_dots`, from above."""
    return Axis(low=len(names) - 0.5, high=-0.5, ticks=dict(enumerate(names)))
