"""Observability of the velocity models over wheel speed, axle weights, and the errors of Table III."""

from __future__ import annotations

import numpy as np
import sympy as sp

from analysis.observability import observability_matrix
from analysis.rank_loss import rank_loss
from estimators.velocity.mapping import SlipWeights
from studies.papers.corner_estimation.claims_accuracy import VX, VY
from studies.papers.corner_estimation.inputs import (
    DIRECTIONS,
    STATED_SPEED,
    corner_model,
    printed_numbers,
    printed_value,
)
from studies.plots.colours import BLUE, GREY, ORANGE, RED
from studies.report.canvas import DASHES, canvas, grid, label, legend
from studies.study import Drawing
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray

RATE = 800.0  # rad/s^2


def velocity_determinant(direction: Direction, omega: FloatArray, rate: float) -> FloatArray:
    """det O_2 of the time-varying observability matrix over its value at rest, (g,)."""
    matrix = observability_matrix(corner_model(direction))
    (determinant,) = matrix.minors()
    names = [sp.Symbol("wheel_speed"), sp.Symbol("wheel_speed_rate")]
    function = sp.lambdify(names, determinant, "numpy")
    return np.asarray(function(omega, rate) / function(0.0, 0.0) * np.ones_like(omega))


def lost_speeds(direction: Direction) -> list[float]:
    """Constant wheel speeds in the stated range at which rank is lost, rad/s; exact roots, rounded to floats."""
    return [
        float(root) for root in rank_loss(observability_matrix(corner_model(direction))).roots_inside("wheel_speed")
    ]


def observability_figure() -> Drawing:
    """Where the measured force says nothing of the bristle deflection."""
    figure, axes = canvas(7.2, 3.4, 1, 2, sharey=True)
    omega = grid(0.0, STATED_SPEED, 361)
    for ax, direction in zip(axes[0], DIRECTIONS, strict=True):
        slow, fast = (velocity_determinant(direction, omega, rate) for rate in (-RATE, RATE))
        ax.fill_between(
            omega, slow, fast, color=BLUE, alpha=0.2, linewidth=0, label=f"wheel acceleration within ±{RATE:g} rad/s²"
        )
        still = velocity_determinant(direction, omega, 0.0)
        ax.plot(omega, still, color=BLUE, label="constant wheel speed")
        ax.axhline(0.0, color="0.1", linewidth=0.8)
        for root in lost_speeds(direction):
            ax.plot(root, 0.0, "o", color=RED, markersize=5)
            ax.annotate(f"{root:.1f} rad/s", (root, 0.0), (6, 8), textcoords="offset points", fontsize=8)
        ax.set_xlim(0.0, STATED_SPEED)
        ax.set_xticks([0, 45, 90, 135, 180])
        label(ax, "wheel speed [rad/s]", "determinant over its value at rest [1]", direction)
    legend(figure)
    return Drawing(
        "velocity-observability",
        "Determinant of the time-varying observability matrix of the velocity models, over its value at rest. "
        "Laterally it vanishes inside the operating range (dot: constant wheel speed); the bristle deflection is "
        "hidden there, and decays by itself. Derived from P1 (22), (23), (36), (37).",
        "Longitudinally the determinant stays positive; laterally it crosses zero near 53 radians per second.",
        figure,
    )


def axle_weight_figure() -> Drawing:
    """The axle weight (34) in both readings, and with the difference of the slips as argument."""
    shipped, threshold = SlipWeights(), 0.1
    slip = grid(0.0, 0.3, 301)
    weight = 0.5 + (shipped.upper - shipped.lower) / np.pi * np.arctan(shipped.sharpness * (slip - threshold))
    corners = np.zeros((len(slip), 4))
    corners[:, 2] = slip  # all of it at the rear
    figure, axes = canvas(4.8, 3.4)
    ax = axes[0, 0]
    ax.plot(slip, weight, color=BLUE, label="W, if i is the front axle")
    ax.plot(slip, 1.0 - weight, color=RED, linestyle=DASHES[1], label="1 − W, if i is the rear axle")
    ax.plot(slip, shipped.front(corners), color=ORANGE, linestyle=DASHES[3], label="argument Σr − Σf instead (ours)")
    ax.axvline(threshold, color=GREY, linewidth=0.8, linestyle=DASHES[2])
    ax.set_ylim(0.0, 1.0)
    label(ax, "slip of the rear axle Σr, front without slip [1]", "weight of the front axle [1]")
    legend(ax, loc="center right")
    return Drawing(
        "axle-weights",
        "Weight of the front axle over the slip of the rear one, as (34) prints it, for both meanings of axle i "
        f"(threshold 0.1, dotted; W between {shipped.lower:g} and {shipped.upper:g}, sharpness "
        f"{shipped.sharpness:g}; the paper prints no values). The printed argument is the same for both axles, so "
        "the formula does not say which of them loses. P1 (34), (35).",
        "Two curves that cross at one half at the threshold, and one that starts at one half without slip.",
        figure,
    )


def table_figure() -> Drawing:
    """Table III beside the limit that the text states."""
    rows = printed_numbers()["table_3"]["rows"]
    limit = float(printed_value("P1-tab3"))
    figure, axes = canvas(7.2, 3.8)
    ax = axes[0, 0]
    places = np.arange(len(rows))[::-1]
    for k, (name, column, colour, hatch) in enumerate((("Vₓ", VX, BLUE, ""), ("Vᵧ", VY, ORANGE, "//"))):
        bars = ax.barh(places + 0.2 - 0.4 * k, [row[column] for row in rows], 0.38, color=colour, hatch=hatch,
                       edgecolor="white", label=name)  # fmt: skip
        ax.bar_label(bars, fmt="%g", fontsize=7, padding=2)
    ax.axvline(limit, color=RED, linewidth=1.2, linestyle=DASHES[1], label=f"{limit:g} %, the text")
    ax.set_yticks(places, [f"{row[0]}: {row[1]}" for row in rows])
    ax.grid(axis="y", visible=False)
    label(ax, "normalised error as printed [%]", "drive [as in Table III]")
    legend(figure)
    return Drawing(
        "table-3",
        "Velocity errors of Table III as the paper prints them (NRMS (46), eight drives on the road), beside the "
        "limit that its text states for all of them. Two lateral values of the rear-driven car exceed it.",
        "Bars per drive; two lateral bars, 7.6 and 7.15 percent, pass the line at 6.3 percent.",
        figure,
    )
