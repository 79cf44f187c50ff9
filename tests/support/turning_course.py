"""A car that turns, brakes sideways or stands on a slope, as samples for the fusion: signals, and the true velocities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.faults import Flag
from estimators.vehicle import GRAVITY
from estimators.velocity import FusionStep, VelocityFusion
from tests.support.fusion_course import CAR, STEP, Signals, driven

TIRE = (0.09, 0.09)  # alpha = c_1 mu + c_3 mu^3, rad


class Turn(NamedTuple):
    """Noisy signals of n samples, and V_x, V_y."""

    signals: Signals
    vx: FloatArray
    vy: FloatArray


def turn(
    seconds: float, yaw_rate: FloatArray, speed: float = 20.0, gravity: FloatArray | float = 0.0, seed: int = 0
) -> Turn:
    """Quasi-steady: V_y follows the side forces as on brush tires (`TIRE`); `gravity` along y is in a_y too.

    `yaw_rate` (n,); V_y' is part of a_y.
    """
    n, rng, car = round(seconds / STEP), np.random.default_rng(seed), CAR
    felt = speed * yaw_rate + gravity
    mu = felt / GRAVITY
    angle = -(TIRE[0] * mu + TIRE[1] * mu**3)
    vy = speed * np.tan(angle) + yaw_rate * car.rear_axle_distance
    delta = np.arctan((vy + yaw_rate * car.front_axle_distance) / speed) - angle
    steer = np.stack([delta, delta, 0.0 * delta, 0.0 * delta], axis=1)
    across = vy[:, None] + yaw_rate[:, None] * car.corner_x
    along = (speed - yaw_rate[:, None] * car.corner_y) * np.cos(steer) + across * np.sin(steer)
    noise = rng.normal(size=(3, n)) * np.array([[0.05], [0.05], [0.002]])
    signals = Signals(
        along / car.radius + 0.05 * rng.normal(size=(n, 4)), steer, -yaw_rate * vy + noise[0],
        felt + np.gradient(vy, STEP) + noise[1], yaw_rate + noise[2], np.zeros((n, 4)),
    )  # fmt: skip
    return Turn(signals, np.full(n, speed), vy)


def there_and_back(
    seconds: float, yaw_rate: float, begin: float = 1.5, end: float = 4.5, ramp: float = 0.6
) -> FloatArray:
    """Straight, a turn from `begin` to `end`, straight again."""
    t = STEP * np.arange(round(seconds / STEP))
    rise = np.clip((t - begin) / ramp, 0.0, 1.0) * np.clip((end - t) / ramp, 0.0, 1.0)
    return np.asarray(yaw_rate * rise * rise * (3.0 - 2.0 * rise))


class Driven(NamedTuple):
    """What became of a run."""

    steps: list[FusionStep]
    error_x: FloatArray
    error_y: FloatArray
    deviation_y: FloatArray
    used: FloatArray  # (n, 3) whether a_x, a_y, r were used


def run(course: Turn, fusion: VelocityFusion | None = None) -> Driven:
    steps, vx = driven(course.signals, fusion)
    vy, deviation = (np.array([getattr(step, name) for step in steps]) for name in ("vy", "vy_deviation"))
    used = np.array([step.inertial_used for step in steps])
    return Driven(steps, vx - course.vx, vy - course.vy, deviation, used)


def longest(condition: FloatArray) -> float:
    """s for which it holds without a break."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], condition.astype(int), [0]])))
    return float(np.diff(edges)[::2].max(initial=0)) * STEP


def resets(steps: list[FusionStep]) -> int:
    return sum(bool(step.flags & Flag.RESET) for step in steps)
