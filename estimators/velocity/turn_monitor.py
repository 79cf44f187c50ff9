"""a_y, yaw rate and roll: what replaces a signal that the witnesses of `turn` (`turn_witnesses`) outvote."""

from __future__ import annotations

import math
from typing import NamedTuple

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.signals import limits
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.exclusion import Exclusion
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.lateral_fusion import BANK, BIAS, SCALE, LateralFusion
from estimators.velocity.longitudinal_fusion import LongitudinalFusion
from estimators.velocity.parity import FRONT, REAR, SIDE, STEERING, TURN, YAW_RATE
from estimators.velocity.signal_vote import Readings, vote
from estimators.velocity.turn_witnesses import UNDERSTEER, UNDULATION, TurnWitnesses

_PATIENCE = 0.5  # s for which a car that follows its steering contradicts its a_y before the road is taken for banked
_TRANSITION = 0.1  # s for which an a_y beyond what the steering carries may be V_y' of a car that is not steady
_BANK = 0.3  # rad: banked curves of test tracks are up to 0.5
_AY, _R, _ROLL = range(3)


class Turning(NamedTuple):
    """What is to be used of a_y and yaw rate, see `Validated`."""

    reading: tuple[Number, Number]
    noise: tuple[Number, Number]
    used: tuple[Number, Number]
    doubt: Number
    unknown: Number
    gravity: Number
    road: Number
    gated: Number


