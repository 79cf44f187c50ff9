"""The gains of a schedule as they are deployed, drawn over their first parameter."""

from __future__ import annotations

from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from studies.plots import Axis, Figure, Line, Mark, Panel, Shade
from studies.plots.colours import CURVES, DEPLOYED, PRINTED_BAND
from studies.schedules import ScheduleRun

MOST_PANELS, ACROSS = 12, 3


def gain_figure(run: ScheduleRun) -> Figure:
    """Every gain as points and straight lines, the published range shaded behind it.

    Of several parameters the first runs along x; a curve each stands for the ends and the middle of the second, the others being
    in their middle. Of more than twelve gains the first twelve are drawn.
    """
    first = run.content["scheduling"][0]
    breakpoints = np.array(first["breakpoints"])
    units = GainSchedule.from_content(run.content).gain_units
    symbol = "$L$" if run.content["update"]["kind"] == "held" else "$K$"
    curves = curves_of(run.content)
    states, outputs = curves[0][1].shape[1:]
    panels = []
    for place in list(np.ndindex(states, outputs))[:MOST_PANELS]:
        marks: list[Mark] = [
            Line(
                breakpoints,
                gains[(slice(None), *place)],
                label,
                DEPLOYED if len(curves) == 1 else CURVES[k],
                marker="o",
            )
            for k, (label, gains) in enumerate(curves)
        ]
        if run.published is not None and outputs == 1:
            low, high = run.published[place[0]]
            marks.insert(0, Shade(low, high, "y", f"published range {low:g} to {high:g}", PRINTED_BAND))
        x = Axis(f"{first['name'].replace('_', ' ')} [{first['unit']}]", breakpoints[0], breakpoints[-1])
        index = "".join(str(i + 1) for i in (place if outputs > 1 else place[:1]))
        flat = all(gains[(slice(None), *place)].min() >= 0.0 for _, gains in curves)
        y = Axis(f"{symbol}$_{{{index}}}$ [{units[place[0]][place[1]]}]", low=0.0 if flat else None)
        panels.append(Panel(marks, x, y, legend="best"))
    across = min(ACROSS, len(panels)) if len(panels) != 4 else 2
    rows = [panels[i : i + across] for i in range(0, len(panels), across)]
    decay = next(p.level for p in run.proofs if p.kind in ("internal update", "sampled error"))
    title = f"{run.name}: update decays at {decay:g} 1/s, proved over the whole range and rate box"
    return Figure(
        run.name,
        title,
        "Each gain as straight lines between its breakpoints, over the published range where there is one.",
        rows,
        size=(4.4 * across, 0.4 + 3.0 * len(rows)), title=title,
    )  # fmt: skip


def curves_of(content: dict[str, Any]) -> list[tuple[str, FloatArray]]:
    """Label and gains (breakpoints, states, outputs) of every curve."""
    table, others = np.array(content["gain"]["table"]), content["scheduling"][1:]
    if not others:
        return [("deployed, proved", table)]
    for p in others[1:]:
        table = np.take(table, len(p["breakpoints"]) // 2, axis=2)
    second, count = others[0], len(others[0]["breakpoints"])
    return [
        (
            f"{second['name'].replace('_', ' ')} {second['breakpoints'][k]:g} {second['unit']}",
            table[:, k],
        )
        for k in dict.fromkeys((0, count // 2, count - 1))
    ]
