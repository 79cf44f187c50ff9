"""What the pictures of a sweep are called: words for names, axes with units, panels in two columns."""

from __future__ import annotations

from collections.abc import Sequence

from studies.plots import Figure, Panel
from studies.sweeps.measures import Measure


def paneled(name: str, title: str, panels: Sequence[Panel], width: float, height: float) -> Figure:
    """Panels of so many inches in two columns, with one legend below all."""
    across = min(2, len(panels))
    rows = [panels[k : k + across] for k in range(0, len(panels), across)]
    shown = f"{title}: {', '.join(panel.title for panel in panels)}"
    size = (width * across, height * len(rows) + 0.7)
    return Figure(name, title, shown, rows, size=size, legend="below", title=title)


def better(measure: Measure) -> str:
    """The name of the measure, and which way is better."""
    return f"{words(measure.name)}: {measure.better} is better"


def words(name: str) -> str:
    """A name as a reader writes it."""
    return name.replace("_", " ")


def titled(measure: Measure) -> str:
    """Name and unit, for an axis."""
    return f"{words(measure.name)} [{measure.unit}]"