class TurnMonitor(Exclusion):
    """Remembers the witnesses, and for how long who is not believed."""

    memory = ("remaining", "since", "sloped", "yaw_rate", "yaw_acceleration", "impossible")
    parts = ("witnesses",)
    unknowns = ("yaw_rate",)

    def __init__(
        self, vehicle: VehicleParameters, along: LongitudinalFusion, across: LateralFusion, count: int
    ) -> None:
        self.settings, self.along, self.across = along.settings, along, across
        self.kit = kit = arithmetic((count,))
        self.witnesses = TurnWitnesses(vehicle, along, across, count)
        # rad/s^2: both axles at their limit, one against the other, turn a car with I_z = m L_f L_r no quicker
        self._quickest = 2.0 * limits.FRICTION * GRAVITY / vehicle.wheelbase
        zero, self._never, self._always = kit.full(0.0), kit.full(False), kit.full(True)
        self._nothing = zero, zero
        self.remaining: Signals = kit.stacked([zero] * 3)  # s for which a_y, yaw rate, roll are not believed
        self.since: Signals = kit.stacked([zero] * 2)  # s since a_y, yaw rate have been replaced
        self.sloped: Number = zero  # s for which a_y has been off as on a bank
        self.yaw_rate: Number = kit.full(math.nan)  # the last one that was used, rad/s
        self.yaw_acceleration: Number = zero  # filtered, rad/s^2
        self.impossible: Number = zero  # 1 where tires would slip along their side force, as of the last sample

    def __call__(
        self, elapsed: Number, seen: ConditionedInputs, mu: Signals, gravity: tuple[Number, Number] | None
    ) -> Turning:
        """One sample; `mu` F_x/F_z of the wheels, `gravity` as in `Turning`, which has been taken off a_y."""
        kit, (_, b, r) = self.kit, seen.inertial
        off = self._nothing if gravity is None else gravity
        readings, sway, now = self.witnesses(elapsed, seen, self.yaw_acceleration, mu, gravity)
        level = readings.level
        v_g, v_p, v_f, v_q = level[:4]
        t_g, t_p, t_f, t_q = readings.allowed[:4]
        known = readings.known
        stuck = tuple((run - 1.0) * elapsed > self.settings.slowest_unit for run in seen.run)
        wide = t_p + t_g
        quiet = known[YAW_RATE] & known[SIDE] & (abs(v_p - v_g) < wide) & (abs(now[SIDE] - now[YAW_RATE]) < wide)
        quiet = (
            quiet
            & kit.no(stuck[1])
            & (kit.no(known[FRONT]) | (abs(v_f - v_g) < t_f + t_g))
            & (kit.no(known[REAR]) | (abs(v_q - v_g) < t_q + t_g))
        )
        quiet = quiet & (self.remaining[_AY] + self.remaining[_R] + self.remaining[_ROLL] == 0.0)
        if kit.some(kit.no(quiet)):
            return self._outvoted(elapsed, seen, readings, sway, off, stuck, now)
        self._differentiate(r, self.since[_R] > 0.0, elapsed)
        self.since = kit.stacked(self._nothing)
        self.sloped = kit.maximum(self.sloped - elapsed, 0.0)
        used = known[SIDE], known[YAW_RATE]
        gated, noises = kit.no(used[0] & used[1]), (seen.noise[1], seen.noise[2])
        return Turning((b, r), noises, used, self._nothing[0], self._never, *off, gated)

    def _outvoted(
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        readings: Readings,
        sway: Number,
        gravity: tuple[Number, Number],
        stuck: tuple[Number, ...],
        now: tuple[Number, ...],
    ) -> Turning:
        s, kit, no, largest = self.settings, self.kit, self.kit.no, self.kit.maximum
        level, known, never = readings.level, readings.known, self._never
        _, stuck_y, stuck_r = stuck
        # a car that slides is turned further than its side force carries it, never less
        carried, steered = level[SIDE], level[STEERING]
        allowed = readings.allowed
        excess, leaps = (
            kit.maximum(abs(side) - abs(steered), -side * kit.sign(steered)) > allowed[SIDE]
            for side in (carried, now[SIDE])
        )
        gap = level[YAW_RATE] - level[SIDE]
        wide, lasts = allowed[YAW_RATE] + allowed[SIDE], self.since[_AY] > _TRANSITION
        # what V_y' may explain lasts a moment, and counts twice
        sure = (self.impossible > 0.0) | (leaps & lasts & (abs(gap) > wide + abs(sway)))
        plausible = tuple(excess | sure if rule.one_sided else self._always for rule in TURN.rules)
        verdicts, agree = vote(kit, TURN, readings, (stuck_r, never, stuck_y), plausible, (never, never, sure))
        yaw, roll, side = verdicts
        steady = abs(sway) < 0.5 * abs(gap)
        apart = known[SIDE] & steady & (abs(gap) > wide - abs(sway))
        straight = largest(abs(level[YAW_RATE]), abs(level[STEERING])) < UNDERSTEER
        front, rear = (agree[YAW_RATE, i] & agree[i, STEERING] for i in (FRONT, REAR))
        # tires of a banked car carry less than its turn takes: it follows its steering closely
        follows = abs(level[YAW_RATE] - steered) < readings.allowed[YAW_RATE] + UNDERSTEER
        second = agree[YAW_RATE, STEERING] & (front | rear)
        grip = second & follows
        banked = self._banked(elapsed, apart & grip & (no(side.wrong) | straight) & no(stuck_y | roll.wrong), gap)
        before = self.remaining
        decided = (side._replace(wrong=side.wrong & no(banked)), yaw, roll)
        left = [self.left(elapsed, verdict, old) for verdict, old in zip(decided, before, strict=True)]
        begun_y, begun_r, begun_roll = ((now > 0.0) & (old == 0.0) for now, old in zip(left, before, strict=True))
        followed = kit.where(begun_r, level[YAW_RATE] - level[REAR], gap) * s.error_memory
        self.across.filter.widen(begun_y | begun_r | begun_roll, followed * followed)
        self.across.excuse(begun_y | begun_r)
        self.remaining = kit.stacked(left)
        used_y, used_r = known[SIDE] & (left[0] == 0.0) & no(stuck_y), known[YAW_RATE] & (left[1] == 0.0)
        apart_now = abs(now[YAW_RATE] - now[SIDE])
        # of a car whose steering and wheels do not follow its turn, which slides, a_y is the best there is
        pending = used_y & used_r & leaps & second & (apart_now > wide)
        pending = kit.where(pending, apart_now, 0.0)
        reported = known[SIDE] & (left[0] == 0.0)  # one that repeats what the others say is no fault
        levelled = left[2] == 0.0
        off = tuple(kit.where(levelled, value, 0.0) for value in gravity)
        if kit.some(no(levelled)):
            a, b, r = seen.inertial
            seen = seen._replace(inertial=kit.stacked((a, kit.where(levelled, b, b + gravity[0]), r)))
        found = self._replaced(elapsed, seen, readings, used_y, used_r, sway, pending)
        gated = no(reported & used_r & levelled)
        return found._replace(used=(reported, used_r), gravity=off[0], road=off[1], gated=gated)

    def forget(self, where: Number) -> None:
        """Starts the cars `where` afresh."""
        super().forget(where)
        self.witnesses.forget(where)

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
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        readings: Readings,
        used_y: Number,
        used_r: Number,
        sway: Number,
        pending: Number,
    ) -> Turning:
        """Readings that are not used, from those that are; `pending`: m/s^2 of doubt in an a_y that still is."""
        s, kit, choose, no = self.settings, self.kit, self.kit.where, self.kit.no
        _, b, r = seen.inertial
        (level, allowed, known), y, speed = readings, self.across.filter.mean, self.along.speed
        speed_at_least = choose(abs(speed) > 1.0, speed, 1.0)
        front, rear = known[FRONT], known[REAR]
        wheels = front | rear

        def best(of: Signals, nothing: Number) -> Number:
            """From both axles, one, the steering, or a_y."""
            axles = choose(front & rear, 0.5 * (of[FRONT] + of[REAR]), choose(front, of[FRONT], of[REAR]))
            return choose(wheels, axles, choose(by_steer, of[STEERING], choose(used_y, of[SIDE], nothing)))

        by_steer = known[STEERING] & (no(used_y) | (allowed[STEERING] < allowed[SIDE]))
        other, doubt = best(level, 0.0), best(allowed, abs(speed_at_least))
        unknown = no(used_r | wheels | used_y | known[STEERING])
        turn = choose(used_r, self.across.yaw_rate(r), other / speed_at_least)
        yaw_rate = choose(used_r, r, self.across.reading(turn))
        switched = (self.since[_R] > 0.0) == used_r
        ages = [
            choose(used, 0.0, kit.minimum(age + elapsed, s.error_memory))
            for used, age in zip((used_y & (pending == 0.0), used_r), self.since, strict=True)
        ]
        self.since = kit.stacked(ages)
        grown_y, grown_r = (self.grown(age, elapsed) for age in ages)
        noise_r = choose(used_r, seen.noise[2], doubt / (s.gate * abs(speed_at_least)) * grown_r)
        own = choose(used_r, speed * turn, other) + sway + y[BIAS] + y[BANK]
        ay = choose(used_y, b, own / (1.0 - y[SCALE]))
        doubt_y = (UNDULATION + abs(sway) + choose(used_r, allowed[YAW_RATE], doubt)) / s.gate
        doubt_y = choose(used_y, pending, doubt_y)
        noise_y = choose(doubt_y > 0.0, doubt_y * grown_y, seen.noise[1])
        self._differentiate(yaw_rate, switched, elapsed)
        reading, noises, used = (ay, yaw_rate), (noise_y, noise_r), (used_y, used_r)
        return Turning(reading, noises, used, doubt_y, unknown, *self._nothing, no(used_y & used_r))

    def _differentiate(self, yaw_rate: Number, switched: Number, elapsed: Number) -> None:
        """First-order filter of the slope; where the yaw rate comes from another source than before, that is no slope."""
        kit, kept = self.kit, self.kit.exp(-elapsed / self.settings.wheel_lag)
        steady = kit.no(switched) & (abs(self.yaw_rate) < math.inf)
        slope = kit.where(steady, (yaw_rate - self.yaw_rate) / elapsed, self.yaw_acceleration)
        slope = kit.maximum(kit.minimum(slope, self._quickest), -self._quickest)
        self.yaw_acceleration = kept * self.yaw_acceleration + (1.0 - kept) * slope
        self.yaw_rate = yaw_rate
