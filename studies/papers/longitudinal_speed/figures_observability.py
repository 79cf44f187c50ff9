"""Fig. 1 (rank of the gramian), the determinant of (24), and Figs 2 and 3 (both tests for an unknown start)."""

from __future__ import annotations

import numpy as np
import sympy as sp

from analysis.gramians import growing_observability
from studies.papers.longitudinal_speed.claims_observability import ACCELERATION, JERK, speed_observability
from studies.papers.longitudinal_speed.inputs import (
    TYPICAL,
    WheelRecord,
    accelerating,
    braking,
    constant,
    launch,
    printed_value,
    sample_time,
    slalom,
)
from studies.papers.longitudinal_speed.unknown_start import RAMP, SPEEDS, both_tests, two_states
from studies.plots.colours import BLUE, CURVES, GREEN, GREY, ORANGE, PURPLE, RED
from studies.report.canvas import DASHES, canvas, label, legend
from studies.study import Drawing
from synthesis.polynomials.matrix import FloatArray

RANK_TOLERANCE = 1e-12  # singular values of the gramian's factor, over the largest, states in their typical sizes


def drives() -> tuple[WheelRecord, ...]:
    """Wheel speed histories of the kinds that Fig. 1 covers, 6 s each; constant speed is ours."""
    return launch(2.0, 6.0), slalom(45.0, 4.0, 0.5, 6.0), braking(80.0, 25.0, 6.0), constant(40.0, 1200)


def gramian_rank(record: WheelRecord) -> np.ndarray[tuple[int], np.dtype[np.int_]]:
    """rank V(0, N) for every N."""
    return growing_observability(record.sequence.A, record.sequence.C, TYPICAL).rank(RANK_TOLERANCE)


def rank_figure() -> Drawing:
    """Wheel speed and rank of V(0, N) over time."""
    figure, axes = canvas(7.2, 4.4, 2, 1, sharex=True)
    top, bottom = axes[:, 0]
    for k, record in enumerate(drives()):
        style = {"color": CURVES[k], "linestyle": DASHES[k], "label": record.name}
        top.plot(record.time, record.speed, **style)
        bottom.step(record.time, gramian_rank(record) + 0.05 * (k - 1.5), where="post", **style)
    label(top, "", "wheel speed [rad/s]")
    label(bottom, "time [s]", "rank of V(0, N) [1]")
    bottom.set_yticks([1, 2, 3])
    bottom.set_ylim(0.7, 3.4)
    top.set_xlim(0.0, 6.0)
    legend(figure)
    return Drawing(
        "gramian-rank",
        "Wheel speed histories (above) and numerical rank of the observability gramian over all samples so far "
        f"(below, lines a little apart; tolerance {RANK_TOLERANCE:g} of the largest singular value of its factor, "
        "states in typical sizes). Full rank comes once the wheel changes its speed: not while it stands, and not "
        "at constant speed. Fig. 1 and (A1) of P2, on histories of our own.",
        "The rank is two during the two seconds of standstill and for constant speed, three otherwise.",
        figure,
    )


def determinant_figure(points: int = 201) -> Drawing:
    """Size of det O_3 over wheel speed and acceleration."""
    (determinant,) = speed_observability().minors({JERK: 0})
    function = sp.lambdify([sp.Symbol("wheel_speed"), sp.Symbol(ACCELERATION)], determinant, "numpy")
    speed, acceleration = np.meshgrid(np.linspace(0.0, 140.0, points), np.linspace(-800.0, 800.0, points + 1))
    size = np.abs(function(speed, acceleration)) / abs(float(function(140.0, 800.0)))
    figure, axes = canvas(5.6, 3.6)
    ax = axes[0, 0]
    image = ax.pcolormesh(speed, acceleration, np.log10(size), cmap="Blues", vmin=-5.0, vmax=0.0, rasterized=True)
    ax.axhline(0.0, color=RED, linewidth=1.4, linestyle=DASHES[1])
    ax.annotate("rank 2", (70.0, 0.0), (0, 5), textcoords="offset points", ha="center", fontsize=8, color=RED)
    bar = figure.colorbar(image, ax=ax)
    bar.set_label("log₁₀ of the determinant over its value at the corner [1]", fontsize=8)
    label(ax, "wheel speed [rad/s]", "wheel acceleration [rad/s²]")
    ax.grid(False)
    return Drawing(
        "observability-determinant",
        "Size of the determinant of the time-varying observability matrix (24) over wheel speed and wheel "
        "acceleration, at constant acceleration. It vanishes along the dashed line: at any constant wheel speed "
        "the three-state model is not observable, and near it only weakly.",
        "A map that fades to white along zero acceleration and towards low speed.",
        figure,
    )


