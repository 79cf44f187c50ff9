"""What reaches the fusion is finite: missing, impossible and repeated samples are held, counted and flagged.

A value that repeats bit for bit is taken for the old sample: a slow sensor behind a fast clock. An inertial signal that
has been the same for j samples has integrated one and the same error j times: the variance of the integral grows by
j^2 - (j - 1)^2 = 2 j - 1 times that of a single one. A wheel speed that repeats is not used again before its model error
has changed, so that a 50 Hz signal does not count four times; a wheel that reads zero has no other way to say so. An a_x
that is missing is held for a while, and then counts as zero; what replaces a_y and the yaw rate is in `signal_monitor`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.faults import Flag
from estimators.memory import CarsMemory
from estimators.signals import limits
from estimators.velocity.fusion_settings import FusionSettings

_LONGEST_RUN = 40.0  # samples a signal may repeat before it counts as stale; its noise grows no further
_MISSING_INPUT, _OUT_OF_RANGE = int(Flag.MISSING_INPUT), int(Flag.PARAMETER_OUT_OF_RANGE)
_MISSING, _STALE = int(Flag.MISSING_MEASUREMENT), int(Flag.STALE_MEASUREMENT)


class ConditionedInputs(NamedTuple):
    """Three inertial signals a_x, a_y, r, or four wheels."""

    inertial: Signals
    noise: Signals  # standard deviations of the means over this sample
    run: Signals  # samples for which each has been the same, or missing
    good: Signals  # whether each was there
    wheel_speed: Signals
    fresh: Signals  # a wheel speed that says something new
    gap: Signals  # s since the wheel last said something new
    silent: Signals  # a wheel that hardly turns
    left: Signals  # s for which a wheel is still believed to slip, as of the last sample
    steer: Signals
    steered: Number  # whether all steering angles were there
    locked: Number  # whether those in front have been the same for longer than a slow sensor is
    present: Number  # whether all inertial signals were there
    alive: Number  # whether a_x was there, and has not been the same for longer than a slow sensor is
    flags: Number
    wheel_flags: Signals


class FusionInputs(CarsMemory):
    """Remembers the last good values of `count` cars."""

    memory = ("inertial", "run", "wheel_speed", "age", "steer", "locked", "slope", "slip_left")
    unknowns = ("wheel_speed",)

    def __init__(self, radius: Signals, settings: FusionSettings, count: int) -> None:
        s = self.settings = settings
        self.radius, self.count = radius, count
        self.kit = kit = arithmetic((count,))
        self._limits = kit.signals((limits.ACCELERATION, limits.ACCELERATION, limits.YAW_RATE))
        self._quiet = kit.signals((s.acceleration_noise, s.acceleration_noise, s.yaw_rate_noise))
        self._loud = kit.signals((s.missing_acceleration, s.missing_acceleration, s.missing_yaw_rate))
        three, four = kit.signals((0.0,) * 3), kit.signals((0.0,) * 4)
        self.locked = zero = kit.full(0.0)  # s since a front steering angle last changed
        self.inertial, self.run = kit.each(lambda v: (v + zero, v + zero), three)
        # of the wheels: s since each last said something new, filtered derivative rad/s^2, s of high slip still believed
        wheels = kit.each(lambda v: (v + zero, v + zero, v + zero, v + zero, v + zero + math.nan), four)
        self.steer, self.age, self.slope, self.slip_left, self.wheel_speed = wheels

    def __call__(self, inertial: Signals, wheel_speed: Signals, steer: Signals, elapsed: Number) -> ConditionedInputs:
        """Raw signals, which may be anything; `elapsed` s, above zero."""
        kit, choose, no, some = self.kit, self.kit.where, self.kit.no, self.kit.some
        flags = kit.full(0)
        value, run, noise, good, stale = kit.each(
            self._inertial, inertial, self.inertial, self.run, self._limits, self._quiet, self._loud
        )
        present, tired = good[0] & good[1] & good[2], stale[0] | stale[1] | stale[2]
        if some(tired):
            flags = flags | choose(tired, _STALE, 0)
        if some(no(present)):
            flags = flags | self._missing(inertial, good)
            gone = no(good[0]) & (run[0] >= _LONGEST_RUN)
            value = kit.stacked((choose(gone, 0.0, value[0]), value[1], value[2]))
        (turned,) = kit.each(lambda angle: (abs(angle) <= limits.ANGLE,), steer)
        steered = turned[0] & turned[1] & turned[2] & turned[3]
        if some(no(steered)):
            flags = flags | choose(steered, 0, _MISSING_INPUT)
            (steer,) = kit.each(lambda good, angle, old: (choose(good, angle, old),), turned, steer, self.steer)
        same = (steer[0] == self.steer[0]) & (steer[1] == self.steer[1])
        self.locked = choose(same, self.locked + elapsed, 0.0)
        self.steer = steer
        self.inertial, self.run = value, run

        def wheel(new: Number, before: Number, age: Number, slope: Number, radius: Number) -> tuple[Number, ...]:
            good = abs(new) <= limits.WHEEL_SPEED
            gap, still = age + elapsed, abs(radius * new) < self.settings.still_speed
            fresh = good & ((new != before) | still | (gap >= self.settings.error_memory))
            known = abs(before) < math.inf  # NaN: never seen
            rate = choose(fresh & known, new - before, 0.0) / gap
            held = choose(good, new, before)
            return (
                held,
                choose(fresh, 0.0, gap),
                self._smooth(slope, rate, choose(fresh, gap, 0.0)),
                choose(abs(held) < math.inf, held, 0.0),
                fresh,
                gap,
                good & still,
                choose(fresh, 0, choose(good, _STALE, _MISSING)),
            )

        self.wheel_speed, self.age, self.slope, speed, fresh, gap, silent, wheel_flags = kit.each(
            wheel, wheel_speed, self.wheel_speed, self.age, self.slope, self.radius
        )
        wheels = (speed, fresh, gap, silent, self.slip_left, self.steer)
        alive = good[0] & (run[0] < _LONGEST_RUN) & ((run[0] - 1.0) * elapsed < self.settings.slowest_unit)
        locked = self.locked > self.settings.slowest_unit
        return ConditionedInputs(value, noise, run, good, *wheels, steered, locked, present, alive, flags, wheel_flags)

    def slipping(self, acceleration: Signals, fresh: Signals, elapsed: Number, doubt: Number) -> Signals:
        """Fresh wheels whose surface leaves the car, |R w' - a| too large, now or within the hold time.

        The wheel-acceleration criterion of P2 notes 7, relative to the acceleration of the car, which may be off by
        twice its `doubt`, m/s^2.
        """
        s, choose, largest = self.settings, self.kit.where, self.kit.maximum
        most = s.excess_acceleration + 2.0 * doubt

        def wheel(slope: Number, pull: Number, left: Number, new: Number, radius: Number) -> tuple[Number, ...]:
            excess = abs(radius * slope - pull) > most
            left = choose(excess, s.high_slip_hold, largest(left - elapsed, 0.0))
            return left, new & (left > 0.0)

        self.slip_left, slips = self.kit.each(wheel, self.slope, acceleration, self.slip_left, fresh, self.radius)
        return slips

    def _inertial(
        self, given: Number, last: Number, run: Number, limit: Number, quiet: Number, loud: Number
    ) -> tuple[Number, ...]:
        """Value, samples that it has been the same, noise, good, stale."""
        choose = self.kit.where
        good = abs(given) <= limit
        same = good & (given == last) & (run > 0.0)
        run = choose(good & self.kit.no(same), 1.0, self.kit.minimum(run + 1.0, _LONGEST_RUN))
        noise = choose(good, quiet, loud) * self.kit.sqrt(2.0 * run - 1.0)
        return choose(good, given, last), run, noise, good, same & (run >= _LONGEST_RUN)

    def _missing(self, inertial: Signals, good: Signals) -> Number:
        """Flags of inertial signals that are not usable."""
        flags, choose, no = self.kit.full(0), self.kit.where, self.kit.no
        for given, fine in zip(inertial, good, strict=True):
            finite = abs(given) < math.inf
            flags = flags | choose(finite, 0, _MISSING_INPUT) | choose(finite & no(fine), _OUT_OF_RANGE, 0)
        return flags

    def _smooth(self, last: Number, slope: Number, elapsed: Number) -> Number:
        """First-order filter y' = (x' - y)/lag, exact for piecewise linear x; no time, no change."""
        kept = self.kit.exp(-elapsed / self.settings.wheel_lag)
        return kept * last + (1.0 - kept) * slope
