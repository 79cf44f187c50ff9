"""A sweep beside its baseline: what every statistic won or lost."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from studies.report.sweep_panels import HIGH, LOW, NOMINAL, finished, panels, words
from studies.sweeps.baseline import Baseline
from studies.sweeps.engine import SweepResult

VALUES = ("nominal", "median", "quantile 95 %", "quantile 99 %", "worst")
MARKS = dict(zip(VALUES, ("o", "s", "^", "D", "X"), strict=True))


def draw_before_after(result: SweepResult, before: Baseline) -> Figure:
    """One panel a measure, one row an observer: how much of its distance to worthlessness each statistic won or lost."""
    measures = list(result.sweep.measures)
    figure, axes = panels(len(measures), 4.8, 1.0 + 0.42 * len(result.sweep.observers))
    for ax, measure in zip(axes, measures, strict=True):
        tolerance = 100.0 * result.sweep.tolerances.get(measure.name, result.sweep.tolerance)
        reach, marks = 2.0 * tolerance, []
        for place, observer in enumerate(result.sweep.observers):
            for name in VALUES:
                old, new = (
                    before.summary.of(observer.name, measure.name, name),
                    result.summary.of(observer.name, measure.name, name),
                )
                if old is None or new is None:
                    continue
                change = -100.0 * measure.loss(old.value, new.value)
                marks.append((place, name, change))
                reach = max(reach, abs(change)) if np.isfinite(change) else reach
        for place, name, change in marks:
            shown = np.clip(change, -1.15 * reach, 1.15 * reach)
            ax.plot([0.0, shown], [place, place], color="0.75", lw=1.2, zorder=1)
            ax.plot(shown, place, MARKS[name], color=HIGH if change < -tolerance else LOW, ms=5, zorder=2)
        ax.axvspan(-tolerance, 0.0, color="0.92", lw=0, zorder=0)
        ax.axvline(0.0, color=NOMINAL, lw=0.9)
        if reach > 10.0 * tolerance > 0.0:
            ax.set_xscale("symlog", linthresh=2.0 * tolerance, linscale=0.5)
        ax.set_xlim(-1.3 * reach, 1.3 * reach)
        ax.set_ylim(len(result.sweep.observers) - 0.5, -0.5)
        ax.set_yticks(range(len(result.sweep.observers)), [s.name for s in result.sweep.observers], fontsize=7)
        ax.set_xlabel("change against the baseline (%): left is worse")
        ax.set_title(f"{words(measure.name)}", loc="left", fontsize=9)
    handles: list[Line2D | Patch] = [
        Line2D([], [], marker=mark, ls="", color="0.4", label=name) for name, mark in MARKS.items()
    ]
    handles += [
        Line2D([], [], marker="o", ls="", color=HIGH, label="shrunk"),
        Patch(color="0.92", label="tolerance"),
    ]
    return finished(figure, f"Sweep {result.sweep.name}: after, against the baseline", handles)
