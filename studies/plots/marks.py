"""What stands inside the axes of a figure, as plain numbers: lines, bands, levels, maps, bars and words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from numpy.typing import ArrayLike

from studies.plots.colours import BLUE, GREY

Dash = Literal["solid", "dashed", "dotted", "dash-dot", "long dash", "none"]
DASHES: tuple[Dash, ...] = ("solid", "dashed", "dotted", "dash-dot", "long dash")
"""In the order in which the lines of a figure take them: distinct in print and for the colour-blind."""


@dataclass(frozen=True)
class Line:
    """A curve through (x, y), or with the dash "none" and a marker dots; y of the shape (g, k) is k curves of one look.

    ``marker`` is one of matplotlib's characters; ``hollow`` markers are white inside. ``steps`` holds a value until the next one.
    """

    x: ArrayLike
    y: ArrayLike
    label: str = ""
    color: str = BLUE
    dash: Dash = "solid"
    width: float = 1.5
    marker: str = ""
    size: float = 4.0
    hollow: bool = False
    alpha: float = 1.0
    steps: bool = False
    edge: str = ""


def dots(
    x: ArrayLike,
    y: ArrayLike,
    label: str = "",
    color: str = BLUE,
    marker: str = "o",
    size: float = 5.0,
    hollow: bool = False,
    edge: str = "",
) -> Line:
    """Markers that no line joins."""
    return Line(x, y, label, color, "none", marker=marker, size=size, hollow=hollow, edge=edge)


@dataclass(frozen=True)
class Band:
    """What lies between two curves over x."""

    x: ArrayLike
    low: ArrayLike
    high: ArrayLike
    label: str = ""
    color: str = BLUE
    alpha: float = 0.2


@dataclass(frozen=True)
class Level:
    """A straight line across the panel: horizontal at the value y, or vertical at the value x."""

    y: float | None = None
    x: float | None = None
    label: str = ""
    color: str = "0.1"
    dash: Dash = "solid"
    width: float = 0.8
    alpha: float = 1.0


ZERO = Level(y=0.0)


@dataclass(frozen=True)
class Shade:
    """A stripe across the panel from ``low`` to ``high``, of x values or of y values."""

    low: float
    high: float
    along: Literal["x", "y"] = "y"
    label: str = ""
    color: str = GREY
    alpha: float = 0.15


@dataclass(frozen=True)
class Words:
    """Text at (x, y) of the data, or of the panel (0 to 1) if ``relative``; ``offset`` in points."""

    x: float
    y: float
    text: str
    color: str = "0.1"
    size: float = 8.0
    offset: tuple[float, float] = (0.0, 0.0)
    horizontal: Literal["left", "center", "right"] = "left"
    vertical: Literal["top", "center", "bottom", "baseline"] = "baseline"
    relative: bool = False
    rotation: float = 0.0


@dataclass(frozen=True)
class Bars:
    """Bars of ``values`` at ``places``; errors are (2, n) below and above; ``numbers`` formats values written on them."""

    places: ArrayLike
    values: ArrayLike
    label: str = ""
    color: str | Sequence[str] = BLUE
    width: float = 0.8
    flat: bool = False  # bars that lie
    errors: ArrayLike | None = None
    numbers: str = ""
    start: ArrayLike = 0.0
    alpha: float = 1.0


@dataclass(frozen=True)
class ErrorBars:
    """Points with a span: ``below`` and ``above`` are lengths, not ends."""

    x: ArrayLike
    y: ArrayLike
    below: ArrayLike
    above: ArrayLike
    label: str = ""
    color: str = BLUE
    marker: str = "o"
    size: float = 4.0
    flat: bool = False  # spans along x


@dataclass(frozen=True)
class Map:
    """z of the shape (len(y), len(x)) as colours, with a bar that ``label`` names; no bar without a label."""

    x: ArrayLike
    y: ArrayLike
    z: ArrayLike
    label: str = ""
    colors: str = "cividis"
    low: float | None = None
    high: float | None = None
    smooth: bool = True  # False: one even cell around each place


@dataclass(frozen=True)
class ColouredDots:
    """Dots at (x, y) in the colour of z, the later ones on top, with a bar that ``label`` names; z beyond low and high is cut."""

    x: ArrayLike
    y: ArrayLike
    z: ArrayLike
    label: str
    colors: str = "viridis"
    low: float | None = None
    high: float | None = None
    size: float = 2.6


@dataclass(frozen=True)
class Contours:
    """Lines of equal z, with their values if ``numbers`` is a format; ``filled`` colours the span of two levels instead."""

    x: ArrayLike
    y: ArrayLike
    z: ArrayLike
    levels: Sequence[float]
    color: str = "0.25"
    dash: Literal["solid", "dashed", "dotted"] = "solid"
    width: float = 0.9
    numbers: str = "%g"
    filled: bool = False


@dataclass(frozen=True)
class Box:
    """The outline of a rectangle."""

    x: tuple[float, float]
    y: tuple[float, float]
    label: str = ""
    color: str = BLUE
    width: float = 1.5


Mark = Line | Band | Level | Shade | Words | Bars | ErrorBars | Map | ColouredDots | Contours | Box
