"""Where the model of P4 is observable, and two motions that measure the same."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from studies.papers.ekf_ukf_lateral.observability import sight, substitute_car
from studies.papers.ekf_ukf_lateral.twins import twins
from studies.plots.colours import BLUE, GREEN, PURPLE, RED
from studies.study import Drawing

FLOOR = 1e-17  # singular values below rounding are drawn here
OUTPUTS = (("yaw rate [0.1 rad/s]", 0, 10.0), ("acceleration [m/s²]", 3, 1.0))


def rank_map(points: int = 161) -> Drawing:
    """Singular values over steering angle and speed."""
    figure = Figure(figsize=(9.2, 3.9), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.15, 1.0))
    degrees = np.linspace(-8.0, 8.0, points)
    angle = np.radians(degrees)
    right_y, printed = sight(angle, np.array(20.0)).relative, sight(angle, np.array(20.0), printed=True).relative
    for values, label, style in (
        (right_y[:, 6], "7th, y₄ corrected", {"color": BLUE, "lw": 1.8}),
        (right_y[:, 7], "8th, y₄ corrected", {"color": BLUE, "lw": 1.4, "ls": ":"}),
        (printed[:, 7], "8th, y₄ as printed", {"color": RED, "lw": 1.4, "ls": "--"}),
    ):
        left.semilogy(degrees, np.maximum(values, FLOOR), label=label, **style)
    left.axhspan(FLOOR / 3, 1e-14, color="0.5", alpha=0.15, lw=0)
    left.text(0.98, 0.04, "zero up to rounding", ha="right", va="bottom", transform=left.transAxes, fontsize=8)
    left.set_ylim(FLOOR / 3, 1e-1)
    left.set_xlabel("steering angle of the front wheels [deg]")
    left.set_ylabel("singular value / largest [1]")
    left.set_title("at 20 m/s, steering held", loc="left")
    left.legend(loc="center right")
    speed = np.geomspace(1.0, 40.0, max(points // 3, 12))
    field = sight(angle[None, :], speed[:, None]).relative[..., 6]
    mesh = right.pcolormesh(
        degrees, speed, np.log10(np.maximum(field, 1e-9)), shading="gouraud", cmap="viridis", vmin=-7
    )
    mesh.set_rasterized(True)
    right.axvline(0.0, color=RED, lw=1.6)
    right.annotate(
        "rank 6", (0.0, 3.0), (2.2, 2.0), color="white", fontsize=9, arrowprops={"arrowstyle": "->", "color": "white"}
    )
    right.text(-7.5, 22.0, "rank 7", color="white", fontsize=9)
    right.set_yscale("log")
    right.set_yticks([1, 2, 5, 10, 20, 40], ["1", "2", "5", "10", "20", "40"])
    right.minorticks_off()
    right.grid(visible=False)
    right.set_xlabel("steering angle of the front wheels [deg]")
    right.set_ylabel("speed [m/s]")
    right.set_title("7th singular value, y₄ corrected", loc="left")
    figure.colorbar(mesh, ax=right, label="log₁₀ (value / largest) [1]", pad=0.02)
    return Drawing(
        "observability",
        "Observability of the eight-state model in a left bend (yaw rate 0.25 rad/s, forces 1.1 to 2.2 kN): "
        "singular values of the gradients of the four outputs and of their first derivatives, states and outputs "
        "in typical sizes. Left: the eighth value is zero at every steering angle, so the rank is 7, not 8; the "
        "seventh vanishes at zero steering, rank 6. Only with y₄ as misprinted in (12) is the eighth value not "
        "zero. Right: the seventh value over steering angle and speed; speed moves it little, steering decides.",
        "Left: three curves over the steering angle; one stays at rounding level, two drop sharply at zero "
        "steering. Right: colour map over steering angle and speed with a dark vertical valley at zero steering.",
        figure,
    )  # fmt: skip


def twin_motions() -> Drawing:
    """Two starts with another rear split: forces differ, outputs do not."""
    run, car = twins(), substitute_car()
    figure = Figure(figsize=(9.6, 3.7), layout="constrained")
    axes = figure.subplots(1, 3)
    styles = (("first", "-", 2.6), ("second", "--", 1.4))
    for k, (name, dashes, width) in enumerate(styles):
        for wheel, color in ((5, BLUE), (6, RED)):
            label = f"rear {'left' if wheel == 5 else 'right'}, {name} motion"
            axes[0].plot(run.time, run.states[:, k, wheel] / 1e3, color=color, ls=dashes, lw=width, label=label)
        for (what, column, factor), color in zip(OUTPUTS, (GREEN, PURPLE), strict=True):
            values = factor * run.outputs[:, k, column]
            axes[1].plot(run.time, values, color=color, ls=dashes, lw=width, label=f"{what}, {name}")
    axes[0].set_ylabel("lateral force [kN]")
    axes[0].set_title("not measured: rear forces", loc="left")
    axes[0].set_ylim(top=3.4)
    axes[1].set_ylabel("measured [see legend]")
    axes[1].set_title("measured: the motions coincide", loc="left")
    axes[1].set_ylim(top=9.5)
    split = np.abs(np.diff(run.states[:, :, 5], axis=1)[:, 0])
    seen = np.abs(np.diff(run.outputs, axis=1)[:, 0]).max(axis=1)
    lag = np.exp(-run.time * 20.0 / car.rear_relaxation)
    axes[2].semilogy(run.time, np.maximum(split / split[0], FLOOR), color=BLUE, lw=2.6, label="rear left force / 800 N")
    axes[2].semilogy(run.time, lag, color="black", lw=1.0, ls="--", label="exp(−t V / σ₂)")
    axes[2].semilogy(run.time, np.maximum(seen, FLOOR), ".", color=GREEN, ms=2, label="outputs, largest [SI units]")
    axes[2].set_ylim(FLOOR / 3, 1e4)
    axes[2].set_ylabel("difference of the motions [see legend]")
    axes[2].set_title("their difference", loc="left")
    for axis in axes:
        axis.set_xlabel("time [s]")
        axis.legend(loc="upper right", fontsize=7)
    return Drawing(
        "twins",
        "Two motions of the eight-state model in the same slalom (20 m/s, ±3° at 0.7 Hz) that start with the same "
        "rear axle force and another split of it between left and right. Left: the rear forces differ. Middle: yaw "
        "rate and lateral acceleration do not, nor do the other outputs. Right: the split dies out with V/σ₂ = 40 "
        "1/s by itself while the outputs agree to rounding. So the rear split cannot be observed; what filters "
        "report of it is the tire model's.",
        "Three panels over time: rear forces of two motions that start apart and merge; outputs that coincide; the "
        "difference on a logarithmic scale, a straight line for the force and rounding noise for the outputs.",
        figure,
    )  # fmt: skip
