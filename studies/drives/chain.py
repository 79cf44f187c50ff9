"""The estimation pipeline over a recorded drive: forces, loads, velocities and sideslip of every sample."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from estimators import GainSchedule, forces
from estimators import pipeline as parts
from estimators.arrays import FloatArray, IntArray
from estimators.pipeline.corner_kinds import CornerKind
from estimators.pipeline.pipeline import REAL_SENSORS
from estimators.sideslip import FourWheel, SingleTrack
from estimators.sideslip.stiffness import PUBLISHED_TIME
from estimators.vehicle import VehicleParameters
from estimators.velocity import KinematicKalman, SlipWeights
from studies.drives.drive_file import DriveFile
from studies.drives.log import DriveLog
from studies.drives.prepare import CornerInputs
from studies.drives.quantities import at_corners
from studies.drives.replay import PROGRESS_STEPS, Progress
from studies.errors import refused_at


@dataclass(frozen=True)
class Chain:
    """What the pipeline made of n samples; corner order fl, fr, rl, rr, SI.

    ``corner_vy`` is V_y of the corner observers, ``sideslip_part`` that of the chosen sideslip estimator: NaN without
    them. A ``*_deviation`` is the standard deviation that the pipeline states, NaN where it states none. ``flags`` and ``checks``
    (n,) are sums of ``estimators.Flag`` and ``estimators.pipeline.Check``.
    """

    vx: FloatArray
    vy: FloatArray
    sideslip: FloatArray
    sideslip_part: FloatArray
    corner_vy: FloatArray
    force_x: FloatArray
    axle_force_y: FloatArray
    force_z: FloatArray
    slip: FloatArray
    slip_angle: FloatArray
    vx_deviation: FloatArray
    vy_deviation: FloatArray
    force_x_deviation: FloatArray
    axle_force_y_deviation: FloatArray
    flags: IntArray
    checks: IntArray
    assumptions: tuple[str, ...]


@refused_at("estimators")
def pipeline_of(
    drive: DriveFile, longitudinal: GainSchedule | CornerKind | None, lateral: GainSchedule | None = None
) -> tuple[parts.EstimationPipeline, tuple[str, ...]]:
    """The pipeline that the drive file asks for, for one car, and what had to be assumed.

    ``longitudinal``: the corner observers along the wheels, for this pipeline alone; they run where ``lateral`` is given too.

    Raises SpecError, one line, on vehicle data that no car has.
    """
    vehicle, car = drive.vehicle.parameters, drive.vehicle
    assumptions = () if car.yaw_inertia else ("yaw inertia is not given: taken as m L_f L_r",)
    time, chosen = drive.sample_time, drive.estimators
    longitudinal_force: dict[str, Callable[..., Any]] = {
        "unknown-input": forces.UnknownInputForceObserver, "pid": parts.DifferentiatedPid,
        "unscented": forces.WheelForceFilter, "linear": partial(forces.WheelForceFilter, method="linear"),
    }  # fmt: skip
    method: Any = chosen.lateral_force
    suspension = car.suspension.parameters if chosen.suspension == "compliant" else None
    weights = SlipWeights() if chosen.axle_weights == "slip" else None
    corners: parts.CornerObservers | None = None
    if longitudinal is not None and lateral is not None:
        corners = parts.CornerObservers(vehicle, longitudinal, lateral, weights=weights, suspension=suspension)
    velocity: parts.CornerVelocity | None = None  # the fusion; else a paper's own chain
    if chosen.velocity != "fusion" and corners is not None:
        velocity = parts.CornerVelocity(corners, KinematicKalman(time) if chosen.velocity == "kinematic" else None)
    pipeline = parts.EstimationPipeline(
        vehicle,
        time,
        longitudinal_force=longitudinal_force[chosen.longitudinal_force](vehicle, time),
        loads=forces.VerticalLoads(vehicle, time, dynamic=chosen.vertical_load == "dynamic"),
        attitude=forces.AttitudeObserver(time) if chosen.attitude == "gyro" else None,
        lateral_force=forces.LateralForceEstimator(vehicle, time, method=method, measurement_deviation=REAL_SENSORS),
        velocity=velocity,
        corner_observers=corners if velocity is None else None,
        sideslip=_sideslip_of(drive, vehicle),
        speed_of_rear_wheels=chosen.sideslip_speed == "rear-wheels",
        unsigned_wheels=drive.unsigned_wheels,
    )
    return pipeline, assumptions


def _sideslip_of(drive: DriveFile, vehicle: VehicleParameters) -> Any:
    kind, car = drive.estimators.sideslip, drive.vehicle
    front, rear = car.cornering_stiffness_front, car.cornering_stiffness_rear
    if kind == "none" or front is None or rear is None:
        return None
    base = (vehicle.mass, vehicle.yaw_inertia, vehicle.front_axle_distance, vehicle.rear_axle_distance)
    if kind.endswith("stiffness") or kind == "sliding-mode":
        car_model, fixed, sliding = SingleTrack(*base, front, rear), kind == "fixed-stiffness", kind == "sliding-mode"
        noise_time = PUBLISHED_TIME if drive.estimators.stiffness_noise == "per-time" else None
        return parts.StiffnessSideslip(
            car_model, drive.sample_time, adaptive=not fixed, sliding=sliding, noise_time=noise_time
        )
    track, length = 0.5 * (vehicle.front_track + vehicle.rear_track), car.relaxation_length or 0.5
    wheels = FourWheel(*base, track, front / 2, rear / 2, length, length, car.friction)
    method: Any = kind.removeprefix("four-wheel-")
    return parts.FourWheelSideslip(wheels, drive.sample_time, method=method)


def run_chain(
    log: DriveLog,
    inputs: CornerInputs,
    pipeline: parts.EstimationPipeline,
    assumptions: tuple[str, ...],
    progress: Progress,
) -> Chain:
    """Every sample through the pipeline; signals that the log lacks are not flagged, missing samples are."""
    n, signals = log.time.size, log.signals
    zero = np.zeros(n)
    torque = at_corners(signals, "torque")
    ax, ay, turn = signals["ax"], signals.get("ay", zero), signals.get("yaw_rate", zero)
    wheel, steer = inputs.wheel_speed, inputs.steer
    optional = {name: signals[name] for name in ("az", "roll_rate", "pitch_rate", "direction") if name in signals}
    rows: list[tuple[Any, ...]] = []
    for k in range(n):
        extra = {name: value[k] for name, value in optional.items()}
        step = pipeline.step(parts.VehicleSignals(wheel[k], ax[k], ay[k], turn[k], steer[k], torque[k], **extra))
        part = np.nan if step.sideslip_step is None else step.sideslip_step.sideslip
        corner = np.nan if step.corners is None else step.corners.vy
        rows.append((
            step.vx, step.vy, step.sideslip, part, corner, step.force_x, step.axle_force_y, step.force_z, step.slip,
            step.slip_angle, step.vx_deviation, step.vy_deviation, step.force_x_deviation, step.lateral.deviation[..., :2],
            int(step.flags), int(step.consistency.failed),
        ))  # fmt: skip
        if k % max(1, n // PROGRESS_STEPS) == 0:
            progress(k / n)
    columns: list[Any] = [np.array(column) for column in zip(*rows, strict=True)]
    return Chain(*[*columns, assumptions])
