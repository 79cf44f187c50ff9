"""What the witnesses of the parity relations `turn` and `pull` say, m/s^2, and by how much each may be off.

    yaw rate      V_x r                                                       bias and scale error, as far as they are known
    a_y           a_y - b - g_bank - V_y',  V_y' = r' (L_r - V_x^2 c_1/g)     bias, bank, and V_y' itself
    front wheels  V_x (v_fr - v_fl)/(t_f cos delta)                           slips that differ, radii as far as they are known
    rear wheels   V_x (v_rr - v_rl)/t_r                                       likewise
    steering      V_x^2 tan(delta)/L                                          half of itself: the tires slip

    a_x           a_x (1 - s) - b
    forces        g (s_f mu_f + s_r mu_r)/(1 + (h/L)(mu_f - mu_r)), mu = F_x/F_z, mean of an axle, s its static load share
    wheels        middle of R_i w_i' + g_grade                                half of what a_x and the forces are apart, `rolling` at least

The forces follow from sum F_x = m a and loads that shift by m a h/L. The accelerometer feels forces alone, so grade is in neither.
Forces come from torques and wheel speeds: a_x has no part in them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from estimators.arithmetic import Arithmetic, Number, Signals, arithmetic
from estimators.signals import limits
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.lateral_fusion import BANK, SCALE, TIRES, YAW_BIAS, LateralFusion
from estimators.velocity.lateral_fusion import BIAS as SIDE_BIAS
from estimators.velocity.longitudinal_fusion import BIAS, RADIUS, SLIP, SPEED, LongitudinalFusion
from estimators.velocity.longitudinal_fusion import SCALE as PULL_SCALE
from estimators.velocity.parity import SIDE, STEERING, YAW_RATE

UNDERSTEER = 1.0  # m/s^2 by which steering may be off where tires slip: 2 deg/g at 25 m/s
_FOLLOW = 0.5  # share of itself: the same, and the lag of the car behind its steering
_TOE = 0.02  # 1/m: 3.5 deg of steering over a wheelbase, all that is left of it at walking pace
UNDULATION = 0.5  # m/s^2 of side wind, ruts and body roll in a_y
_UNLIKE = 0.001  # slip of a free-rolling wheel that the other one of its axle does not share
SHARE = 0.03  # relative: scale errors of the inertial unit and of V_x
_FAR = 1e9  # m/s
LARGEST_ACCELERATION = limits.FRICTION * GRAVITY  # m/s^2 of a car on its tires


class Told(NamedTuple):
    """By the witnesses of a relation, in its order."""

    level: tuple[Number, ...]
    allowed: tuple[Number, ...]
    known: tuple[Number, ...]  # who says anything


class TurnWitnesses:
    """Formulas of `turn` for the cars of the two filters."""

    def __init__(self, vehicle: VehicleParameters, along: LongitudinalFusion, across: LateralFusion) -> None:
        self.settings, self.along, self.across, self.kit = along.settings, along, across, across.kit
        self._length, self._arm = vehicle.wheelbase, vehicle.rear_axle_distance
        self._tracks = (vehicle.corner_y[0::2] - vehicle.corner_y[1::2]).tolist()

    def say(
        self, seen: ConditionedInputs, yaw_acceleration: Number, gravity: Number | None
    ) -> tuple[tuple[Number, ...], Signals]:
        """The six and V_y', not low-passed; the surface speeds of the wheels. `gravity`: what a levelled a_y had besides."""
        kit, along, across = self.kit, self.along, self.across
        x, y, speed = along.filter.mean, across.filter.mean, along.speed
        _, b, r = seen.inertial
        fl, fr, rl, rr = seen.steer
        angle = 0.5 * (fl + fr)
        surface = tuple(
            R * w * (1.0 + rho) for R, w, rho in zip(along.radius, seen.wheel_speed, x[RADIUS:], strict=True)
        )
        square = speed * speed
        sway = yaw_acceleration * (self._arm - square * y[TIRES + 2] / GRAVITY)
        own = b * (1.0 - y[SCALE]) - y[SIDE_BIAS] - sway
        front, rear = self._tracks
        levelled = own - y[BANK]
        told = (
            speed * across.yaw_rate(r),
            levelled,
            speed * (surface[1] - surface[0]) / (front * kit.cos(angle)),
            speed * (surface[3] - surface[2]) / rear,
            square * kit.tan(angle - 0.5 * (rl + rr)) / self._length,
            levelled if gravity is None else own + gravity,
            sway,
        )
        return told, surface

    def judge(
        self, seen: ConditionedInputs, level: Signals, sway: Number, surface: Signals, mu: Signals, levelled: Number
    ) -> Told:
        """The low-passed `level` with allowances; `mu` F_x/F_z of the wheels, `levelled`: an attitude part is there."""
        s, kit, speed = self.settings, self.kit, self.along.speed
        P, Q, gate = self.across.filter.variance, self.along.filter.variance, s.gate
        magnitude, largest = abs(speed), kit.maximum
        t_g = magnitude * gate * kit.sqrt(P(YAW_BIAS) + s.yaw_rate_noise**2) + SHARE * abs(level[YAW_RATE])
        t_p = gate * kit.sqrt(P(SIDE_BIAS) + P(BANK)) + UNDULATION + SHARE * abs(level[SIDE]) + abs(sway)
        allowed, known = [t_g, t_p], [seen.good[2], seen.good[1]]
        for axle, track in enumerate(self._tracks):
            i, k = 2 * axle, 2 * axle + 1
            a, c = RADIUS + i, RADIUS + k
            force = largest(abs(mu[i]), abs(mu[k]))
            share = _UNLIKE + (s.slip_linear + s.slip_cubic * force * force) * force
            radii = kit.sqrt(largest(Q(a) + Q(c) - 2.0 * Q(a, c), 0.0))
            allowed.append(magnitude * (magnitude * (share + radii) + s.slip_speed) / track)
            rolls = abs(0.5 * (surface[i] + surface[k]) - speed) < s.agreement * magnitude + s.dead_speed
            live = (seen.gap[i] < s.error_memory) & (seen.gap[k] < s.error_memory)
            known.append(live & rolls & kit.no(seen.silent[i] | seen.silent[k]))
        allowed.append(kit.minimum(UNDERSTEER, _TOE * speed * speed) + _FOLLOW * abs(level[STEERING]))
        return Told(tuple(level), (*allowed, t_p), (*known, seen.steered, seen.good[1] & levelled))


