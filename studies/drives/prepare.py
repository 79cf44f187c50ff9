"""The signals of one drive as arrays for the four corner observers, with what had to be assumed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from estimators.forces import normalised, vertical_loads
from estimators.vehicle import GRAVITY
from estimators.velocity import corner_acceleration_by_speed
from studies.drives import corner_inputs
from studies.drives.drive_file import DriveFile
from studies.drives.log import DriveLog
from studies.drives.quantities import CORNERS, at_corners


@dataclass(frozen=True)
class CornerInputs:
    """Inputs of the four corner observers over n samples, SI; corner order fl, fr, rl, rr.

    The relative acceleration is u = R_e dw/dt - (free + per_speed V_x), P1 (22), with the estimate of V_x put in as the
    observers run. ``assumptions`` says what the log did not give, ``force_sources`` where each corner's force is from.
    """

    time: FloatArray
    wheel_speed: FloatArray
    radius: FloatArray
    wheel_acceleration: FloatArray
    vertical_load: FloatArray
    force: FloatArray
    normalised_force: FloatArray
    free: FloatArray
    per_speed: FloatArray
    steer: FloatArray
    yaw_rate: FloatArray
    ax: FloatArray
    ay: FloatArray
    vy: FloatArray
    x: FloatArray
    y: FloatArray
    force_sources: tuple[str, ...]
    assumptions: tuple[str, ...]

    @property
    def surface_speed(self) -> FloatArray:
        """R_e w (n, 4), m/s."""
        return self.radius * self.wheel_speed


def first_speed(inputs: CornerInputs) -> float:
    """Mean of the wheel surface speeds where they are first known, m/s."""
    wheels = corner_inputs.mean_over(inputs.surface_speed)
    return float(wheels[np.flatnonzero(np.isfinite(wheels))[:1]].sum())


def dead_reckoned(inputs: CornerInputs, sample_time: float) -> tuple[FloatArray, FloatArray]:
    """V_x, V_y (n,) of the accelerations and the yaw rate alone, from the first wheel speeds on, m/s."""
    return corner_inputs.dead_reckoning(inputs.ax, inputs.ay, inputs.yaw_rate, sample_time, first_speed(inputs))


def corner_inputs_of(log: DriveLog, drive: DriveFile) -> CornerInputs:
    """Everything the observers need from a log; signals that are not measured count as zero, and are listed."""
    car, lag, step = drive.vehicle, drive.observer.derivative_lag, drive.sample_time
    assumptions: list[str] = []

    def measured(name: str, meaning: str) -> FloatArray:
        if name not in log.signals:
            assumptions.append(f"{meaning} is not measured: taken as 0")
        return log.signals.get(name, np.zeros_like(log.time))

    def rate(value: FloatArray) -> FloatArray:
        columns = [corner_inputs.derivative(column, step, lag) for column in np.atleast_2d(value.T)]
        return np.stack(columns, axis=-1).reshape(value.shape)

    wheel_speed = at_corners(log.signals, "wheel_speed")
    radius = np.repeat([car.effective_radius_front, car.effective_radius_rear], 2)
    ax, ay = log.signals["ax"], measured("ay", "lateral acceleration")
    yaw_rate, vy = measured("yaw_rate", "yaw rate"), measured("vy", "lateral velocity")
    steer = _steer(log, drive, assumptions)
    if drive.unsigned_wheels and (log.signals.get("direction", 0.0 * log.time) == 0.0).any():
        assumptions.append(
            "mean wheel speed is forward where no gear tells the way; the pipeline has it from the accelerometer"
        )
    wheel_acceleration = rate(wheel_speed)
    load = vertical_loads(car.parameters, ax, ay)
    force, sources = _forces(log, drive, wheel_speed, wheel_acceleration, load, radius)
    turning = yaw_rate, rate(yaw_rate)
    free, per_speed = corner_acceleration_by_speed(car.parameters, ax, ay, *turning, vy, steer, rate(steer))
    return CornerInputs(
        time=log.time, wheel_speed=wheel_speed, radius=radius, wheel_acceleration=wheel_acceleration,
        vertical_load=load, force=force,
        normalised_force=normalised(force, load, car.mass * GRAVITY / 4), free=free,
        per_speed=per_speed, steer=steer, yaw_rate=yaw_rate, ax=ax, ay=ay, vy=vy, x=car.parameters.corner_x,
        y=car.parameters.corner_y, force_sources=sources, assumptions=tuple(assumptions),
    )  # fmt: skip


def _steer(log: DriveLog, drive: DriveFile, assumptions: list[str]) -> FloatArray:
    """Road-wheel angles (n, 4), rad: per corner where measured, else both front wheels alike, rear wheels straight."""
    steer = np.zeros((log.time.size, 4))
    if "steering" in log.signals:
        steer[:, :2] = log.signals["steering"][:, None]
    elif "hand_wheel" in log.signals and drive.vehicle.steering_ratio:
        steer[:, :2] = log.signals["hand_wheel"][:, None] / drive.vehicle.steering_ratio
    elif not any(name.startswith("steer_") for name in log.signals):
        assumptions.append("steering angle is not measured: taken as 0")
    for k, corner in enumerate(CORNERS):
        steer[:, k] = log.signals.get(f"steer_{corner}", steer[:, k])
    return steer


def _forces(
    log: DriveLog, drive: DriveFile, wheel_speed: FloatArray, dw: FloatArray, load: FloatArray, radius: FloatArray
) -> tuple[FloatArray, tuple[str, ...]]:
    """F_x per corner: wheel dynamics where the torque is known, what is left of m a_x shared by load elsewhere."""
    car = drive.vehicle
    dynamics = corner_inputs.wheel_forces(
        at_corners(log.signals, "torque"), wheel_speed, dw, load, car.wheel_inertia or 0.0, radius,
        car.rolling_resistance, drive.observer.stopped_below, car.bearing_friction,
    )  # fmt: skip
    known = np.array([f"torque_{corner}" in log.signals for corner in CORNERS])
    sources = tuple("wheel dynamics" if k else "m*a_x shared by load" for k in known)
    if known.all():
        return dynamics, sources
    dynamics[:, ~known] = np.nan
    return corner_inputs.shared_forces(log.signals["ax"], load, car.mass, dynamics, known), sources
