"""Figures as plain data, and the one place that draws them: `from studies.plots import Figure, Panel, Line`.

Nothing here imports matplotlib before a figure is drawn (`studies.plots.save`).
"""

from studies.plots.figure import Axis, Figure, Panel
from studies.plots.marks import (
    DASHES,
    ZERO,
    Band,
    Bars,
    Box,
    ColouredDots,
    Contours,
    Dash,
    ErrorBars,
    Level,
    Line,
    Map,
    Mark,
    Shade,
    Words,
    dots,
)

__all__ = [
    "DASHES", "ZERO", "Axis", "Band", "Bars", "Box", "ColouredDots", "Contours", "Dash", "ErrorBars", "Figure", "Level", "Line",
    "Map", "Mark", "Panel", "Shade", "Words", "dots",
]  # fmt: skip
