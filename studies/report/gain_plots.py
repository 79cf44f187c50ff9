"""Gains over the scheduling parameter, beside the published ranges."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

from estimators.schedule import GainSchedule
from studies.plots.colours import PRINTED_BAND

if TYPE_CHECKING:
    from studies.schedules import ScheduleRun


def plot_schedules(runs: Sequence[ScheduleRun], folder: Path) -> list[Path]:
    """One figure for each schedule, as SVG and PNG; returns the files."""
    folder.mkdir(parents=True, exist_ok=True)
    return [path for run in runs for path in plot_schedule(run, folder)]


def plot_schedule(run: ScheduleRun, folder: Path) -> list[Path]:
    """Every gain as it is deployed (points and straight lines), the published range shaded behind it."""
    parameter = run.content["scheduling"][0]
    breakpoints = np.array(parameter["breakpoints"])
    table = np.array(run.content["gain"]["table"])[..., 0]
    units = GainSchedule.from_content(run.content).gain_units
    symbol = "$L$" if run.content["update"]["kind"] == "held" else "$K$"
    figure, axes = plt.subplots(
        1, table.shape[1], figsize=(4.4 * table.shape[1], 3.4), layout="constrained", squeeze=False
    )
    for i, axis in enumerate(axes[0]):
        if run.published is not None:
            low, high = run.published[i]
            axis.axhspan(low, high, color=PRINTED_BAND, alpha=0.15, lw=0, label=f"published range {low:g} to {high:g}")
        axis.plot(breakpoints, table[:, i], "o-", color="#aa3377", ms=4, lw=1.5, label="deployed, proved")
        axis.set_xlabel(f"{parameter['name'].replace('_', ' ')} [{parameter['unit']}]")
        axis.set_ylabel(f"{symbol}$_{i + 1}$ [{units[i][0]}]")
        axis.set_xlim(breakpoints[0], breakpoints[-1])
        axis.set_ylim(bottom=0.0)
        axis.grid(alpha=0.3)
        axis.legend(loc="best", frameon=False, fontsize=8)
    decay = next(p.level for p in run.proofs if p.kind in ("internal update", "sampled error"))
    figure.suptitle(
        f"{run.name}: update decays at {decay:g} 1/s, proved over the whole range and rate box", fontsize=10
    )
    paths = [folder / f"{run.name}.{kind}" for kind in ("svg", "png")]
    for path in paths:
        figure.savefig(path, dpi=130)
    plt.close(figure)
    return paths
