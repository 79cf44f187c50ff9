"""Both blocks of P5 on recorded signals: forces by sliding mode, then rear sideslip with adapted or fixed stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.sideslip import (
    AdaptiveStiffnessObserver,
    FixedStiffnessObserver,
    SingleTrack,
    SlidingModeObserver,
    wheel_axes,
)
from studies.papers.smo_ekf_sideslip.inputs import SAMPLE_TIME


@dataclass(frozen=True)
class Signals:
    """What the car measures, (..., n) each: rad/s, m/s^2 twice, rad, and the speed in m/s."""

    yaw_rate: FloatArray
    ay: FloatArray
    ax: FloatArray
    steering: FloatArray
    speed: FloatArray


def axle_forces(car: SingleTrack, signals: Signals, start: FloatArray | None = None) -> FloatArray:
    """States of block 1, (..., n, 4): yaw rate rad/s, F_y1, F_yw2, F_x1 in N; with its default linear zones."""
    observer = SlidingModeObserver(car, signals.yaw_rate.shape[:-1], SAMPLE_TIME)
    if start is not None:
        observer.reset(state=start)
    measured = np.stack([signals.yaw_rate, signals.ay, signals.ax], axis=-1)
    return np.stack([observer.step(measured[..., k, :]).state for k in range(measured.shape[-2])], axis=-2)


def rear_sideslip(
    car: SingleTrack, signals: Signals, state: FloatArray, adaptive: bool = True
) -> tuple[FloatArray, FloatArray]:
    """beta_2 (..., n), rad, and stiffness of both axles (..., n, 2), N/rad, by block 2 from the states of block 1."""
    kind = AdaptiveStiffnessObserver if adaptive else FixedStiffnessObserver
    shape = signals.yaw_rate.shape
    observer = kind(car, shape[:-1], SAMPLE_TIME)
    forces = wheel_axes(state, signals.steering)  # P5 (9)
    measured = np.concatenate([forces[..., 1:], signals.ay[..., None]], axis=-1)
    rear, stiffness = np.empty(shape), np.empty((*shape, 2))
    for k in range(shape[-1]):
        steering, yaw_rate, speed = (values[..., k] for values in (signals.steering, signals.yaw_rate, signals.speed))
        step = observer.step(steering, yaw_rate, speed, forces[..., k, 0], measured[..., k, :])
        rear[..., k], stiffness[..., k, :] = step.rear_sideslip, step.stiffness
    return rear, stiffness


class Estimates(NamedTuple):
    """For k assumed cars: rear sideslip (n, k) rad; stiffness (n, k, 2) N/rad; F_y1, F_yw2, F_x1 in body axes (n, k, 3) N."""

    rear_sideslip: FloatArray
    stiffness: FloatArray
    forces: FloatArray


def estimates(signals: Signals, cars: Sequence[SingleTrack], adaptive: bool = True) -> Estimates:
    """Both blocks on signals (n,), for several assumed cars."""
    states = {car.mass: axle_forces(car, signals) for car in cars}  # block 1 knows the mass alone
    found = [(*rear_sideslip(car, signals, states[car.mass], adaptive), states[car.mass][:, 1:]) for car in cars]
    return Estimates(*(np.stack(values, axis=1) for values in zip(*found, strict=True)))