class PullWitnesses:
    """Formulas of `pull`."""

    def __init__(self, vehicle: VehicleParameters, along: LongitudinalFusion) -> None:
        self.settings, self.along, self.kit = along.settings, along, along.kit
        length = vehicle.wheelbase
        self._front, self._rear = vehicle.rear_axle_distance / length, vehicle.front_axle_distance / length
        self._lever = vehicle.cg_height / length
        self._never = self.kit.full(False)

    def unit(self, reading: Number) -> Number:
        """a_x without bias and scale error."""
        x = self.along.filter.mean
        return reading * (1.0 - x[PULL_SCALE]) - x[BIAS]

    def reading(self, unit: Number) -> Number:
        """The contrary."""
        x = self.along.filter.mean
        return (unit + x[BIAS]) / (1.0 - x[PULL_SCALE])

    def forces(self, mu: Signals, seen: ConditionedInputs) -> tuple[Number, Number]:
        """What F_x/F_z of the wheels make, and how far it may be off."""
        s, ahead, behind = self.settings, 0.5 * (mu[0] + mu[1]), 0.5 * (mu[2] + mu[3])
        force = GRAVITY * (self._front * ahead + self._rear * behind) / (1.0 + self._lever * (ahead - behind))
        # steered front wheels pull backwards with their side force, about half of m a_y
        allowed = s.force_gap_floor + s.force_gap_linear * abs(force) + abs(seen.inertial[1] * seen.steer[0])
        return force, allowed

    def wheels(self, slope: Signals, seen: ConditionedInputs) -> Number:
        """The middle of their accelerations, of a size that a car can have; 0 where they are old. `slope` rad/s^2."""
        kit, pulls = self.kit, [R * rate for R, rate in zip(self.along.radius, slope, strict=True)]
        top, least = (pick(pick(pulls[0], pulls[1]), pick(pulls[2], pulls[3])) for pick in (kit.maximum, kit.minimum))
        middle = 0.5 * (sum(pulls) - top - least)
        recent = kit.minimum(kit.minimum(*seen.gap[:2]), kit.minimum(*seen.gap[2:])) < self.settings.error_memory
        return kit.where(recent, kit.maximum(kit.minimum(middle, LARGEST_ACCELERATION), -LARGEST_ACCELERATION), 0.0)

    def shares(self, given: Signals | None, reading: Number) -> tuple[Signals, Number]:
        """F_x/F_z, of a size that a tire can have, a_x/g where unknown: the same share; and whether all were known."""
        kit = self.kit
        share = self.unit(reading) / GRAVITY
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

    def against_friction(self, seen: ConditionedInputs, innovation: Signals, mu: Signals) -> Number:
        """Whether all wheels that turn, three at least, slip against their force: no tire does, so the estimate is wrong.

        A braked wheel is never faster than the road, a driven one never slower. `innovation` m/s, from which slip as the forces
        `mu` make it has been taken. Which side is possible is known only where the wheel uses some friction (`unloaded`); beyond
        what the uncertainty of the estimate, noise and radii allow.
        """
        s, kit, choose, filter_ = self.settings, self.kit, self.kit.where, self.along.filter
        usual, sure = abs(filter_.mean[SPEED]) * filter_.mean[SLIP], s.unloaded

        def power(off: Number, force: Number) -> tuple[Number, ...]:
            return ((off + usual * force) * force,)

        (spent,) = kit.each(power, innovation, mu)  # by friction, per load: slip times force, never below zero
        least = kit.minimum(kit.minimum(spent[0], spent[1]), kit.minimum(spent[2], spent[3]))
        if not kit.some(least < -s.dead_speed * sure):
            return self._never
        turning, least = 0, _FAR
        for work, force, fresh, silent, age in zip(spent, mu, seen.fresh, seen.silent, seen.gap, strict=True):
            turns = fresh & kit.no(silent) & (age < s.error_memory)  # one that repeats itself for longer is dead
            turning = turning + choose(turns, 1, 0)
            wrong = choose(abs(force) > sure, -work / kit.maximum(abs(force), sure), 0.0)  # m/s
            least = kit.minimum(least, choose(turns, wrong, _FAR))
        white = s.wheel_speed_noise * self.along.radius[0]
        unsure = kit.sqrt(filter_.variance(SPEED) + white * white)
        return (turning >= 3) & (least > s.gate * unsure + s.agreement * abs(filter_.mean[SPEED]) + s.dead_speed)
