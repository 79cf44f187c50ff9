"""Fig. 2: the H-infinity norms over the wheel speed."""

from __future__ import annotations

import numpy as np

from studies.papers.resilient_velocity.claims_norms import AXES, SPEEDS, floor, norms
from studies.papers.resilient_velocity.exact_norms import norm_crosses_one
from studies.papers.resilient_velocity.ink import SPEED_LABEL, sheet
from studies.papers.resilient_velocity.setting import DIRECTIONS, HIGHEST_SPEED, PRINTED, Setting
from studies.plots.colours import BLUE, GREY, RED
from studies.study import Drawing


def norm_figure(setting: Setting = PRINTED) -> Drawing:
    """One panel for each direction, on the axis range of the paper."""
    figure = sheet(9.2, 3.9)
    for axis, direction in zip(figure.subplots(1, 2), DIRECTIONS, strict=True):
        both = norms(setting, direction, SPEEDS)
        low, high = AXES[direction]
        axis.axhspan(low, high, color="0.9", lw=0, label="axis of the paper")
        axis.axhline(1.0, color=GREY, lw=0.8)
        axis.plot(SPEEDS, both, color=BLUE, lw=1.9, label="friction and acceleration error")
        axis.plot(
            SPEEDS,
            norms(setting, direction, SPEEDS, "friction"),
            color=RED,
            lw=1.5,
            ls=(0, (6, 2)),
            label="friction alone",
        )
        marks = SPEEDS[::20]
        axis.plot(marks, floor(setting, direction, marks), "x", color="0.1", ms=5, mew=1.2, label="floor of any gain")
        for speed in norm_crosses_one(setting, direction):
            axis.plot(speed, 1.0, "o", mfc="white", mec=BLUE, ms=6)
            axis.annotate(
                f"1 at {speed:.1f} rad/s",
                (speed, 1.0),
                (12 if speed < 70 else -4, 11),
                textcoords="offset points",
                color=BLUE,
                fontsize=8,
            )
        room = 0.1 * (high - low)
        axis.set_ylim(low - room, high + room)
        axis.set_xlim(0.0, HIGHEST_SPEED)
        axis.ticklabel_format(axis="y", useOffset=False)
        axis.set_xlabel(SPEED_LABEL)
        axis.set_title(direction, loc="left")
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    figure.axes[0].set_ylabel("H∞ norm to both errors [1]")
    top = {d: float(np.max(norms(setting, d, SPEEDS))) for d in DIRECTIONS}
    return Drawing(
        "fig-2-norms",
        "Fig. 2 regenerated: H∞ norm of the error dynamics with the printed gains over the wheel speed. Both "
        "curves lie on the axis of the paper. Crosses: the static gain σ₀/(σ₀ + σ₂κRₑ|ω|) that no observer gain "
        f"can lower. With both disturbances the norm starts above 1 ({top['longitudinal']:.6f} and "
        f"{top['lateral']:.4f} at standstill) and falls below it at the circles; with friction alone it never "
        "exceeds 1.",
        "Two panels of nearly straight, falling lines of the norm over wheel speed; the lateral one with both "
        "disturbances starts at 1.0026 and crosses 1 near 80 rad/s.",
        figure,
    )
