"""Figs. 9 to 11 of P5: lateral tire models, and the zones of the filter."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure

from studies.papers.smo_ekf_sideslip.axle_drive import PRINTED_GRAVITY, SAMPLE_TIME, AxleDrive, published_car
from studies.papers.smo_ekf_sideslip.observer_chain import ChainRun
from studies.report.colours import BLUE, GREEN, ORANGE, PURPLE, RED
from studies.study import Drawing
from synthesis.polynomials.matrix import FloatArray

THRESHOLD = 1000.0  # N, lambda_1; not printed
ZONES = (("zones 1, 2: β₁F < 0", RED), ("zones 3, 4: |F| < λ₁", ORANGE), ("zones 5, 6", BLUE))
# Burckhardt's c1, c2, c3 as commonly tabulated (Burckhardt 1993; Kiencke and Nielsen 2005); P5 names the model, not the values.
BURCKHARDT = {
    "dry asphalt": (1.2801, 23.99, 0.52),
    "wet asphalt": (0.857, 33.822, 0.347),
    "dry cobblestone": (1.3713, 6.4565, 0.6691),
    "snow": (0.1946, 94.129, 0.0646),
}


def burckhardt_force(slip: FloatArray, road: str, load: float) -> FloatArray:
    """F_z (c1 (1 - exp(-c2 s)) - c3 s) in N, odd in the slip angle [rad], with s = |tan(slip)|."""
    c1, c2, c3 = BURCKHARDT[road]
    s = np.abs(np.tan(slip))
    return np.asarray(np.sign(slip) * load * (c1 * (1.0 - np.exp(-c2 * s)) - c3 * s))


def zone_of(slip: FloatArray, force: FloatArray, threshold: float = THRESHOLD) -> FloatArray:
    """0 for zones 1 and 2 (slip and force disagree), 1 for zones 3 and 4 (small force), 2 for zones 5 and 6 (P5 section 4)."""
    opposed = slip * force < 0.0
    return np.where(opposed, 0, np.where(np.abs(force) < threshold, 1, 2))


def lateral_models() -> Drawing:
    """Fig. 9: linear, linear adaptive and Burckhardt."""
    car = published_car()
    load = car.mass * PRINTED_GRAVITY * car.rear_axle_distance / (car.front_axle_distance + car.rear_axle_distance)
    slip = np.radians(np.linspace(0.0, 12.0, 241))
    figure = Figure(figsize=(7.2, 4.0), layout="constrained")
    axis = figure.subplots()
    for road, color in zip(BURCKHARDT, (BLUE, ORANGE, GREEN, PURPLE), strict=True):
        axis.plot(
            np.degrees(slip), burckhardt_force(slip, road, load) / 1e3, color=color, lw=1.6, label=f"Burckhardt, {road}"
        )
    shown = 10.4  # kN, so that the straight lines end below the legend
    linear = car.front_stiffness * slip / 1e3
    axis.plot(
        np.degrees(slip),
        np.where(linear < shown, linear, np.nan),
        color="black",
        ls="--",
        lw=1.2,
        label="linear, C₁ = 65 kN/rad",
    )
    point = np.radians(6.0)
    secant = float(burckhardt_force(np.array(point), "dry asphalt", load)) / point
    axis.plot(
        np.degrees(slip),
        np.where(secant * slip / 1e3 < shown, secant * slip / 1e3, np.nan),
        color=RED,
        lw=1.2,
        label="linear adaptive, through dry asphalt at 6°",
    )
    axis.plot(6.0, secant * point / 1e3, "o", color=RED, ms=5)
    axis.set_xlim(0, 12)
    axis.set_ylim(0, 13)
    axis.set_xlabel("front slip angle β₁ [deg]")
    axis.set_ylabel("front axle lateral force [kN]")
    axis.legend(loc="upper left", fontsize=7.5, ncols=2)
    return Drawing(
        "lateral-models",
        "Fig. 9 of P5: lateral force of the front axle over its slip angle by the linear model with the printed "
        "stiffness, the linear adaptive model (the secant at the present slip angle) and Burckhardt's model on "
        f"several roads, at the static axle load of {load / 1e3:.1f} kN. P5 prints no Burckhardt values; the common "
        "ones are used. The adaptive model needs no road: its slope follows.",
        "Rising curves of force over slip angle: two straight lines and four saturating curves, snow far below "
        "asphalt.",
        figure,
    )


def zones(drive: AxleDrive, run: ChainRun) -> Drawing:
    """Figs. 10 and 11: the zones in the plane of front slip angle and force, along a slalom, for one setting."""
    car = published_car()
    turn = drive.yaw_rate / drive.speed
    # beta_1 of the estimate from its beta_2: by (11) the two differ by measured quantities alone.
    slip = run.rear_sideslip[:, 0] + drive.steering - (car.front_axle_distance + car.rear_axle_distance) * turn
    force = run.forces[:, 0, 0] * np.cos(drive.steering) - run.forces[:, 0, 2] * np.sin(drive.steering)
    stiffness = run.stiffness[:, 0, 0] / 1e3
    kind = zone_of(slip, force)
    figure = Figure(figsize=(9.2, 4.0), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.1, 1.0))
    for k, (name, color) in enumerate(ZONES):
        left.plot(np.degrees(slip[kind == k]), force[kind == k] / 1e3, ".", color=color, ms=3.5, label=name)
    line = np.array([-5.5, 5.5])
    for value, style, name in (
        (stiffness[0], {"color": "black", "ls": "--"}, "at the start"),
        (stiffness[-1], {"color": GREEN}, "at the end"),
    ):
        left.plot(line, value * np.radians(line), lw=1.2, label=f"(C₁ + ΔC₁) β₁ {name}", **style)
    for sign in (-1, 1):
        left.axhline(sign * THRESHOLD / 1e3, color="0.4", lw=0.9, ls=":")
        left.text(5.4, sign * THRESHOLD / 1e3, f"{'−' if sign < 0 else ''}λ₁", ha="right", va="bottom", fontsize=8)
    left.set_xlim(-5.5, 5.5)
    left.set_ylim(-8, 8)
    left.set_xlabel("estimated front slip angle β₁ [deg]")
    left.set_ylabel("estimated front lateral force [kN]")
    left.legend(loc="upper left", fontsize=7.5)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(kind)) + 1, [len(kind)]])
    for begin, end in pairwise(edges):
        right.axvspan(begin * SAMPLE_TIME, end * SAMPLE_TIME, color=ZONES[int(kind[begin])][1], alpha=0.35, lw=0)
    right.plot(drive.time, stiffness, color="black", lw=1.5)
    right.set_xlim(drive.time[0], drive.time[-1])
    right.set_xlabel("time [s]")
    right.set_ylabel("C₁ + ΔC₁ [kN/rad]")
    right.set_title("stiffness over time; background: zone", loc="left")
    right.grid(visible=False)
    return Drawing(
        "zones",
        "Figs. 10 and 11 of P5 on a model: estimated front lateral force over estimated front slip angle in a "
        "slalom with saturating axles (17 m/s, 0.6 g, noise on yaw rate and accelerations; stiffness set to 1.5 "
        "times the printed one), coloured by the zones that switch the covariances, with the threshold λ₁ = 1 kN "
        "(not printed). Right: the adapted front stiffness moves in zones 5 and 6 and is frozen elsewhere.",
        "Left: a band of points through the origin, red and orange near the axes, blue outside, with two straight "
        "lines. Right: stiffness over time that moves where the background is blue.",
        figure,
    )  # fmt: skip
