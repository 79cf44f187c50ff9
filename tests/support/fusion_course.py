"""A straight course with rolling, slipping and noisy wheels, for tests of the fusion."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity import FusionStep, VelocityFusion

CAR = VehicleParameters.published_suv()
STEP = 0.005
COMPLIANCE = 0.04  # slip per unit of mu, within the prior of the fusion


class Course(NamedTuple):
    """n samples of clean signals on a straight road, and the true speed."""

    speed: FloatArray
    ax: FloatArray
    wheel_speed: FloatArray  # (n, 4)
    force: FloatArray  # (n, 4) F_x/F_z


def course(acceleration: FloatArray, start: float = 0.0) -> Course:
    """All wheels drive and brake alike: mu = a/g, slip COMPLIANCE mu."""
    speed = start + STEP * np.concatenate([[0.0], np.cumsum(acceleration[1:])])
    mu = np.repeat(acceleration[:, None] / GRAVITY, 4, axis=1)
    surface = speed[:, None] + np.abs(speed[:, None]) * COMPLIANCE * mu
    return Course(speed, acceleration, surface / CAR.radius, mu)


def phases(*parts: tuple[float, float]) -> FloatArray:
    """Accelerations from (seconds, m/s^2)."""
    return np.concatenate([np.full(round(seconds / STEP), a) for seconds, a in parts])


class Signals(NamedTuple):
    """What the sensors say; change it at will."""

    wheel_speed: FloatArray
    steer: FloatArray
    ax: FloatArray
    ay: FloatArray
    yaw_rate: FloatArray
    force: FloatArray


def sensed(drive: Course, seed: int = 0, bias: float = 0.0) -> Signals:
    """With white noise of the usual size and a constant error of a_x."""
    rng = np.random.default_rng(seed)
    n = drive.speed.size
    wheels = np.where(drive.wheel_speed == 0.0, 0.0, drive.wheel_speed + 0.05 * rng.normal(size=(n, 4)))
    noise = rng.normal(size=(3, n)) * np.array([[0.05], [0.05], [0.002]])
    return Signals(wheels, np.zeros((n, 4)), drive.ax + bias + noise[0], noise[1], noise[2], drive.force.copy())


def driven(
    signals: Signals, fusion: VelocityFusion | None = None, **options: Any
) -> tuple[list[FusionStep], FloatArray]:
    """All steps, and V_x."""
    runner = VelocityFusion(CAR, STEP) if fusion is None else fusion
    steps = [runner.step(*sample, **{k: v[i] for k, v in options.items()}) for i, sample in enumerate(zip(*signals))]  # noqa: B905
    return steps, np.array([step.vx for step in steps])
