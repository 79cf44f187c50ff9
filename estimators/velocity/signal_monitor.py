"""The signal monitor: every signal is predicted from the others with its uncertainty, loses its weight, and comes back.

Which witnesses tell the same number is in `parity`, what they say and by how much each may be off in `witnesses`, and who is
outvoted in `signal_vote`. Of all signals alike:

    found      outvoted by others that agree; one that repeats itself (frozen, zero, clipped at its limit) by fewer
    replaced   by what the others say that it should read, with their allowance as its noise: an error that stays counts
               (2 j - 1) times in the j-th sample, up to `error_memory`. Nothing that is replaced teaches bias, scale or slope
    flagged    GATED, and `FusionStep.inertial_used`
    back       when no peer contradicts it and one has agreed with it for `error_memory`

**a_x.** While the wheels have not decided between a_x and the forces, a_x is as unsure as these are apart. Four wheels that slip
against their force disprove it without any torque, for `lost_time`. Where neither a_x nor the forces tell, the wheels do, by
+-`unseen_acceleration`.

**a_y, yaw rate.** Until it was found V_y followed it: its variance grows by that. A car that follows its steering while a_y, alive,
contradicts it for `_PATIENCE` is on a banked road: the variance of the bank grows, and a_y is believed again. An a_y that has lost
its gain looks the same.

**Attitude.** A levelled a_y that the turn contradicts while the one that is not levelled agrees: roll is wrong, and nothing is
levelled. The contrary is a banked road, and no fault.

**Steering.** The front axle condition predicts it from V_y, yaw rate and side force; while the rear axle's holds, its gate is a flag.

**Wheels.** The gate of `longitudinal_fusion`: each innovation is a wheel against the estimate, that the others hold.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.lateral_fusion import BANK, BIAS, SCALE, AxleUpdate, LateralFusion
from estimators.velocity.longitudinal_fusion import GRADE, LongitudinalFusion
from estimators.velocity.parity import FRONT, PULL, REAR, SIDE, STEERING, TURN, YAW_RATE
from estimators.velocity.signal_vote import Verdict, vote
from estimators.velocity.witnesses import SHARE, UNDERSTEER, UNDULATION, PullWitnesses, Told, TurnWitnesses

_PATIENCE = 0.5  # s for which a car that follows its steering contradicts its a_y before the road is taken for banked
_BANK = 0.3  # rad: banked curves of test tracks are up to 0.5
AX, AY, R, ROLL = range(4)


class Gravity(NamedTuple):
    """What an attitude part knows of gravity in a_x and a_y, m/s^2."""

    total: Signals
    road: Signals  # of it, from grade and bank: the tires carry that


class Judged(NamedTuple):
    """What the filters are to use; readings a_x, a_y, r without the gravity that is known."""

    reading: tuple[Number, Number, Number]  # what was read, or should have been
    noise: tuple[Number, Number, Number]
    used: tuple[Number, Number, Number]  # whether it is the reading
    doubt: tuple[Number, Number]  # m/s^2 by which a_x and a_y may be off for long; 0 where they are believed
    gravity: tuple[Number, Number]  # m/s^2 that was taken off a_x and a_y
    road: tuple[Number, Number]  # of it, from grade and bank
    mu: Signals  # F_x/F_z of the wheels, of a size that a tire can have; shares of a_x where unknown
    blind: Number  # whether neither a_x nor the forces tell
    unknown: Number  # whether nothing tells the yaw rate
    gated: Number  # whether a signal is there, and is not believed


class SignalMonitor(CarsMemory):
    """Remembers of `count` cars the low-passed witnesses and for how long who is not believed."""

    memory = ("level", "gap", "apart", "remaining", "since", "sloped", "astray", "yaw_rate", "yaw_acceleration", "mu")
    unknowns = ("yaw_rate",)

    def __init__(
        self, vehicle: VehicleParameters, along: LongitudinalFusion, across: LateralFusion, count: int
    ) -> None:
        self.settings, self.along, self.across = along.settings, along, across
        self.kit = kit = arithmetic((count,))
        self._turn, self._pull = TurnWitnesses(vehicle, along, across), PullWitnesses(vehicle, along)
        zero = kit.full(0.0)
        self._zero, self._never = zero, kit.full(False)
        self.level: Signals = kit.stacked([zero] * (len(TURN.witnesses) + 1))  # of the turn, and V_y', low-passed, m/s^2
        self.gap: Number = zero  # m/s^2, a_x - forces, low-passed
        self.apart: Number = zero  # m/s^2, wheels - forces, low-passed since a_x is in doubt
        self.remaining: Signals = kit.stacked([zero] * 4)  # s for which a_x, a_y, yaw rate, roll are not believed
        self.since: Signals = kit.stacked([zero] * 3)  # s since a_x is in doubt, a_y and the yaw rate are replaced
        self.sloped: Number = zero  # s for which a_y has been off as on a bank
        self.astray: Number = zero  # s for which the steering has been off
        self.mu: Signals = kit.stacked([zero] * 4)  # F_x/F_z of the wheels at the last sample
        self.yaw_rate: Number = kit.full(math.nan)  # the last one that was used, rad/s
        self.yaw_acceleration: Number = zero  # filtered, rad/s^2

    def __call__(
        self, elapsed: Number, seen: ConditionedInputs, given: Signals | None, slope: Signals, gravity: Gravity | None
    ) -> Judged:
        """One sample: `given` F_x/F_z of the wheels, not finite where unknown; `slope` of their speeds, rad/s^2.

        What is known of `gravity` has been taken off the readings.
        """
        turn = self._turning(elapsed, seen, gravity)
        pull = self._pulling(elapsed, seen, given, slope, self._zero if gravity is None else gravity.road[0])
        self.mu = pull.mu
        ahead = (self._zero, self._zero) if gravity is None else (gravity.total[0], gravity.road[0])
        return Judged(
            (pull.reading, *turn.reading),
            (pull.noise, *turn.noise),
            (pull.used, *turn.used),
            (pull.doubt, turn.doubt),
            (ahead[0], turn.gravity),
            (ahead[1], turn.road),
            pull.mu,
            pull.blind,
            turn.unknown,
            pull.gated | self.kit.no(turn.used[0] & turn.used[1]) | (self.remaining[ROLL] > 0.0),
        )

    def learn(
        self, elapsed: Number, seen: ConditionedInputs, innovation: Signals, axle: AxleUpdate, usable: Signals
    ) -> Number:
        """What the corrections say of a_x (`innovation` of the wheels, m/s) and of the steering; whether that is off."""
        s, kit = self.settings, self.kit
        impossible = self._pull.against_friction(seen, innovation, self.mu)
        if kit.some(impossible):
            left = kit.maximum(self.remaining[AX], kit.where(impossible, s.lost_time, 0.0))
            self.remaining = kit.stacked([left, *self.remaining[1:]])
        off = usable[0] & kit.no(axle.used[0]) & axle.used[1]
        self.astray = kit.where(off, self.astray + elapsed, 0.0) if kit.some(off) else self._zero
        return self.astray > s.wheel_lag

    def _turning(self, elapsed: Number, seen: ConditionedInputs, gravity: Gravity | None) -> _Turn:
        """a_y and the yaw rate."""
        s, kit = self.settings, self.kit
        _, b, r = seen.inertial
        off = (self._zero, self._zero) if gravity is None else (gravity.total[1], gravity.road[1])
        now, surface = self._turn.say(seen, self.yaw_acceleration, None if gravity is None else off[0])
        kept = kit.exp(-elapsed / s.wheel_lag)
        self.level = kit.stacked([kept * old + (1.0 - kept) * new for old, new in zip(self.level, now, strict=True)])
        *level, sway = self.level
        told = self._turn.judge(seen, level, sway, surface, self.mu, self._never if gravity is None else kit.no(self._never))
        v_g, v_p, v_f, v_q = level[:4]
        t_g, t_p, t_f, t_q = told.allowed[:4]
        known = told.known
        quiet = known[YAW_RATE] & known[SIDE] & (abs(v_p - v_g) < t_p + t_g)
        quiet = (
            quiet
            & (kit.no(known[FRONT]) | (abs(v_f - v_g) < t_f + t_g))
            & (kit.no(known[REAR]) | (abs(v_q - v_g) < t_q + t_g))
        )
        quiet = quiet & (self.remaining[AY] + self.remaining[R] + self.remaining[ROLL] == 0.0)
        if kit.some(kit.no(quiet)):
            return self._outvoted(elapsed, seen, told, sway, off)
        self._differentiate(r, self.since[R] > 0.0, elapsed)
        self.since = kit.stacked([self.since[AX], self._zero, self._zero])
        self.sloped = kit.maximum(self.sloped - elapsed, 0.0)
        used = known[SIDE], known[YAW_RATE]
        return _Turn((b, r), (seen.noise[1], seen.noise[2]), used, self._never, self._zero, *off)

    def _outvoted(
        self, elapsed: Number, seen: ConditionedInputs, told: Told, sway: Number, gravity: tuple[Number, Number]
    ) -> _Turn:
        s, kit, no, largest = self.settings, self.kit, self.kit.no, self.kit.maximum
        level, known, never = told.level, told.known, self._never
        _, stuck_y, stuck_r = ((run - 1.0) * elapsed > s.slowest_unit for run in seen.run)
        # a car that slides is turned further than its side force carries it, never less
        excess = (level[SIDE] * level[STEERING] < 0.0) | (abs(level[SIDE]) > abs(level[STEERING]))
        always = no(never)
        verdicts, agree = vote(kit, TURN, *told, (stuck_r, never, stuck_y), (always, always, excess))
        yaw, roll, side = verdicts
        gap = level[YAW_RATE] - level[SIDE]
        steady = abs(sway) < 0.5 * abs(gap)
        apart = known[SIDE] & steady & (abs(gap) > told.allowed[YAW_RATE] + told.allowed[SIDE] - abs(sway))
        straight = largest(abs(level[YAW_RATE]), abs(level[STEERING])) < UNDERSTEER
        front, rear = (agree[YAW_RATE, i] & agree[i, STEERING] for i in (FRONT, REAR))
        grip = agree[YAW_RATE, STEERING] & (front | rear)
        banked = self._banked(elapsed, apart & grip & (no(side.wrong) | straight) & no(stuck_y | roll.wrong), gap)
        before = self.remaining[AY:]
        judged = (side._replace(wrong=side.wrong & no(banked)), yaw, roll)
        left = [self._left(elapsed, verdict, old) for verdict, old in zip(judged, before, strict=True)]
        begun_y, begun_r, begun_roll = ((now > 0.0) & (old == 0.0) for now, old in zip(left, before, strict=True))
        followed = kit.where(begun_r, level[YAW_RATE] - level[REAR], gap) * s.error_memory
        self.across.filter.widen(begun_y | begun_r | begun_roll, followed * followed)
        self.remaining = kit.stacked([self.remaining[AX], *left])
        used_y, used_r = known[SIDE] & (left[0] == 0.0), known[YAW_RATE] & (left[1] == 0.0)
        levelled = left[2] == 0.0
        off = tuple(kit.where(levelled, value, 0.0) for value in gravity)
        if kit.some(no(levelled)):
            a, b, r = seen.inertial
            seen = seen._replace(inertial=kit.stacked((a, kit.where(levelled, b, b + gravity[0]), r)))
        return self._replaced(elapsed, seen, told, used_y, used_r, sway)._replace(gravity=off[0], road=off[1])

    def _left(self, elapsed: Number, verdict: Verdict, before: Number) -> Number:
        """s for which a signal is not believed, now that the vote is known."""
        kit = self.kit
        held = verdict.contradicted | kit.no(verdict.supported)
        fades = kit.where(held, before, kit.maximum(before - elapsed, 0.0))
        return kit.where(verdict.wrong, kit.maximum(self.settings.error_memory, before), fades)

    def _banked(self, elapsed: Number, looks: Number, gap: Number) -> Number:
        """Cars whose road has looked banked for so long that the filter is to learn its bank."""
        kit, speed = self.kit, self.across.filter
        self.sloped = kit.maximum(self.sloped + kit.where(looks, elapsed, -elapsed), 0.0)
        found = self.sloped > _PATIENCE
        if kit.some(found):
            speed.widen(found, (GRAVITY * _BANK) ** 2, BANK)
            speed.widen(found, (gap * _PATIENCE) ** 2)
            self.sloped = kit.where(found, 0.0, self.sloped)
        return found

    def _replaced(
        self, elapsed: Number, seen: ConditionedInputs, told: Told, used_y: Number, used_r: Number, sway: Number
    ) -> _Turn:
        """Readings that are not used, from those that are."""
        s, kit, choose, no = self.settings, self.kit, self.kit.where, self.kit.no
        _, b, r = seen.inertial
        (level, allowed, known), y, speed = told, self.across.filter.mean, self.along.speed
        pace = choose(abs(speed) > 1.0, speed, 1.0)
        front, rear = known[FRONT], known[REAR]
        wheels = front | rear

        def best(of: Signals, nothing: Number) -> Number:
            """From both axles, one, the steering, or a_y."""
            axles = choose(front & rear, 0.5 * (of[FRONT] + of[REAR]), choose(front, of[FRONT], of[REAR]))
            return choose(wheels, axles, choose(by_steer, of[STEERING], choose(used_y, of[SIDE], nothing)))

        by_steer = known[STEERING] & (no(used_y) | (allowed[STEERING] < allowed[SIDE]))
        other, doubt = best(level, 0.0), best(allowed, abs(pace))
        unknown = no(used_r | wheels | used_y | known[STEERING])
        turn = choose(used_r, self.across.yaw_rate(r), other / pace)
        yaw_rate = choose(used_r, r, self.across.reading(turn))
        switched = (self.since[R] > 0.0) == used_r
        ages = [
            choose(used, 0.0, kit.minimum(age + elapsed, s.error_memory))
            for used, age in zip((used_y, used_r), self.since[AY:], strict=True)
        ]
        self.since = kit.stacked([self.since[AX], *ages])
        grown_y, grown_r = (self._grown(age, elapsed) for age in ages)
        noise_r = choose(used_r, seen.noise[2], doubt / (s.gate * abs(pace)) * grown_r)
        own = choose(used_r, speed * turn, other) + sway + y[BIAS] + y[BANK]
        ay = choose(used_y, b, own / (1.0 - y[SCALE]))
        doubt_y = (UNDULATION + abs(sway) + choose(used_r, allowed[YAW_RATE], doubt)) / s.gate
        noise_y = choose(used_y, seen.noise[1], doubt_y * grown_y)
        self._differentiate(yaw_rate, switched, elapsed)
        doubt_y = choose(used_y, 0.0, doubt_y)
        return _Turn((ay, yaw_rate), (noise_y, noise_r), (used_y, used_r), unknown, doubt_y, self._zero, self._zero)

    def _pulling(
        self, elapsed: Number, seen: ConditionedInputs, given: Signals | None, slope: Signals, road: Number
    ) -> _Pull:
        """a_x."""
        s, kit, choose, no = self.settings, self.kit, self.kit.where, self.kit.no
        reading, noise, before = seen.inertial[0], seen.noise[0], self.remaining[AX]
        mu, known = self._pull.shares(given, reading + road)
        force, t_f = self._pull.forces(mu, seen)
        unit = self._pull.unit(reading + road)
        kept = kit.exp(-elapsed / s.force_gap_memory)
        self.gap = gap = choose(known & seen.alive, kept * self.gap + (1.0 - kept) * (unit - force), 0.0)
        doubtful = no(seen.alive) | (abs(gap) > 0.5 * t_f) | (before > 0.0)
        if not kit.some(doubtful):
            self.since = kit.stacked([self._zero, *self.since[1:]])
            return _Pull(reading, noise, seen.good[0], self._zero, mu, self._never, self._never)

        believed = seen.alive & (before == 0.0)
        blind, base = no(believed | known), choose(believed | known, force, 0.0)
        middle = self._pull.wheels(slope, seen) + self.along.filter.mean[GRADE] + road
        near = no(believed) | (kit.minimum(abs(middle - force), abs(middle - unit)) < s.excess_acceleration)
        held = choose(before > 0.0, middle, unit)
        fresh = choose(believed, 0.5 * gap, choose(known, 0.0, held))
        apart = choose(self.since[AX] > 0.0, self.apart, fresh)
        self.apart = apart = choose(near, kept * apart + (1.0 - kept) * (middle - base), apart)
        age = choose(doubtful, kit.minimum(self.since[AX] + elapsed, s.error_memory), 0.0)
        self.since = kit.stacked([age, *self.since[1:]])

        told = Told(
            (choose(known, gap, unit), self._zero, apart),
            (SHARE * abs(unit), t_f, kit.maximum(0.5 * abs(gap), s.rolling)),
            (seen.good[0], known, near),
        )
        (verdict,), _ = vote(kit, PULL, *told, (no(seen.alive),), (no(self._never),))
        left = self._left(elapsed, verdict, before)
        self.remaining = kit.stacked([left, *self.remaining[1:]])
        used = seen.alive & (left == 0.0)
        with_force = no(used) & known
        pending = used & (abs(gap) > 0.5 * t_f) & (abs(apart) < abs(apart - gap))
        explained = force * kit.sign(apart) > GRAVITY * s.unloaded  # wheels slip to the side of their force
        leaves = choose(explained, 0.0, kit.minimum(kit.maximum(abs(apart) - t_f, 0.0), s.unseen_acceleration))
        # forces that were corrected with a_x have a part of its error
        doubt = choose(with_force, 0.5 * t_f + 0.25 * abs(gap) + leaves, choose(pending, abs(gap), 0.0))
        blind = no(used | known)
        doubt = choose(blind, s.unseen_acceleration, doubt)
        instead = self._pull.reading(choose(blind, apart, force)) - road
        reading = choose(used, reading, instead)
        if kit.some(blind):
            mu, _ = self._pull.shares(given, reading + road)
        grown = kit.maximum(doubt * self._grown(age, elapsed), choose(seen.alive, noise, 0.0))
        gated = seen.good[0] & no(used) & (seen.alive | verdict.contradicted)
        return _Pull(reading, choose(doubt > 0.0, grown, noise), used, doubt, mu, blind, gated)

    def _grown(self, age: Number, elapsed: Number) -> Number:
        """By how much a deviation counts more in the integral, after `age` s of the same error."""
        return self.kit.sqrt(self.kit.maximum(2.0 * age / elapsed - 1.0, 1.0))

    def _differentiate(self, yaw_rate: Number, switched: Number, elapsed: Number) -> None:
        """First-order filter of the slope; where the yaw rate comes from another source than before, that is no slope."""
        kit, kept = self.kit, self.kit.exp(-elapsed / self.settings.wheel_lag)
        steady = kit.no(switched) & (abs(self.yaw_rate) < math.inf)
        slope = kit.where(steady, (yaw_rate - self.yaw_rate) / elapsed, self.yaw_acceleration)
        self.yaw_acceleration = kept * self.yaw_acceleration + (1.0 - kept) * slope
        self.yaw_rate = yaw_rate


class _Turn(NamedTuple):
    """Of a_y and the yaw rate, as in `Judged`."""

    reading: tuple[Number, Number]
    noise: tuple[Number, Number]
    used: tuple[Number, Number]
    unknown: Number
    doubt: Number
    gravity: Number
    road: Number


class _Pull(NamedTuple):
    """Of a_x."""

    reading: Number
    noise: Number
    used: Number
    doubt: Number
    mu: Signals
    blind: Number
    gated: Number
