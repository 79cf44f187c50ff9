"""Monitor of yaw rate, lateral acceleration and steering: each is predicted from the others, and outvoted by them.

Five witnesses tell the same number, the centripetal acceleration of the car, m/s^2, each with an allowance for its error:

    yaw rate      V_x r                                            bias and scale error, as the fusion knows them
    a_y           a_y - b - g_bank - V_y',  V_y' = r' (L_r - V_x^2 c_1/g)        bias, bank, and half of V_y'
    front wheels  V_x (v_fr - v_fl)/(t_f cos delta)                slip error of both, and the radii as far as they are known
    rear wheels   V_x (v_rr - v_rl)/t_r                            likewise
    steering      V_x^2 tan(delta)/L                               1 m/s^2, and half of itself: the tires slip

all low-passed alike (`wheel_lag`). Two contradict each other where they are further apart than both allowances. The rule is
the same for all: **a signal is outvoted by two others that agree with each other and contradict it, unless another contradicts these.**
What cannot be known from values alone narrows it:

* In a slide V_y' is any, so a_y is outvoted only while the steering agrees with those two, and only where it points to the
  other side or reads more than they say: a car that slides is turned further than its side force can carry it, never less.
* Tires slip, so the yaw rate is outvoted only if wheels, front or rear, are among the two.
* A reading that repeats itself for longer than a slow unit does (`slowest_unit`: frozen, zero, clipped at its limit) has no
  benefit of doubt: one pair of wheels outvotes the yaw rate, one of yaw rate and wheels outvotes a_y.

An outvoted signal, or one that is missing, is replaced by what the others say it should read, with their allowance as its
noise; it comes back when nothing contradicts it and another agrees with it for `error_memory`.

**What can be told apart.** fault -> who contradicts whom:

    yaw rate             | against a_y, front, rear                       | found, replaced by wheels
    a_y                  | against yaw rate, front, rear, steering        | found, replaced by V_x r
    one axle's wheels    | against yaw rate, a_y, the other axle          | yaw rate kept; the wheel is gated by its own innovation
    steering             | against all others                             | looks like understeer (or a drift): its axle is gated, nothing named
    yaw rate and a_y     | both against front and rear, which agree       | both found
    yaw rate and an axle | against a_y and the other axle, which agree    | yaw rate found
    a_y and steering     | a_y against yaw rate and wheels, no grip known  | a_y found only if it repeats itself; else it looks like a slide
    yaw rate and wheels  | a_y and steering agree, nobody else            | nothing decided: found only if the yaw rate repeats itself and one axle is right
    a_y too small, alive | as a slide or a bank, for as long as it lasts  | the bank may explain it: its uncertainty grows (`bank_found`)
"""

from __future__ import annotations

import math
from typing import NamedTuple

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.lateral_fusion import BANK, BIAS, SCALE, TIRES, YAW_BIAS, LateralFusion
from estimators.velocity.longitudinal_fusion import RADIUS, LongitudinalFusion

_STEERING = (1.0, 0.5, 0.02)  # m/s^2, share of itself, 1/m: understeer of 2 deg/g at 25 m/s, and the lag of the car; 3.5 deg
_ALIVE = (0.5, 0.1)  # m/s^2, and share of the larger: what a slide adds before a live reading is doubted
_PATIENCE = 0.5  # s for which a car that follows its steering contradicts its a_y before the road is taken for banked
_BANK = 0.3  # rad: banked curves of test tracks are up to 0.5
_SWAY = 1.0  # share of V_y' by which its model may be off: it is made of a yaw rate that may be at fault itself
_UNDULATION = 0.5  # m/s^2 of side wind, ruts and body roll in a_y
_UNLIKE = 0.001  # slip of a free-rolling wheel that the other one of its axle does not share
_SHARE = 0.03  # relative: scale errors of both sensors and of V_x


class Judged(NamedTuple):
    """What the lateral filter is to use."""

    ay: Number  # m/s^2, the reading, or what it should be
    yaw_rate: Number  # rad/s, likewise
    noise_ay: Number
    noise_yaw_rate: Number
    used_ay: Number
    used_yaw_rate: Number
    unknown: Number  # whether nothing tells the yaw rate
    doubt: Number  # m/s^2 by which a replaced a_y may be off for long; 0 where it is the reading


