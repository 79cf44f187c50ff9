"""Readings of the process covariance, the slip threshold, Theorem 1, the appendix, and Table II."""

from __future__ import annotations

import numpy as np
import sympy as sp

from estimators.velocity.high_slip import adaptive_threshold
from studies.papers.longitudinal_speed.appendix import fixed_gain, remainder_errors, setting
from studies.papers.longitudinal_speed.claims_bounds import bounds, worst_runs
from studies.papers.longitudinal_speed.claims_slip import LOWER, RATE, UPPER, VARIANCE, printed_width, threshold
from studies.papers.longitudinal_speed.covariance import MODES, steady_filter
from studies.papers.longitudinal_speed.inputs import printed_numbers, printed_value, sample_time
from studies.papers.longitudinal_speed.unknown_start import STRUCTURES
from studies.plots.colours import BLUE, CURVES, GREY, ORANGE, RED
from studies.report.canvas import DASHES, canvas, label, legend
from studies.study import Drawing


def covariance_figure(points: int = 28) -> Drawing:
    """Velocity gain and slowest time constant over wheel speed for each reading of Q, both modes."""
    figure, axes = canvas(7.2, 3.8, 1, 2, sharex=True)
    speeds = np.linspace(5.0, 140.0, points)
    for structure, colour in zip(STRUCTURES, CURVES, strict=False):
        for mode, dash in zip(MODES, DASHES, strict=False):
            found = [steady_filter(float(w), structure, mode) for w in speeds]
            name = f"S = {structure}, {mode.replace('_', ' ')}"
            axes[0, 0].semilogy(speeds, [f.velocity_gain for f in found], color=colour, linestyle=dash, label=name)
            axes[0, 1].semilogy(speeds, [f.time_constant for f in found], color=colour, linestyle=dash, label=name)
    label(axes[0, 0], "wheel speed [rad/s]", "velocity gain [m/s per unit of μ]")
    label(axes[0, 1], "wheel speed [rad/s]", "slowest time constant [s]")
    legend(figure, ncols=3)
    return Drawing(
        "covariance-readings",
        "Steady Kalman filter of the three-state model for three readings of the printed scalar Q = q S (normal: q "
        "= 2.5e-3, R = 1e-3; high slip: q = 3.3e-4, R = 0.21): gain from the innovation to the velocity, and "
        "slowest time constant without the hidden mode. For S = I both modes coincide. Only S = B B' corrects the "
        "velocity by the force within milliseconds and can be switched down. P2 (20)-(22).",
        "Gains near 1e-3 for the unit matrix, about 0.5 for B B' in the normal mode.",
        figure,
    )


def threshold_figure() -> Drawing:
    """(29) over the variance of the acceleration, as printed and corrected."""
    rate = 100.0
    variance = np.linspace(0.0, 1.5, 301)
    function = sp.lambdify(VARIANCE, threshold(printed_width(LOWER, UPPER), UPPER).subs(RATE, rate), "numpy")
    low, high = float(LOWER), float(UPPER)
    figure, axes = canvas(7.2, 3.2, 1, 2)
    left, right = axes[0]
    left.plot(variance, adaptive_threshold(variance, low, high, rate), color=BLUE, label="corrected")
    for level, name in ((low, "λl"), (high, "λu")):
        left.axhline(level, color=GREY, linestyle=DASHES[2], linewidth=1.0)
        left.annotate(name, (1.45, level), (0, 3), textcoords="offset points", fontsize=8)
    left.set_ylim(0.0, 0.25)
    fine = np.linspace(0.0, 5e-3, 301)
    right.plot(fine, function(fine), color=RED, linestyle=DASHES[1], label="as printed")
    right.axhline(low, color=GREY, linestyle=DASHES[2], linewidth=1.0)
    label(left, "variance of |a| [m²/s⁴]", "slip threshold [1]", "φe = 1/(√(2π) (λu − λl))")
    label(right, "variance of |a| [m²/s⁴]", "slip threshold [1]", "φe as printed (finer axis)")
    return Drawing(
        "slip-threshold",
        f"Threshold (29) of the high-slip detector over the variance of the measured acceleration, λl = {low:g}, λu "
        f"= {high:g}, βe = {rate:g} s⁴/m² (the paper prints no values). Corrected it rises from λl to λu; as "
        "printed it starts at −6.47, so that any slip counts as high.",
        "Left: a curve from 0.05 to 0.2. Right: a curve that starts at minus 6.5.",
        figure,
    )


