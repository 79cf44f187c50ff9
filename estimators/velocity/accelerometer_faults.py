"""Accelerometer fault detection: by the tire forces, and by the side to which wheels slip.

**Forces.** Which acceleration moves the car: the one that is measured, or the one that the tire forces make?

    a_F = g (s_f mu_f + s_r mu_r)/(1 + (h/L)(mu_f - mu_r)),      mu = F_x/F_z, mean of an axle, s its static load share

from sum F_x = m a and loads that shift by m a h/L. The accelerometer feels forces alone, so grade is in neither. Forces
come from torques and wheel speeds, thus a_x has no part in a_F. Two sources that contradict each other leave it open which
is wrong; the wheels decide: the middle of their surface accelerations follows the car, unless it leaves both.

    believed   a_x                    as long as it is there, alive and within `force_gap_floor` + `force_gap_linear` |a_F| of a_F
    pending    a_x, as unsure as the two are apart, until the wheels side with one of them
    doubted    a_F, if the wheels side with it, or a_x is missing, frozen or disproved (slip direction)
    blind      what the wheels gain, +-`unseen_acceleration`, if the forces are not known either

Reading a_F, the filter stays as sure as the forces are, unless the wheels leave to a side to which these cannot make them
slip. An error of this kind stays: its deviation s counts (2 j - 1) s^2 in the j-th sample, up to `error_memory`. Nothing
that is not believed teaches bias, scale or grade.

**Slip direction.** Do all wheels slip against their force? Friction opposes slip, so no tire does: then the estimate is wrong.

A braked wheel is never faster than the road, a driven one never slower. Which side is possible is known only where the
wheel uses some friction (`unloaded`). When all wheels that turn, three at least, are off to the impossible side by more
than the uncertainty of the estimate, their noise and their radii allow, it is a_x that has brought the estimate there:
for `lost_time` it counts as missing, and forces or wheels take its place. This needs no torques: where
these are unknown, forces are shares of a_x, and an a_x that points to the wrong side is found out all the same.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.signals import limits
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.longitudinal_fusion import BIAS, SCALE, SLIP, SPEED, LongitudinalFusion

LARGEST_ACCELERATION = limits.FRICTION * GRAVITY  # m/s^2 of a car on its tires
_UNDECIDED, _FORCES, _UNIT = 0.45, 0.35, 0.5  # how far from a_F towards a_x the wheels are: neither, with a_F, with a_x


class Acceleration(NamedTuple):
    """What moves the car over this sample."""

    reading: Number  # m/s^2, as a_x with its bias and scale error would read
    noise: Number  # m/s^2, deviation of its mean over the sample
    doubt: Number  # m/s^2 by which it may be off for long; 0 where a_x is believed
    blind: Number  # whether neither a_x nor the forces tell
    gated: Number  # whether a_x is there and alive, and is not believed
    mu: Signals  # F_x/F_z of the wheels, of a size that a tire can have; shares of a_x where unknown


class AccelerationSource(CarsMemory):
    """Compares a_x of `count` cars with what their tire forces make, and replaces it where it is at fault.

    It remembers how far a_x, forces and wheels are apart.
    """

    memory = ("gap", "apart", "since")

    def __init__(self, vehicle: VehicleParameters, along: LongitudinalFusion, count: int) -> None:
        self.settings, self.along, self.kit = along.settings, along, arithmetic((count,))
        length = vehicle.wheelbase
        self._front, self._rear = vehicle.rear_axle_distance / length, vehicle.front_axle_distance / length
        self._lever = vehicle.cg_height / length
        self._zero, self._never = self.kit.full(0.0), self.kit.full(False)
        self.gap: Number = self._zero  # m/s^2, a_x - a_F, low-passed
        self.apart: Number = self._zero  # m/s^2, wheels - a_F, low-passed since the contradiction began
        self.since: Number = self._zero  # s since it began

    def __call__(
        self, elapsed: Number, seen: ConditionedInputs, given: Signals | None, slope: Signals, disproved: Number
    ) -> Acceleration:
        """`given` F_x/F_z of the wheels, not finite where unknown, if any; `slope` of their speeds, rad/s^2.

        An a_x that is `disproved` counts as missing.
        """
        s, kit, choose, x = self.settings, self.kit, self.kit.where, self.along.filter.mean
        reading, noise = seen.inertial[0], seen.noise[0]
        mu, known = self._shares(given, reading)
        alive = seen.alive & kit.no(disproved)
        ahead, behind = 0.5 * (mu[0] + mu[1]), 0.5 * (mu[2] + mu[3])
        force = GRAVITY * (self._front * ahead + self._rear * behind) / (1.0 + self._lever * (ahead - behind))
        unit = reading * (1.0 - x[SCALE]) - x[BIAS]
        kept = kit.exp(-elapsed / s.force_gap_memory)
        self.gap = gap = choose(known & alive, kept * self.gap + (1.0 - kept) * (unit - force), 0.0)
        # steered front wheels pull backwards with their side force, about half of m a_y
        allowed = s.force_gap_floor + s.force_gap_linear * abs(force) + abs(seen.inertial[1] * seen.steer[0])
        wrong = kit.no(alive) | (abs(gap) > 0.5 * allowed)
        if not kit.some(wrong):
            self.since = self._zero
            return Acceleration(reading, noise, self._zero, self._never, self._never, mu)

        pulls = [R * rate for R, rate in zip(self.along.radius, slope, strict=True)]
        top, least = (pick(pick(pulls[0], pulls[1]), pick(pulls[2], pulls[3])) for pick in (kit.maximum, kit.minimum))
        middle = 0.5 * (sum(pulls) - top - least)
        recent = kit.minimum(kit.minimum(*seen.gap[:2]), kit.minimum(*seen.gap[2:])) < s.error_memory
        middle = choose(recent, kit.maximum(kit.minimum(middle, LARGEST_ACCELERATION), -LARGEST_ACCELERATION), 0.0)
        blind = kit.no(alive | known)
        votes = kit.no(alive) | (kit.minimum(abs(middle - force), abs(middle - unit)) < s.excess_acceleration)
        fresh = choose(alive, _UNDECIDED * gap, choose(known, 0.0, choose(disproved, middle, unit)))
        before = choose(self.since > 0.0, self.apart, fresh)
        base = choose(blind, 0.0, force)
        self.apart = apart = choose(votes, kept * before + (1.0 - kept) * (middle - base), before)
        self.since = choose(wrong, kit.minimum(self.since + elapsed, s.error_memory), 0.0)

        share = apart * kit.sign(gap)  # of the gap
        with_force = wrong & known & (kit.no(alive) | ((share < _FORCES * abs(gap)) & (abs(gap) > allowed)))
        pending = wrong & alive & kit.no(with_force) & (share < _UNIT * abs(gap))
        explained = force * kit.sign(apart) > GRAVITY * s.unloaded  # wheels slip to the side of their force
        leaves = choose(explained, 0.0, kit.minimum(kit.maximum(abs(apart) - allowed, 0.0), s.unseen_acceleration))
        # forces that were corrected with a_x have a part of its error
        doubt = choose(with_force, 0.5 * allowed + 0.25 * abs(gap) + leaves, choose(pending, abs(gap), 0.0))
        doubt = choose(blind, s.unseen_acceleration, doubt)
        samples = kit.maximum(2.0 * self.since / elapsed - 1.0, 1.0)
        replacement = (choose(blind, apart, force) + x[BIAS]) / (1.0 - x[SCALE])
        replacement = choose(with_force | blind, replacement, reading)
        if kit.some(blind):
            mu, _ = self._shares(given, replacement)
        return Acceleration(
            replacement,
            choose(doubt > 0.0, kit.maximum(doubt * kit.sqrt(samples), choose(alive, noise, 0.0)), noise),
            doubt,
            blind,
            seen.alive & (with_force | disproved),
            mu,
        )

    def _shares(self, given: Signals | None, reading: Number) -> tuple[Signals, Number]:
        """F_x/F_z, of a size that a tire can have, a_x/g where unknown: the same share; and whether all were known."""
        kit, x = self.kit, self.along.filter.mean
        share = (reading * (1.0 - x[SCALE]) - x[BIAS]) / GRAVITY
        share = kit.maximum(kit.minimum(share, limits.FRICTION), -limits.FRICTION)
        if given is None:
            return kit.stacked((share,) * 4), self._never
        (usual,) = kit.each(lambda mu: (abs(mu) <= limits.FRICTION,), given)
        all_usual = usual[0] & usual[1] & usual[2] & usual[3]
        if not kit.some(kit.no(all_usual)):
            return given, all_usual

        def limited(mu: Number) -> tuple[Number, ...]:
            size = kit.maximum(kit.minimum(mu, limits.FRICTION), -limits.FRICTION)
            return kit.where(abs(mu) < math.inf, size, share), abs(mu) <= 2.0 * limits.FRICTION

        mu, known = kit.each(limited, given)
        return mu, known[0] & known[1] & known[2] & known[3]


_FAR = 1e9


class SlipDirectionTest(CarsMemory):
    """Finds an a_x at fault from slip against the force; remembers of `count` cars for how long it is not believed."""

    memory = ("remaining",)

    def __init__(self, along: LongitudinalFusion, count: int) -> None:
        self.along, self.settings, self.kit = along, along.settings, arithmetic((count,))
        self._zero = self.kit.full(0.0)
        self.remaining: Number = self._zero  # s for which a_x is not believed

    def __call__(self, elapsed: Number, seen: ConditionedInputs, innovation: Signals, mu: Signals) -> None:
        """`innovation` of the wheels, m/s, from which slip as their forces `mu` make it has been taken."""
        s, kit, choose, filter_ = self.settings, self.kit, self.kit.where, self.along.filter
        speed = filter_.mean[SPEED]
        usual, sure = abs(speed) * filter_.mean[SLIP], s.unloaded

        def power(off: Number, force: Number) -> tuple[Number, ...]:
            return ((off + usual * force) * force,)

        (spent,) = kit.each(power, innovation, mu)  # by friction, per load: slip times force, never below zero
        least = kit.minimum(kit.minimum(spent[0], spent[1]), kit.minimum(spent[2], spent[3]))
        if not kit.some((least < -s.dead_speed * sure) | (self.remaining > 0.0)):
            return
        turning, least = 0, _FAR
        for work, force, fresh, silent, age in zip(spent, mu, seen.fresh, seen.silent, seen.gap, strict=True):
            turns = fresh & kit.no(silent) & (age < s.error_memory)  # one that repeats itself for longer is dead
            turning = turning + choose(turns, 1, 0)
            wrong = choose(abs(force) > sure, -work / kit.maximum(abs(force), sure), 0.0)  # m/s
            least = kit.minimum(least, choose(turns, wrong, _FAR))
        white = s.wheel_speed_noise * self.along.radius[0]
        unsure = kit.sqrt(filter_.variance(SPEED) + white * white)
        impossible = (turning >= 3) & (least > s.gate * unsure + s.agreement * abs(speed) + s.dead_speed)
        self.remaining = choose(impossible, s.lost_time, kit.maximum(self.remaining - elapsed, 0.0))
