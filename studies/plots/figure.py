"""A figure as plain data: panels of marks, with the caption that stands on its own; `studies.plots.draw` draws it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from estimators.display import Display
from studies.plots.marks import Mark

Scale = Literal["linear", "log", "symlog"]


@dataclass(frozen=True)
class Axis:
    """A label with its unit, ``wheel speed [rad/s]``, and how the axis runs; what is None follows the data.

    ``ticks`` are places, or places with the words that stand there. ``linear`` is the half-width of the linear part of "symlog".
    """

    label: str = ""
    low: float | None = None
    high: float | None = None
    scale: Scale = "linear"
    ticks: Sequence[float] | Mapping[float, str] | None = None
    linear: float = 1.0
    margin: float | None = None  # beyond the data, as a share of their span
    turned: float = 0.0  # degrees by which the words at the ticks are turned


@dataclass(frozen=True, repr=False)
class Panel(Display):
    """One pair of axes; a text in the place of an axis is its label. ``legend`` says where it stands inside ("upper left").

    A ``bare`` panel has words alone: no axes, no grid.

    >>> Panel([], x="time (s)", y="speed (m/s)").x
    'time (s)'
    """

    marks: Sequence[Mark]
    x: Axis | str = ""
    y: Axis | str = ""
    title: str = ""
    legend: str = ""
    grid: bool = True
    columns: int = 1  # of the legend
    heading: str = ""  # of the legend
    equal: bool = False  # x and y on one scale
    bare: bool = False


@dataclass(frozen=True, repr=False)
class Figure(Display):
    """Panels in rows, written as SVG and PNG under ``name``; ``alternative`` is the text for readers who cannot see it.

    ``size`` in inches. The legend "below" collects the labels of all panels under them. Axes are shared along "row", "col"
    or "all". None is an empty place.

    >>> Figure("speed", "Speed", "A rising line", [[Panel([], x="time (s)", y="speed (m/s)")]]).name
    'speed'
    """

    name: str
    caption: str
    alternative: str
    panels: Panel | Sequence[Panel | None] | Sequence[Sequence[Panel | None]]
    size: tuple[float, float] = (7.2, 4.0)
    legend: Literal["", "below"] = ""
    columns: int = 4  # of the legend
    share_x: Literal["", "row", "col", "all"] = ""
    share_y: Literal["", "row", "col", "all"] = ""
    title: str = ""
    widths: Sequence[float] | None = None
    heights: Sequence[float] | None = None
    bar: str = ""  # label of one colour bar for the maps of all panels, which then share their limits

    @property
    def rows(self) -> list[list[Panel | None]]:
        """The panels, row by row; a single sequence is one row."""
        if isinstance(self.panels, Panel):
            return [[self.panels]]
        entries = list(self.panels)
        if all(entry is None or isinstance(entry, Panel) for entry in entries):
            return [[entry for entry in entries if entry is None or isinstance(entry, Panel)]]
        return [[] if row is None or isinstance(row, Panel) else list(row) for row in entries]


def axis(given: Axis | str) -> Axis:
    """The axis, also where only its label is given."""
    return Axis(given) if isinstance(given, str) else given
