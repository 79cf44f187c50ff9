"""Figs. 9 to 13 of P2 on truth vehicles: Kalman filters with three and two states, shipped schedule, fusion, two baselines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.pipeline import CornerObservers, KalmanCorners
from estimators.schedule import GainSchedule
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire, FusionSettings, VelocityFusion
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, colours
from studies.study import Cell, PartResult, Scope, Table
from studies.trials import estimation
from studies.trials.accuracy import Spread, known_spread, nrms
from studies.trials.histories import BANDS, backgrounds, error_dots, estimate_lines, history, row_axis, truth_line
from studies.trials.motion import MotionTest
from studies.trials.simulations import LUGRE
from studies.trials.velocities import COMPLIANCE_SPREAD, FUSION
from studies.truth import Measured
from synthesis.models.parameter_set import load_parameter_set

PARAMETERS = "longitudinal-speed"
THREE, TWO, LPV = "Kalman, 3 states", "Kalman, 2 states", "schedule"
CLAIMED = 6.6  # %, what the paper claims of the longitudinal speed (section VI, no table)
STATES: tuple[Literal[3], Literal[2]] = (3, 2)
CORNER = 0  # the wheel whose own velocity is drawn: front left
READINGS: dict[str, estimation.Reading] = {
    FUSION: lambda step: step.vx,
    THREE: lambda step: step.corners.steps[THREE].vx,
    TWO: lambda step: step.corners.steps[TWO].vx,
    LPV: lambda step: step.corners.steps[LPV].vx,
    "relative": lambda step: step.corners.steps[THREE].relative_velocity[..., CORNER],
    "high": lambda step: step.corners.steps[THREE].high_slip[..., CORNER],
}
LOOKS = {
    THREE: ("s", colours.KALMAN), TWO: ("D", colours.SECOND_FILTER), LPV: ("P", colours.SCHEDULE),
    FUSION: ("o", colours.FUSION), estimation.WHEELS: ("^", colours.MEAN_WHEEL_SPEED),
    estimation.INTEGRATED: ("v", colours.INTEGRATED_ACCELERATION),
}  # fmt: skip


class Compared(NamedTuple):
    """Steps by name; ``vx`` is that of the first."""

    vx: FloatArray
    steps: Mapping[str, Any]


class SideBySide(NamedTuple):
    """Several corner observers on the same signals, one after the other."""

    observers: Mapping[str, Any]

    def step(self, *signals: Any) -> Compared:
        """What each of them says of one sample."""
        found = {name: observer.step(*signals) for name, observer in self.observers.items()}
        return Compared(next(iter(found.values())).vx, found)


def parts(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """All corner observers side by side, with fixed weights of the axles; the fusion knows the same tire.

    Kalman filters: P2 (19)-(23), (28), (29) at each corner; axles weigh a half each, V_y is an input.
    """
    values = load_parameter_set(PARAMETERS).tire["longitudinal"]
    constants = (values.sigma0.value, values.sigma1.value, values.sigma2.value, values.kappa.value)
    tire = BristleTire(*constants, float(np.mean(car.radius)))
    compliance = tire.kappa / tire.sigma0
    settings = FusionSettings(slip_compliance=compliance, slip_compliance_spread=COMPLIANCE_SPREAD * compliance)
    three, two = (KalmanCorners(tire, sample_time, (*shape, 4), states) for states in STATES)
    laws: dict[str, GainSchedule | KalmanCorners] = {THREE: three, TWO: two, LPV: GainSchedule.shipped(PARAMETERS)}
    observers = {name: CornerObservers(car, law, None, shape) for name, law in laws.items()}
    return {
        "velocity": VelocityFusion(car, sample_time, shape, settings), "corner_observers": SideBySide(observers),
    }  # fmt: skip


def speed_part(name: str, rows: Sequence[MotionTest], scope: Scope, tire: str = LUGRE) -> PartResult:
    """Errors of V_x of all of them in every manoeuvre."""
    drawn = estimation.measured_runs([row.manoeuvre for row in rows], tire, scope)
    truth = drawn.truth
    estimates = estimation.run_pipeline(drawn, READINGS, parts) | estimation.baselines(drawn)
    table, measures, found = list[list[Cell]](), dict[str, float](), list[dict[str, Spread]]()
    for row in rows:
        run, samples = estimation.run_of(truth, row.manoeuvre)
        true = truth["vx"][run, samples]
        peak = round(float(np.abs(true).max()), 2)
        found.append({who: known_spread(nrms(estimates[who][:, run, samples], true)) for who in LOOKS})
        for who, error in found[-1].items():
            largest = known_spread(np.abs(estimates[who][:, run, samples] - true).max(axis=1))
            claimed, worst = CLAIMED if who == THREE else None, round(error.worst, 2)
            table.append([row.title, peak, who, claimed, error.text(), worst, error.worst < CLAIMED, largest.text()])
            measures[f"{row.manoeuvre}, {who}"] = error.mean
    caption = (
        f"Longitudinal speed at the centre of gravity on the truth vehicle ({tire} tires), NRMS in % of the peak as P1 (46): "
        f"mean over {scope.seeds} sensor draws with its 95 % confidence interval, the worst draw, and the greatest error in "
        "m/s. Kalman filters: P2 (19) to (23) with the detector (29), the published covariances and equal weights of the "
        f"axles; schedule: the shipped '{PARAMETERS}' observer in the same place. The paper claims less than {CLAIMED:g} % "
        "without a table."
    )
    columns = (
        "manoeuvre", "peak [m/s]", "estimate", "claimed NRMS [%]", "NRMS [%]", "worst draw [%]", "every draw below the claim",
        "greatest error [m/s]",
    )  # fmt: skip
    marks = [*error_dots(found, LOOKS), Level(x=CLAIMED, label="claimed", dash="dashed", width=1.0)]
    x = Axis("$V_x$ NRMS [% of the peak]", scale="log")
    dots = Figure(
        f"{name}-errors",
        "Error of the longitudinal speed by manoeuvre, mean over the sensor draws with 95 % interval; dashed: what P2 claims "
        "of its own.",
        "Dot plot of the normalised speed error of two Kalman filters, a gain schedule, the fusion and two baselines by "
        "manoeuvre.",
        Panel(marks, x, row_axis([row.title for row in rows])), size=(8.0, 1.7 + 0.75 * len(rows)), legend="below",
    )  # fmt: skip
    drawings = [dots, *(speed_history(f"{name}-{row.manoeuvre}", drawn, row, estimates) for row in rows)]
    return PartResult(tables=[Table(f"{name}-errors", caption, columns, table)], figures=drawings, measures=measures)


def speed_history(name: str, drawn: Measured, row: MotionTest, estimates: Mapping[str, FloatArray]) -> Figure:
    """Speed, its error, and the front left wheel: surface speed, velocity of its centre, and where the detector speaks."""
    truth = drawn.truth
    run, samples = estimation.run_of(truth, row.manoeuvre)
    time, true = truth.time[samples], truth["vx"][run, samples]
    wheels, grey = estimation.WHEELS, LOOKS[estimation.WHEELS][1]
    mean_speed = Line(time, estimates[wheels][0, run, samples], wheels, grey, width=0.7)
    speeds, errors = list[Mark]([mean_speed, truth_line(time, true)]), list[Mark]()
    for who in (THREE, LPV, FUSION):
        value = estimates[who][:, run, samples]
        speeds += estimate_lines(time, value, who, LOOKS[who][1])
        errors += estimate_lines(time, value - true, who, LOOKS[who][1])
    surface = estimation.assumed_car(drawn).radius[CORNER] * drawn.signals["wheel_speed"][0, run, samples, CORNER]
    high = (estimates["high"][0, run, samples] > 0.5).astype(int)
    wheel = [
        *backgrounds(time, high, [None, ("high slip detected", colours.HIGH_SLIP)]),
        Line(time, surface, "$R_e\\omega$", grey, width=0.7),
        truth_line(time, truth["wheel_vx"][run, samples, CORNER]),
        Line(time, surface - estimates["relative"][0, run, samples], THREE, LOOKS[THREE][1], width=0.9),
    ]
    return history(
        name,
        f"{row.title}: speed of the car, its error, and the velocity of the front left wheel's centre. {BANDS}",
        "Three panels over time: speed with estimates, errors of the estimates, and the front left wheel with detected high "
        "slip shaded.",
        [Panel(speeds, y="$V_x$ [m/s]", legend="best", columns=3), Panel(errors, y="error of $V_x$ [m/s]"),
         Panel(wheel, y="front left wheel [m/s]", legend="best", columns=4)], (8.6, 6.4),
    )  # fmt: skip
