"""Figs. 6 to 9 of P4 on a truth drive, and its table as a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from estimators.sideslip import used_friction
from estimators.vehicle import CORNERS
from studies.plots import colours
from studies.study import Drawing
from studies.trials.accuracy import Spread
from studies.trials.four_wheel import EKF, PIPELINE, SHARE, STEADY, UKF, FourWheelRun
from studies.trials.panels import estimate_line, finished, true_line

if TYPE_CHECKING:
    from studies.trials.four_wheel_report import PrintedRow

STYLE: dict[str, dict[str, Any]] = {
    EKF: {"color": colours.EXTENDED, "linewidth": 1.9},
    UKF: {"color": colours.UNSCENTED, "linestyle": (0, (4, 2))},
    PIPELINE: {"color": colours.PIPELINE},
    SHARE: {"color": colours.STEADY},
    STEADY: {"color": colours.STEADY},
}
MARKERS = {EKF: "s", UKF: "o", PIPELINE: "D", SHARE: "^", STEADY: "^"}
_TITLES = {SHARE: "m a_y by load", STEADY: "steady linear car"}


def error_dots(
    name: str, printed: Sequence[PrintedRow], found: Sequence[Mapping[str, tuple[Spread, Spread]]]
) -> Drawing:
    """Means and deviations of every quantity beside the printed ones."""
    figure = Figure(figsize=(8.6, 3.9), layout="constrained")
    for j, (axes, title) in enumerate(
        zip(figure.subplots(1, 2, sharey=True), ("mean", "standard deviation"), strict=True)
    ):
        for k, (row, errors) in enumerate(zip(printed, found, strict=True)):
            shown = [who for who in MARKERS if who in errors]
            for place, who in enumerate(shown):
                value, height = errors[who][j], k + 0.16 * (place - 1.5)
                ends = [[value.mean - value.low], [value.high - value.mean]]
                label = who if k == 0 or who == STEADY else None
                axes.errorbar(
                    value.mean, height, xerr=ends, fmt=MARKERS[who], color=STYLE[who]["color"], markersize=4.5, capsize=2,
                    linewidth=1, label=label,
                )  # fmt: skip
                own = (row.mean, row.deviation)[j].get(who.lower())
                if own is not None:
                    label = f"{who} as printed" if k == 0 else None
                    axes.plot(
                        own, height, marker=MARKERS[who], markerfacecolor="none", color=STYLE[who]["color"], markersize=8,
                        linestyle="none", label=label,
                    )  # fmt: skip
        axes.set_xlabel(f"{title} of the error (13) [% of the peak]")
        axes.set_xlim(left=0.0)
        axes.grid(axis="x", alpha=0.25)
    first = figure.axes[0]
    first.set_yticks(range(len(printed)), [row.quantity for row in printed])
    first.invert_yaxis()
    handles, labels = first.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return Drawing(
        name,
        "Errors of lateral forces and sideslip on the truth vehicle (filled, with 95 % confidence interval) and as printed "
        "(open). EKF and UKF have the same model, noise and start.",
        "Dot plot: mean and standard deviation of the error for four lateral forces and the sideslip, by estimate.",
        figure,
    )


def force_history(name: str, run: FourWheelRun) -> Drawing:
    """Figs. 6 and 7: the four lateral forces."""
    figure = Figure(figsize=(9.0, 5.4), layout="constrained")
    time = run.drawn.truth.time
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for k, axes in enumerate(panels.flat):
        true_line(axes, time, 1e-3 * run.true_forces[:, k])
        for who in (EKF, UKF, PIPELINE):
            estimate_line(axes, time, 1e-3 * run.forces[who][:, :, k], who, **STYLE[who])
        axes.set_title(CORNERS[k], loc="left", fontsize="medium")
        finished(axes, "$F_y$ [kN]" if k % 2 == 0 else "", last=k > 1)
    panels[0, 0].legend(fontsize="small", frameon=False, ncols=2)
    return Drawing(
        name,
        f"Figs. 6 and 7 of P4 on {run.drawn.truth.tires[0]} tires: lateral forces of the four wheels, "
        "positive to the left. Lines: first "
        "sensor draw; bands: 95 % of all draws.",
        "Four panels of lateral force over time, front wheels above, rear wheels below, with estimates of both filters.",
        figure,
    )


def sideslip_history(name: str, run: FourWheelRun) -> Drawing:
    """Fig. 8."""
    figure = Figure(figsize=(8.0, 3.2), layout="constrained")
    axes, time = figure.subplots(), run.drawn.truth.time
    true_line(axes, time, np.degrees(run.true_sideslip))
    for who in (STEADY, PIPELINE, EKF, UKF):
        estimate_line(axes, time, np.degrees(run.sideslip[who]), _TITLES.get(who, who), **STYLE[who])
    finished(axes, "sideslip [deg]", last=True)
    axes.legend(ncols=3, fontsize="small", frameon=False)
    return Drawing(
        name,
        f"Fig. 8 of P4 on {run.drawn.truth.tires[0]} tires: sideslip at the centre of gravity, positive to "
        "the left. Lines: first sensor draw; "
        "bands: 95 % of all draws.",
        "Sideslip over time: truth, both filters, the pipeline and the formula of a linear car in a steady turn.",
        figure,
    )


def used_friction_history(name: str, run: FourWheelRun) -> Drawing:
    """Fig. 9: F_y/F_z of (14), estimated force over estimated load."""
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    time = run.drawn.truth.time
    for k, axes in enumerate(figure.subplots(2, 2, sharex=True, sharey=True).flat):
        true_line(axes, time, used_friction(run.true_forces[:, k], run.true_loads[:, k]))
        estimate_line(axes, time, used_friction(run.forces[UKF][:, :, k], run.loads[:, :, k]), UKF, **STYLE[UKF])
        for side in (-1, 1):
            limit = side * float(np.mean(run.tire.peak))
            axes.axhline(limit, color=colours.LIMIT, linewidth=0.8, linestyle=":", label="limit" if side > 0 else None)
        axes.set_title(CORNERS[k], loc="left", fontsize="medium")
        finished(axes, "$F_y/F_z$" if k % 2 == 0 else "", last=k > 1)
    figure.axes[0].legend(fontsize="small", frameon=False, ncols=3)
    return Drawing(
        name,
        f"Fig. 9 of P4 on {run.drawn.truth.tires[0]} tires: used lateral friction (14) of the four wheels, "
        "and the greatest that the tire has.",
        "Four panels of lateral force over vertical load with the unscented filter's estimate and the friction limit.",
        figure,
    )
