"""Tables 1 to 5 of P5 and its Figs. 7, 8 and 12 to 18 on a truth drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import Spread, sample_spreads
from studies.trials.axle_figures import force_history, mass_history, stiffness_history
from studies.trials.axle_forces import FORCES, RIGHT, AxleRun, Setting, run_axles
from studies.trials.driven import LUGRE, driven
from studies.trials.first_block import LEAST_SPEED, SAMPLE_TIME, START
from studies.trials.sensors import TEST_CAR
from studies.trials.tire_curve import USE
from studies.truth import draw

Array = npt.NDArray[np.float64]
BETA = "beta_2"


@dataclass(frozen=True)
class AxleTest:
    """A road test of the paper: the manoeuvre here, its printed tables, largest sideslip in deg, and the settings tried."""

    manoeuvre: str
    title: str
    printed: Mapping[str, Any]
    sideslip_peak: float
    factors: tuple[float, ...]
    masses: tuple[float, ...] = ()


def axle_part(name: str, test: AxleTest, scope: Scope, tire: str = LUGRE) -> PartResult:
    """Drive, observe with every setting, judge."""
    truth = driven((test.manoeuvre,), tire, scope)
    settings: list[Setting] = [(0.0, factor) for factor in test.factors]
    settings += [(mass, 1.0) for mass in test.masses if mass != 0.0]
    run = run_axles(draw(truth, TEST_CAR, range(scope.seeds), SAMPLE_TIME), settings)
    about = _about(test, run, scope)
    measures: dict[str, float] = {}
    tables = [_force_table(name, test, run, about, measures), _stiffness_table(name, test, run, about, measures)]
    drawings = [
        force_history(f"{name}-forces", test.title, run),
        stiffness_history(f"{name}-stiffness", test.title, run),
    ]
    if test.masses:
        tables.append(_mass_table(name, test, run, about, measures))
        drawings.append(mass_history(f"{name}-mass", test.title, run))
    return PartResult(tables=tables, drawings=drawings, measures=measures)


def force_errors(run: AxleRun, estimate: Array) -> list[tuple[Spread, Spread]]:
    """Mean and deviation of (8) of each of `FORCES`, from (S, n, 4)."""
    at = run.counted
    return [sample_spreads(estimate[:, at, k], run.true_forces[at, k]) for k in range(len(FORCES))]


def sideslip_errors(run: AxleRun, estimate: Array) -> tuple[Spread, Spread]:
    """Mean and deviation of (8) of the rear sideslip, from (S, n)."""
    return sample_spreads(estimate[:, run.counted], run.true_sideslip[run.counted])


def _force_table(name: str, test: AxleTest, run: AxleRun, about: str, measures: dict[str, float]) -> Table:
    rows: list[list[Cell]] = []
    printed = test.printed["forces"]
    found = (("sliding mode", force_errors(run, run.forces[RIGHT[0]])), ("static split", force_errors(run, run.static)))
    for k, quantity in enumerate(FORCES):
        own, angle = printed[quantity], quantity == "yaw_rate"
        peak = float(np.abs(run.true_forces[run.counted, k]).max())
        for who, errors in found:
            mean, deviation = errors[k]
            paper: tuple[Cell, Cell] = (own["mean"], own["deviation"]) if who == "sliding mode" else (None, None)
            rows.append(
                [
                    quantity, own["unit"], own["largest"], round(float(np.degrees(peak)), 1) if angle else round(peak), who,
                    paper[0], mean.text(), paper[1], deviation.text(), round(mean.worst, 2),
                ]
            )  # fmt: skip
            _keep(measures, f"{quantity}, {who}", mean, deviation)
    return Table(
        f"{name}-forces",
        f"{test.title}: errors (8) of the axle forces (body axes) and of the yaw rate. Static split: m a_y on "
        "the axles as in a steady "
        f"turn, m a_x in front, and the gyro as it is. {about}",
        ("quantity", "unit", "printed peak", "peak", "estimate", "printed mean [%]", "mean [%]", "printed std [%]", "std [%]",
         "worst mean of a draw [%]"),
        rows,
    )  # fmt: skip


def _stiffness_table(name: str, test: AxleTest, run: AxleRun, about: str, measures: dict[str, float]) -> Table:
    rows: list[list[Cell]] = []
    printed = test.printed["stiffness"]
    peak = round(float(np.degrees(np.abs(run.true_sideslip[run.counted]).max())), 2)
    for who, estimates in (("adaptive (EKF)", run.adaptive), ("fixed (ORL)", run.fixed)):
        for j, factor in enumerate(test.factors):
            mean, deviation = sideslip_errors(run, estimates[0.0, factor])
            paper = (printed["mean"][j], printed["deviation"][j]) if estimates is run.adaptive else (None, None)
            rows.append(
                [
                    who, factor, test.sideslip_peak, peak, paper[0], mean.text(), paper[1], deviation.text(),
                    round(mean.worst, 2),
                ]
            )  # fmt: skip
            _keep(measures, f"{BETA}, {who}, stiffness x {factor:g}", mean, deviation)
    return Table(
        f"{name}-stiffness",
        f"{test.title}: errors (8) of the rear sideslip by believed cornering stiffness, adapted or fixed (the paper shows the "
        f"fixed one in figures alone). {about}",
        ("observer", "stiffness setting", "printed peak [deg]", "peak [deg]", "printed mean [%]", "mean [%]", "printed std [%]",
         "std [%]", "worst mean of a draw [%]"),
        rows,
    )  # fmt: skip


def _mass_table(name: str, test: AxleTest, run: AxleRun, about: str, measures: dict[str, float]) -> Table:
    rows: list[list[Cell]] = []
    for j, mass in enumerate(test.masses):
        errors = dict(zip(FORCES, force_errors(run, run.forces[mass]), strict=True))
        errors[BETA] = sideslip_errors(run, run.adaptive[mass, 1.0])
        for quantity, paper in test.printed["mass"].items():
            mean, deviation = errors[quantity]
            rows.append(
                [
                    quantity,
                    mass,
                    paper["mean"][j],
                    mean.text(),
                    paper["deviation"][j],
                    deviation.text(),
                    round(mean.worst, 2),
                ]
            )
            _keep(measures, f"{quantity}, mass {mass:+g} kg", mean, deviation)
    return Table(
        f"{name}-mass",
        f"{test.title}: errors (8) of forces and rear sideslip by believed mass, stiffness adapted. {about}",
        (
            "quantity",
            "mass error [kg]",
            "printed mean [%]",
            "mean [%]",
            "printed std [%]",
            "std [%]",
            "worst mean of a draw [%]",
        ),
        rows,
    )


def _keep(measures: dict[str, float], key: str, mean: Spread, deviation: Spread) -> None:
    measures[f"{key}, mean"], measures[f"{key}, deviation"] = mean.mean, deviation.mean


def _about(test: AxleTest, run: AxleRun, scope: Scope) -> str:
    truth = run.drawn.truth
    front, rear = (2e-3 * value for value in run.tire.secant)
    return (
        f"Truth vehicle on {truth.tires[0]} tires, {truth.time[-1]:.0f} s at 100 Hz: means over {scope.seeds} "
        "draws of the sensor errors with "
        f"95 % confidence intervals, judged from {START:g} s on above {LEAST_SPEED:g} m/s. Believed: the "
        "truth's masses and lengths, and the "
        f"secant of its tires at {USE:g} of the static load, {front:.1f} and {rear:.1f} kN/rad an axle (the "
        "paper: 65 and 50). As in the paper "
        "accelerations are not corrected for roll, and the force observer starts from the greatest values. "
        "Printed values are those "
        "of the paper's road test with another driver, road and car."
    )
