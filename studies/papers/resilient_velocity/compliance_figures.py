"""Figs. 9, 10 and 12 of P3 on truth vehicles: wheel speeds, force residuals, and the wheels against the body."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from estimators.vehicle import CORNERS
from estimators.velocity.slip import LEAST_SPEED
from studies.papers.resilient_velocity.compliance_trial import INSIDE, PRINTED_WAY, WITHOUT, ComplianceTrial
from studies.papers.resilient_velocity.ink import sheet
from studies.papers.resilient_velocity.setting import DIRECTIONS
from studies.plots.colours import BLUE, GREY, ORANGE, RED
from studies.report.canvas import legend
from studies.study import Drawing
from studies.trials.panels import estimate_line, finished, true_line
from studies.trials.play import believed, run_of

if TYPE_CHECKING:
    from studies.papers.resilient_velocity.compliance_report import Shown

STYLE = {WITHOUT: (GREY, "-", 1.8), PRINTED_WAY: (RED, (0, (4, 1.5)), 1.0), INSIDE: (BLUE, "-", 0.9)}


def residual_history(name: str, trial: ComplianceTrial, test: Shown) -> Drawing:
    """Left: measured minus calculated F/F_z by way; right: psi' of the truth and of (14); a row a corner, first draw."""
    truth = trial.drawn.truth
    row, samples = run_of(truth, test.manoeuvre)
    time, axis = truth.time[samples], "xy"[test.direction]
    moving = np.abs(truth["vx"][row, samples]) >= LEAST_SPEED
    limit = _limit(trial, row, moving, test)
    figure = sheet(9.4, 1.2 + 1.55 * len(test.corners))
    panels = figure.subplots(len(test.corners), 2, sharex=True, squeeze=False)
    for (left, right), corner in zip(panels, test.corners, strict=True):
        last = corner == test.corners[-1]
        for way, (colour, dash, width) in STYLE.items():
            value = trial.residual[way][0, row, samples, corner, test.direction]
            left.plot(time, np.where(moving, value, np.nan), color=colour, ls=dash, lw=width, label=way)
        left.axhline(0.0, color="black", lw=0.6)
        left.set_ylim(-limit, limit)
        left.set_title(CORNERS[corner], loc="left")
        true_line(right, time, trial.true_give[row, samples, corner, test.direction])
        estimate = trial.give[0, row, samples, corner, test.direction]
        right.plot(time, estimate, color=ORANGE, lw=0.9, label="(14) on estimated forces")
        finished(left, f"$\\Delta f_{{n{axis}}}$ [1]", last)
        finished(right, f"$\\dot\\psi_{axis}$ [m/s]", last)
    legend(figure, ncols=5)
    direction = DIRECTIONS[test.direction]
    return Drawing(
        name,
        f"{test.title}: {direction} force of the wheels, measured minus calculated, over the vertical load (left), "
        "with and without the suspension compliance, and the velocity of the wheel against the body (right). First sensor draw.",
        f"Rows of two panels over time, one for each corner: the difference of the {direction} forces for three ways of "
        "treating the compliance, and the wheel's velocity against the body with its estimate.",
        figure,
    )


def wheel_history(name: str, trial: ComplianceTrial, test: Shown) -> Drawing:
    """Fig. 9: surface speed of each wheel, velocity of its centre, and what the observers without compliance make of it."""
    truth, signals = trial.drawn.truth, trial.drawn.signals
    row, samples = run_of(truth, test.manoeuvre)
    time, radius = truth.time[samples], believed(trial.drawn).radius
    figure = sheet(9.4, 5.4)
    for corner, axes in enumerate(figure.subplots(2, 2, sharex=True).flat):
        surface = radius[corner] * signals["wheel_speed"][:, row, samples, corner]
        axes.plot(time, surface[0], color=GREY, lw=0.8, label="$R_e\\omega$", zorder=2)
        true_line(axes, time, truth["wheel_vx"][row, samples, corner])
        centre = surface - trial.slip[WITHOUT][:, row, samples, corner, 0]
        estimate_line(axes, time, centre, "$R_e\\omega-\\hat V_{rx}$", color=RED)
        axes.set_title(CORNERS[corner], loc="left")
        finished(axes, "speed [m/s]" if corner % 2 == 0 else "", corner > 1)
    legend(figure)
    return Drawing(
        name,
        f"{test.title.replace('10', '9')}: surface speed of the wheels, velocity of their centres along the car, and the corner "
        "observers' estimate of it, as Fig. 9 of P3. Lines: first sensor draw; band: 95 % of all draws. On ice the wheels spin "
        "and their observers follow them: what friction hides of the slip, no gain brings back.",
        "Four panels of speed over time: on the right side all lines agree, on the left the wheel's surface and its estimate "
        "run away from the car.",
        figure,
    )


def _limit(trial: ComplianceTrial, row: int, moving: npt.NDArray[np.bool_], test: Shown) -> float:
    """Half the axis: all but the greatest hundredth of the differences without compliance."""
    shown = trial.residual[WITHOUT][0, row, : moving.size, :, test.direction][moving][:, test.corners]
    return 1.2 * float(np.percentile(np.abs(shown), 99.0))
