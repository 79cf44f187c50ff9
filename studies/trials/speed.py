"""P2's speed on truth drives: Kalman filters with three and two states, the shipped schedule, the fusion, two baselines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from estimators.pipeline import CornerObservers
from estimators.schedule import GainSchedule
from estimators.vehicle import VehicleParameters
from estimators.velocity import FusionSettings, VelocityFusion
from studies.study import Cell, PartResult, Scope, Table
from studies.trials.accuracy import Spread, known_spread, nrms
from studies.trials.driven import LUGRE, driven
from studies.trials.ltv_corners import SideBySide, bristle_tire, kalman_corners
from studies.trials.play import QUICK_SECONDS, Reading, baselines, measured, play, run_of
from studies.trials.sensors import TEST_CAR
from studies.trials.speed_figures import error_dots, speed_history
from studies.trials.velocities import FUSION, TOLD

Array = npt.NDArray[np.float64]
PARAMETERS = SCHEDULE = "longitudinal-speed"
THREE, TWO, LPV = "Kalman, 3 states", "Kalman, 2 states", "schedule"
CLAIMED = 6.6
"""%, what the paper claims of the longitudinal speed (section VI, no table)."""
CORNER = 0
"""The wheel whose own velocity is drawn: front left."""
READINGS: dict[str, Reading] = {
    FUSION: lambda step: step.vx,
    THREE: lambda step: step.corners.steps[THREE].vx,
    TWO: lambda step: step.corners.steps[TWO].vx,
    LPV: lambda step: step.corners.steps[LPV].vx,
    "relative": lambda step: step.corners.steps[THREE].relative_velocity[..., CORNER],
    "high": lambda step: step.corners.steps[THREE].high_slip[..., CORNER],
}
ESTIMATES = (THREE, TWO, LPV, FUSION, "mean wheel speed", "integrated acceleration")


@dataclass(frozen=True)
class Drive:
    """A manoeuvre here and its name in the paper."""

    manoeuvre: str
    title: str


def parts(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, Any]:
    """All corner observers side by side, with fixed weights of the axles; the fusion knows the same tire."""
    tire = bristle_tire(PARAMETERS, float(np.mean(car.radius)))
    compliance = tire.kappa / tire.sigma0
    settings = FusionSettings(slip_compliance=compliance, slip_compliance_spread=TOLD * compliance)
    return {
        "velocity": VelocityFusion(car, sample_time, shape, settings),
        "corner_observers": SideBySide(
            {
                THREE: kalman_corners(car, tire, sample_time, shape, 3),
                TWO: kalman_corners(car, tire, sample_time, shape, 2),
                LPV: CornerObservers(car, GainSchedule.shipped(SCHEDULE), None, shape),
            }
        ),
    }


def speed_part(name: str, rows: Sequence[Drive], scope: Scope, tire: str = LUGRE) -> PartResult:
    """Play every manoeuvre with all of them and judge V_x."""
    truth = driven(tuple(row.manoeuvre for row in rows), tire, scope, QUICK_SECONDS)
    drawn = measured(truth, range(scope.seeds), TEST_CAR)
    estimates = play(drawn, READINGS, parts) | baselines(drawn)
    table: list[list[Cell]] = []
    measures: dict[str, float] = {}
    found: list[dict[str, Spread]] = []
    for row in rows:
        place, samples = run_of(truth, row.manoeuvre)
        true = truth["vx"][place, samples]
        errors = {who: known_spread(nrms(estimates[who][:, place, samples], true)) for who in ESTIMATES}
        found.append(errors)
        peak = float(np.abs(true).max())
        for who, value in errors.items():
            largest = known_spread(np.abs(estimates[who][:, place, samples] - true).max(axis=1))
            table.append(
                [
                    row.title, round(peak, 2), who, CLAIMED if who == THREE else None, value.text(), round(value.worst, 2),
                    value.worst < CLAIMED, largest.text(),
                ]
            )  # fmt: skip
            measures[f"{row.manoeuvre}, {who}"] = value.mean
    caption = (
        f"Longitudinal speed at the centre of gravity on the truth vehicle ({tire} tires), NRMS in % of the "
        "peak as P1 (46): mean over "
        f"{scope.seeds} sensor draws with its 95 % confidence interval, the worst draw, and the greatest "
        "error in m/s. Kalman filters: P2 "
        f"(19) to (23) with the detector (29), the published covariances and equal weights of the axles; schedule: the shipped "
        f"'{SCHEDULE}' observer in the same place. The paper claims less than {CLAIMED:g} % without a table."
    )
    columns = (
        "manoeuvre", "peak [m/s]", "estimate", "claimed NRMS [%]", "NRMS [%]", "worst draw [%]", "every draw below the claim",
        "greatest error [m/s]",
    )  # fmt: skip
    drawings = [
        error_dots(f"{name}-errors", rows, found, CLAIMED),
        *(speed_history(f"{name}-{row.manoeuvre}", drawn, row, estimates) for row in rows),
    ]
    return PartResult(tables=[Table(f"{name}-errors", caption, columns, table)], drawings=drawings, measures=measures)
