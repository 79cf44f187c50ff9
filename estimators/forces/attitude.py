"""Roll and pitch of the body: the gyros integrated, and led back by what the accelerometers say of gravity.

IMU convention (ISO, x forward, y left, z up; rates positive right-handed about x and y, accelerometers +g up at rest).
Pitch is positive nose up, so it falls with a positive rate about y; roll is positive left side up, and grows with the
rate about x: P1 (11), a_x = (vehicle part) + g sin(pitch), a_y = (vehicle part) + g sin(roll).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import LIMIT, batch, mask, setting
from estimators.arithmetic import Number, Signals, arithmetic
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.faults import Flag
from estimators.memory import Renewable
from estimators.vehicle import GRAVITY

STEEPEST = math.sin(math.radians(60.0))
"""Sine of the largest tilt; beyond it a car lies on its side, and the difference of accelerations is an error."""
ACCELERATION_BIAS = 0.15
"""m/s^2, standard deviation of what the accelerometers read too much and nothing takes off."""
GYRO_BIAS = 0.003
"""rad/s, the same of the gyros."""
MISALIGNED = 0.005
"""rad, of the axes of the unit: a turn at r adds this much of r to both rates."""
LEVEL = (0.01, 0.02)
"""rad, standard deviations of bank and grade of a road before anything is known of it."""
_SURE = 2.0  # deviations by which accelerometers may differ before the deviation grows with them


class AttitudeStep(NamedTuple):
    """What one step returns; leading axes are those of the batch."""

    roll: FloatArray  # rad, of the body against the road (phi_v)
    pitch: FloatArray  # rad (theta_v)
    total_roll: FloatArray  # rad, against the horizon (phi_v + phi_r)
    total_pitch: FloatArray  # rad
    roll_deviation: FloatArray  # rad, standard deviation of the total roll; where the bank is given, of roll, too
    pitch_deviation: FloatArray  # rad
    innovation: FloatArray  # (..., 2) rad, low-passed accelerometer angle minus low-passed estimate, roll and pitch
    used: BoolArray  # (..., 2) whether the accelerometers corrected roll and pitch
    flags: FlagArray  # MISSING_MEASUREMENT (accelerometer), MISSING_INPUT (gyro, grade, bank), RESET


def without_gravity(
    ax: FloatArray, ay: FloatArray, total_roll: FloatArray, total_pitch: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """P1 (11): a_x - g sin(theta_v + theta_r), a_y - g sin(phi_v + phi_r), m/s^2."""
    return ax - GRAVITY * np.sin(total_pitch), ay - GRAVITY * np.sin(total_roll)


class AttitudeObserver(Renewable):
    """phi' = p - r sin(theta) + L e_phi, theta' = -q + r sin(phi) + L e_theta, e = F(s) (stationary - estimate): P2, after Rehm.

    The stationary angles are those at which gravity explains what the accelerometers read beyond the motion of the car,
    sin(theta) = (a_x - (V_x' - r V_y))/g, sin(phi) = (a_y - (V_y' + r V_x))/g. Both they and the estimate pass the
    low-pass F(s) = 1/(tau s + 1) before they are compared, so rates and angles that agree pass undisturbed at every
    frequency. The error obeys tau e'' + e' + L e = 0; the default L = 1/(2 tau) damps it with 0.71. A gyro bias b
    leaves the error b/L. (P2 gives no gains; the yaw rate turns a sloping car's roll into pitch, and is left out if not given.)

    Deviations are those of errors that last, as the first-order error obeys them: with the share u of the accelerometers,
    u' = L (1 - u), and the drift d' = bias + misalignment |r| - L d of the gyros, sigma^2 = (b_a u/g)^2 + (level (1-u))^2 + d^2;
    a difference above 2 sigma is an error of either, and its excess counts.

    Without the motion of the car (None or missing) the gyros alone carry the angles; without gyros the accelerometers
    alone. Grade and bank of the road are inputs: the body's angle is the total one minus them.

    Args:
        sample_time: s.
        batch_shape: one entry a car; () for one.
        time_constant: tau, s.
        gain: L, 1/s; None: 1/(2 tau).

    Raises:
        EstimatorError: a setting that is not positive.

    >>> observer = AttitudeObserver(sample_time=0.005)
    >>> step = observer.step(rate_x=0.0, rate_y=0.0, ax=0.0, ay=0.0)
    >>> round(float(step.roll), 3), round(float(step.pitch), 3)  # rad, on a level road
    (0.0, 0.0)
    """

    memory = ("angle", "lagged", "share", "drift", "yaw_rate", "road", "renewed")

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
        self._kit = kit = arithmetic(self.batch_shape)
        self.angle: Signals = kit.stacked([kit.full(0.0)] * 2)  # sin of roll and pitch, against the horizon
        self.lagged: Signals = kit.stacked([kit.full(0.0)] * 2)  # F(s) (stationary - estimate)
        self.share: Signals = kit.stacked([kit.full(0.0)] * 2)  # of the accelerometers in the angles
        self.drift: Signals = kit.stacked([kit.full(0.0)] * 2)  # deviation of what the gyros have added, rad
        self.yaw_rate: Number = kit.full(0.0)  # the last known ones
        self.road: Signals = kit.stacked([kit.full(0.0)] * 2)  # bank and grade

    def like(self, batch_shape: tuple[int, ...]) -> AttitudeObserver:
        """The same for another batch, as new."""
        return AttitudeObserver(self.sample_time, batch_shape, self.time_constant, self.gain)

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
        shape, kit, choose = self.batch_shape, self._kit, self._kit.where
        names = ("rate_x", "rate_y", "ay", "ax", "yaw_rate", "bank", "grade")
        given = (rate_x, rate_y, ay, ax, yaw_rate, bank, grade)
        p, q, side, ahead, turn, *road = (kit.car(value, shape, name) for value, name in zip(given, names, strict=True))
        across, along = (
            kit.full(math.nan) if value is None else kit.car(value, shape, name)
            for value, name in ((motion_y, "motion_y"), (motion_x, "motion_x"))
        )
        known = [abs(value) <= LIMIT for value in (p, q, turn, *road)]  # False for NaN
        complete = known[0] & known[1] & known[2] & known[3] & known[4]
        if kit.some(kit.no(complete)):
            p, q = choose(known[0], p, 0.0), choose(known[1], q, 0.0)
            turn = choose(known[2], turn, self.yaw_rate)
            road = [choose(good, new, old) for good, new, old in zip(known[3:], road, self.road, strict=True)]
        self.yaw_rate, self.road = turn, kit.stacked(road)
        with kit.silent():
            sines = (side - across) / GRAVITY, (ahead - along) / GRAVITY
        used = [abs(value) <= LIMIT for value in sines]
        roll, pitch = self.angle
        up = kit.sqrt(1.0 - kit.minimum(roll * roll + pitch * pitch, 1.0))
        spins, unlike = (p * up - turn * pitch, turn * roll - q * up), GYRO_BIAS + MISALIGNED * abs(turn)
        states = self.angle, self.lagged, self.share, self.drift
        moved = [self._followed(unlike, *entry) for entry in zip(*states, LEVEL, spins, sines, used, strict=True)]
        self.angle, self.lagged, self.share, self.drift, *sigma = (
            kit.stacked(values) for values in zip(*moved, strict=True)
        )
        deviation = kit.table(sigma, shape)
        total = np.arcsin(kit.table((self.angle,), shape))
        body, counts = total - kit.table((self.road,), shape), kit.table((used,), shape)
        off = [choose(good, value, math.nan) for good, value in zip(used, self.lagged, strict=True)]
        reasons = choose(complete, 0, int(Flag.MISSING_INPUT)) | choose(
            used[0] & used[1], 0, int(Flag.MISSING_MEASUREMENT)
        )
        flags: FlagArray = np.array(reasons, dtype=np.int32).reshape(shape)
        self._flag_renewed(flags)
        return AttitudeStep(
            body[..., 0], body[..., 1], total[..., 0], total[..., 1], deviation[..., 0], deviation[..., 1],
            kit.table((off,), shape), counts, flags,
        )  # fmt: skip

    def reset(self, where: npt.ArrayLike | None = None, roll: float = 0.0, pitch: float = 0.0) -> None:
        """Sets the entries `where` (bool mask; None: all) to the given angles against the horizon, rad; flagged RESET next.

        Raises:
            EstimatorError: a mask of another shape, angles that are not finite.
        """
        chosen = mask(where, self.batch_shape, "where")
        start = [setting(roll, "roll", "rad", low=-math.inf), setting(pitch, "pitch", "rad", low=-math.inf)]
        kit, here = self._kit, self._kit.own(chosen)
        starts = [min(max(math.sin(value), -STEEPEST), STEEPEST) for value in start]
        self.angle = kit.stacked([kit.where(here, new, old) for new, old in zip(starts, self.angle, strict=True)])
        for name in ("lagged", "share", "drift", "road", "yaw_rate"):
            setattr(self, name, kit.replaced(here, 0.0, getattr(self, name)))
        self._renew(chosen)

    def _followed(
        self,
        unlike: Number,
        angle: Number,
        lagged: Number,
        share: Number,
        drift: Number,
        level: float,
        spin: Number,
        sine: Number,
        used: Number,
    ) -> tuple[Number, ...]:
        """Sine, lagged difference, share, drift and deviation of an angle, one sample on.

        The direction of gravity u = (sin pitch, sin roll, up) turns with u' = -w x u; `spin` is what the gyros make of that,
        1/s, `sine` the stationary one; `unlike`: deviation of the gyros' lasting error, rad/s.
        """
        kit, time = self._kit, self.sample_time
        stationary = kit.where(used, kit.minimum(kit.maximum(sine, -STEEPEST), STEEPEST), 0.0)
        lagged = self._keep * lagged + used * ((1.0 - self._keep) * (stationary - angle))
        felt, begun = ACCELERATION_BIAS / GRAVITY * share, level * (1.0 - share)
        variance, gain = felt * felt + begun * begun + drift * drift, self.gain * used
        moved = angle + time * (spin + gain * lagged)
        share = share + time * gain * (1.0 - share)
        drift = drift + time * (unlike - gain * drift)
        excess = used * kit.maximum(abs(lagged) - _SURE * kit.sqrt(variance), 0.0)
        sigma = kit.sqrt(variance + excess * excess)
        return kit.minimum(kit.maximum(moved, -STEEPEST), STEEPEST), lagged, share, kit.minimum(drift, STEEPEST), sigma
