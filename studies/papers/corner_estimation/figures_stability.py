"""Poles over wheel speed, the printed Lyapunov matrices over wheel speed, and maps of the gain boxes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.patches import Rectangle

from studies.papers.corner_estimation.claims_error_matrix import L1, L2, P1
from studies.papers.corner_estimation.claims_stability import gain_grid, slowest_poles
from studies.papers.corner_estimation.inputs import (
    DESIGN_SPEED,
    DIRECTIONS,
    STATED_SPEED,
    corner_model,
    printed_box,
    printed_gains,
)
from studies.papers.corner_estimation.lyapunov import Reading, certificate
from studies.plots.colours import BLUE, FORBIDDEN, GREEN, GREY, ORANGE, RED
from studies.report.canvas import DASHES, canvas, grid, label, legend
from studies.study import Drawing
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray

NAMES = {
    "primal": "as printed, V = e'Pe", "swapped": "states exchanged", "dual": "dual, V = e'Q⁻¹e", "adjugate": "adjugate",
}  # fmt: skip
LINES: tuple[tuple[Reading, str, Any, float], ...] = (
    ("primal", RED, DASHES[2], 1.5), ("swapped", ORANGE, DASHES[3], 1.5),
    ("dual", BLUE, DASHES[0], 2.6), ("adjugate", GREEN, DASHES[1], 1.5),
)  # fmt: skip
SPEED = "wheel speed [rad/s]"


def error_poles(direction: Direction, omega: FloatArray, printed_entry: bool = False) -> FloatArray:
    """Real parts of both frozen error poles, (g, 2) ascending; with entry (1,2) of (26) as printed if asked."""
    first, second = printed_gains(direction)
    model = corner_model(direction)
    A_e = model.on(omega).error_dynamics(np.array([[first], [second]]))[0].copy()
    if printed_entry:
        p1 = model.constants["sigma1"].value + model.constants["sigma2"].value
        A_e[:, 0, 1] = float((-L1 * P1).subs({L1: first, L2: second, P1: p1}))
    return np.sort(np.linalg.eigvals(A_e).real, axis=1)


def pole_figure() -> Drawing:
    """Real parts of the error poles over wheel speed, corrected and printed A0."""
    figure, axes = canvas(7.2, 3.4, 1, 2, sharex=True)
    omega = grid(0.0, STATED_SPEED, 361)
    for ax, direction in zip(axes[0], DIRECTIONS, strict=True):
        right, wrong = error_poles(direction, omega), error_poles(direction, omega, printed_entry=True)
        ax.plot(omega, right, color=BLUE, label="A − L C (corrected entry)")
        ax.plot(omega, wrong, color=RED, linestyle=DASHES[1], label="A₀ as printed in (26)")
        ax.axhline(0.0, color="0.1", linewidth=0.8)
        ax.plot([0.0], [wrong[0, 1]], "o", color=RED, markersize=5)
        gains = printed_gains(direction)
        label(ax, SPEED, "real part of the poles [1/s]", f"{direction}, L = [{gains[0]:g}, {gains[1]:g}]")
        ax.set_xlim(0.0, STATED_SPEED)
    legend(figure)
    return Drawing(
        "poles",
        "Real parts of the two poles of the velocity observer error over wheel speed, with the printed gains. With "
        "entry (1,2) of A0 as printed, without its one, a pole lies at zero at standstill (dot): nothing could be "
        "proved. P1 (26).",
        "Two panels, longitudinal and lateral. Corrected poles stay below zero; the printed ones reach zero at "
        "standstill.",
        figure,
    )


def lyapunov_figure() -> Drawing:
    """Growth rate of V over wheel speed in four readings of (29), (41)."""
    figure, axes = canvas(7.2, 3.6, 1, 2, sharex=True)
    omega = grid(0.0, STATED_SPEED, 721)
    for ax, direction, number in zip(axes[0], DIRECTIONS, ("(29)", "(41)"), strict=True):
        for reading, colour, dash, width in LINES:
            offered = certificate(direction, reading)
            ax.plot(omega, offered.growth(omega), color=colour, linestyle=dash, linewidth=width, label=NAMES[reading])
            if reading == "dual":
                ends = [end for span in offered.judgement().intervals for end in span if 0.0 < end < STATED_SPEED]
                ax.plot(ends, [0.0] * len(ends), "o", color=colour, markersize=5)
                for end in ends:
                    ax.annotate(f"{end:.1f}", (end, 0.0), (-6, 6), textcoords="offset points", ha="right", fontsize=8)
        ax.axhline(0.0, color="0.1", linewidth=0.8)
        ax.axvline(DESIGN_SPEED, color=GREY, linewidth=0.8, linestyle=DASHES[2])
        ax.set_yscale("symlog", linthresh=10.0)
        ax.set_yticks([-1e3, -1e2, -10.0, 0.0, 10.0, 1e2, 1e3, 1e5, 1e7])
        ax.set_ylim(-2e3, 5e7)
        label(ax, SPEED, "largest growth rate of V [1/s]", f"{direction}, {number}")
        ax.set_xlim(0.0, STATED_SPEED)
    legend(figure)
    return Drawing(
        "printed-lyapunov",
        "Largest growth rate of V along the error dynamics, over both bounds of the wheel acceleration (±800 "
        "rad/s²), for the printed Lyapunov matrices in four readings; below zero the matrix proves stability at "
        "that wheel speed. Logarithmic beyond ±10 1/s. Dots: exact ends of the dual reading. Dotted line: "
        f"{DESIGN_SPEED:g} rad/s, the end of the design range. As printed (41) holds on 0.03 rad/s, too little to "
        "see. P1 (28), (29), (40), (41).",
        "As printed both matrices give growth rates of 1e5 to 1e7 per second; the dual reading is negative over "
        "the whole range longitudinally, and up to 162 rad/s laterally.",
        figure,
    )


def box_figure(points: int = 81) -> Drawing:
    """Slowest frozen pole over the plane of gains, with the printed boxes."""
    figure, axes = canvas(7.2, 3.6, 1, 2)
    for ax, direction in zip(axes[0], DIRECTIONS, strict=True):
        box, gains = printed_box(direction), printed_gains(direction)
        wide = tuple((low - 0.6 * (high - low), high + 0.6 * (high - low)) for low, high in box)
        first, second = gain_grid(wide, points)
        slowest = slowest_poles(direction, first, second, speeds=46)
        steps = [-200.0, -100.0, -50.0, -25.0, 0.0] if direction == "longitudinal" else [-10.0, -5.0, -2.5, -1.0, 0.0]
        ax.contourf(first, second, slowest, levels=[0.0, max(1.0, slowest.max())], colors=[FORBIDDEN])
        lines = ax.contour(first, second, slowest, levels=steps, colors=["0.25"], linewidths=0.9, linestyles="solid")
        ax.clabel(lines, fmt="%g", fontsize=7)
        (left, right), (low, high) = box
        ax.add_patch(
            Rectangle(
                (left, low), right - left, high - low, fill=False, edgecolor=BLUE, linewidth=1.8, label="printed box"
            )
        )
        ax.plot(*gains, "o", color=RED, label="printed gains")
        label(ax, "L₁ [m/s]", "L₂ [m/s²]", direction)
        ax.grid(False)
    legend(figure)
    return Drawing(
        "gain-boxes",
        f"Slowest pole in 1/s (largest real part over wheel speeds from 0 to {STATED_SPEED:g} rad/s) over the plane "
        "of constant gains; shaded: unstable at some wheel speed. The printed boxes lie well inside the stable "
        "region; one constant Lyapunov matrix proves each of them, exactly. P1, text after (28) and (40).",
        "Contour maps of the slowest pole with the printed gain boxes inside the stable region.",
        figure,
    )
