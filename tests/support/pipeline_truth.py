"""A car whose answer is known: all wheels use the same share mu of their load, slip is c mu, slip angle -(c_1 mu + c_3 mu^3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.forces import vertical_loads
from estimators.pipeline import EstimationPipeline, PipelineStep, VehicleSignals
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity import FusionSettings

TIME = 0.005
CAR = VehicleParameters.published_suv()
SETTINGS = FusionSettings()
SLIP = SETTINGS.slip_compliance
BIAS = (0.1, -0.1, 0.001)


class Truth(NamedTuple):
    """n samples: signals as measured, and what is to be found."""

    wheel_speed: FloatArray  # (n, 4)
    torque: FloatArray  # (n, 4)
    steer: FloatArray  # (n, 4)
    ax: FloatArray  # (n,)
    ay: FloatArray
    yaw_rate: FloatArray
    vx: FloatArray
    vy: FloatArray
    force_x: FloatArray  # (n, 4)
    force_z: FloatArray
    axle_force_y: FloatArray  # (n, 2)


def straight(acceleration: FloatArray, start: float, slip: float = SLIP) -> Truth:
    """V_x from an acceleration that is held over each sample; loads follow at once; `slip` is that at mu = 1."""
    n, car = acceleration.size, CAR
    vx = start + TIME * np.concatenate([[0.0], np.cumsum(acceleration[:-1])])
    vx = np.where(np.absolute(vx) < 1e-9, 0.0, vx)
    load = vertical_loads(car, acceleration, 0.0)
    mu = (acceleration / GRAVITY)[:, None]
    w = (vx[:, None] + np.absolute(vx[:, None]) * slip * mu) / car.radius
    force = mu * load
    spin = np.concatenate([np.diff(w, axis=0), np.zeros((1, 4))]) / TIME
    torque = force * car.radius + car.wheel_inertia * spin
    torque = np.concatenate([torque[:1], torque[:-1]])  # what acted since the last sample
    zero = np.zeros(n)
    return Truth(w, torque, np.zeros((n, 4)), acceleration, zero, zero, vx, zero, force, load, np.zeros((n, 2)))


def turning(
    n: int,
    speed: float = 20.0,
    yaw_rate: float = 0.2,
    slip: float = SLIP,
    side: tuple[float, float] = (SETTINGS.side_compliance, SETTINGS.side_cubic),
) -> Truth:
    """A steady turn to the left; `side` are c_1 and c_3."""
    car, ay = CAR, speed * yaw_rate
    mu = ay / GRAVITY
    angle = -(side[0] * mu + side[1] * mu**3)
    vy = speed * np.tan(angle) + yaw_rate * car.rear_axle_distance
    delta = np.arctan((vy + yaw_rate * car.front_axle_distance) / speed) - angle
    ax = -yaw_rate * vy
    load = vertical_loads(car, ax, ay)
    # all of F_x at the rear, half a wheel: then the front axle has F_y alone, and left and right make no moment
    front = car.mass * ay * car.rear_axle_distance / car.wheelbase / np.cos(delta)
    rear = car.mass * ay * car.front_axle_distance / car.wheelbase
    total = car.mass * ax + front * np.sin(delta)
    force = np.array([0.0, 0.0, total / 2, total / 2])
    steer = np.array([delta, delta, 0.0, 0.0])
    across = vy + yaw_rate * car.corner_x
    along = (speed - yaw_rate * car.corner_y) * np.cos(steer) + across * np.sin(steer)
    w = (along + speed * slip * force / load) / car.radius

    def repeat(value: FloatArray | float) -> FloatArray:
        out: FloatArray = np.tile(np.asarray(value, dtype=np.float64), (n, *[1] * np.ndim(value)))
        return out

    return Truth(
        repeat(w),
        repeat(force * car.radius),
        repeat(steer),
        repeat(ax),
        repeat(ay),
        repeat(yaw_rate),
        repeat(speed),
        repeat(vy),
        repeat(force),
        repeat(load),
        repeat(np.array([front, rear])),
    )


def noisy(truth: Truth, seed: int, bias: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Truth:
    """White noise of a good sensor, and constant errors of a_x, a_y, r."""
    rng, n = np.random.default_rng(seed), truth.ax.size
    return truth._replace(
        wheel_speed=truth.wheel_speed + 0.05 * rng.normal(size=(n, 4)),
        ax=truth.ax + bias[0] + 0.05 * rng.normal(size=n),
        ay=truth.ay + bias[1] + 0.05 * rng.normal(size=n),
        yaw_rate=truth.yaw_rate + bias[2] + 0.002 * rng.normal(size=n),
    )


def sample(truth: Truth, k: int) -> VehicleSignals:
    """What the car measures at sample k; every array may have batch axes in front of the time."""
    return VehicleSignals(
        truth.wheel_speed[..., k, :],
        truth.ax[..., k],
        truth.ay[..., k],
        truth.yaw_rate[..., k],
        truth.steer[..., k, :],
        truth.torque[..., k, :],
    )


def run(pipeline: EstimationPipeline, truth: Truth, start: int = 0, end: int | None = None) -> list[PipelineStep]:
    return [pipeline.step(sample(truth, k)) for k in range(start, truth.ax.shape[-1] if end is None else end)]


def flat(step: PipelineStep) -> bytes:
    """Every array of a step, as bytes."""

    def parts(value: object) -> list[bytes]:
        if isinstance(value, tuple):
            return [piece for entry in value for piece in parts(entry)]
        return [] if value is None else [np.ascontiguousarray(np.asarray(value)).tobytes()]

    return b"".join(parts(tuple(step)))


def finite(step: PipelineStep) -> bool:
    """Whether every estimate is; innovations may be NaN where nothing was measured."""
    own = step[: PipelineStep._fields.index("consistency")]
    return all(bool(np.isfinite(np.asarray(value)).all()) for value in (*own, *step.consistency))
