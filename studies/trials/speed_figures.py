"""Figs. 9 to 13 of P2 on truth drives, and the errors by manoeuvre."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from studies.plots.colours import (
    FUSION,
    HIGH_SLIP,
    INTEGRATED_ACCELERATION,
    KALMAN,
    MEAN_WHEEL_SPEED,
    SCHEDULE,
    SECOND_FILTER,
)
from studies.study import Drawing
from studies.trials.accuracy import Spread
from studies.trials.panels import estimate_line, finished, true_line
from studies.trials.play import believed, run_of
from studies.truth import Measured

if TYPE_CHECKING:
    from studies.trials.speed import Drive

Array = npt.NDArray[np.float64]
STYLE = {
    "Kalman, 3 states": ("s", KALMAN),
    "Kalman, 2 states": ("D", SECOND_FILTER),
    "schedule": ("P", SCHEDULE),
    "fusion": ("o", FUSION),
    "mean wheel speed": ("^", MEAN_WHEEL_SPEED),
    "integrated acceleration": ("v", INTEGRATED_ACCELERATION),
}


def error_dots(name: str, rows: Sequence[Drive], found: Sequence[Mapping[str, Spread]], claimed: float) -> Drawing:
    """Mean NRMS with its interval by manoeuvre and estimate, and the claim."""
    figure = Figure(figsize=(8.0, 1.7 + 0.75 * len(rows)), layout="constrained")
    axes = figure.subplots()
    for y, errors in enumerate(found):
        for place, (who, value) in enumerate(errors.items()):
            marker, colour = STYLE[who]
            ends = [[value.mean - value.low], [value.high - value.mean]]
            height = y + 0.12 * (place - 2.5)
            axes.errorbar(
                value.mean, height, xerr=ends, fmt=marker, color=colour, markersize=5, capsize=2, linewidth=1,
                label=who if y == 0 else None,
            )  # fmt: skip
    axes.axvline(claimed, color="black", linewidth=1.0, linestyle="--", label="claimed")
    axes.set_xscale("log")
    axes.set_xlabel("$V_x$ NRMS [% of the peak]")
    axes.grid(axis="x", which="both", alpha=0.25)
    axes.set_yticks(range(len(rows)), [row.title for row in rows])
    axes.invert_yaxis()
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    return Drawing(
        name,
        "Error of the longitudinal speed by manoeuvre, mean over the sensor draws with 95 % interval; "
        "dashed: what P2 claims of its own.",
        "Dot plot of the normalised speed error of two Kalman filters, a gain schedule, the fusion and two "
        "baselines by manoeuvre.",
        figure,
    )


def speed_history(name: str, drawn: Measured, row: Drive, estimates: Mapping[str, Array]) -> Drawing:
    """Speed, its error, and the front left wheel: surface speed, velocity of its centre, and where the detector speaks."""
    truth = drawn.truth
    place, samples = run_of(truth, row.manoeuvre)
    time, true = truth.time[samples], truth["vx"][place, samples]
    figure = Figure(figsize=(8.6, 6.4), layout="constrained")
    top, middle, bottom = figure.subplots(3, 1, sharex=True)
    true_line(top, time, true)
    top.plot(time, estimates["mean wheel speed"][0, place, samples], color=STYLE["mean wheel speed"][1], linewidth=0.7,
             label="mean wheel speed", zorder=0)  # fmt: skip
    for who in ("Kalman, 3 states", "schedule", "fusion"):
        value = estimates[who][:, place, samples]
        estimate_line(top, time, value, who, color=STYLE[who][1])
        estimate_line(middle, time, value - true, who, color=STYLE[who][1])
    surface = believed(drawn).radius[0] * drawn.signals["wheel_speed"][0, place, samples, 0]
    bottom.plot(time, surface, color=STYLE["mean wheel speed"][1], linewidth=0.7, label="$R_e\\omega$", zorder=0)
    true_line(bottom, time, truth["wheel_vx"][place, samples, 0])
    centre = surface - estimates["relative"][0, place, samples]
    bottom.plot(time, centre, color=STYLE["Kalman, 3 states"][1], linewidth=0.9, label="Kalman, 3 states", zorder=3)
    high = estimates["high"][0, place, samples] > 0.5
    bottom.fill_between(time, 0, 1, where=high, transform=bottom.get_xaxis_transform(), color=HIGH_SLIP, linewidth=0, zorder=0,
                        label="high slip detected")  # fmt: skip
    finished(top, "$V_x$ [m/s]")
    finished(middle, "error of $V_x$ [m/s]")
    finished(bottom, "front left wheel [m/s]", last=True)
    top.legend(ncols=3, fontsize="small", frameon=False)
    bottom.legend(ncols=4, fontsize="small", frameon=False)
    return Drawing(
        name,
        f"{row.title}: speed of the car, its error, and the velocity of the front left wheel's centre. Lines: "
        "first sensor draw; bands: "
        "95 % of all draws.",
        "Three panels over time: speed with estimates, errors of the estimates, and the front left wheel "
        "with detected high slip shaded.",
        figure,
    )
