"""Launches of the truth vehicle on roads of falling friction: what the corner observers miss, what the fusion recovers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import numpy.typing as npt

from estimators.vehicle import GRAVITY
from studies.beyond.friction_floor.theory import friction_curve, missed_share
from studies.experiments.accuracy import Spread, nrms, spread
from studies.experiments.play import Reading, baselines, measured, play, run_of
from studies.experiments.sensors import TEST_CAR
from studies.experiments.velocities import corner_observers
from studies.study import Scope
from studies.truth import Truth, load_manoeuvre, simulate_manoeuvres
from studies.truth.road import Road
from synthesis.models.parameter_set import load_parameter_set

Array = npt.NDArray[np.float64]
FRICTIONS = (0.2, 0.35, 0.5, 0.8, 1.0)
BEYOND = 1.15
"""Peak torque over what the road holds of sliding wheels: enough to leave static friction, mu_s/mu_c = 1.3, at the front."""
LEAST_SLIP = 0.01
"""Below it the slip velocity drowns in the noise of the wheel speeds and shares mean nothing."""
READINGS: dict[str, Reading] = {
    "fusion": lambda step: step.vx,
    "corner observers": lambda step: step.corners.vx,
    "relative": lambda step: step.corners.relative_velocity,
}


def name_of(friction: float) -> str:
    """Of the run on a road of this friction."""
    return f"floor-launch-{round(100 * friction)}"


QUICK_PACE = 0.5
"""Durations of a quick run, over those of the manoeuvre: the torque still changes slowly against the bristles."""


@cache
def launched(quick: bool = False) -> Truth:
    """One run for each friction, integrated together."""
    pace = QUICK_PACE if quick else 1.0
    base = load_manoeuvre("floor-launch")
    car = base.truth_vehicle()
    grip = car.lugre.sliding * car.parameters.mass * GRAVITY * float(np.mean(car.parameters.radius))
    runs = []
    for friction in FRICTIONS:
        held, rise, fall = (piece.model_copy(update={"time": pace * (piece.time or 0.0)}) for piece in base.torque)
        pieces = [held, rise.model_copy(update={"to": f"{BEYOND * friction * grip:.6g} N*m"}), fall]
        changes = {
            "name": name_of(friction), "road": Road(friction=friction), "torque": pieces, "duration": pace * base.duration,
        }  # fmt: skip
        runs.append(base.model_copy(update=changes))
    return simulate_manoeuvres(runs)


@dataclass(frozen=True)
class Launch:
    """One road: slips and shares over time of the first sensor draw, velocity errors over all draws."""

    friction: float
    time: Array  # (n,)
    slip: Array  # (n,) mean over the wheels, v_r/(R_e w)
    predicted: Array  # (n,) share of the slip velocity missed, NaN at little slip
    missed: Array  # (n,) mean over the draws
    errors: dict[str, Spread]


def launches(scope: Scope) -> list[Launch]:
    """Play all roads in one batch."""
    truth = launched(scope.quick)
    drawn = measured(truth, range(scope.seeds), TEST_CAR)
    estimates = play(drawn, READINGS, corner_observers("corner-estimation"))
    velocities = {name: estimates[name] for name in ("fusion", "corner observers")} | baselines(drawn)
    values = load_parameter_set("corner-estimation")
    tire, car = values.tire["longitudinal"], truth.vehicles[0]
    found = []
    for friction in FRICTIONS:
        row, samples = run_of(truth, name_of(friction))
        speed, relative = truth["wheel_speed"][row, samples], truth["slip_velocity_x"][row, samples]
        surface = car.parameters.radius * speed
        slip = relative / np.maximum(surface, 1.0)
        level = friction * friction_curve(car.lugre, relative)
        share = missed_share(tire, float(np.mean(car.parameters.radius)), speed, slip, level)
        enough = np.abs(slip).mean(axis=1) > LEAST_SLIP
        estimated = estimates["relative"][:, row, samples].mean(axis=0)
        total = np.where(enough, relative.sum(axis=1), np.nan)
        missed = (relative - estimated).sum(axis=1) / total
        true = truth["vx"][row, samples]
        errors = {name: spread(nrms(value[:, row, samples], true)) for name, value in velocities.items()}
        found.append(
            Launch(
                friction,
                truth.time[samples],
                slip.mean(axis=1),
                (share * relative).sum(axis=1) / total,
                missed,
                {name: value for name, value in errors.items() if value is not None},
            )
        )
    return found
