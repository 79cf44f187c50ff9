"""Errors of the force observer, sigma point weights, observability of the lateral forces, vertical loads."""

from __future__ import annotations

import numpy as np
import sympy as sp

from analysis.bounds import force_observer_bound
from analysis.loads import vertical_loads
from studies.papers.corner_estimation.claims_filter import SIZES, STEER, determinants
from studies.papers.corner_estimation.claims_forces import DISTURBANCE_RATE, STEP, force_errors
from studies.papers.corner_estimation.inputs import FORCE_GAINS, PRINTED_GRAVITY, parameters
from studies.papers.corner_estimation.sigma_points import weights
from studies.report.canvas import DASHES, canvas, grid, label, legend
from studies.report.colours import BLUE, CURVES, GREY, RED
from studies.study import Drawing


def observer_error_figure() -> Drawing:
    """Force error against the bound of Proposition 1, and the wheel speed error that delays it."""
    errors = force_errors()
    bound = force_observer_bound(FORCE_GAINS[2], DISTURBANCE_RATE).ultimate
    figure, axes = canvas(7.2, 3.6, 1, 2)
    left, right = axes[0]
    for k, name in enumerate(errors.names):
        left.plot(errors.time, errors.force[:, k], color=CURVES[k], linewidth=1.4, linestyle=DASHES[k], label=name)
    left.axhspan(-bound, bound, color=GREY, alpha=0.18, linewidth=0, label=f"±{bound:.3f} N, the bound")
    left.set_xlim(0.0, 6.0)
    left.set_ylim(-4.0, 6.0)
    label(left, "time [s]", "force error [N]")
    right.plot(errors.time, errors.wheel_speed, color=BLUE, linewidth=1.0)
    label(right, "time [s]", "virtual wheel speed error [rad/s]")
    right.set_xlim(0.0, 40.0)
    legend(figure)
    return Drawing(
        "force-observer-error",
        "Left: first seconds of the error of the longitudinal force observer with the printed gains, started 1 "
        f"rad/s and 30 N off (cut off), under three disturbances whose slope stays within {DISTURBANCE_RATE:g} N/s. "
        "Right: error of its virtual wheel speed, which pushes the force error a little over the bound until it "
        "has died out. Behind that the bound holds, and the ramp attains it. P1 (3)-(8), Proposition 1.",
        "Left: force errors fall within 0.1 s to about two newtons and follow the disturbance. Right: an "
        "oscillation of 2.6 rad/s that takes 30 seconds to decay.",
        figure,
    )


def observer_noise_figure() -> Drawing:
    """Frequency response of the force estimate to the wheel equation as implemented, (1 + a - 1/z)/(1 - (1 - a)/z)."""
    a = FORCE_GAINS[2] * STEP
    frequency = np.geomspace(0.1, 0.5 / STEP, 400)
    z = np.exp(2j * np.pi * frequency * STEP)
    gain = np.abs((1.0 + a - 1.0 / z) / (1.0 - (1.0 - a) / z))
    figure, axes = canvas(4.8, 3.2)
    ax = axes[0, 0]
    ax.semilogx(frequency, gain, color=BLUE)
    ax.axhline(
        (2.0 + a) / (2.0 - a), color=GREY, linestyle=DASHES[1], label=f"(2 + a)/(2 − a) = {(2 + a) / (2 - a):.3f}"
    )
    ax.set_ylim(0.9, 1.4)
    label(ax, "frequency [Hz]", "gain from (T − I dω/dt)/R to the force [1]")
    legend(ax, loc="upper left")
    return Drawing(
        "force-observer-noise",
        "Gain of the force observer as the paper implements it (200 Hz, integral of the equation's force minus the "
        f"last estimate, a = η₃ Ts = {a:.3f}), started at the measured wheel speed: it smooths nothing and "
        "amplifies the fastest noise, so the wheel acceleration must come filtered. P1 (2) and its implementation "
        "note.",
        "The gain is one at low frequency and rises to 1.29 at 100 hertz.",
        figure,
    )


