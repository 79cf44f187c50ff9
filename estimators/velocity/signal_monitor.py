"""Monitor of yaw rate and lateral acceleration: each is predicted from the others with its uncertainty, and replaced by them.

Five witnesses tell the same number, the centripetal acceleration of the car, m/s^2, each with an allowance for its error:

    yaw rate      V_x r                                                       bias and scale error, as far as they are known
    a_y           a_y - b - g_bank - V_y',  V_y' = r' (L_r - V_x^2 c_1/g)     bias, bank, and V_y' itself
    front wheels  V_x (v_fr - v_fl)/(t_f cos delta)                           slips that differ, radii as far as they are known
    rear wheels   V_x (v_rr - v_rl)/t_r                                       likewise
    steering      V_x^2 tan(delta)/L                                          half of itself: the tires slip

all low-passed alike (`wheel_lag`). Who is outvoted, and what can be told apart, is in `signal_vote`. A signal that is outvoted,
or missing, is replaced by what the others say it should read, with their allowance as its noise; it comes back when nothing
contradicts it and another has agreed with it for `error_memory`. Until it was found V_y followed it: its variance grows by that.

**Bank.** A car that follows its steering while a_y, alive, contradicts it for `_PATIENCE` is on a banked road: the variance of
the bank grows, and a_y is believed again. An a_y that has lost its gain looks the same.
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
from estimators.velocity.signal_vote import FRONT, REAR, SIDE, STEERING, YAW_RATE, vote

_UNDERSTEER = 1.0  # m/s^2 by which steering may be off where tires slip: 2 deg/g at 25 m/s
_FOLLOW = 0.5  # share of itself: the same, and the lag of the car behind its steering
_TOE = 0.02  # 1/m: 3.5 deg of steering over a wheelbase, all that is left of it at walking pace
_SWAY = 1.0  # share of V_y' by which its model may be off: it is made of a yaw rate that may be at fault itself
_UNDULATION = 0.5  # m/s^2 of side wind, ruts and body roll in a_y
_UNLIKE = 0.001  # slip of a free-rolling wheel that the other one of its axle does not share
_SHARE = 0.03  # relative: scale errors of both sensors and of V_x
_PATIENCE = 0.5  # s for which a car that follows its steering contradicts its a_y before the road is taken for banked
_BANK = 0.3  # rad: banked curves of test tracks are up to 0.5


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
        v_g, v_p, v_f, v_q, _ = level
        t_g, t_p, t_f, t_q, _ = allowed
        quiet = known[0] & known[1] & (abs(v_p - v_g) < t_p + t_g)
        quiet = (
            quiet
            & (kit.no(known[2]) | (abs(v_f - v_g) < t_f + t_g))
            & (kit.no(known[3]) | (abs(v_q - v_g) < t_q + t_g))
        )
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
        t_g = magnitude * gate * kit.sqrt(P(YAW_BIAS) + s.yaw_rate_noise**2) + _SHARE * abs(level[YAW_RATE])
        t_p = gate * kit.sqrt(P(BIAS) + P(BANK)) + _UNDULATION + _SHARE * abs(level[SIDE]) + _SWAY * abs(sway)
        allowed, known = [t_g, t_p], [seen.good[2], seen.good[1]]
        for axle, track in enumerate(self._tracks):
            i, k = 2 * axle, 2 * axle + 1
            a, c = RADIUS + i, RADIUS + k
            force = largest(abs(self.mu[i]), abs(self.mu[k]))
            share = _UNLIKE + (s.slip_linear + s.slip_cubic * force * force) * force
            radii = kit.sqrt(largest(Q(a) + Q(c) - 2.0 * Q(a, c), 0.0))
            allowed.append(magnitude * (magnitude * (share + radii) + s.slip_speed) / track)
            rolls = abs(0.5 * (surface[i] + surface[k]) - speed) < s.agreement * magnitude + s.dead_speed
            live = (
                (seen.gap[i] < s.error_memory)
                & (seen.gap[k] < s.error_memory)
                & kit.no(seen.silent[i] | seen.silent[k])
            )
            known.append(live & rolls)
        slow = _TOE * speed * speed
        allowed.append(kit.minimum(_UNDERSTEER, slow) + _FOLLOW * abs(level[STEERING]))
        known.append(seen.steered)
        return tuple(allowed), tuple(known)

    def _voted(
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        allowed: tuple[Number, ...],
        known: tuple[Number, ...],
        sway: Number,
    ) -> Judged:
        s, kit, no, largest = self.settings, self.kit, self.kit.no, self.kit.maximum
        level, (_, stuck_y, stuck_r) = self.level, ((run - 1.0) * elapsed > s.slowest_unit for run in seen.run)
        found = vote(kit, level, allowed, known, (stuck_y, stuck_r))
        gap, (wrong_y, wrong_r) = level[YAW_RATE] - level[SIDE], found.wrong
        steady = abs(sway) < 0.5 * abs(gap)
        apart = known[SIDE] & steady & (abs(gap) > allowed[YAW_RATE] + allowed[SIDE] - _SWAY * abs(sway))
        straight = largest(abs(level[YAW_RATE]), abs(level[STEERING])) < _UNDERSTEER
        banked = self._banked(elapsed, apart & found.grip & (no(wrong_y) | straight) & no(stuck_y), gap)
        left = []
        for wrong, contradicted, supported, before in zip(
            (wrong_y & no(banked), wrong_r), found.contradicted, found.supported, self.remaining, strict=True
        ):
            fades = kit.where(contradicted | no(supported), before, largest(before - elapsed, 0.0))
            left.append(kit.where(wrong, s.error_memory, fades))
        begun_y, begun_r = ((now > 0.0) & (before == 0.0) for now, before in zip(left, self.remaining, strict=True))
        followed = kit.where(begun_r, level[YAW_RATE] - level[REAR], gap) * s.error_memory
        self.across.filter.widen(begun_y | begun_r, followed * followed)
        self.remaining = kit.stacked(left)
        used_y, used_r = known[SIDE] & (left[0] == 0.0), known[YAW_RATE] & (left[1] == 0.0)
        return self._replaced(elapsed, seen, allowed, known, used_y, used_r, sway)

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
        doubt_y = (_UNDULATION + _SWAY * abs(sway) + choose(used_r, allowed[YAW_RATE], doubt)) / s.gate
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
