"""The force observer of P5: convergence, chatter at 100 Hz, and the widths that avoid it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.bounds_sliding_mode import OUTPUTS, PUBLISHED, smallest_zone_widths
from studies.papers.smo_ekf_sideslip.claims_gains import FINE
from studies.papers.smo_ekf_sideslip.claims_sampling import NARROW, SAMPLE_TIME, WIDE, radius
from studies.papers.smo_ekf_sideslip.error_motion import CAR, LARGEST, error_motion, split, split_tracking
from studies.plots.colours import BLUE, GREEN, ORANGE, RED
from studies.study import Drawing

RATE = 3.44  # 1/s, (A.12)


def convergence() -> Drawing:
    """The four Lyapunov functions' errors from the worst start, bare sign at a fine step."""
    path = error_motion(LARGEST * [0.5, 1.0, -1.0, 1.0], 1.2, FINE)
    time = FINE * np.arange(1, len(path) + 1)
    moment = np.abs(split(path)) / 1e3
    figure = Figure(figsize=(9.2, 3.7), layout="constrained")
    left, right = figure.subplots(1, 2)
    thin = slice(None, None, 20)
    for values, label, color in (
        (path[:, 1], "front lateral", BLUE),
        (path[:, 2], "rear lateral", RED),
        (path[:, 1] + path[:, 2], "their sum", "black"),
        (path[:, 3], "longitudinal", GREEN),
    ):
        left.plot(time[thin], values[thin] / 1e3, color=color, lw=1.5, label=label)
    left.set_ylabel("force error [kN]")
    left.set_xlabel("time [s]")
    left.legend()
    right.semilogy(time[thin], moment[thin], color=BLUE, lw=1.6, label="|L₁x₂ − L₂x₃| simulated")
    start = moment[np.searchsorted(time, 0.2)]
    right.semilogy(time[thin], start * np.exp(-RATE * (time[thin] - 0.2)), color="black", ls="--", lw=1.0,
                   label=f"exp(−{RATE:g} t), (A.12)")  # fmt: skip
    right.axhline(30.0, color=RED, lw=1.0, ls=":", label="limit of (A.4), 30 kN m")
    right.set_ylabel("yaw moment error of the split [kN m]")
    right.set_xlabel("time [s]")
    right.set_ylim(0.1, 60.0)
    right.legend()
    return Drawing(
        "convergence",
        "Error of the sliding-mode observer from the worst start that the printed maxima allow (6.28 kN in front, "
        "−3.66 kN at the rear), printed gains, bare sign at 50 kHz, constant true forces. Left: the sum of the "
        "lateral forces and the longitudinal force are reached within 0.13 s; what remains is a wrong split "
        "between the axles. Right: that split decays at 3.44 1/s, as (A.12) says, and stays below the limit up to "
        "which Omega_1 dominates.",
        "Left: force errors over time; the sum drops to zero at once, front and rear errors decay slowly towards "
        "zero from opposite sides. Right: the split on a logarithmic scale, parallel to a dashed exponential.",
        figure,
    )


def chatter() -> Drawing:
    """Yaw rate and front force error at 100 Hz for the sign and two linear zones."""
    figure = Figure(figsize=(9.2, 4.6), layout="constrained")
    axes = figure.subplots(2, 3, sharex=True, sharey="row")
    start = LARGEST * [0.5, 1.0, -1.0, 1.0]
    cases = ((None, "bare sign"), (WIDE, f"linear zone {WIDE}"), (NARROW, f"linear zone {NARROW}"))
    for column, (widths, title) in enumerate(cases):
        path = error_motion(start, 2.0, SAMPLE_TIME, widths)
        time = SAMPLE_TIME * np.arange(1, len(path) + 1)
        axes[0, column].plot(time, path[:, 0], color=BLUE, lw=1.0)
        axes[1, column].plot(time, path[:, 1] / 1e3, color=RED, lw=1.0)
        axes[0, column].set_title(title, loc="left")
        axes[1, column].set_xlabel("time [s]")
        if widths is not None:
            value = radius(widths)
            state = "stable" if value < 1 else "unstable"
            axes[0, column].text(0.98, 0.95, f"spectral radius {value:.4g}: {state}", ha="right", va="top", fontsize=8,
                                 transform=axes[0, column].transAxes)  # fmt: skip
    axes[0, 0].set_ylabel("yaw rate error [rad/s]")
    axes[1, 0].set_ylabel("front force error [kN]")
    return Drawing(
        "chatter",
        "The same start at 100 Hz with Euler steps: error of yaw rate and front lateral force with the bare sign, "
        "and with linear zones of two widths (rad/s, m/s², m/s²; P5 prints none). The sign chatters by 0.1 rad/s "
        "and several hundred newtons; zones wide enough converge smoothly, zones narrower than gain times half a "
        "sample keep chattering.",
        "Six panels over two seconds: ragged bands for the bare sign and the narrow zone, smooth decay for the "
        "wide zone.",
        figure,
    )


