"""The panels of a figure one by one, so that two stand side by side on a screen and one fills a telephone, letters readable."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from studies.plots import Axis, Figure
from studies.plots.figure import axis
from studies.plots.save import save_as
from studies.report.pictures import LARGEST_SVG, Picture, picture

WIDTH, HEIGHT = 4.4, 2.5  # inches
LEGEND_ROW = 0.17  # inches, for the rows of a legend below the panel


@dataclass(frozen=True)
class Tiles:
    """Drawings under one caption; each with what it shows for those who cannot see it."""

    name: str
    caption: str
    drawings: tuple[tuple[Picture, str], ...]


def tiled(figure: Figure, folder: Path, caption: str = "", height: float = HEIGHT, share: int = LARGEST_SVG) -> Tiles:
    """Every panel of ``figure`` as a drawing of its own, drawn in ``folder``, each in about ``share`` bytes."""
    return drawn(apart(figure, height), figure.name, caption or figure.caption, folder, share)


def drawn(figures: Iterable[Figure], name: str, caption: str, folder: Path, share: int = LARGEST_SVG) -> Tiles:
    """Several figures under one caption."""
    return Tiles(name, caption, tuple((_picture(figure, folder, share), figure.alternative) for figure in figures))


def apart(figure: Figure, height: float = HEIGHT) -> Iterator[Figure]:
    """A figure for each panel; a label that a shared axis left out is written again."""
    rows = figure.rows
    for i, row in enumerate(rows):
        for j, panel in enumerate(row):
            if panel is None:
                continue
            below = [other[j] for other in rows[i:] if j < len(other) and other[j] is not None]
            x = _labelled(panel.x, (p.x for p in below if p is not None), figure.share_x in ("col", "all"))
            y = _labelled(panel.y, (p.y for p in row if p is not None), figure.share_y in ("row", "all"))
            said = panel.title or x.label if not y.label else ": ".join(filter(None, (panel.title, y.label)))
            own = replace(panel, x=x, y=y)
            labels = {label for mark in panel.marks if (label := getattr(mark, "label", ""))}
            tall = height + (LEGEND_ROW * -(-len(labels) // 2) if figure.legend else 0.0)
            yield Figure(
                f"{figure.name}-{i}-{j}", figure.caption, f"{said}. {figure.alternative}", own, size=(WIDTH, tall),
                legend=figure.legend, columns=2,
            )  # fmt: skip


def _labelled(own: Axis | str, others: Iterable[Axis | str], shared: bool) -> Axis:
    given = axis(own)
    label = next((axis(other).label for other in others if axis(other).label), "") if shared else ""
    return given if given.label or not label else replace(given, label=label)


def _picture(figure: Figure, folder: Path, share: int) -> Picture:
    """As SVG, and where that is too heavy from a PNG."""
    vector = folder / f"{figure.name}.svg"
    save_as(figure, vector)
    if vector.stat().st_size > min(share, LARGEST_SVG):
        save_as(figure, vector.with_suffix(".png"))
    return picture(folder, figure.name, share)
