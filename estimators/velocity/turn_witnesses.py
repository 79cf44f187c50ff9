"""What the witnesses of `turn` (`parity`) say, and by how much each may be off.

    yaw rate      V_x r                                            bias and scale error, as far as they are known
    a_y           a_y - b - g_bank - V_y'                          bias, bank, and V_y' itself,
                  V_y' = r' L_r - (V_x r + g_bank)' V_x c_1/g      that the forces make
    front wheels  V_x (v_fr - v_fl)/(t_f cos delta)                slips that differ, radii as far as they are known
    rear wheels   V_x (v_rr - v_rl)/t_r                            likewise
    steering      V_x^2 tan(delta)/L                               half of itself: the tires slip

in m/s^2, each with an allowance for its error, all low-passed alike (`wheel_lag`). The wheels of an axle are witnesses while
they roll, and no sooner than the low-passed level has forgotten that they did not.
"""

from __future__ import annotations

import math

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.fusion_inputs import ConditionedInputs
from estimators.velocity.lateral_fusion import BANK, BIAS, SCALE, TIRES, YAW_BIAS, LateralFusion
from estimators.velocity.longitudinal_fusion import RADIUS, LongitudinalFusion
from estimators.velocity.parity import SIDE, STEERING, TURN, YAW_RATE
from estimators.velocity.signal_vote import Readings

UNDERSTEER = 1.0  # m/s^2 by which steering may be off where tires slip: 2 deg/g at 25 m/s
_FOLLOW = 0.5  # share of itself: the same, and the lag of the car behind its steering
_TOE = 0.02  # 1/m: 3.5 deg of steering over a wheelbase, all that is left of it at walking pace
UNDULATION = 0.5  # m/s^2 of side wind, ruts and body roll in a_y
_UNLIKE = 0.001  # slip of a free-rolling wheel that the other one of its axle does not share
_SHARE = 0.03  # relative: scale errors of the inertial unit and of V_x
_SETTLED = 3.0  # time constants until a low-passed level has forgotten wheels that did not roll


class TurnWitnesses(CarsMemory):
    """Remembers what they said; `readings` are those of the last sample."""

    memory = ("level", "rolled", "lean", "leaning")
    unknowns = ("lean",)
    readings: Readings

    def __init__(
        self, vehicle: VehicleParameters, along: LongitudinalFusion, across: LateralFusion, count: int
    ) -> None:
        self.settings, self.along, self.across = along.settings, along, across
        self.kit = kit = arithmetic((count,))
        self._length, self._arm = vehicle.wheelbase, vehicle.rear_axle_distance
        self._tracks = (vehicle.corner_y[0::2] - vehicle.corner_y[1::2]).tolist()
        zero, self._never = kit.full(0.0), kit.full(False)
        self.level: Signals = kit.stacked([zero] * (len(TURN.witnesses) + 1))  # and V_y', low-passed, m/s^2
        self.rolled: Signals = kit.stacked(
            [zero] * 2
        )  # s for which the wheels of an axle have rolled, up to `_SETTLED`
        self.lean: Number = kit.full(math.nan)  # m/s^2 of gravity across the road at the last sample, if it is known
        self.leaning: Number = zero  # its filtered derivative, m/s^3

    def __call__(
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        yaw_acceleration: Number,
        mu: Signals,
        gravity: tuple[Number, Number] | None,
    ) -> tuple[Readings, Number, tuple[Number, ...]]:
        """Levels with allowances, V_y', and the levels of this sample alone; arguments as in `TurnMonitor`."""
        kit, kept = self.kit, self.kit.exp(-elapsed / self.settings.wheel_lag)
        if gravity is not None:
            change = kit.where(abs(self.lean) < math.inf, gravity[1] - self.lean, 0.0)
            self.lean, self.leaning = gravity[1], kept * self.leaning + (1.0 - kept) * change / elapsed
        now, surface = self.say(seen, yaw_acceleration, None if gravity is None else gravity[0])
        self.level = kit.stacked([kept * old + (1.0 - kept) * new for old, new in zip(self.level, now, strict=True)])
        *level, sway = self.level
        self.readings = self._with_allowances(elapsed, seen, level, sway, surface, mu, gravity is not None)
        return self.readings, sway, now

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
        sway = yaw_acceleration * self._arm
        sway = sway - speed * y[TIRES + 2] / GRAVITY * (speed * yaw_acceleration + self.leaning)
        own = b * (1.0 - y[SCALE]) - y[BIAS] - sway
        front, rear = self._tracks
        levelled = own - y[BANK]
        levels = (
            speed * across.yaw_rate(r),
            levelled,
            speed * (surface[1] - surface[0]) / (front * kit.cos(angle)),
            speed * (surface[3] - surface[2]) / rear,
            square * kit.tan(angle - 0.5 * (rl + rr)) / self._length,
            levelled if gravity is None else own + gravity,
            sway,
        )
        return levels, surface

    def _with_allowances(
        self,
        elapsed: Number,
        seen: ConditionedInputs,
        level: Signals,
        sway: Number,
        surface: Signals,
        mu: Signals,
        levelled: bool,
    ) -> Readings:
        """The low-passed `level` with allowances; `mu` F_x/F_z of the wheels, `levelled`: an attitude part is there."""
        s, kit, speed = self.settings, self.kit, self.along.speed
        P, Q, gate = self.across.filter.variance, self.along.filter.variance, s.gate
        magnitude, largest, settled, rolled = abs(speed), kit.maximum, _SETTLED * s.wheel_lag, []
        t_g = magnitude * gate * kit.sqrt(P(YAW_BIAS) + s.yaw_rate_noise**2) + _SHARE * abs(level[YAW_RATE])
        t_p = gate * kit.sqrt(P(BIAS) + P(BANK)) + UNDULATION + _SHARE * abs(level[SIDE]) + abs(sway)
        allowed, known = [t_g, t_p], [seen.good[2], seen.good[1]]
        for axle, track in enumerate(self._tracks):
            i, k = 2 * axle, 2 * axle + 1
            a, c = RADIUS + i, RADIUS + k
            force = largest(abs(mu[i]), abs(mu[k]))
            share = _UNLIKE + (s.slip_linear + s.slip_cubic * force * force) * force
            radii = kit.sqrt(largest(Q(a) + Q(c) - 2.0 * Q(a, c), 0.0))
            allowed.append(magnitude * (magnitude * (share + radii) + s.slip_speed) / track)
            rolls = abs(0.5 * (surface[i] + surface[k]) - speed) < s.agreement * magnitude + s.dead_speed
            # a wheel on its way from spinning to locked passes the speed of the car, too
            rolls = rolls & (seen.left[i] + seen.left[k] == 0.0)
            rolled.append(kit.where(rolls, kit.minimum(self.rolled[axle] + elapsed, settled), 0.0))
            live = (seen.gap[i] < s.error_memory) & (seen.gap[k] < s.error_memory)
            known.append(live & (rolled[axle] >= settled) & kit.no(seen.silent[i] | seen.silent[k]))
        self.rolled = kit.stacked(rolled)
        allowed.append(kit.minimum(UNDERSTEER, _TOE * speed * speed) + _FOLLOW * abs(level[STEERING]))
        return Readings(
            tuple(level), (*allowed, t_p), (*known, seen.steered, seen.good[1] if levelled else self._never)
        )
