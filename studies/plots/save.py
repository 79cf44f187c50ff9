"""Figures as files: SVG and PNG, the same bytes from the same data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from studies.execution.files import whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Sheet

    from studies.plots.figure import Figure

PNG_DPI = 150


def save_figure(figure: Figure, folder: Path) -> None:
    """Draw ``<name>.svg`` and ``<name>.png`` into ``folder``."""
    save_as(figure, folder / f"{figure.name}.svg", folder / f"{figure.name}.png")


def save_as(figure: Figure, *paths: Path) -> None:
    """Draw into every path, in the format of its suffix: svg, png, pdf."""
    from studies.plots.draw import draw

    save_sheet(draw(figure), *paths)


def save_sheet(sheet: Sheet, *paths: Path) -> None:
    """Write what is drawn to every path, in the format of its suffix."""
    from studies.plots.draw import look

    with look():
        layout = sheet.get_layout_engine()
        if layout is not None:  # once for all files: it takes as long as drawing
            layout.execute(sheet)
            sheet.set_layout_engine("none")
        for path in paths:
            dated = {".svg": "Date", ".pdf": "CreationDate"}.get(path.suffix)
            sheet.savefig(path, dpi=PNG_DPI, metadata={dated: None} if dated else None)
        sheet.clear()


def write_figures(
    figures: Sequence[Figure], out: Path, progress: Callable[[float], None] = lambda _done: None
) -> list[Path]:
    """Each figure as SVG and PNG under its name, whole or not at all; ``progress`` hears the share done."""
    paths = []
    for k, figure in enumerate(figures):
        svg, png = (out / f"{figure.name}{suffix}" for suffix in (".svg", ".png"))
        with whole_file(svg) as first, whole_file(png) as second:
            save_as(figure, first, second)
        paths += [svg, png]
        progress((k + 1) / len(figures))
    return paths
