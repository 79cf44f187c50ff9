"""The corner observers that a drive file can ask for, behind one step for the four corners of a car."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from estimators import EstimatorError, GainSchedule, LpvVelocityObserver
from estimators.velocity import BristleTire, HighSlipDetector, LtvKalmanObserver, SwitchedVelocityObserver
from studies.drives.drive_file import DriveFile
from studies.drives.schedules import load_tire
from synthesis.errors import SpecError

Array = npt.NDArray[np.float64]


class CornerSample(NamedTuple):
    """One sample, (4,) unless said otherwise; SI."""

    relative_acceleration: Array  # u = R_e dw/dt - d(v_xt)/dt
    normalised_force: Array
    wheel_speed: Array
    wheel_acceleration: Array
    slip: Array  # slip ratios of the last estimate
    ax: float
    ay: float


class CornerStep(NamedTuple):
    """What one step made of it, (4,)."""

    relative_velocity: Array
    innovation: Array
    flags: npt.NDArray[np.int32]


class CornerObserver(Protocol):
    """Four corners, sample by sample."""

    def step(self, sample: CornerSample) -> CornerStep:
        """Takes one sample."""


class ScheduledObserver:
    """``lpv``: gains scheduled by wheel speed, P1 (24)."""

    def __init__(self, schedule: GainSchedule) -> None:
        self._observer = LpvVelocityObserver(schedule)

    def step(self, sample: CornerSample) -> CornerStep:
        """Takes one sample."""
        step = self._observer.step(sample.relative_acceleration, sample.normalised_force, sample.wheel_speed)
        return CornerStep(step.estimate[:, 1], step.innovation, step.flags)


class GainSwitchedObserver:
    """``gain-switched``: the schedule up to 15 % of slip, P3's gain of high slip beyond it, P3 (19), Example 2."""

    def __init__(self, schedule: GainSchedule) -> None:
        self._observer = SwitchedVelocityObserver(schedule)

    def step(self, sample: CornerSample) -> CornerStep:
        """Takes one sample."""
        u, mu, w = sample.relative_acceleration, sample.normalised_force, sample.wheel_speed
        step = self._observer.step(u, mu, w, sample.slip)
        return CornerStep(step.estimate[:, 1], step.innovation, step.flags)


class KalmanObserver:
    """``kalman-three-state``, ``kalman-two-state``: P2 (19)-(23) with the covariances switched by P2 (29) and |dw/dt|."""

    def __init__(self, tire: BristleTire, sample_time: float, states: Literal[2, 3]) -> None:
        self._observer = LtvKalmanObserver(tire, sample_time, states=states)
        self._detector = HighSlipDetector()

    def step(self, sample: CornerSample) -> CornerStep:
        """Takes one sample."""
        u, mu, w, dw = sample[:4]
        high = self._detector.step(sample.ax, sample.ay, sample.slip, dw).high
        step = self._observer.step(u, mu, w, dw, high)
        return CornerStep(step.relative_velocity, step.innovation, step.flags)


def corner_observer(drive: DriveFile, folder: Path, schedule: GainSchedule) -> CornerObserver:
    """What ``estimators.corner_velocity`` of the drive file asks for; ``folder`` is that of the drive file.

    Raises SpecError, one line, when the schedule cannot serve it.
    """
    kind = drive.estimators.corner_velocity
    try:
        if kind == "gain-switched":
            return GainSwitchedObserver(schedule)
        if kind == "lpv":
            return ScheduledObserver(schedule)
        tire = load_tire(drive.schedules.longitudinal, folder)
        return KalmanObserver(tire, schedule.sample_time, 3 if kind == "kalman-three-state" else 2)
    except EstimatorError as error:
        raise SpecError(f"estimators.corner_velocity = '{kind}': {error}") from error
