"""a_x: the witnesses of `pull` (`parity`), and what replaces it where they outvote it.

    a_x      a_x (1 - s) - b
    forces   g (s_f mu_f + s_r mu_r)/(1 + (h/L)(mu_f - mu_r)), mu = F_x/F_z, mean of an axle, s its static load share
    wheels   middle of R_i w_i' + g_grade                      half of what the others are apart, `rolling` at least

in m/s^2. The forces follow from sum F_x = m a and loads that shift by m a h/L; they come from torques and wheel speeds, so
a_x has no part in them. The accelerometer feels forces alone, so grade is in neither. They may contradict each other by
`force_gap_floor` + `force_gap_linear` |a_F|.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.signals import limits
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.exclusion import Exclusion
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.longitudinal_fusion import BIAS, GRADE, SCALE, SLIP, SPEED, LongitudinalFusion
from estimators.velocity.parity import PULL
from estimators.velocity.signal_vote import Readings, vote

_FAR = 1e9  # m/s
LARGEST_ACCELERATION = limits.FRICTION * GRAVITY  # m/s^2 of a car on its tires


class Pull(NamedTuple):
    """What is to be used of a_x, see `Validated`."""

    reading: Number
    noise: Number
    used: Number
    doubt: Number
    mu: Signals
    blind: Number
    gated: Number
    contested: Number  # whether it and the forces have contradicted each other by half of what they may, for 0.05 s


class PullMonitor(Exclusion):
    """Remembers how far a_x, forces and wheels are apart, and for how long a_x is not believed."""

    memory = ("gap", "apart", "remaining", "since")

    def __init__(self, vehicle: VehicleParameters, along: LongitudinalFusion, count: int) -> None:
        self.settings, self.along = along.settings, along
        self.kit = kit = arithmetic((count,))
        length = vehicle.wheelbase
        self._front, self._rear = vehicle.rear_axle_distance / length, vehicle.front_axle_distance / length
        self._lever = vehicle.cg_height / length
        zero, self._never, self._always = kit.full(0.0), kit.full(False), kit.full(True)
        self._zero = zero
        self.gap: Number = zero  # m/s^2, a_x - forces, low-passed
        self.allowed: Number = zero  # m/s^2 that a_x and forces may be apart, at the last sample
        self.apart: Number = zero  # m/s^2, wheels - forces, low-passed since a_x is in doubt
        self.remaining: Number = zero  # s for which a_x is not believed
        self.since: Number = zero  # s since it is in doubt

    def __call__(
        self, elapsed: Number, seen: ConditionedInputs, given: Signals | None, slope: Signals, road: Number
    ) -> Pull:
        """One sample: `given` F_x/F_z of the wheels, not finite where unknown; `slope` of their speeds, rad/s^2.

        `road`: m/s^2 of gravity that has been taken off a_x and is carried by the tires.
        """
        s, kit, choose, no = self.settings, self.kit, self.kit.where, self.kit.no
        reading, noise, before = seen.inertial[0], seen.noise[0], self.remaining
        mu, known = self._shares(given, reading + road)
        force, t_f = self._forces(mu, seen)
        self.allowed = t_f
        unit = self._unit(reading + road)
        kept = kit.exp(-elapsed / s.force_gap_memory)
        self.gap = gap = choose(known & seen.alive, kept * self.gap + (1.0 - kept) * (unit - force), 0.0)
        contested = abs(gap) > 0.5 * t_f
        doubtful = no(seen.alive) | contested | (before > 0.0)
        if not kit.some(doubtful):
            self.since = self._zero
            return Pull(reading, noise, seen.good[0], self._zero, mu, self._never, self._never, self._never)

        believed = seen.alive & (before == 0.0)
        blind, base = no(believed | known), choose(believed | known, force, 0.0)
        middle = self._wheels(slope, seen) + self.along.filter.mean[GRADE] + road
        near = no(believed) | (kit.minimum(abs(middle - force), abs(middle - unit)) < s.excess_acceleration)
        held = choose(before > 0.0, middle, unit)
        fresh = choose(believed, 0.5 * gap, choose(known, 0.0, held))
        apart = choose(self.since > 0.0, self.apart, fresh)
        self.apart = apart = choose(near, kept * apart + (1.0 - kept) * (middle - base), apart)
        age = choose(doubtful, kit.minimum(self.since + elapsed, s.error_memory), 0.0)
        self.since = age

        readings = Readings(
            (choose(known, gap, unit), self._zero, apart),
            (self._zero, t_f, kit.maximum(0.5 * abs(gap), s.rolling)),
            (seen.good[0], known, near),
        )
        (verdict,), _ = vote(kit, PULL, readings, (no(seen.alive),), (self._always,), (self._never,))
        # one that repeats what the others say, as at rest, has done nothing wrong: it is believed as soon as it lives
        blameless = no(seen.alive) & verdict.supported & no(verdict.contradicted)
        left = self.left(elapsed, verdict._replace(wrong=verdict.wrong & no(blameless)), before)
        self.remaining = left
        used = seen.alive & (left == 0.0)
        with_force = no(used) & known
        pending = used & contested & (abs(apart) < abs(apart - gap))
        explained = force * kit.sign(apart) > GRAVITY * s.unloaded  # wheels slip to the side of their force
        leaves = choose(explained, 0.0, kit.minimum(kit.maximum(abs(apart) - t_f, 0.0), s.unseen_acceleration))
        # forces that were corrected with a_x have a part of its error
        doubt = choose(with_force, 0.5 * t_f + 0.25 * abs(gap) + leaves, choose(pending, abs(gap), 0.0))
        blind = no(used | known)
        doubt = choose(blind, s.unseen_acceleration, doubt)
        instead = self._reading(choose(blind, apart, force)) - road
        reading = choose(used, reading, instead)
        if kit.some(blind):
            mu, _ = self._shares(given, reading + road)
        grown = kit.maximum(doubt * self.grown(age, elapsed), choose(seen.alive, noise, 0.0))
        gated = seen.good[0] & no(used) & (seen.alive | verdict.contradicted)
        # one that repeats what the others say is no fault
        reported = seen.good[0] & no(gated)
        lasting = contested & (age > s.slowest_unit)  # a patch of ice brings them apart for a moment
        return Pull(reading, choose(doubt > 0.0, grown, noise), reported, doubt, mu, blind, gated, lasting)

    def learn(self, seen: ConditionedInputs, innovation: Signals, mu: Signals) -> None:
        """Do all wheels that turn, three at least, slip against their force? No tire does: a_x has led the estimate astray.

        A braked wheel is never faster than the road, a driven one never slower. `innovation` m/s, from which slip as the
        forces `mu` make it has been taken. Which side is possible is known only where the wheel uses some friction
        (`unloaded`); beyond what the uncertainty of the estimate, noise and radii allow.
        """
        s, kit, choose, filter_ = self.settings, self.kit, self.kit.where, self.along.filter
        usual, sure = abs(filter_.mean[SPEED]) * filter_.mean[SLIP], s.unloaded

        def power(off: Number, force: Number) -> tuple[Number, ...]:
            return ((off + usual * force) * force,)

        (spent,) = kit.each(power, innovation, mu)  # by friction, per load: slip times force, never below zero
        least = kit.minimum(kit.minimum(spent[0], spent[1]), kit.minimum(spent[2], spent[3]))
        if not kit.some(least < -s.dead_speed * sure):
            return
        turning, least = 0, _FAR
        for work, force, fresh, silent, age in zip(spent, mu, seen.fresh, seen.silent, seen.gap, strict=True):
            turns = fresh & kit.no(silent) & (age < s.error_memory)  # one that repeats itself for longer is dead
            turning = turning + choose(turns, 1, 0)
            wrong = choose(abs(force) > sure, -work / kit.maximum(abs(force), sure), 0.0)  # m/s
            least = kit.minimum(least, choose(turns, wrong, _FAR))
        white = s.wheel_speed_noise * self.along.radius[0]
        unsure = kit.sqrt(filter_.variance(SPEED) + white * white)
        impossible = (turning >= 3) & (least > s.gate * unsure + s.agreement * abs(filter_.mean[SPEED]) + s.dead_speed)
        self.remaining = kit.maximum(self.remaining, choose(impossible, s.lost_time, 0.0))

    def _unit(self, reading: Number) -> Number:
        """a_x without bias and scale error."""
        x = self.along.filter.mean
        return reading * (1.0 - x[SCALE]) - x[BIAS]

    def _reading(self, unit: Number) -> Number:
        """The contrary."""
        x = self.along.filter.mean
        return (unit + x[BIAS]) / (1.0 - x[SCALE])

    def _forces(self, mu: Signals, seen: ConditionedInputs) -> tuple[Number, Number]:
        """What F_x/F_z of the wheels make, and how far it may be off."""
        s, ahead, behind = self.settings, 0.5 * (mu[0] + mu[1]), 0.5 * (mu[2] + mu[3])
        force = GRAVITY * (self._front * ahead + self._rear * behind) / (1.0 + self._lever * (ahead - behind))
        # steered front wheels pull backwards with their side force, about half of m a_y
        allowed = s.force_gap_floor + s.force_gap_linear * abs(force) + abs(seen.inertial[1] * seen.steer[0])
        return force, allowed

    def _wheels(self, slope: Signals, seen: ConditionedInputs) -> Number:
        """The middle of their accelerations, of a size that a car can have; 0 where they are old. `slope` rad/s^2."""
        kit, pulls = self.kit, [R * rate for R, rate in zip(self.along.radius, slope, strict=True)]
        top, least = (pick(pick(pulls[0], pulls[1]), pick(pulls[2], pulls[3])) for pick in (kit.maximum, kit.minimum))
        middle = 0.5 * (sum(pulls) - top - least)
        recent = kit.minimum(kit.minimum(*seen.gap[:2]), kit.minimum(*seen.gap[2:])) < self.settings.error_memory
        return kit.where(recent, kit.maximum(kit.minimum(middle, LARGEST_ACCELERATION), -LARGEST_ACCELERATION), 0.0)

    def _shares(self, given: Signals | None, reading: Number) -> tuple[Signals, Number]:
        """F_x/F_z, of a size that a tire can have, a_x/g where unknown: the same share; and whether all were known."""
        kit = self.kit
        share = self._unit(reading) / GRAVITY
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
