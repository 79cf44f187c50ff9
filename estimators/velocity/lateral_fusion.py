"""Lateral half of the fusion: V_y from the kinematics, held in place by what the two axles must slip to carry the car.

    dV_y/dt = a (1 - s) - b - g - V_x (r_m (1 - s_t) - b_r)                          P1 notes 5, with sensor errors
    0 = V_y + L_f r - V_x tan(delta) + |V_x| alpha_f + l c_1 mu_f',   0 = V_y - L_r r + |V_x| alpha_r + l c_1 mu_r'
    alpha(mu) = c_1 mu + c_3 mu^3,   mu_f = (m a L_r + I_z r')/(L F_zf),   mu_r = (m a L_f - I_z r')/(L F_zr)

A single-track car whose side slip follows its forces, with stiffnesses that adapt (P5 adapts one number per axle): no
friction coefficient enters. alpha is positive where F_y is (P4, P5), the opposite of P1. The accelerometer feels forces
alone, so mu needs no bank. The force of a tire follows its slip over l, `relaxation_length`: slip is ahead of alpha(mu), in a
slalom by a third of V_y. What gives is the carcass, as much at any slip: l c_1 mu', and not l alpha'. mu' is low-passed over
`wheel_lag`.

Every axle on one road: where one is further off than its model explains, or the two differ, which no V_y explains, neither is
believed more than that (half the difference), for a second (`axle_error`), even where the steering is not believed. Such an
error lasts as long as the turn, and no number of samples averages it away: each counts with the density of one of
`lost_time`, where toe and linkage change with every stroke of the steering (`side_error_memory`). Without side force an axle
is believed, and leads V_y back, for it does not slip sideways on any road.

The error has a side. On a slippery road, or where it pulls along as well, a tire slips further than alpha(mu), never less. An
axle that slips further, low-passed over `side_excess_memory`, is not believed more than that. One that would slip less is a
bound that V_y is led back to. A bound does not say where beyond it V_y is: all that it says within twice `side_error_memory`
counts as no surer than V_y itself.

Two scale errors decide how far the kinematics may be believed in a turn, where a and r V_x are large and cancel: s is that
of a, sensor and leftover body roll; s_t is that of the product r V_x, of the yaw rate sensor and of the speed, whose error
is that of the radii. Only the sensor's share of s_t is taken off the yaw rate. Attitude follows the estimated speeds, and
what it leaves in a wanders with their errors: b, s and s_t forget within `levelling_memory`, the gyro's b_r does not.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from estimators.arithmetic import Number, Signals, arithmetic
from estimators.memory import CarsMemory
from estimators.signals import limits
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.speed_filter_few import speed_filter

SPEED, BIAS, YAW_BIAS, SCALE, TURN_SCALE, BANK, TIRES = 0, 1, 2, 3, 4, 5, 6  # TIRES: c_1, c_3 front, c_1, c_3 rear
SIZE = 10
_TOLD = 0.15**2  # (F_y/F_z)^2 from which on the side slip tells how the tires bend
_STEEPEST = 2.0  # rad per F_y/F_z: sliding on ice
_MOVING = (BIAS, BANK, YAW_BIAS, SCALE, TURN_SCALE)
_SEEN = tuple((SPEED, BIAS, YAW_BIAS, SCALE, TURN_SCALE, TIRES + 2 * axle, TIRES + 2 * axle + 1) for axle in (0, 1))
_STILL = ((SPEED, TURN_SCALE), (YAW_BIAS, TURN_SCALE))


class AxleUpdate(NamedTuple):
    """What became of the two axle conditions (front, rear)."""

    innovation: Signals  # m/s
    used: Signals
    friction: Signals  # mu: F_y/F_z that the axles need
    excited: Number  # whether an axle slips enough for its stiffness to show above the error of its condition


class LateralFusion(CarsMemory):
    """V_y filter of `count` cars."""

    memory = ("axle_error", "lasting_error", "bend", "apart", "excess", "lagged")
    unknowns = ("lagged",)

    def __init__(self, vehicle: VehicleParameters, settings: FusionSettings, every: int, count: int) -> None:
        s = self.settings = settings
        self.kit = arithmetic((count,))
        mean, rates = np.zeros((2, SIZE))
        mean[TIRES:] = [s.side_compliance, s.side_cubic] * 2
        tires = [s.side_compliance_spread, s.side_cubic_spread] * 2
        scale, turn_scale = s.scale**2 + s.body_roll**2, s.scale**2 + s.radius_common**2
        body = [1.0, s.acceleration_bias**2, s.yaw_rate_bias**2, scale, turn_scale, (GRAVITY * s.bank) ** 2]
        rates[[BIAS, SCALE, TURN_SCALE]] = 1.0 / s.levelling_memory
        rates[YAW_BIAS], rates[TIRES:] = 1.0 / s.sensor_memory, 1.0 / s.side_memory
        spread = np.diag([*body, *np.square(tires)])
        self.filter = speed_filter(mean, spread, rates, (BANK, 1.0 / s.road_length), SIZE, every, count)
        self.axle_error: Number = self.kit.full(0.0)  # m/s by which axles have been off of late
        self.lasting_error: Number = self.kit.full(0.0)  # the same, low-passed
        self.bend: Signals = self.kit.stacked([self.kit.full(0.0)] * 2)  # side slip per F_y/F_z beyond c_1, rad
        self.apart: Number = self.kit.full(0.0)  # m/s between what the axles say of V_y, low-passed
        self.excess: Signals = self.kit.stacked([self.kit.full(0.0)] * 2)  # m/s, slip beyond alpha(mu), low-passed
        self.lagged: Signals = self.kit.stacked([self.kit.full(math.nan)] * 2)  # mu of the axles, low-passed
        self._both = self.kit.signals((1.0, 1.0))
        self._sensor = s.scale**2 / turn_scale  # share of the yaw rate sensor in s_t
        m, L, inertia = vehicle.mass, vehicle.wheelbase, vehicle.yaw_inertia
        front, rear, height = vehicle.front_axle_distance, vehicle.rear_axle_distance, vehicle.cg_height
        self._axles = tuple(
            self.kit.signals(values)
            for values in (
                (front, -rear),
                (m * rear / L, m * front / L),  # N of the axles per m/s^2 of lateral acceleration
                (inertia / L, -inertia / L),  # and per rad/s^2 of yaw acceleration
                (-m * height / L, m * height / L),  # N of their loads per m/s^2 of a_x
                ((front * s.yaw_rate_noise) ** 2, (rear * s.yaw_rate_noise) ** 2),
                (s.steering_noise**2, 0.0),
            )
        )

    @property
    def speed(self) -> Number:
        """V_y, m/s."""
        return self.filter.mean[SPEED]

    def yaw_rate(self, measured: Number) -> Number:
        """r, rad/s, without bias and scale error of the sensor."""
        x = self.filter.mean
        return measured * (1.0 - self._sensor * x[TURN_SCALE]) - x[YAW_BIAS]

    def reading(self, yaw_rate: Number) -> Number:
        """What the sensor would say of the yaw rate r, rad/s."""
        x = self.filter.mean
        return (yaw_rate + x[YAW_BIAS]) / (1.0 - self._sensor * x[TURN_SCALE])

    def predict(
        self,
        elapsed: Number,
        measured: Number,
        noise: Number,
        yaw_rate: Number,
        yaw_noise: Number,
        speed: Number,
        believed: Number,
        present: Number,
    ) -> None:
        """`measured` a_y and `yaw_rate` as the unit gives them, with their standard deviations; `speed` V_x.

        Readings that are not `believed` teach nothing about the sensors, nor about the road; without those of a sensor (not
        `present`) the axles are all there is, and believed again.
        """
        travel = elapsed * speed
        self.axle_error = self.kit.where(present, self.axle_error, 0.0)
        coupling = (-elapsed, -elapsed, travel, -elapsed * measured, travel * yaw_rate)
        if self.kit.some(self.kit.no(believed)):
            x, choose = self.filter.mean, self.kit.where
            known = sum(gain * x[place] for gain, place in zip(coupling, _MOVING, strict=True))
            coupling = tuple(choose(believed, gain, 0.0) for gain in coupling)
            held = choose(believed, 0.0, known)
        else:
            held = 0.0
        own, turned = elapsed * noise, travel * yaw_noise
        shift = elapsed * measured - travel * yaw_rate + held
        self.filter.move(elapsed, abs(speed), _MOVING, coupling, shift, own * own + turned * turned)

    def correct(
        self,
        elapsed: Number,
        measured: Number,
        yaw_rate: Number,
        yaw_acceleration: Number,
        steer: Signals,
        speed: Number,
        acceleration: Number,
        usable: Signals,
        rolling: Signals,
        doubt: Number,
    ) -> AxleUpdate:
        """`steer` of the axles, rad; `acceleration` a_x, for the loads; `rolling`: the tires of the axle do not slip.

        `usable`: and its steering is believed. `doubt`: m/s^2 by which an a_y that is not the sensor's may be off.
        """
        s, x, kit = self.settings, self.filter.mean, self.kit
        largest, smallest = kit.maximum, kit.minimum
        magnitude, turn, left = abs(speed), self.yaw_rate(yaw_rate), x[SPEED]
        own = measured * (1.0 - x[SCALE]) - x[BIAS]
        held, lasting = (largest(1.0, 2.0 * time / elapsed) for time in (s.side_error_memory, s.lost_time))
        sensed, one, gate = self._sensor * yaw_rate, kit.full(1.0), s.gate**2
        kept, sure = kit.exp(-elapsed / s.lost_time), s.unloaded - s.gate * doubt / GRAVITY
        slid = self.axle_error > s.dead_speed
        follows, ahead = kit.exp(-elapsed / s.wheel_lag), s.relaxation_length / s.wheel_lag
        axle_error, at_least = self.axle_error * self.axle_error, largest(magnitude, 1.0)

        def predicted(
            angle: Number,
            lagged: Number,
            c1: Number,
            c3: Number,
            arm: float,
            share: float,
            spin: float,
            tilt: float,
            turn_noise: float,
            steering_noise: float,
        ) -> tuple[Number, ...]:
            load = largest(share * GRAVITY + tilt * acceleration, 0.1 * GRAVITY * share)
            mu = (share * own + spin * yaw_acceleration) / load
            mu = largest(smallest(mu, limits.FRICTION), -limits.FRICTION)
            square = mu * mu
            side, linear = (c1 + c3 * square) * mu, magnitude * mu
            lagged = kit.where(abs(lagged) < math.inf, mu + follows * (lagged - mu), mu)
            innovation = speed * kit.tan(angle) - left - arm * turn - magnitude * side - ahead * c1 * (mu - lagged)
            steep = -magnitude * (c1 + 3.0 * c3 * square) * share / load
            sigma = magnitude * (s.side_floor + s.side_linear * abs(side)) + s.slip_speed
            white = turn_noise + speed * speed * steering_noise
            values = (one, steep, -arm * one, steep * measured, -arm * sensed, linear, linear * square)
            unknown = steep * doubt
            # what the tires slip sideways by the kinematics, beyond the straight line
            beyond = (abs(innovation + magnitude * side) - sigma) / at_least - c1 * abs(mu)
            excess = smallest(largest(beyond, 0.0) * abs(mu) / largest(square, _TOLD), _STEEPEST)
            return innovation, mu, lagged, sigma * sigma + unknown * unknown, white, excess, *values

        tires = x[TIRES::2], x[TIRES + 1 :: 2]
        innovation, mu, self.lagged, model, white, excess, *values = kit.each(
            predicted, steer, self.lagged, *tires, *self._axles
        )
        bent = kit.exp(-elapsed / s.error_memory)

        (self.bend,) = kit.each(lambda old, new: (bent * old + (1.0 - bent) * new,), self.bend, excess)
        both = rolling[0] & rolling[1]
        self.apart = bent * self.apart + (1.0 - bent) * kit.where(both, innovation[0] - innovation[1], 0.0)
        gap = 0.5 * abs(self.apart)
        keeps = kit.exp(-elapsed / s.side_excess_memory)

        def further(old: Number, off: Number, friction: Number, usable: Number) -> tuple[Number, ...]:
            return (keeps * old + (1.0 - keeps) * kit.where(usable, off * kit.sign(friction), 0.0),)

        (self.excess,) = kit.each(further, self.excess, innovation, mu, usable)

        def tested(
            explained: Number,
            off: Number,
            model: Number,
            white: Number,
            linear: Number,
            friction: Number,
            usable: Number,
            gap: Number,
            excess: Number,
        ) -> tuple[Number, ...]:
            shows, error = linear * s.side_compliance_spread, white + model
            calm = abs(friction) < sure
            far = usable & kit.no((calm & slid) | (off * off < gate * (explained + error)))
            excess = largest(excess, 0.0)
            stays = kit.where(off * friction < 0.0, explained * held, largest(axle_error, excess * excess) * lasting)
            wide = white + model * held + kit.where(calm, 0.0, stays)
            beyond = kit.where(calm, 0.0, largest(kit.where(far, abs(off), 0.0), gap))
            return usable & kit.no(far), wide, shows * shows > error, beyond

        explained = self.filter.expect(_SEEN, values)
        used, variance, excited, beyond = kit.each(
            tested, explained, innovation, model, white, values[5], mu, usable, kit.stacked((gap, gap)), self.excess
        )
        self.axle_error = kit.maximum(kept * self.axle_error, kit.maximum(*beyond))
        self.lasting_error = kept * self.lasting_error + (1.0 - kept) * self.axle_error
        self.filter.weigh(innovation, variance, used)
        return AxleUpdate(innovation, used, mu, excited[0] | excited[1])

    def excuse(self, where: Number) -> None:
        """A sensor of the cars `where` was found wrong: what axles were off by since shortly before is its error, not theirs."""
        self.axle_error = self.kit.where(where, self.kit.minimum(self.axle_error, self.lasting_error), self.axle_error)

    @property
    def wheel_bend(self) -> Signals:
        """`bend` of the four wheels."""
        front, rear = self.bend
        return self.kit.stacked((front, front, rear, rear))

    def friction(self, measured: Number) -> Number:
        """|F_y|/F_z of the whole car, from its a_y as measured."""
        x = self.filter.mean
        return abs(measured * (1.0 - x[SCALE]) - x[BIAS] - x[BANK]) / GRAVITY

    def calm(self, measured: Number) -> Number:
        """Whether the body accelerates sideways no more than a standing one may, given what is known of bias and bank."""
        f, s, x = self.filter, self.settings, self.filter.mean
        unknown = f.variance(BIAS) + f.variance(BANK) + 2.0 * f.variance(BIAS, BANK)
        own = measured * (1.0 - x[SCALE]) - x[BIAS] - x[BANK]
        return abs(own) < 3.0 * self.kit.sqrt(unknown + s.still_acceleration**2)

    def blind(self, elapsed: Number, where: Number) -> None:
        """V_y near zero for the cars `where` that have no lateral motion sensor: nothing else is known."""
        if self.kit.some(where):
            variance = 2.0 * self.settings.side_error_memory / elapsed  # 1 m/s
            self.filter.expect(((SPEED,),), ((1.0,),))
            self.filter.weigh([-self.speed], [variance], [where])

    def zero_velocity_update(self, where: Number, yaw_rate: Number) -> None:
        """V_y = 0 and r = 0 for the cars `where`."""
        if not self.kit.some(where):
            return
        s = self.settings
        sensed = self.kit.stacked((self.kit.full(0.0), self._sensor * yaw_rate))
        self.filter.expect(_STILL, (self._both, sensed))
        self.filter.weigh(
            (-self.speed, self.yaw_rate(yaw_rate)), (s.still_speed**2, s.yaw_rate_noise**2), (where, where)
        )
