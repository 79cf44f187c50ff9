"""Roll and pitch of the body: the gyros integrated, and led back by what the accelerometers say of gravity.

IMU convention (ISO, x forward, y left, z up; rates positive right-handed about x and y, accelerometers +g up at rest).
Pitch is positive nose up, so it falls with a positive rate about y; roll is positive left side up, and grows with the
rate about x: P1 (11), a_x = (vehicle part) + g sin(pitch), a_y = (vehicle part) + g sin(roll).
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from estimators.arguments import LIMIT, any_missing, batch, bounded, mask, number, pair, quiet, setting
from estimators.faults import BoolArray, Flag, FlagArray, raise_flag
from estimators.interpolate import FloatArray
from estimators.memory import Renewable
from estimators.signals.held import Held
from estimators.vehicle import GRAVITY

STEEPEST = math.sin(math.radians(60.0))
"""Sine of the largest tilt; beyond it a car lies on its side, and the difference of accelerations is an error."""
Number = TypeVar("Number", float, FloatArray)
_SIGNS = np.array([1.0, -1.0])  # roll grows with the rate about x, pitch falls with that about y


class AttitudeStep(NamedTuple):
    """What one step returns; leading axes are those of the batch."""

    roll: FloatArray  # rad, of the body against the road (phi_v)
    pitch: FloatArray  # rad (theta_v)
    total_roll: FloatArray  # rad, against the horizon (phi_v + phi_r)
    total_pitch: FloatArray  # rad
    innovation: FloatArray  # (..., 2) rad, low-passed accelerometer angle minus low-passed estimate, roll and pitch
    used: BoolArray  # (..., 2) whether the accelerometers corrected roll and pitch
    flags: FlagArray  # MISSING_MEASUREMENT (accelerometer), MISSING_INPUT (gyro, grade, bank), RESET


def without_gravity(
    ax: FloatArray, ay: FloatArray, total_roll: FloatArray, total_pitch: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """P1 (11): a_x - g sin(theta_v + theta_r), a_y - g sin(phi_v + phi_r), m/s^2."""
    return ax - GRAVITY * np.sin(total_pitch), ay - GRAVITY * np.sin(total_roll)


class _Read(NamedTuple):
    """What the inertial unit reads, what of it is the motion of the car, and how the road lies."""

    rate_x: npt.ArrayLike
    rate_y: npt.ArrayLike
    ay: npt.ArrayLike
    ax: npt.ArrayLike
    motion_y: npt.ArrayLike
    motion_x: npt.ArrayLike
    yaw_rate: npt.ArrayLike
    bank: npt.ArrayLike
    grade: npt.ArrayLike


class AttitudeObserver(Renewable):
    """phi' = p - r sin(theta) + L e_phi, theta' = -q + r sin(phi) + L e_theta, e = F(s) (stationary - estimate): P2, after Rehm.

    The stationary angles are those at which gravity explains what the accelerometers read beyond the motion of the car,
    sin(theta) = (a_x - (V_x' - r V_y))/g, sin(phi) = (a_y - (V_y' + r V_x))/g. Both they and the estimate pass the
    low-pass F(s) = 1/(tau s + 1) before they are compared, so rates and angles that agree pass undisturbed at every
    frequency. The error obeys tau e'' + e' + L e = 0; the default L = 1/(2 tau) damps it with 0.71. A gyro bias b
    leaves the error b/L. (P2 gives no gains; the yaw rate turns a sloping car's roll into pitch, and is left out if not given.)

    Without the motion of the car (None or missing) the gyros alone carry the angles; without gyros the accelerometers
    alone. Grade and bank of the road are inputs: the body's angle is the total one minus them.

    Args:
        sample_time: s.
        batch_shape: one entry a car; () for one.
        time_constant: tau, s.
        gain: L, 1/s; None: 1/(2 tau).

    Raises:
        EstimatorError: a setting that is not positive.
    """

    memory = ("angle", "lagged", "renewed")
    parts = ("yaw_rate", "road")

    def __init__(
        self,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        time_constant: float = 2.0,
        gain: float | None = None,
    ) -> None:
        self.sample_time = setting(sample_time, "sample_time", "s")
        self.time_constant = setting(time_constant, "time_constant", "s")
        self.gain = 0.5 / self.time_constant if gain is None else setting(gain, "gain", "1/s")
        super().__init__(batch(batch_shape))
        self._keep = math.exp(-self.sample_time / self.time_constant)
        self.yaw_rate = Held(self.batch_shape, "yaw_rate")
        self.road = Held((*self.batch_shape, 2), "bank and grade")
        self.angle: FloatArray = np.zeros((*self.batch_shape, 2))  # sin of roll and pitch, against the horizon
        self.lagged: FloatArray = np.zeros((*self.batch_shape, 2))  # F(s) (stationary - estimate)
        self._single = math.prod(self.batch_shape) == 1

    def step(
        self,
        rate_x: npt.ArrayLike,
        rate_y: npt.ArrayLike,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        motion_x: npt.ArrayLike | None = None,
        motion_y: npt.ArrayLike | None = None,
        yaw_rate: npt.ArrayLike = 0.0,
        grade: npt.ArrayLike = 0.0,
        bank: npt.ArrayLike = 0.0,
    ) -> AttitudeStep:
        """Takes one sample of the batch shape.

        Args:
            rate_x, rate_y: rad/s, of the gyros about x and y.
            ax, ay: m/s^2, of the accelerometers.
            motion_x, motion_y: m/s^2, V_x' - r V_y and V_y' + r V_x; None: not known.
            yaw_rate: rad/s.
            grade, bank: rad, of the road: theta_r (uphill positive) and phi_r (left side up).

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        shape = self.batch_shape
        flags: FlagArray = np.zeros(shape, dtype=np.int32)
        self._flag_renewed(flags)
        across, along = np.nan if motion_y is None else motion_y, np.nan if motion_x is None else motion_x
        read = _Read(rate_x, rate_y, ay, ax, across, along, yaw_rate, bank, grade)
        used = self._one(read, flags) if self._single else None
        if used is None:
            used = self._many(read, flags)
        total = np.arcsin(self.angle)
        body = total - self.road.last
        innovation = np.where(used, self.lagged, np.nan)
        return AttitudeStep(body[..., 0], body[..., 1], total[..., 0], total[..., 1], innovation, used, flags)

    def reset(self, where: npt.ArrayLike | None = None, roll: float = 0.0, pitch: float = 0.0) -> None:
        """Sets the entries `where` (bool mask; None: all) to the given angles against the horizon, rad; flagged RESET next.

        Raises:
            EstimatorError: a mask of another shape, angles that are not finite.
        """
        chosen = mask(where, self.batch_shape, "where")
        start = [setting(roll, "roll", "rad", low=-math.inf), setting(pitch, "pitch", "rad", low=-math.inf)]
        self.angle = np.where(chosen[..., None], np.clip(np.sin(start), -STEEPEST, STEEPEST), self.angle)
        self.lagged = np.where(chosen[..., None], 0.0, self.lagged)
        self.yaw_rate.forget(chosen)
        self.road.forget(chosen[..., None])
        self._renew(chosen)

    def _many(self, read: _Read, flags: FlagArray) -> BoolArray:
        """Moves `angle` and `lagged` by one sample and flags what is missing; returns `used`.

        The direction of gravity u = (sin pitch, sin roll, up) turns with u' = -w x u.
        """
        shape = self.batch_shape
        turn, no_turn = self.yaw_rate(read.yaw_rate)
        _, no_road = self.road(pair(read.bank, read.grade, shape, "bank", "grade"))
        for lost in (no_turn, no_road):
            if lost is not None:
                raise_flag(flags, any_missing(lost, shape), Flag.MISSING_INPUT)
        gyro = pair(read.rate_x, read.rate_y, shape, "rate_x", "rate_y")
        with np.errstate(invalid="ignore", over="ignore"):
            tilt = pair(read.ay, read.ax, shape, "ay", "ax")
            tilt = (tilt - pair(read.motion_y, read.motion_x, shape, "motion_y", "motion_x")) / GRAVITY
        used: BoolArray = np.ones((*shape, 2), dtype=np.bool_)
        if not quiet(tilt):
            used = bounded(tilt)
            tilt = np.where(used, tilt, 0.0)
            raise_flag(flags, any_missing(~used, shape), Flag.MISSING_MEASUREMENT)
        if not quiet(gyro):
            spins = bounded(gyro)
            gyro = np.where(spins, gyro, 0.0)
            raise_flag(flags, any_missing(~spins, shape), Flag.MISSING_INPUT)
        angle = self.angle
        up = np.sqrt(1.0 - np.minimum((angle * angle).sum(axis=-1), 1.0))
        spin = gyro * up[..., None] * _SIGNS + turn[..., None] * (_SIGNS * angle)[..., ::-1]
        moved, self.lagged = self._followed(angle, self.lagged, spin, _limited(tilt), used)
        self.angle = _limited(moved)
        return used

    def _one(self, read: _Read, flags: FlagArray) -> BoolArray | None:
        """`_many` for one car, in plain numbers; None, and nothing done, where a gyro or the road is missing."""
        shape = self.batch_shape
        p, q, side, ahead, across, along, turn, bank, grade = (
            number(value, shape, name) for name, value in zip(_Read._fields, read, strict=True)
        )
        if not abs(p) + abs(q) + abs(turn) + abs(bank) + abs(grade) <= LIMIT:
            return None
        self.yaw_rate.last, self.road.last = np.full(shape, turn), np.array((bank, grade)).reshape(*shape, 2)
        side, ahead = (side - across) / GRAVITY, (ahead - along) / GRAVITY
        used = [-LIMIT <= value <= LIMIT for value in (side, ahead)]
        if not (used[0] and used[1]):
            flags |= int(Flag.MISSING_MEASUREMENT)
        angles = self.angle.reshape(2).tolist()
        roll, pitch = angles
        up = math.sqrt(1.0 - min(roll * roll + pitch * pitch, 1.0))
        rates = p * up - turn * pitch, turn * roll - q * up
        moved, lags = [], []
        for angle, lagged, spin, sine, good in zip(
            angles, self.lagged.reshape(2).tolist(), rates, (side, ahead), used, strict=True
        ):
            stationary = min(max(sine, -STEEPEST), STEEPEST) if good else 0.0
            new, lag = self._followed(angle, lagged, spin, stationary, good)
            moved.append(min(max(new, -STEEPEST), STEEPEST))
            lags.append(lag)
        self.angle, self.lagged = np.array(moved).reshape(*shape, 2), np.array(lags).reshape(*shape, 2)
        return np.array(used).reshape(*shape, 2)

    def _followed(
        self, angle: Number, lagged: Number, spin: Number, stationary: Number, used: Any
    ) -> tuple[Number, Number]:
        """`angle` and `lagged` one sample on, of numbers or of arrays; `spin` is what the gyros make of the angle, 1/s."""
        lagged = self._keep * lagged + used * ((1.0 - self._keep) * (stationary - angle))
        return angle + self.sample_time * (spin + used * (self.gain * lagged)), lagged


def _limited(sine: FloatArray) -> FloatArray:
    limited: FloatArray = np.minimum(np.maximum(sine, -STEEPEST), STEEPEST)
    return limited
