"""The flags of a drive over time, a ribbon with its name for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from studies.drives.raised import Raised
from studies.plots import Axis, Bars, Figure, Mark, Panel
from studies.plots.colours import GREY, ORANGE

KINDS = (("something is wrong or weaker", ORANGE, False), ("what the car does", GREY, True))


def flag_figure(name: str, rows: Sequence[Raised]) -> Figure | None:
    """One row a flag, from the top in the order given; None where none rose."""
    if not rows:
        return None
    marks: list[Mark] = []
    for label, colour, usual in KINDS:
        pieces = [(place, *row.intervals()) for place, row in enumerate(rows) if row.usual == usual]
        if pieces:
            places = np.concatenate([np.full(start.size, place, float) for place, start, _ in pieces])
            start, length = (np.concatenate([piece[k] for piece in pieces]) for k in (1, 2))
            marks.append(Bars(places, length, label, colour, 0.6, flat=True, start=start))
    time = rows[0].time
    words: dict[float, str] = {place: f"{row.owner}: {row.name}" for place, row in enumerate(rows)}
    return Figure(
        "flags",
        f"{name}: flags over time. A ribbon stands where the flag is up; what each of them means is in the table below.",
        f"Ribbons over time: {', '.join(words.values())}.",
        Panel(
            marks, Axis("time [s]", float(time[0]), float(time[-1])), Axis("", len(rows) - 0.4, -0.6, ticks=words)
        ),
        size=(9.0, 1.1 + 0.26 * len(rows)), legend="below", title=f"{name}: flags",
    )  # fmt: skip
