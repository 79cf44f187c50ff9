"""The sideslip filter of P5: settings of stiffness and mass, and where it is observable."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from studies.papers.smo_ekf_sideslip.axle_drive import LINEAR, SAMPLE_TIME, AxleDrive, axle_drive, slalom, steady_turn
from studies.papers.smo_ekf_sideslip.observer_chain import ChainRun
from studies.papers.smo_ekf_sideslip.published_tables import MASS_SETTINGS, STIFFNESS_SETTINGS
from studies.papers.smo_ekf_sideslip.stiffness_rank import third_singular_value
from studies.plots.colours import BLUE, GREEN, ORANGE, RED
from studies.study import Drawing

COLOURS = (ORANGE, BLUE, GREEN)
TRUTH = {"color": "black", "lw": 2.2, "label": "true"}


def stiffness_settings(drive: AxleDrive, fixed: ChainRun, adaptive: ChainRun) -> Drawing:
    """Figs. 12 to 17 of P5 on a saturating single track."""
    figure = Figure(figsize=(9.4, 5.6), layout="constrained")
    axes = figure.subplots(2, 2, sharex=True)
    for axis, run, title in (
        (axes[0, 0], fixed, "fixed stiffness (ORL)"),
        (axes[0, 1], adaptive, "adaptive stiffness (EKF)"),
    ):
        axis.plot(drive.time, np.degrees(drive.rear_sideslip), **TRUTH)
        for j, factor in enumerate(STIFFNESS_SETTINGS):
            axis.plot(
                drive.time, np.degrees(run.rear_sideslip[:, j]), color=COLOURS[j], lw=1.1, label=f"set × {factor:g}"
            )
        axis.set_title(title, loc="left")
        axis.set_ylim(-8, 8)
        axis.legend(loc="upper left", ncols=2)
    axes[0, 0].set_ylabel("rear sideslip β₂ [deg]")
    secant = drive.forces / np.where(np.abs(drive.slips) > np.radians(0.4), drive.slips, np.nan)
    for i, name in enumerate(("front", "rear")):
        axes[1, i].plot(drive.time, secant[:, i] / 1e3, ".", color="0.6", ms=2, label="true force / slip angle")
        for j, factor in enumerate(STIFFNESS_SETTINGS):
            axes[1, i].plot(
                drive.time, adaptive.stiffness[:, j, i] / 1e3, color=COLOURS[j], lw=1.2, label=f"set × {factor:g}"
            )
        axes[1, i].set_ylabel(f"{name} axle stiffness [kN/rad]")
        axes[1, i].set_xlabel("time [s]")
        axes[1, i].set_ylim(0, 132)
        axes[1, i].legend(loc="upper left", ncols=2)
    return Drawing(
        "stiffness-settings",
        "Figs. 12 to 17 of P5 on a model: a slalom (17 m/s, straight for 5 s, lateral acceleration to 0.6 g) of a "
        "single track whose axles saturate, which the observers do not know. Force observer and filter with the "
        "stiffness set to 0.5, 1 and 1.5 times the printed one. Above: with fixed stiffness the rear sideslip is "
        "too large for the soft setting and too small for the stiff one; with adaptive stiffness the three "
        "settings agree soon after the slalom begins. Below: the stiffnesses are frozen while driving straight and "
        "then converge to common values; the rear one stays low because the force observer follows the split late.",
        "Upper panels: rear sideslip over time, three spread curves at the left, three nearly equal ones at the "
        "right. Lower panels: front and rear stiffness, constant until 5 s, then converging.",
        figure,
    )


def mass_settings(drive: AxleDrive, run: ChainRun) -> Drawing:
    """Fig. 18 of P5: forces and sideslip with another assumed mass."""
    figure = Figure(figsize=(9.4, 3.8), layout="constrained")
    axes = figure.subplots(1, 3)
    true = drive.body_forces()
    for i, name in enumerate(("front lateral force", "rear lateral force")):
        axes[i].plot(drive.time, true[:, i] / 1e3, **TRUTH)
        for j, change in enumerate(MASS_SETTINGS):
            axes[i].plot(
                drive.time,
                run.forces[:, j, i] / 1e3,
                color=COLOURS[j],
                lw=1.1,
                label=f"m {change:+g} kg" if change else "m",
            )
        axes[i].set_ylabel(f"{name} [kN]")
    axes[2].plot(drive.time, np.degrees(drive.rear_sideslip), **TRUTH)
    for j, change in enumerate(MASS_SETTINGS):
        axes[2].plot(
            drive.time,
            np.degrees(run.rear_sideslip[:, j]),
            color=COLOURS[j],
            lw=1.1,
            label=f"m {change:+g} kg" if change else "m",
        )
    axes[2].set_ylabel("rear sideslip β₂ [deg]")
    for axis in axes:
        axis.set_xlim(5.0, drive.time[-1])
        axis.set_xlabel("time [s]")
        low, high = axis.get_ylim()
        axis.set_ylim(low, high + 0.35 * (high - low))
        axis.legend(loc="upper left", ncols=2, fontsize=7)
    return Drawing(
        "mass-settings",
        "Fig. 18 of P5 on a model: the same slalom with the assumed mass 300 kg too small, right, and 300 kg too "
        "large. Forces scale with the assumed mass (they are mass times measured acceleration); the rear sideslip "
        "hardly changes, because mass and force cancel in (10) and the adapted stiffness takes the rest.",
        "Three panels over time: front force, rear force and rear sideslip; force curves differ in size by a "
        "fifth, sideslip curves nearly coincide.",
        figure,
    )  # fmt: skip


def stiffness_observability() -> Drawing:
    """Third singular value in a slalom and in a steady turn."""
    figure = Figure(figsize=(9.2, 3.7), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True)
    for steering, name, color in ((slalom, "slalom", BLUE), (steady_turn, "steady turn", RED)):
        drive = axle_drive(steering, seconds=14.0, friction=LINEAR)
        signals = {"sideslip": drive.sideslip, "steering_angle": drive.steering, "yaw_rate": drive.yaw_rate,
                   "speed": drive.speed, "front_force_x": drive.drive}  # fmt: skip
        rates = {key: np.gradient(value, SAMPLE_TIME) for key, value in signals.items() if key != "sideslip"}
        left.plot(drive.time, np.degrees(drive.slips[:, 0]), color=color, lw=1.4, label=f"front, {name}")
        left.plot(drive.time, np.degrees(drive.slips[:, 1]), color=color, lw=1.0, ls="--", label=f"rear, {name}")
        right.semilogy(
            drive.time, np.maximum(third_singular_value(signals, rates), 1e-9), color=color, lw=1.3, label=name
        )
    left.set_ylabel("slip angle [deg]")
    left.set_xlabel("time [s]")
    left.set_ylim(top=9.0)
    left.legend(loc="upper left", ncols=2)
    right.set_ylabel("third singular value / largest [1]")
    right.set_xlabel("time [s]")
    right.set_ylim(1e-9, 10.0)
    right.legend(loc="upper left")
    return Drawing(
        "stiffness-observability",
        "When the sideslip filter can tell sideslip from stiffness: third singular value of the gradients of the "
        "two axle forces and of their rates (states in typical sizes), along a slalom and along a turn that "
        "becomes steady, linear axles as printed, both at constant 17 m/s. Straight ahead nothing is seen of the "
        "stiffnesses; in the steady turn the value falls to zero although both axles slip (left), because slip "
        "angles that do not change cannot be told from softer tires. In the slalom it stays large.",
        "Left: slip angles over time, oscillating in the slalom and constant in the turn. Right: the singular "
        "value on a logarithmic scale, large throughout the slalom, falling steadily in the steady turn.",
        figure,
    )