def unknown_start_figure() -> Drawing:
    """lambda_max(M) and lambda_max(N) over time in five readings."""
    figure, axes = canvas(7.2, 4.0, 1, 2, sharex=True)
    left, right = axes[0]
    moving = accelerating(SPEEDS[0], RAMP, 40, 80)
    turning = slalom(45.0, 4.0, 0.5, 0.4)
    cases = (
        ("constant 40 rad/s", both_tests(constant(SPEEDS[0], 80)), BLUE, DASHES[0]),
        ("constant 100 rad/s", both_tests(constant(SPEEDS[1], 80)), GREEN, DASHES[1]),
        (moving.name, both_tests(moving), RED, DASHES[3]),
        ("slalom, rank tolerance 1e-9", both_tests(turning), ORANGE, DASHES[2]),
        ("slalom, rank tolerance 1e-2", both_tests(turning, tolerance=1e-2), PURPLE, DASHES[1]),
        ("two states, accelerating", two_states(80), GREY, DASHES[0]),
    )
    for name, found, colour, dash in cases:
        time = sample_time() * np.arange(len(found.M))
        shown = slice(0, round(0.1 / sample_time()) + 1)
        unknown = _cut(found.largest_unknown)
        left.semilogy(time[shown], unknown[shown], color=colour, linestyle=dash, marker=".", markersize=4, label=name)
        known = found.largest_known[1:]
        if found.samples_needed is not None:
            last = found.samples_needed - 1
            left.plot(time[last], unknown[last], "x", color=colour, markersize=9, markeredgewidth=2)
        right.semilogy(
            time[1:][: shown.stop],
            known[: shown.stop],
            color=colour,
            linestyle=dash,
            marker=".",
            markersize=4,
            label=name,
        )
    printed = float(printed_value("P2-test1"))
    left.axvline(printed, color="0.1", linewidth=0.9, linestyle=DASHES[2], label=f"{printed:g} s, Fig. 2")
    left.set_ylim(1e-9, 2.0)
    label(left, "time [s]", "λmax(M), 1 at the start [1]", "test 1: what is still unknown")
    label(right, "time [s]", "λmax(N) [1, states in m and m/s]", "test 2: covariance of what is known")
    left.set_xlim(0.0, 0.1)
    legend(figure, ncols=3)
    return Drawing(
        "unknown-start",
        "Both tests for an initial covariance of which nothing is known (200 Hz, Q = 2.5e-3 I, R = 1e-3). Left: M "
        "ends at exactly zero (the line stops at a cross) after as many samples as states while the wheel "
        "accelerates, and decays for ever at constant speed. Right: N stays bounded, but peaks beyond all use "
        "where nearly silent data is taken as seen; a coarser rank tolerance keeps it small. Figs 2 and 3 of P2, "
        "on wheel speeds of our own.",
        "Left: lines that stop after two or three samples, and two straight decays. Right: peaks between 0.1 and "
        "1e8 that fall off.",
        figure,
    )


def _cut(values: FloatArray) -> FloatArray:
    """Exact zeros are left out: a logarithmic axis has no place for them."""
    return np.where(values > 0.0, values, np.nan)
