"""What scaling does to the Lyapunov search, how the H-infinity optimum runs away, and the gain curves of Figs 3 and 4."""

from __future__ import annotations

import numpy as np

from estimators.schedule import GainSchedule
from studies.papers.corner_estimation.claims_gains import FIT_SPEED, axes_of_the_figures
from studies.papers.corner_estimation.conditioning import best_margin, natural_scale, vertices_only
from studies.papers.corner_estimation.hinf import literal_design
from studies.papers.corner_estimation.inputs import (
    DESIGN_SPEED,
    DESIGNS,
    DIRECTIONS,
    PAPER,
    STATED_SPEED,
    corner_model,
    printed_gains,
)
from studies.papers.corner_estimation.kalman import fitted, schedule
from studies.plots.colours import BLUE, CURVES, GREEN, GREY, ORANGE, PRINTED_BAND, RED
from studies.report.canvas import DASHES, canvas, grid, label, legend
from studies.study import Drawing
from synthesis.well_posedness import well_posedness


def conditioning_figure(caps: int = 13) -> Drawing:
    """Best Lyapunov margin over the allowed condition number, and false certificates between the vertices."""
    figure, axes = canvas(7.2, 3.6, 1, 2)
    left, right = axes[0]
    conditions = np.geomspace(1.0, 1e6, caps)
    for (name, direction), colour in zip(DESIGNS, CURVES, strict=False):
        scale = natural_scale(name, direction)
        for g, dash in ((1.0, DASHES[1]), (scale, "-")):
            # Relative to the trivial growth of the margin with P itself, so that the sign is what one sees.
            margin = np.array([best_margin(name, direction, g, cap) / cap for cap in conditions])
            left.plot(conditions, margin, color=colour, linestyle=dash, marker=".", markersize=4)
        loose = vertices_only(name, direction)
        right.plot(loose.omega, loose.growth, color=colour, label=f"{PAPER[name]} {direction}")
    left.axhline(0.0, color="0.1", linewidth=0.8)
    left.set_xscale("log")
    left.set_yscale("symlog", linthresh=1e-3, linscale=0.4)
    left.set_yticks([-1e4, -1e2, -1.0, 0.0, 1.0, 1e2])
    left.plot([], [], color=GREY, linestyle="-", label="z scaled by g")
    left.plot([], [], color=GREY, linestyle=DASHES[1], label="z in metres")
    label(left, "allowed condition number κ of P [1]", "best margin / κ [1/s]", "constant P")
    right.axhline(0.0, color="0.1", linewidth=0.8)
    label(right, "wheel speed [rad/s]", "growth rate of V [1/s]", "affine P, vertices only, z in metres")
    right.set_xlim(0.0, STATED_SPEED)
    legend(figure)
    return Drawing(
        "conditioning",
        "Left: the largest margin of the Lyapunov inequality that a constant P with I ≤ P ≤ κ I reaches, over the "
        "allowed condition number κ, with the bristle deflection in metres (dashed) and multiplied by its natural "
        "scale g (solid); below zero there is no certificate (logarithmic beyond ±0.001). Right: an affine P(ω) "
        "that a solver accepts at the four vertices of wheel speed and acceleration lets V grow between them. "
        "Printed gains of P1 and P3.",
        "Left: unscaled margins become positive only at condition numbers of 1e4 to 1e5, scaled ones at once. "
        "Right: growth rates below zero at both ends and up to 280 per second in between.",
        figure,
    )


def optimum_figure(quick: bool = False, points: int = 40) -> Drawing:
    """Least gain energy over the distance from the optimum of (30)."""
    figure, axes = canvas(4.8, 3.4)
    ax = axes[0, 0]
    design = literal_design(1, points=points)
    backoffs = (1.0, 1e-1, 1e-2, 1e-3) if quick else (1.0, 3e-1, 1e-1, 3e-2, 1e-2, 3e-3, 1e-3)
    for direction, colour, marker in zip(DIRECTIONS, (BLUE, RED), "os", strict=True):
        found = well_posedness(corner_model(direction, DESIGN_SPEED), design, backoffs)
        ax.loglog(backoffs, found.energy, color=colour, marker=marker, markersize=4, label=direction)
    ax.invert_xaxis()
    label(ax, "γ above its infimum, relative [1]", "least gain energy, max over ω of LᵀPL [1]")
    legend(ax)
    return Drawing(
        "hinf-ill-posed",
        "The least energy LᵀPL that gains of degree 1 need, over the distance that gamma keeps from its infimum (1 "
        "in both directions). It grows without bound as the optimum is approached: minimising gamma alone "
        "determines no gains. P1 (30)-(32).",
        "Gain energy rises with every decade towards the optimum, for both directions.",
        figure,
    )


def gain_figure() -> Drawing:
    """Figs 3 and 4: gains over wheel speed against the printed axes."""
    figure, axes = canvas(7.2, 5.2, 2, 2, sharex=True)
    omega = grid(0.0, DESIGN_SPEED, 141)
    for row, direction in zip(axes, DIRECTIONS, strict=True):
        gains = printed_gains(direction)
        filtered = schedule(direction, fitted(direction, gains, FIT_SPEED), omega)
        shipped = GainSchedule.shipped(f"corner-estimation-{direction}").gain(omega)[..., 0]
        for i, (ax, (low, high)) in enumerate(zip(row, axes_of_the_figures(direction), strict=True)):
            ax.axhspan(low, high, color=PRINTED_BAND, alpha=0.13, linewidth=0, label="axis of the printed figure")
            ax.axhline(gains[i], color=GREY, linewidth=1.2, linestyle=DASHES[2], label="printed constant gain")
            ax.plot(
                omega, filtered[:, i], color=ORANGE, linestyle=DASHES[1], label="Kalman filter through the printed gain"
            )
            ax.plot(omega, shipped[:, i], color=GREEN, label="our proved schedule")
            ax.plot([FIT_SPEED], [gains[i]], "o", color=RED, markersize=4)
            label(ax, "", f"L{'₁₂'[i]}{'xy'[direction == 'lateral']} [{('m/s', 'm/s²')[i]}]")
            ax.set_ylim(bottom=0.0)
            ax.set_xlim(0.0, DESIGN_SPEED)
    for ax in axes[-1]:
        ax.set_xlabel("wheel speed [rad/s]")
    legend(figure, ncols=2)
    return Drawing(
        "gain-curves",
        "Observer gains over wheel speed, longitudinal above and lateral below (Figs 3 and 4 of P1, whose curves "
        "are not tabulated). The problem as printed determines no gains. Two that do: the steady Kalman filter "
        f"whose noise intensities make it pass through the printed gains at {FIT_SPEED:g} rad/s (dot), and our "
        "schedule with bounded friction gain, a pole band and least force noise.",
        "Four panels of gains over wheel speed; both designs run inside the ranges of the printed axes.",
        figure,
    )