class SignalMonitor(CarsMemory):
    """Remembers of `count` cars the low-passed witnesses and for how long who is not believed."""

    memory = ("level", "remaining", "since", "sloped", "yaw_rate", "yaw_acceleration", "mu")
    unknowns = ("yaw_rate",)

    def __init__(
        self, vehicle: VehicleParameters, along: LongitudinalFusion, across: LateralFusion, count: int
    ) -> None:
        self.settings, self.along, self.across = along.settings, along, across
        self.kit = kit = arithmetic((count,))
        self._length, self._arm = vehicle.wheelbase, vehicle.rear_axle_distance
        left, right = vehicle.corner_y[0::2], vehicle.corner_y[1::2]
        self._tracks = (left - right).tolist()
        zero = kit.full(0.0)
        self._zero, self._never = zero, kit.full(False)
        self.level: Signals = kit.stacked([zero] * 5)  # low-passed witnesses, m/s^2
        self.remaining: Signals = kit.stacked([zero] * 2)  # s for which a_y, yaw rate are not believed
        self.since: Signals = kit.stacked([zero] * 2)  # s for which a_y, yaw rate have been replaced
        self.sloped: Number = zero  # s for which a_y has been off as on a bank
        self.mu: Signals = kit.stacked([zero] * 4)  # F_x/F_z of the wheels at the last sample
        self.yaw_rate: Number = kit.full(math.nan)  # the last one that was used, rad/s
        self.yaw_acceleration: Number = zero  # filtered, rad/s^2

    def __call__(self, elapsed: Number, seen: ConditionedInputs) -> Judged:
        """One sample."""
        s, kit, along, across = self.settings, self.kit, self.along, self.across
        x, y, speed = along.filter.mean, across.filter.mean, along.speed
        _, b, r = seen.inertial
        fl, fr, rl, rr = seen.steer
        angle = 0.5 * (fl + fr)
        s_fl, s_fr, s_rl, s_rr = (
            R * w * (1.0 + rho) for R, w, rho in zip(along.radius, seen.wheel_speed, x[RADIUS:], strict=True)
        )
        turn = across.yaw_rate(r)
        square = speed * speed
        sway = self.yaw_acceleration * (self._arm - square * y[TIRES + 2] / GRAVITY)
        own = b * (1.0 - y[SCALE]) - y[BIAS] - y[BANK]
        front, rear = self._tracks
        now = (
            speed * turn,
            own - sway,
            speed * (s_fr - s_fl) / (front * kit.cos(angle)),
            speed * (s_rr - s_rl) / rear,
            square * kit.tan(angle - 0.5 * (rl + rr)) / self._length,
        )
        kept = kit.exp(-elapsed / s.wheel_lag)
        self.level = level = kit.stacked(
            [kept * old + (1.0 - kept) * new for old, new in zip(self.level, now, strict=True)]
        )
        allowed, known = self._allowances(seen, level, sway, (s_fl, s_fr, s_rl, s_rr))
        v_g, v_p, v_f, v_q, v_d = level
        t_g, t_p, t_f, t_q, _ = allowed
        quiet = known[0] & known[1] & (abs(v_p - v_g) < t_p + t_g)
        quiet = quiet & (kit.no(known[2]) | (abs(v_f - v_g) < t_f + t_g)) & (kit.no(known[3]) | (abs(v_q - v_g) < t_q + t_g))
        quiet = quiet & (self.remaining[0] + self.remaining[1] == 0.0)
        if not kit.some(kit.no(quiet)):
            self._differentiate(r, self.since[1] > 0.0, elapsed)
            self.since = kit.stacked([self._zero] * 2)
            self.sloped = kit.maximum(self.sloped - elapsed, 0.0)
            return Judged(b, r, seen.noise[1], seen.noise[2], known[1], known[0], self._never, self._zero)
        return self._voted(elapsed, seen, allowed, known, sway)

    def _allowances(
        self, seen: ConditionedInputs, level: Signals, sway: Number, surface: Signals
    ) -> tuple[tuple[Number, ...], tuple[Number, ...]]:
        """Of each witness, m/s^2, and whether it says anything."""
        s, kit, speed = self.settings, self.kit, self.along.speed
        P, Q, gate = self.across.filter.variance, self.along.filter.variance, s.gate
        magnitude, largest = abs(speed), kit.maximum
        t_g = magnitude * gate * kit.sqrt(P(YAW_BIAS) + s.yaw_rate_noise**2) + _SHARE * abs(level[0])
        t_p = gate * kit.sqrt(P(BIAS) + P(BANK)) + _UNDULATION + _SHARE * abs(level[1]) + _SWAY * abs(sway)
        allowed, known = [t_g, t_p], [seen.good[2], seen.good[1]]
        for axle, track in enumerate(self._tracks):
            i, k = 2 * axle, 2 * axle + 1
            a, c = RADIUS + i, RADIUS + k
            force = largest(abs(self.mu[i]), abs(self.mu[k]))
            share = _UNLIKE + (s.slip_linear + s.slip_cubic * force * force) * force
            radii = kit.sqrt(largest(Q(a) + Q(c) - 2.0 * Q(a, c), 0.0))
            allowed.append(magnitude * (magnitude * (share + radii) + s.slip_speed) / track)
            rolls = abs(0.5 * (surface[i] + surface[k]) - speed) < s.agreement * magnitude + s.dead_speed
            live = (seen.gap[i] < s.error_memory) & (seen.gap[k] < s.error_memory) & kit.no(seen.silent[i] | seen.silent[k])
            known.append(live & rolls)
        slow = _STEERING[2] * speed * speed
        allowed.append(kit.minimum(_STEERING[0], slow) + _STEERING[1] * abs(level[4]))
        known.append(seen.steered)
        return tuple(allowed), tuple(known)

    def _voted(
        self, elapsed: Number, seen: ConditionedInputs, allowed: tuple[Number, ...], known: tuple[Number, ...], sway: Number
    ) -> Judged:
        s, kit, choose, no = self.settings, self.kit, self.kit.where, self.kit.no
        level, largest = self.level, kit.maximum
        never = self._never
        against: dict[tuple[int, int], Number] = {}
        agree: dict[tuple[int, int], Number] = {}
        beyond: dict[tuple[int, int], Number] = {}
        for i in range(5):
            for k in range(i + 1, 5):
                both, gap = known[i] & known[k], abs(level[i] - level[k]) - allowed[i] - allowed[k]
                alive = _ALIVE[0] + _ALIVE[1] * largest(abs(level[i]), abs(level[k]))
                against[i, k] = against[k, i] = both & (gap > 0.0)
                agree[i, k] = agree[k, i] = both & (gap <= 0.0)
                beyond[i, k] = beyond[k, i] = both & (gap > alive)

        def outvoted(i: int, far: dict[tuple[int, int], Number], *groups: tuple[int, ...]) -> Number:
            """By all of a group, whose members agree with each other, and none of the others agrees with it."""
            found = never
            for group in groups:
                all_ = known[i]
                for place, j in enumerate(group):
                    all_ = all_ & far[i, j]
                    for k in group[:place]:
                        all_ = all_ & agree[j, k]
                found = found | all_
            return found

        stuck = [(count - 1.0) * elapsed > s.slowest_unit for count in seen.run]
        wrong_r = outvoted(0, beyond, (1, 2, 3), (2, 3, 4), (1, 2, 4), (1, 3, 4))
        backed = agree[0, 1] & (against[1, 2] | against[1, 3] | against[1, 4])
        wrong_r = wrong_r & no(backed | agree[0, 2] | agree[0, 3])
        wrong_r = wrong_r | (stuck[2] & outvoted(0, against, (1, 2), (1, 3), (2, 3), (2, 4), (3, 4)))
        wrong_y = never
        for j, k in ((0, 2), (0, 3), (2, 3)):
            follows = agree[j, k] & agree[j, 4] & agree[k, 4]
            wrong_y = wrong_y | (beyond[1, j] & against[1, k] & follows)
        wrong_y = wrong_y & no(agree[1, 2] | agree[1, 3])
        wrong_y = wrong_y & ((level[1] * level[4] < 0.0) | (abs(level[1]) > abs(level[4])))
        wrong_y = wrong_y | (stuck[1] & (against[1, 2] | against[1, 3] | (against[0, 1] & no(wrong_r))))
        straight = largest(abs(level[0]), abs(level[4])) < _STEERING[0]
        follows = agree[0, 4] & (agree[0, 2] & agree[2, 4] | agree[0, 3] & agree[3, 4])
        gap = level[0] - level[1]
        steady = abs(sway) < 0.5 * abs(gap)
        apart = steady & (abs(gap) > allowed[0] + allowed[1] - _SWAY * abs(sway))
        slope = apart & follows & (no(wrong_y) | straight) & no(stuck[1])
        self.sloped = largest(self.sloped + choose(slope, elapsed, -elapsed), 0.0)
        found = self.sloped > _PATIENCE
        if kit.some(found):
            self.across.filter.widen(found, (GRAVITY * _BANK) ** 2, BANK)
            self.across.filter.widen(found, (gap * _PATIENCE) ** 2)
            self.sloped = choose(found, 0.0, self.sloped)
            wrong_y = wrong_y & no(found)
        contradicted_r = against[0, 1] & no(wrong_y) | against[0, 2] | against[0, 3]
        contradicted_y = against[0, 1] & no(wrong_r) | against[1, 2] | against[1, 3]
        supported_r = agree[0, 1] | agree[0, 2] | agree[0, 3]
        supported_y = agree[0, 1] | agree[1, 2] | agree[1, 3]
        left = []
        for wrong, contradicted, supported, before in (
            (wrong_y, contradicted_y, supported_y, self.remaining[0]),
            (wrong_r, contradicted_r, supported_r, self.remaining[1]),
        ):
            fades = choose(contradicted | no(supported), before, largest(before - elapsed, 0.0))
            left.append(choose(wrong, s.error_memory, fades))
        begun = [wrong & (before == 0.0) for wrong, before in zip((wrong_y, wrong_r), self.remaining, strict=True)]
        if kit.some(begun[0] | begun[1]):  # V_y has followed it for a while
            gap = kit.where(begun[1], abs(level[0] - level[3]), abs(level[0] - level[1]))
            self.across.filter.widen(begun[0] | begun[1], (gap * s.error_memory) ** 2)
        self.remaining = kit.stacked(left)
        used_y, used_r = known[1] & (left[0] == 0.0), known[0] & (left[1] == 0.0)
        return self._replaced(elapsed, seen, allowed, known, used_y, used_r, sway)

    def _replaced(
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        allowed: tuple[Number, ...],
        known: tuple[Number, ...],
        used_y: Number,
        used_r: Number,
        sway: Number,
    ) -> Judged:
        """Readings that are not used, from those that are."""
        s, kit, choose, no = self.settings, self.kit, self.kit.where, self.kit.no
        _, b, r = seen.inertial
        level, y, speed = self.level, self.across.filter.mean, self.along.speed
        pace = choose(abs(speed) > 1.0, speed, 1.0)
        wheels = known[2] | known[3]
        axles = choose(known[2] & known[3], 0.5 * (level[2] + level[3]), choose(known[2], level[2], level[3]))
        size = choose(known[2] & known[3], 0.5 * (allowed[2] + allowed[3]), choose(known[2], allowed[2], allowed[3]))
        by_steer = known[4] & (no(used_y) | (allowed[4] < allowed[1]))
        other = choose(wheels, axles, choose(by_steer, level[4], choose(used_y, level[1], 0.0)))
        doubt = choose(wheels, size, choose(by_steer, allowed[4], choose(used_y, allowed[1], abs(pace))))
        unknown = no(used_r | wheels | used_y | known[4])
        turn = choose(used_r, self.across.yaw_rate(r), other / pace)
        yaw_rate = choose(used_r, r, self.across.reading(turn))
        switched = (self.since[1] > 0.0) == used_r
        self.since = kit.stacked(
            [
                choose(used, 0.0, kit.minimum(age + elapsed, s.error_memory))
                for used, age in zip((used_y, used_r), self.since, strict=True)
            ]
        )
        grown = [kit.sqrt(kit.maximum(2.0 * age / elapsed - 1.0, 1.0)) for age in self.since]
        noise_r = choose(used_r, seen.noise[2], doubt / (s.gate * abs(pace)) * grown[1])
        central = choose(used_r, speed * turn, other)
        own = central + sway + y[BIAS] + y[BANK]
        ay = choose(used_y, b, own / (1.0 - y[SCALE]))
        doubt_y = (_UNDULATION + _SWAY * abs(sway) + choose(used_r, allowed[0], doubt)) / s.gate
        noise_y = choose(used_y, seen.noise[1], doubt_y * grown[0])
        self._differentiate(yaw_rate, switched, elapsed)
        return Judged(ay, yaw_rate, noise_y, noise_r, used_y, used_r, unknown, choose(used_y, 0.0, doubt_y))

    def _differentiate(self, yaw_rate: Number, switched: Number, elapsed: Number) -> None:
        """First-order filter of the slope; where the yaw rate comes from another source than before, that is no slope."""
        kit, kept = self.kit, self.kit.exp(-elapsed / self.settings.wheel_lag)
        steady = kit.no(switched) & (abs(self.yaw_rate) < math.inf)
        slope = kit.where(steady, (yaw_rate - self.yaw_rate) / elapsed, self.yaw_acceleration)
        self.yaw_acceleration = kept * self.yaw_acceleration + (1.0 - kept) * slope
        self.yaw_rate = yaw_rate