def theorem_figure() -> Drawing:
    """Worst-sign runs over their bound, and the ultimate bound over xi."""
    runs = worst_runs()
    share = runs.size / bounds(runs)
    figure, axes = canvas(7.2, 3.4, 1, 2)
    left, right = axes[0]
    left.plot(runs.time, share[:, ::5], color=BLUE, linewidth=0.5, alpha=0.35)
    left.plot(runs.time, share.max(axis=1), color=RED, linewidth=1.5, label="largest of 200 runs")
    left.axhline(1.0, color="0.1", linewidth=0.9)
    left.set_ylim(0.0, 1.08)
    label(left, "time [s]", "|e| over the bound of Theorem 1 [1]")
    legend(left, loc="lower right")
    xi = np.linspace(0.02, 0.98, 193)
    right.plot(xi, 0.5 / np.sqrt(xi * (1.0 - xi)), color=BLUE)
    right.axhline(1.0, color=GREY, linestyle=DASHES[2])
    right.plot(0.5, 1.0, "o", color=RED, markersize=5)
    right.set_ylim(0.0, 4.0)
    label(right, "ξ [1]", "ultimate bound over the attained b/K [1]")
    return Drawing(
        "theorem-1",
        "Left: wheel speed error of the unknown-input observer in 200 random runs (K, b, start, ξ) with the "
        "disturbance always pushing outward, as a share of Theorem 1's bound (every fifth run thin); none reaches "
        "one. Right: the ultimate bound over the error b/K that a constant force leaves: ξ = 1/2 is sharp. P2 (9).",
        "Left: thin lines below one. Right: a curve with its minimum one at one half.",
        figure,
    )


def appendix_figure() -> Drawing:
    """(A4) with and without Q, and the error of (A8) with both signs."""
    s = setting()
    fixed, errors = fixed_gain(s), remainder_errors(s, (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6))
    figure, axes = canvas(7.2, 3.4, 1, 2)
    left, right = axes[0]
    time = sample_time() * np.arange(1, len(fixed.printed) + 1)
    left.semilogy(time, fixed.corrected / fixed.filter, color=BLUE, label="(A4) with + Q")
    left.semilogy(time, fixed.summed / fixed.filter, color=ORANGE, linestyle=DASHES[2], linewidth=2.2, label="(A5)")
    left.semilogy(time, fixed.printed / fixed.filter, color=RED, linestyle=DASHES[1], label="(A4) as printed")
    label(left, "time [s]", "trace over that of the filter [1]")
    legend(left)
    sizes = np.array(list(errors))
    right.loglog(sizes, [e[0] for e in errors.values()], "s--", color=RED, markersize=4, label="+ T/ψ, as printed")
    right.loglog(sizes, [e[1] for e in errors.values()], "o-", color=BLUE, markersize=4, label="− T/ψ")
    label(right, "size of the remainder S over N [1]", "relative error of (A8) [1]")
    legend(right)
    return Drawing(
        "appendix",
        "Left: trace of the fixed-gain covariance at 40 rad/s, started at four times that of the filter. Without + "
        "Q, (A4) falls below the covariance that it is meant to bound; with it, it is (A5). Right: first-order "
        "remainder (A8) against the exact difference of two Riccati steps: with the printed sign it does not "
        "converge.",
        "Left: two lines end at one, the printed one keeps falling. Right: one error falls with the size, the "
        "other stays near one.",
        figure,
    )


def table_figure() -> Drawing:
    """Table II: force errors of both observers, beside the limit of the text."""
    numbers = printed_numbers()
    rows, names = numbers["table_2_forces"]["rows"], numbers["table_2_forces"]["drives"]
    limit = float(printed_value("P2-tab2")["ukf"])
    figure, axes = canvas(7.2, 3.6, 1, len(names), sharey=True)
    places = np.arange(len(rows))
    for k, (ax, name) in enumerate(zip(axes[0], names, strict=True)):
        for i, (observer, colour, hatch) in enumerate((("UKF", BLUE, ""), ("unknown-input observer", ORANGE, "//"))):
            values = [row[1 + 2 * k + i] for row in rows]
            ax.bar(places + 0.4 * (i - 0.5), values, 0.38, color=colour, hatch=hatch, edgecolor="white", label=observer)
        worse = [j for j, row in enumerate(rows) if row[2 + 2 * k] < row[1 + 2 * k]]
        ax.plot(
            places[worse],
            [rows[j][1 + 2 * k] + 0.35 for j in worse],
            "v",
            color=RED,
            markersize=5,
            label="UKF is worse",
        )
        ax.axhline(limit, color=GREY, linestyle=DASHES[1], linewidth=1.2, label=f"{limit:g} %, the text on the UKF")
        ax.set_xticks(places, [row[0] for row in rows], rotation=30, ha="right", fontsize=8)
        ax.grid(axis="x", visible=False)
        label(ax, "", "normalised force error [%]" if k == 0 else "", name.replace(", ", ",\n", 1))
    for ax in axes[0]:
        ax.title.set_fontsize(8)
    legend(figure)
    return Drawing(
        "table-2",
        "Longitudinal force errors of Table II as the paper prints them (three drives on the road, four corners), "
        "with the limit that the text states for the UKF. In the three marked cells of twelve the simpler observer "
        "is better.",
        "Grouped bars per corner for three drives; three red marks over pairs whose second bar is lower.",
        figure,
    )
