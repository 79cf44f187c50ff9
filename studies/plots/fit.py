"""Words that stay inside the sheet: what is wider than its place is broken into lines, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill

from studies.plots.figure import Figure, Panel, axis

POINT = 1.0 / 72.0  # inches
BESIDE, NUMBERS = 0.35, 0.35  # inches: an axis' label and the gap beside it, and numbers at its ticks
BELOW, ABOVE = 0.5, 0.25  # of a panel: ticks and label of x, its title
TITLE, LABEL, TICK = 9.5, 9.0, 9.0  # points


def places(figure: Figure) -> tuple[list[float], list[float]]:
    """Inches of every column and of every row of panels."""
    rows = figure.rows
    across = max(len(row) for row in rows)
    return _shares(figure.size[0], across, figure.widths), _shares(figure.size[1], len(rows), figure.heights)


def _shares(whole: float, count: int, ratios: Sequence[float] | None) -> list[float]:
    given = list(ratios) if ratios is not None else [1.0] * count
    return [whole * ratio / sum(given) for ratio in given]


def along(panel: Panel, width: float) -> float:
    """Inches for the title and the label of x: the column without what stands at the left."""
    ticks = axis(panel.y).ticks
    names = [line for name in ticks.values() for line in name.split("\n")] if isinstance(ticks, Mapping) else []
    left = max((breadth(name, TICK) for name in names), default=NUMBERS)
    return max(width - left - BESIDE, 1.0)


def upward(height: float) -> float:
    """Inches for the label of y."""
    return max(height - BELOW - ABOVE, 1.0)


def fitted(text: str, inches: float, points: float) -> str:
    """``text``, broken where it is wider; formulas stay whole."""
    if "$" in text or "\n" in text or breadth(text, points) <= inches:
        return text
    return fill(text, max(int(len(text) * inches / breadth(text, points)), 8))


def breadth(text: str, points: float) -> float:
    """Inches that a line of the common font takes."""
    if not text:
        return 0.0
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    return float(text_to_path.get_text_width_height_descent(text, FontProperties(size=points), ismath=False)[0]) * POINT
