"""What reaches the fusion is finite: missing, impossible and repeated samples are held, counted and flagged.

A value that repeats bit for bit is taken for the old sample: a slow sensor behind a fast clock. An inertial signal that
has been the same for j samples has integrated one and the same error j times: the variance of the integral grows by
j^2 - (j - 1)^2 = 2 j - 1 times that of a single one. A wheel speed that repeats is not used again before its model error
has changed, so that a 50 Hz signal does not count four times; a wheel that reads zero has no other way to say so. An
inertial signal that is missing is held for a while, and then counts as zero: held in a turn, it would run away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.faults import BoolArray, Flag, FlagArray, raise_flag
from estimators.interpolate import FloatArray
from estimators.signals.checks import any_missing
from estimators.signals.memory import Memory
from estimators.velocity.fusion_settings import FusionSettings

_LIMITS = np.array([100.0, 100.0, 20.0])  # m/s^2, m/s^2, rad/s: beyond, a signal is not that of a car
_LARGEST_WHEEL_SPEED = 1000.0  # rad/s
_LARGEST_STEER = 1.5  # rad
_LONGEST_RUN = 40  # samples a signal may repeat before it counts as stale; its noise grows no further


class Screened(NamedTuple):
    """Inertial signals (b, 3): a_x, a_y, r; wheels (b, 4)."""

    inertial: FloatArray
    noise: FloatArray  # (b, 3) standard deviation of the mean over this sample
    wheel_speed: FloatArray
    fresh: BoolArray  # (b, 4) a wheel speed that says something new
    steer: FloatArray
    steered: BoolArray  # (b,) whether all steering angles were there
    present: BoolArray  # (b,) whether all inertial signals were there
    blind: BoolArray  # (b,) a_y or r has been missing for long: both are given as 0
    flags: FlagArray  # (b,)
    wheel_flags: FlagArray  # (b, 4)


class FusionScreen(Memory):
    """Remembers the last good values of b runs."""

    memory = ("inertial", "run", "wheel_speed", "age", "steer", "slope", "slip_left")
    unknowns = ("wheel_speed",)

    def __init__(self, radius: FloatArray, settings: FusionSettings, count: int) -> None:
        s = self.settings = settings
        self.radius = radius.copy()
        self.quiet = np.array([s.acceleration_noise, s.acceleration_noise, s.yaw_rate_noise])
        self.loud = np.array([s.missing_acceleration, s.missing_acceleration, s.missing_yaw_rate])
        self.inertial: FloatArray = np.zeros((count, 3))
        self.run: FloatArray = np.zeros((count, 3))
        self.wheel_speed: FloatArray = np.full((count, 4), np.nan)
        self.age: FloatArray = np.zeros((count, 4))  # s since the wheel last said something new
        self.steer: FloatArray = np.zeros((count, 4))
        self.slope: FloatArray = np.zeros((count, 5))  # filtered derivatives: wheels, then the yaw rate, rad/s^2
        self.slip_left: FloatArray = np.zeros((count, 4))  # s for which high slip is still believed

    def forget(self, where: BoolArray) -> None:
        """Starts the entries `where` (b,) afresh."""
        for array in (self.inertial, self.run, self.age, self.steer, self.slope, self.slip_left):
            array[where] = 0.0
        self.wheel_speed[where] = np.nan

    def __call__(
        self, inertial: FloatArray, wheel_speed: FloatArray, steer: FloatArray, elapsed: FloatArray
    ) -> Screened:
        """Raw arrays (b, 3), (b, 4), (b, 4), (b,); all may hold anything but `elapsed`."""
        count = elapsed.size
        flags: FlagArray = np.zeros(count, dtype=np.int32)
        wheel_flags: FlagArray = np.zeros((count, 4), dtype=np.int32)
        good: BoolArray = np.absolute(inertial) <= _LIMITS
        same = good & (inertial == self.inertial) & (self.run > 0)
        value = np.where(good, inertial, self.inertial)
        run = np.where(good & ~same, 1.0, np.minimum(self.run + 1.0, _LONGEST_RUN))
        noise = np.where(good, self.quiet, self.loud) * np.sqrt(2.0 * run - 1.0)
        blind: BoolArray = np.zeros(count, dtype=np.bool_)
        if not good.all():
            finite: BoolArray = np.isfinite(inertial)
            raise_flag(flags, any_missing(~finite, (count,)), Flag.MISSING_INPUT)
            raise_flag(flags, any_missing(finite & ~good, (count,)), Flag.PARAMETER_OUT_OF_RANGE)
            gone = ~good & (run >= _LONGEST_RUN)
            gone[:, 1:] |= gone[:, 1:].any(axis=1, keepdims=True)  # a_y without r, or r without a_y, misleads V_y
            value = np.where(gone, 0.0, value)
            blind = gone[:, 1]
        if same.any():
            raise_flag(flags, any_missing(same & (run >= _LONGEST_RUN), (count,)), Flag.STALE_MEASUREMENT)
        turned: BoolArray = np.absolute(steer) <= _LARGEST_STEER
        steered = ~any_missing(~turned, (count,))
        if not steered.all():
            raise_flag(flags, ~steered, Flag.MISSING_INPUT)
        self.steer = np.where(turned, steer, self.steer)
        yaw_step = np.where((self.run[:, 2] > 0) & good[:, 2], value[:, 2] - self.inertial[:, 2], 0.0) / elapsed
        self.inertial, self.run = value, run
        speed, fresh = self._wheels(wheel_speed, elapsed, wheel_flags)
        self._smooth(slice(4, 5), yaw_step[:, None], elapsed[:, None])
        present = ~any_missing(~good, (count,))
        return Screened(value, noise, speed, fresh, self.steer, steered, present, blind, flags, wheel_flags)

    def _wheels(self, given: FloatArray, elapsed: FloatArray, flags: FlagArray) -> tuple[FloatArray, BoolArray]:
        good: BoolArray = np.absolute(given) <= _LARGEST_WHEEL_SPEED
        if not good.all():
            raise_flag(flags, ~good, Flag.MISSING_MEASUREMENT)
        age: FloatArray = self.age + elapsed[:, None]
        silent = np.absolute(self.radius * given) < self.settings.still_speed
        repeated = good & (given == self.wheel_speed)
        fresh: BoolArray = good & (~repeated | silent | (age >= self.settings.error_memory))
        if not fresh.all():
            raise_flag(flags, good & ~fresh, Flag.STALE_MEASUREMENT)
        known = np.isfinite(self.wheel_speed)
        step = np.where(fresh & known, given - np.where(known, self.wheel_speed, 0.0), 0.0) / age
        self._smooth(slice(0, 4), step, np.where(fresh, age, 0.0))
        self.age = np.where(fresh, 0.0, age)
        self.wheel_speed = np.where(good, given, self.wheel_speed)
        return np.where(np.isfinite(self.wheel_speed), self.wheel_speed, 0.0), fresh

    def _smooth(self, part: slice, slope: FloatArray, elapsed: FloatArray) -> None:
        """First-order filter y' = (x' - y)/lag, exact for piecewise linear x; no time, no change."""
        kept = np.exp(-elapsed / self.settings.wheel_lag)
        self.slope[:, part] = kept * self.slope[:, part] + (1.0 - kept) * slope

    def slipping(self, acceleration: FloatArray, elapsed: FloatArray) -> BoolArray:
        """Wheels (b, 4) whose surface leaves the car, |R w' - a| too large, now or within the hold time.

        The wheel-acceleration criterion of P2 section 7, relative to the measured acceleration of the car.
        """
        excess = np.absolute(self.radius * self.slope[:, :4] - acceleration) > self.settings.excess_acceleration
        self.slip_left = np.where(
            excess, self.settings.high_slip_hold, np.maximum(self.slip_left - elapsed[:, None], 0.0)
        )
        out: BoolArray = self.slip_left > 0.0
        return out
