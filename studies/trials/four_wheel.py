"""P4 on a truth drive: both filters of the four-wheel model, what a car without them would say, and the pipeline."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from estimators.sideslip import FourWheel, FourWheelObserver
from estimators.vehicle import VehicleParameters
from studies.trials.first_block import Levelled, counted, front_steer, level, rear_speed
from studies.trials.play import Reading, believed, play
from studies.trials.tire_curve import TireFacts, tire_facts
from studies.truth import Measured

Array = npt.NDArray[np.float64]
EKF, UKF, PIPELINE = "EKF", "UKF", "pipeline"
AT_REST = ", stiffness at rest"
SHARE, NO_SLIP, STEADY = "m a_y shared by load", "no slip at the rear", "steady linear car"
READINGS: dict[str, Reading] = {"force_y": lambda step: step.force_y, "sideslip": lambda step: step.sideslip}
_Kind = Literal["extended", "unscented"]


@dataclass(frozen=True)
class FourWheelRun:
    """Estimates of S sensor draws of one run over n samples by who made them, beside the truth (n[, 4])."""

    drawn: Measured
    forces: dict[str, Array]  # (S, n, 4) N, tire frame
    sideslip: dict[str, Array]  # (S, n) rad
    loads: Array  # (S, n, 4) N, of block 1
    true_forces: Array
    true_sideslip: Array
    true_loads: Array
    counted: npt.NDArray[np.bool_]  # (n,) samples that are judged
    tire: TireFacts


def believed_car(car: VehicleParameters, tire: TireFacts, at_rest: bool = False) -> FourWheel:
    """The truth's masses and lengths; of its tires the secant (or slope at rest), relaxation length and greatest friction."""
    front, rear = tire.slope if at_rest else tire.secant
    return FourWheel(
        car.mass, car.yaw_inertia, car.front_axle_distance, car.rear_axle_distance, 0.5 * (car.front_track + car.rear_track),
        front, rear, *tire.relaxation, friction=float(np.mean(tire.peak)),
    )  # fmt: skip


def run_four_wheel(drawn: Measured) -> FourWheelRun:
    """Play the only run of ``drawn`` (at 100 Hz) through everything."""
    car, truth = believed(drawn), drawn.truth
    first, speed, steer = level(drawn), rear_speed(drawn), front_steer(drawn)
    friction = float(truth["friction"][0].mean())
    tire = tire_facts(truth.vehicles[0], truth.tires[0], float(truth["vx"][0].mean()), friction)
    forces: dict[str, Array] = {}
    sideslip: dict[str, Array] = {}
    measurement = np.stack([drawn.signals["yaw_rate"], speed, first.ax, first.ay], axis=-1)
    kinds: tuple[tuple[str, _Kind], ...] = ((EKF, "extended"), (UKF, "unscented"))
    for at_rest in (False, True):
        vehicle = believed_car(car, tire, at_rest)
        for name, kind in kinds:
            label = name + AT_REST * at_rest
            forces[label], sideslip[label] = _observed(drawn, vehicle, kind, steer, first.loads, measurement)
    forces[SHARE] = (first.loads * (car.mass * first.ay / first.loads.sum(axis=-1))[..., None])[:, 0]
    sideslip |= _without_filter(car, 2.0 * tire.secant[1], speed, first, drawn)
    ours = play(drawn, READINGS)
    forces[PIPELINE], sideslip[PIPELINE] = ours["force_y"][:, 0], ours["sideslip"][:, 0]
    return FourWheelRun(
        drawn, forces, sideslip, first.loads[:, 0], truth["force_y"][0], truth["sideslip"][0], truth["force_z"][0],
        counted(drawn, 0), tire,
    )  # fmt: skip


def _observed(
    drawn: Measured, vehicle: FourWheel, kind: _Kind, steer: Array, loads: Array, measurement: Array
) -> tuple[Array, Array]:
    """Forces (S, n, 4) and sideslip (S, n); the filter starts straight ahead at the measured speed."""
    shape, samples = drawn.batch_shape, drawn.time.size
    observer = FourWheelObserver(vehicle, kind, shape, drawn.sample_time)
    start = np.zeros((*shape, 8))
    start[..., 1] = measurement[:, :, 0, 1]
    observer.reset(state=start)
    forces, sideslip = np.empty((shape[0], samples, 4)), np.empty((shape[0], samples))
    for k in range(samples):
        step = observer.step(steer[:, :, k], loads[:, :, k], measurement[:, :, k])
        forces[:, k], sideslip[:, k] = step.forces[:, 0], step.sideslip[:, 0]
    return forces, sideslip


def _without_filter(
    car: VehicleParameters, stiffness: float, speed: Array, first: Levelled, drawn: Measured
) -> dict[str, Array]:
    """Sideslip L_r r/V if the rear axle did not slip, and less m L_f a_y/(L C_r) if it did as a linear one does."""
    free = car.rear_axle_distance * drawn.signals["yaw_rate"] / np.maximum(speed, 1.0)
    slip = car.mass * car.front_axle_distance / (car.wheelbase * stiffness) * first.ay
    return {NO_SLIP: free[:, 0], STEADY: (free - slip)[:, 0]}
