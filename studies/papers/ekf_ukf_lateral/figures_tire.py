"""The Dugoff tire of P4 and what its printed sign does to the car."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from estimators.sideslip import dugoff_force
from studies.papers.ekf_ukf_lateral.equations import SPEED, single_track_poles, step_response
from studies.plots.colours import BLUE, GREEN, ORANGE, RED
from studies.study import Drawing
from synthesis.models.catalogue.four_wheel import SUBSTITUTES
from synthesis.polynomials.matrix import FloatArray

COLOURS = (BLUE, ORANGE, GREEN)
STIFFNESS = SUBSTITUTES["front_stiffness"].value  # N/rad, one tire


def lateral_force(slip: FloatArray, friction: float, load: float) -> FloatArray:
    """Dugoff force in N over slip angles in rad: P4 (3)-(5) with the plus sign."""
    return dugoff_force(STIFFNESS, np.tan(slip), np.array(friction * load / (2.0 * STIFFNESS)))


def dugoff_curves() -> Drawing:
    """Fig. 1 of P4: force over slip angle, for loads and for frictions."""
    figure = Figure(figsize=(9.2, 3.7), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    slip = np.radians(np.linspace(-20.0, 20.0, 801))
    cases = [[(1.0, load) for load in (2000.0, 4000.0, 6000.0)], [(mu, 4000.0) for mu in (0.3, 0.6, 1.0)]]
    for axis, chosen, title in zip(
        axes, cases, ("dry road (μ = 1), three loads", "4 kN load, three frictions"), strict=True
    ):
        for (friction, load), color in zip(chosen, COLOURS, strict=True):
            label = f"$F_z$ = {load / 1e3:g} kN" if axis is axes[0] else f"μ = {friction:g}"
            axis.plot(np.degrees(slip), lateral_force(slip, friction, load) / 1e3, color=color, lw=1.8, label=label)
            axis.axhline(friction * load / 1e3, color=color, lw=0.8, ls=":")
            knee = np.arctan(friction * load / (2.0 * STIFFNESS))
            axis.plot(np.degrees([-knee, knee]), np.array([-0.5, 0.5]) * friction * load / 1e3, "o", color=color, ms=5)
        axis.plot(
            np.degrees(slip), STIFFNESS * np.tan(slip) / 1e3, color="black", lw=0.9, ls="--", label=r"$C_α\,\tan α$"
        )
        axis.set_ylim(-6.6, 6.6)
        axis.set_xlabel("slip angle α [deg]")
        axis.set_title(title, loc="left")
        axis.legend(loc="lower right")
    axes[0].set_ylabel("lateral force [kN]")
    return Drawing(
        "dugoff",
        "The Dugoff tire of (3) to (5) without longitudinal slip, with the plus sign that (1) and (2) need and a "
        "cornering stiffness of 32.5 kN/rad. Dots: λ = 1, where the tire stops being linear, always at half of the "
        "friction limit μF_z; dotted: that limit, which is approached like μF_z (1 − λ/2) and never passed. P4 "
        "shows the generic curve as Fig. 1 and prints no tire values.",
        "Two panels of S-shaped curves of lateral force over slip angle: higher load or friction gives a higher "
        "plateau; all share the slope at the origin.",
        figure,
    )  # fmt: skip


def sign_of_the_force() -> Drawing:
    """Poles over speed and the response to a steering step, for both signs."""
    figure = Figure(figsize=(9.2, 3.5), layout="constrained")
    left, right = figure.subplots(1, 2)
    speed = np.linspace(5.0, 40.0, 141)
    for sign, color, label in ((1, BLUE, "plus (corrected)"), (-1, RED, "minus (as printed)")):
        poles = single_track_poles(sign, speed)
        left.plot(speed, poles[:, 0], color=color, lw=1.6, label=label)
        left.plot(speed, poles[:, 1], color=color, lw=1.6)
        time, yaw = step_response(sign, np.radians(1.0))
        right.plot(time, np.degrees(yaw), color=color, lw=1.6, label=label)
    left.axhline(0.0, color="black", lw=0.8)
    left.axvline(SPEED, color="0.5", lw=0.8, ls=":")
    left.text(SPEED + 0.4, 15.0, f"{SPEED:g} m/s", fontsize=8, color="0.35")
    left.set_xlabel("speed [m/s]")
    left.set_ylabel("real part of the poles [1/s]")
    left.set_ylim(-20, 20)
    left.legend(loc="lower right")
    right.set_ylim(-12.0, 12.0)
    right.axhline(0.0, color="black", lw=0.8)
    right.set_xlabel("time [s]")
    right.set_ylabel("yaw rate [deg/s]")
    right.set_title(f"step of 1° to the left at {SPEED:g} m/s", loc="left")
    right.legend(loc="upper right")
    return Drawing(
        "force-sign",
        "What the sign in (3) decides, on the linear single track of the same car (P5 values). Left: with the "
        "printed minus both poles lie in the right half plane at every speed, with the plus in the left one. "
        "Right: after a steering step to the left the corrected car turns left and settles; with the printed sign "
        "it turns right and diverges.",
        "Left: poles over speed, blue below zero, red above. Right: yaw rate after a step, blue settles at a "
        "positive value, red runs away to negative values.",
        figure,
    )  # fmt: skip
