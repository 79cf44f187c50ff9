"""Figures as files: one look, the same bytes from the same data, closed once written."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl

from studies.study import Drawing

PNG_DPI = 150
STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "0.88",
    "legend.frameon": False,
    "legend.fontsize": 8,
    "figure.figsize": (7.2, 4.0),
    "figure.max_open_warning": 0,
    "svg.hashsalt": "gainsmith",  # otherwise the ids inside an SVG are random
}


@contextmanager
def drawing_style() -> Iterator[None]:
    """Figures made inside need no display and share one look; a study may still overrule it."""
    mpl.use("Agg")
    with mpl.rc_context(STYLE):
        yield


def save_drawing(drawing: Drawing, folder: Path) -> None:
    """Write ``<name>.svg`` and ``<name>.png`` to ``folder`` and close the figure."""
    figure = drawing.figure
    layout = figure.get_layout_engine()
    if layout is not None:  # once for both files: it takes as long as drawing
        layout.execute(figure)
        figure.set_layout_engine("none")
    figure.savefig(folder / f"{drawing.name}.svg", metadata={"Date": None})
    figure.savefig(folder / f"{drawing.name}.png", dpi=PNG_DPI)
    figure.clear()
    if "matplotlib.pyplot" in sys.modules:  # figures made without pyplot are not registered there
        sys.modules["matplotlib.pyplot"].close(figure)
