"""Gains over the scheduling parameter, beside the published ranges."""

from __future__ import annotations

import numpy as np

from estimators.schedule import GainSchedule
from studies.plots import Axis, Figure, Line, Mark, Panel, Shade
from studies.plots.colours import DEPLOYED, PRINTED_BAND
from studies.schedules import ScheduleRun


def gain_figure(run: ScheduleRun) -> Figure:
    """Every gain as it is deployed (points and straight lines), the published range shaded behind it."""
    parameter = run.content["scheduling"][0]
    breakpoints = np.array(parameter["breakpoints"])
    table = np.array(run.content["gain"]["table"])[..., 0]
    units = GainSchedule.from_content(run.content).gain_units
    symbol = "$L$" if run.content["update"]["kind"] == "held" else "$K$"
    panels = []
    for i, gains in enumerate(table.T):
        marks: list[Mark] = [Line(breakpoints, gains, "deployed, proved", DEPLOYED, marker="o")]
        if run.published is not None:
            low, high = run.published[i]
            marks.insert(0, Shade(low, high, "y", f"published range {low:g} to {high:g}", PRINTED_BAND))
        x = Axis(f"{parameter['name'].replace('_', ' ')} [{parameter['unit']}]", breakpoints[0], breakpoints[-1])
        panels.append(Panel(marks, x, Axis(f"{symbol}$_{i + 1}$ [{units[i][0]}]", low=0.0), legend="best"))
    decay = next(p.level for p in run.proofs if p.kind in ("internal update", "sampled error"))
    title = f"{run.name}: update decays at {decay:g} 1/s, proved over the whole range and rate box"
    return Figure(
        run.name,
        title,
        "Each gain as straight lines between its breakpoints, over the published range.",
        panels,
        size=(4.4 * len(panels), 3.4), title=title,
    )  # fmt: skip
