"""Both blocks of P5 on a drive: force observer, then the sideslip filter, for several settings at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimators.sideslip import (
    AdaptiveStiffnessObserver,
    FixedStiffnessObserver,
    SingleTrack,
    SlidingModeObserver,
    wheel_axes,
)
from studies.papers.smo_ekf_sideslip.axle_drive import SAMPLE_TIME, AxleDrive
from synthesis.polynomials.matrix import FloatArray


@dataclass(frozen=True)
class ChainRun:
    """Estimates (n, settings): rear sideslip rad; stiffness (n, settings, 2) N/rad; `forces` (n, settings, 3) N as estimated
    by block 1 (body axes: F_y1, F_yw2, F_x1).
    """

    rear_sideslip: FloatArray
    stiffness: FloatArray
    forces: FloatArray


def run_chain(drive: AxleDrive, cars: Sequence[SingleTrack], adaptive: bool = True) -> ChainRun:
    """Block 1 with its default linear zones, block 2 with adaptive (or fixed) stiffness; each setting is an assumed car."""
    n = len(drive.time)
    rear, stiffness = np.empty((n, len(cars))), np.empty((n, len(cars), 2))
    forces = {car.mass: _forces(drive, car) for car in cars}  # block 1 knows the mass alone
    kind = AdaptiveStiffnessObserver if adaptive else FixedStiffnessObserver
    for j, car in enumerate(cars):
        sideslip_filter = kind(car, sample_time=SAMPLE_TIME)
        for k, found in enumerate(forces[car.mass]):
            drive_force, front, back = wheel_axes(found, drive.steering[k])
            measured = [front, back, drive.lateral_acceleration[k]]
            step = sideslip_filter.step(drive.steering[k], drive.yaw_rate[k], drive.speed[k], drive_force, measured)
            rear[k, j], stiffness[k, j] = step.rear_sideslip, step.stiffness
    return ChainRun(rear, stiffness, np.stack([forces[car.mass][:, 1:] for car in cars], axis=1))


def _forces(drive: AxleDrive, car: SingleTrack) -> FloatArray:
    """States of block 1, (n, 4)."""
    observer = SlidingModeObserver(car, sample_time=SAMPLE_TIME)
    measured = np.stack([drive.yaw_rate, drive.lateral_acceleration, drive.longitudinal_acceleration], axis=1)
    return np.array([observer.step(sample).state for sample in measured])