def weight_figure() -> Drawing:
    """Sums of sigma point weights, printed against corrected."""
    figure, axes = canvas(4.8, 3.0)
    ax = axes[0, 0]
    for k, (form, colour, hatch) in enumerate((("printed", RED, "//"), ("corrected", BLUE, ""))):
        totals = [float(weights(n, form).total) for n in SIZES]  # type: ignore[arg-type]
        places = np.arange(len(SIZES)) + 0.38 * (k - 0.5)
        bars = ax.bar(places, totals, 0.36, color=colour, alpha=0.85, hatch=hatch, edgecolor="white",
                      label={"printed": "W = (N + η)/2, as printed", "corrected": "W = 1/(2 (N + η))"}[form])  # fmt: skip
        ax.bar_label(bars, [str(weights(n, form).total) for n in SIZES], fontsize=8, padding=2)  # type: ignore[arg-type]
    ax.axhline(1.0, color="0.1", linewidth=0.9)
    ax.set_xticks(np.arange(len(SIZES)), ["N = 3, lateral forces (P1)", "N = 1, wheel force (P2)"])
    ax.grid(axis="x", visible=False)
    label(ax, "", "sum of the mean weights [1]")
    legend(ax)
    return Drawing(
        "sigma-weights",
        "What the sigma point weights of the mean add up to, as printed and corrected, in both papers; the line "
        "marks one, without which every predicted mean is off by that factor. P1 section 3, P2 section 3.",
        "Bars: the printed weights add up to 9 for three states and 11/3 for one, the corrected ones to 1.",
        figure,
    )


def force_observability_figure() -> Drawing:
    """det C(delta) of the lateral force model over the steering angle."""
    values = {sp.Symbol(name): q.value for name, q in parameters().vehicle.items()}
    function = sp.lambdify(STEER, determinants()[0].subs(values), "numpy")
    degrees = np.geomspace(0.05, 35.0, 200)
    size = np.abs(function(np.deg2rad(degrees)))
    full = abs(float(function(np.pi / 2)))
    figure, axes = canvas(4.8, 3.2)
    ax = axes[0, 0]
    ax.loglog(degrees, size / full, color=BLUE)
    for angle in (0.02, 0.08):
        share = abs(float(function(angle))) / full
        ax.plot(np.rad2deg(angle), share, "o", color=RED, markersize=4)
        ax.annotate(
            f"{angle:g} rad: {share:.1e}", (np.rad2deg(angle), share), (8, -10), textcoords="offset points", fontsize=8
        )
    label(ax, "steering angle [deg]", "determinant, share of its value at 90° [1]")
    return Drawing(
        "force-observability",
        "Determinant of the output matrix of the lateral force model (outputs a_x, a_y and yaw acceleration) over "
        "the steering angle: it falls with the square of the sine and is zero straight ahead, where the right-left "
        "difference of the front forces cannot be seen. P1 (10), (12).",
        "A straight line of slope two on logarithmic axes: four ten-thousandths of its largest value at 0.02 radians.",
        figure,
    )


def load_figure() -> Drawing:
    """Corner loads over lateral and longitudinal acceleration."""
    figure, axes = canvas(7.2, 3.4, 1, 2, sharey=True)
    acceleration = grid(-9.0, 9.0, 73)
    zero = np.zeros_like(acceleration)
    names = ("front left", "front right", "rear left", "rear right")
    for ax, motion, axis in zip(axes[0], ((acceleration, zero), (zero, acceleration)), "xy", strict=True):
        found = vertical_loads(parameters(), *motion, gravity=PRINTED_GRAVITY)
        for name, colour, dash in zip(names, CURVES, DASHES, strict=False):
            ax.plot(
                acceleration, getattr(found, name.replace(" ", "_")) / 1e3, color=colour, linestyle=dash, label=name
            )
        ax.axhline(0.0, color="0.1", linewidth=0.8)
        label(
            ax,
            f"a{'ₓ' if axis == 'x' else 'ᵧ'} [m/s²]",
            "vertical load [kN]",
            f"{'longitudinal' if axis == 'x' else 'lateral'} acceleration",
        )
    legend(figure)
    return Drawing(
        "vertical-loads",
        "Vertical load of each corner over one acceleration at a time, level car of Table I, no body angles. Left "
        "lines lie on right ones for longitudinal acceleration. Below zero the formulas no longer apply: the wheel "
        "has lifted. P1 (15), (17).",
        "Loads change linearly: 518 newtons per axle and metre per second squared longitudinally, 457 and 471 per "
        "side laterally.",
        figure,
    )
