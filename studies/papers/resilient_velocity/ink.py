"""Dashes of the figures: distinct in print and for the colour-blind, never told by colour alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE, RED

SERIES: tuple[tuple[str, Any], ...] = (
    (BLUE, "-"),
    (RED, (0, (6, 2))),
    (GREEN, (0, (6, 1.5, 1, 1.5))),
    (ORANGE, (0, (2, 1.2))),
    (PURPLE, (0, (8, 2, 2, 2, 2, 2))),
)
COLOUR: Mapping[str, str] = {"longitudinal": BLUE, "lateral": RED}
SPEED_LABEL = "wheel speed |ω| [rad/s]"


def sheet(width: float, height: float) -> Figure:
    """An empty figure of this size in inches that arranges its own panels."""
    return Figure(figsize=(width, height), layout="constrained")
