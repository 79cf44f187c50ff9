"""The floor in pictures: shares over slip, shares over time, and what is left of the velocity error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from studies.beyond.friction_floor.launches import Launch
from studies.beyond.friction_floor.runtime import WHEEL_SPEEDS, Missed
from studies.beyond.friction_floor.theory import missed_share
from studies.plots.colours import FUSION, INTEGRATED_ACCELERATION, MEAN_WHEEL_SPEED, OWN_OBSERVERS, ROADS
from studies.study import Drawing
from synthesis.models.parameter_set import load_parameter_set

NAMES = {
    "corner observers": OWN_OBSERVERS,
    "fusion": FUSION,
    "mean wheel speed": MEAN_WHEEL_SPEED,
    "integrated acceleration": INTEGRATED_ACCELERATION,
}


def shares(missed: Missed, friction: Sequence[float], slip: Sequence[float]) -> Drawing:
    """Predicted lines, simulated points, of the longitudinal observer at the middle wheel speed."""
    values = load_parameter_set("corner-estimation")
    fine = np.geomspace(slip[0], slip[-1], 200)
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.subplots()
    for i, (theta, colour) in enumerate(zip(friction, ROADS, strict=False)):
        radius = values.vehicle["effective_radius"].value
        line = missed_share(values.tire["longitudinal"], radius, WHEEL_SPEEDS[1], fine, theta)
        axes.plot(100 * fine, 100 * line, color=colour, linewidth=1.4, label=f"friction {theta:g}")
        axes.plot(100 * np.asarray(slip), 100 * missed.simulated[1, i], "o", color=colour, markersize=4)
    axes.set_xscale("log")
    axes.set_xlabel(r"slip $v_r/(R_e\omega)$ [%]")
    axes.set_ylabel("share of the slip velocity missed [%]")
    axes.set_ylim(0, 100)
    axes.grid(alpha=0.25, which="both")
    axes.legend(frameon=False)
    return Drawing(
        "missed-shares",
        f"Share of the slip velocity that the longitudinal corner observer misses at {WHEEL_SPEEDS[1]:g} "
        "rad/s: closed form (lines) "
        "and the runtime observer held before a resting tire (points). No gain changes the lines.",
        "Curves of the missed share rising with slip from near zero to near one hundred per cent, earlier on slippery roads.",
        figure,
    )


def over_time(found: Sequence[Launch]) -> Drawing:
    """Slip and shares of every launch."""
    figure = Figure(figsize=(8.0, 5.2), layout="constrained")
    top, bottom = figure.subplots(2, 1, sharex=True)
    for launch, colour in zip(found, ROADS, strict=False):
        top.plot(launch.time, 100 * launch.slip, color=colour, label=f"friction {launch.friction:g}")
        bottom.plot(launch.time, 100 * launch.predicted, color=colour, linewidth=2.4, alpha=0.35)
        bottom.plot(launch.time, 100 * launch.missed, color=colour, linewidth=1.0)
    top.set_ylabel("mean wheel slip [%]")
    top.legend(frameon=False, ncols=3, fontsize="small")
    bottom.set_ylabel("slip velocity missed [%]")
    bottom.set_xlabel("time [s]")
    bottom.set_ylim(0, 110)
    for axes in (top, bottom):
        axes.grid(alpha=0.25)
    return Drawing(
        "missed-over-time",
        "Launches on five roads. Below: what the corner observers miss of the slip velocity (thin), and the closed form at the "
        "slip and friction of the moment (wide), where slip exceeds 1 %.",
        "Time histories of wheel slip and of the missed share on five roads, measured lines on top of predicted ones.",
        figure,
    )


def recovered(found: Sequence[Launch]) -> Drawing:
    """Velocity errors by road."""
    figure = Figure(figsize=(6.4, 4.0), layout="constrained")
    axes = figure.subplots()
    theta = [launch.friction for launch in found]
    for name, colour in NAMES.items():
        mean = np.array([launch.errors[name].mean for launch in found])
        ends = np.array([[launch.errors[name].low, launch.errors[name].high] for launch in found]).T
        axes.errorbar(
            theta, mean, yerr=np.abs(ends - mean), fmt="o-", color=colour, markersize=4, capsize=2, label=name
        )
    axes.set_yscale("log")
    axes.set_xlabel("friction of the road [1]")
    axes.set_ylabel(r"$V_x$ NRMS [% of the peak]")
    axes.grid(alpha=0.25, which="both")
    axes.legend(frameon=False)
    return Drawing(
        "recovered",
        "Velocity errors of the same launches, mean over the sensor draws with 95 % interval: the corner observers stay near the "
        "mean wheel speed, the fusion does not.",
        "Errors over road friction for corner observers, fusion, mean wheel speed and integrated acceleration.",
        figure,
    )
