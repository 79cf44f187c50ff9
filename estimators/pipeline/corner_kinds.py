"""The papers' corner observers behind one interface: what `CornerObservers` and a replay put at the four corners of a car.

A kind has `batch_shape`, which ends with the four corners, `sample_time`, `uses_slip` (whether it looks at the slip ratios
and the accelerations of the car), `step(CornerSample) -> CornerStep` and `reset(where)`; `save` and `restore` as `Memory`.
"""

from __future__ import annotations

from typing import Literal, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, mask
from estimators.arrays import AnyArray, BoolArray, FlagArray, FloatArray
from estimators.memory import Memory
from estimators.schedule import GainSchedule
from estimators.velocity.high_slip import HighSlipDetector, HighSlipSettings
from estimators.velocity.lpv import LpvVelocityObserver
from estimators.velocity.ltv_kalman import LtvKalmanObserver
from estimators.velocity.ltv_model import BristleTire
from estimators.velocity.switching import SwitchedVelocityObserver


class CornerSample(NamedTuple):
    """One sample of the corners (..., 4) of a car, or of a batch of them; NaN where missing."""

    relative_acceleration: FloatArray  # u, m/s^2: R_e dw/dt - d(v_xt)/dt, sideways -d(v_yt)/dt
    normalised_force: FloatArray  # F_x/F_z, sideways F_y/F_z
    wheel_speed: FloatArray  # rad/s
    wheel_acceleration: FloatArray  # rad/s^2
    slip: FloatArray  # slip ratios of the last estimate
    ax: npt.ArrayLike  # (...) m/s^2
    ay: npt.ArrayLike  # (...) m/s^2


class CornerStep(NamedTuple):
    """What a step made of it, (..., 4)."""

    relative_velocity: FloatArray  # R_e w - v_xt, sideways -v_yt, m/s
    innovation: FloatArray  # of the normalised force; NaN where missing
    used: BoolArray
    flags: FlagArray
    high_slip: BoolArray  # whether the observer took the wheel for one that slips much


class CornerKind(Protocol):
    """What stands at the corners."""

    batch_shape: tuple[int, ...]
    sample_time: float
    uses_slip: bool

    def step(self, sample: CornerSample) -> CornerStep:
        """Takes one sample."""

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the corners `where` (bool mask of the batch shape; None: all) afresh."""

    def save(self) -> dict[str, AnyArray]:
        """Everything needed to continue later."""


class ScheduledCorners(Memory):
    """Gains scheduled by wheel speed, P1 (24) and (38), P3 (7) and (12).

    Raises:
        EstimatorError, ScheduleError: as `LpvVelocityObserver`.
    """

    parts = ("observer",)
    uses_slip = False

    def __init__(self, schedule: GainSchedule, batch_shape: tuple[int, ...] = (4,)) -> None:
        self.batch_shape, self.sample_time = batch(batch_shape, corners=True), schedule.sample_time
        self.observer = LpvVelocityObserver(schedule, self.batch_shape)
        self._never: BoolArray = np.zeros(self.batch_shape, dtype=np.bool_)
        self._never.flags.writeable = False

    def step(self, sample: CornerSample) -> CornerStep:
        """Takes one sample."""
        found = self.observer.step(*sample[:3])
        return CornerStep(found.estimate[..., 1], found.innovation, found.used, found.flags, self._never)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the corners `where` (bool mask of the batch shape; None: all) afresh."""
        self.observer.reset(where)


class SwitchedCorners(Memory):
    """A schedule up to 15 % of slip, P3's gain of high slip beyond it: P3 (19), Example 2.

    Raises:
        EstimatorError, ScheduleError: as `SwitchedVelocityObserver`.
    """

    parts = ("observer",)
    uses_slip = True

    def __init__(self, schedule: GainSchedule, batch_shape: tuple[int, ...] = (4,)) -> None:
        self.batch_shape, self.sample_time = batch(batch_shape, corners=True), schedule.sample_time
        self.observer = SwitchedVelocityObserver(schedule, batch_shape=self.batch_shape)

    def step(self, sample: CornerSample) -> CornerStep:
        """Takes one sample."""
        found = self.observer.step(*sample[:3], sample.slip)
        return CornerStep(found.estimate[..., 1], found.innovation, found.used, found.flags, found.high_slip)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the corners `where` (bool mask of the batch shape; None: all) afresh."""
        self.observer.reset(where)


class KalmanCorners(Memory):
    """P2's time-varying Kalman filter (19)-(23), its covariances switched by the slip threshold (29) and by |dw/dt|.

    Args:
        tire: constants of the bristle model.
        sample_time: s.
        batch_shape: ends with the four corners.
        states: 3 as printed; 2: the equivalent form that is observable at constant speed.
        settings: of the high-slip detection; None: those of the paper.
        process: covariance of the process, "input" or "identity", as `LtvKalmanObserver`.

    Raises:
        EstimatorError: as `LtvKalmanObserver` and `HighSlipDetector`.
    """

    parts = ("observer", "detector")
    uses_slip = True

    def __init__(
        self,
        tire: BristleTire,
        sample_time: float,
        batch_shape: tuple[int, ...] = (4,),
        states: Literal[2, 3] = 3,
        settings: HighSlipSettings | None = None,
        process: str = "input",
    ) -> None:
        self.batch_shape, self.sample_time = batch(batch_shape, corners=True), sample_time
        self.observer = LtvKalmanObserver(tire, sample_time, self.batch_shape, states=states, process=process)
        self.detector = HighSlipDetector(settings, self.batch_shape[:-1])

    def step(self, sample: CornerSample) -> CornerStep:
        """Takes one sample."""
        u, mu, w, spin, slip, ax, ay = sample
        high = self.detector.step(ax, ay, slip, spin).high
        found = self.observer.step(u, mu, w, spin, high)
        return CornerStep(found.relative_velocity, found.innovation, found.used, found.flags, high)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the corners `where` (bool mask of the batch shape; None: all) afresh."""
        chosen = mask(where, self.batch_shape, "where")
        self.observer.reset(chosen)
        self.detector.reset(np.asarray(chosen.all(axis=-1)))
