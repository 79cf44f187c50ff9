"""Figs. 7, 8 and 12 to 18 of P5 on a truth drive."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from studies.plots.colours import SETTINGS
from studies.study import Drawing
from studies.trials.axle_forces import FORCES, RIGHT, AxleRun
from studies.trials.panels import estimate_line, finished, true_line

_LABELS = {"F_y1": "$F_{y1}$ [kN]", "F_y2": "$F_{y2}$ [kN]", "F_x1": "$F_{x1}$ [kN]", "yaw_rate": "yaw rate [deg/s]"}
_BANDS = "Lines: first sensor draw; bands: 95 % of all draws."


def force_history(name: str, title: str, run: AxleRun) -> Drawing:
    """Figs. 7 and 8, with the yaw rate."""
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    time = run.drawn.truth.time
    for k, axes in enumerate(figure.subplots(4, 1, sharex=True)):
        scale = float(np.degrees(1.0)) if FORCES[k] == "yaw_rate" else 1e-3
        true_line(axes, time, scale * run.true_forces[:, k])
        estimate_line(axes, time, scale * run.forces[RIGHT[0]][:, :, k], "sliding mode", color=SETTINGS[1])
        finished(axes, _LABELS[FORCES[k]], last=k == 3)
    figure.axes[0].legend(ncols=2, fontsize="small", frameon=False, loc="upper left")
    return Drawing(
        name,
        f"{title}: axle forces and yaw rate of the sliding-mode observer, as Figs. 7 and 8 of P5. It starts "
        "from the greatest values "
        f"of the drive. {_BANDS}",
        "Four panels over time: front and rear lateral force, front longitudinal force, yaw rate, each with its estimate.",
        figure,
    )


def stiffness_history(name: str, title: str, run: AxleRun) -> Drawing:
    """Figs. 12 to 17: rear sideslip with fixed and with adapted stiffness, and the stiffnesses."""
    figure = Figure(figsize=(9.4, 6.0), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True)
    time, settings = run.drawn.truth.time, list(run.fixed)
    limit = 1.9 * float(np.degrees(np.abs(run.true_sideslip[run.counted]).max()))
    shown = np.where(run.counted, np.degrees(run.true_sideslip), np.nan)
    for axes, found, what in ((panels[0, 0], run.fixed, "fixed (ORL)"), (panels[0, 1], run.adaptive, "adapted (EKF)")):
        true_line(axes, time, shown)
        for setting, colour in zip(settings, SETTINGS, strict=False):
            estimate_line(axes, time, np.degrees(found[setting]), f"× {setting[1]:g}", color=colour)
        axes.set_ylim(-limit, limit)
        axes.set_title(f"rear sideslip, stiffness {what}", loc="left", fontsize="medium")
    panels[0, 0].legend(ncols=4, fontsize="small", frameon=False, loc="upper left")
    for k, axle in enumerate(("front", "rear")):
        axes = panels[1, k]
        for setting, colour in zip(settings, SETTINGS, strict=False):
            estimate_line(axes, time, 1e-3 * run.stiffness[setting][:, :, k], f"× {setting[1]:g}", color=colour)
        axes.set_title(f"{axle} axle", loc="left", fontsize="medium")
        axes.set_ylim(bottom=0.0)
        finished(axes, "stiffness [kN/rad]" if k == 0 else "", last=True)
    for axes in panels[0]:
        finished(axes, "sideslip [deg]" if axes is panels[0, 0] else "")
    return Drawing(
        name,
        f"{title}: rear sideslip with the believed stiffness times 0.5, 1 and 1.5, fixed and adapted, and the "
        "adapted stiffness of both "
        f"axles, as Figs. 12 to 17 of P5. {_BANDS}",
        "Upper panels: rear sideslip over time for three settings, fixed left, adapted right. Lower panels: "
        "adapted stiffness of the axles.",
        figure,
    )


def mass_history(name: str, title: str, run: AxleRun) -> Drawing:
    """Fig. 18: front force and rear sideslip by believed mass."""
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    force, slip = figure.subplots(2, 1, sharex=True)
    time = run.drawn.truth.time
    true_line(force, time, 1e-3 * run.true_forces[:, 0])
    true_line(slip, time, np.where(run.counted, np.degrees(run.true_sideslip), np.nan))
    for mass, colour in zip(sorted(run.forces), SETTINGS, strict=False):
        label = f"m {mass:+g} kg" if mass else "m"
        estimate_line(force, time, 1e-3 * run.forces[mass][:, :, 0], label, color=colour)
        estimate_line(slip, time, np.degrees(run.adaptive[mass, 1.0]), label, color=colour)
    limit = 1.9 * float(np.degrees(np.abs(run.true_sideslip[run.counted]).max()))
    slip.set_ylim(-limit, limit)
    finished(force, "$F_{y1}$ [kN]")
    finished(slip, "rear sideslip [deg]", last=True)
    force.legend(ncols=4, fontsize="small", frameon=False, loc="upper left")
    return Drawing(
        name,
        f"{title}: front axle force and rear sideslip by believed mass, as Fig. 18 of P5. {_BANDS}",
        "Front lateral force and rear sideslip over time for three believed masses.",
        figure,
    )