def zone_widths(points: int = 121) -> Drawing:
    """Spectral radius over the widths of the linear zones."""
    figure = Figure(figsize=(9.2, 3.9), layout="constrained")
    axes = figure.subplots(1, 2)
    limits = smallest_zone_widths(PUBLISHED, CAR, SAMPLE_TIME)
    yaw, across = np.geomspace(0.01, 2.0, points), np.geomspace(0.03, 10.0, points)
    field = np.array([[radius((w, a, 1.0)) for w in yaw] for a in across])
    mesh = axes[0].pcolormesh(
        yaw, across, np.log10(np.clip(field, None, 10.0)), cmap="RdBu_r", vmin=-0.3, vmax=0.3, shading="gouraud"
    )
    mesh.set_rasterized(True)
    axes[0].contour(yaw, across, field, levels=[1.0], colors="black", linewidths=1.4)
    _limits(axes[0], limits[OUTPUTS[0]], limits[OUTPUTS[1]])
    for widths, marker, dx, color in ((WIDE, "o", 1.25, "black"), (NARROW, "X", 1.25, "white")):
        axes[0].plot(widths[0], widths[1], marker, color="black", ms=7, mfc="white")
        axes[0].text(widths[0] * dx, widths[1], f"{radius(widths):.3g}", va="center", fontsize=8, color=color)
    axes[0].set_xscale("log")
    axes[0].set_yscale("log")
    axes[0].grid(visible=False)
    axes[0].set_xlabel("width of the yaw rate zone [rad/s]")
    axes[0].set_ylabel("width of the lateral acceleration zone [m/s²]")
    figure.colorbar(mesh, ax=axes[0], label="log₁₀ of the spectral radius [1]", pad=0.02)
    slow = np.array([radius((w, 1.0, 1.0)) for w in yaw])
    axes[1].semilogx(yaw, slow, color=BLUE, lw=1.6, label="spectral radius at 1 m/s²")
    axes[1].axhline(1.0, color="black", lw=0.8)
    axes[1].axhline(
        np.exp(-RATE * SAMPLE_TIME), color=GREEN, ls="--", lw=1.0, label="sliding motion, exp(−3.44 · 0.01)"
    )
    axes[1].axvline(limits[OUTPUTS[0]], color="0.5", ls=":", lw=1.0)
    critical = PUBLISHED[1] / (4.0 * RATE)
    axes[1].axvline(critical, color=RED, ls=":", lw=1.0)
    axes[1].text(critical * 0.94, 1.045, f"critical damping\n{critical:.2f} rad/s", color=RED, fontsize=8, ha="right")
    axes[1].set_xlim(yaw[0], yaw[-1])
    axes[1].set_ylim(0.9, 1.1)
    axes[1].set_xlabel("width of the yaw rate zone [rad/s]")
    axes[1].set_ylabel("spectral radius [1]")
    axes[1].legend(loc="upper right")
    return Drawing(
        "zone-widths",
        "Spectral radius of the observer error inside the linear zones at 100 Hz (longitudinal zone 1 m/s²). Left: "
        "black line radius 1, red unstable; dotted: the limits of each loop alone, Omega_1 T/2 = 0.05 rad/s and "
        "(Omega_5 + Omega_8) T/(2m) = 0.32 m/s². Circle: the widths used here; cross: a pair that chatters. Right: "
        "cut at 1 m/s²; above the limit the split decays at least as fast as in the sliding motion, fastest at "
        "critical damping, Omega_1² I_z / (4 Omega_4 (L_1 + L_2)); wider zones are sluggish.",
        "Left: map with a rectangular unstable region at small widths. Right: curve of the spectral radius that "
        "dips below one above 0.05 rad/s.",
        figure,
    )


def tracking() -> Drawing:
    """How well the split is followed while the true forces move."""
    figure = Figure(figsize=(9.2, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True)
    frequency = np.geomspace(0.02, 5.0, 200)
    span = CAR.front_axle_distance + CAR.rear_axle_distance
    for width, color in ((0.05, ORANGE), (WIDE[0], BLUE), (0.7, GREEN)):
        share = split_tracking(frequency, width)
        left.loglog(frequency, share, color=color, lw=1.5, label=f"yaw rate zone {width:g} rad/s")
        force = CAR.yaw_inertia * 2.0 * np.pi * frequency * LARGEST[0] * share / span
        right.loglog(frequency, force, color=color, lw=1.5)
    left.loglog(
        frequency, 2.0 * np.pi * frequency / RATE, color="black", ls="--", lw=1.0, label="2πf / 3.44, slow motion"
    )
    left.set_ylim(0.02, 3.0)
    left.set_ylabel("split error / true split [1]")
    right.set_ylim(5.0, 2e4)
    right.set_ylabel("amplitude of the error of each axle force [N]")
    for axis in (left, right):
        axis.set_xlabel("frequency of the slalom [Hz]")
        ticks = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5)
        axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        axis.minorticks_off()
    left.legend(loc="lower right")
    for value, name in ((0.041 * LARGEST[1], "4.1 % of F_y1"), (0.022 * LARGEST[2], "2.2 % of F_y2")):
        amplitude = 0.5 * np.pi * value  # of a sine with this mean size
        right.axhline(amplitude, color=RED, ls=":", lw=1.1)
        right.text(5.0, amplitude * 0.9, f"mean {name} (Table 1)", color=RED, fontsize=8, ha="right", va="top")
    return Drawing(
        "tracking",
        "What the proof of Appendix A leaves out: true forces that move. Left: share of the front-rear split that "
        "the observer misses in steady oscillation, printed gains, linear zones of three widths. Slow motion is "
        "followed with a lag of 0.29 s whatever the width. Right: the force error that follows on both axles for "
        "the printed largest yaw rate (33.6 deg/s; the split is yaw inertia times yaw acceleration). The means of "
        "Table 1 (red) belong to a slalom slower than about 0.25 Hz by this bound; the paper prints neither speed "
        "nor period.",
        "Left: three curves of the relative error rising with frequency to about one. Right: force error rising "
        "with the square of the frequency, crossed by two red lines.",
        figure,
    )


def _limits(axis: Axes, yaw: float, across: float) -> None:
    axis.axvline(yaw, color="0.25", ls=":", lw=1.2)
    axis.axhline(across, color="0.25", ls=":", lw=1.2)
