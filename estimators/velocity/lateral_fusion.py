"""Lateral half of the fusion: V_y from the kinematics, held in place by what the two axles must slip to carry the car.

    dV_y/dt = a (1 - s) - b - g - r V_x,    r = r_m (1 - s_r) - b_r                  P1 section 5, with sensor errors
    0 = V_y + L_f r - V_x tan(delta) + |V_x| alpha_f(mu_f),   0 = V_y - L_r r + |V_x| alpha_r(mu_r)
    alpha(mu) = c_1 mu + c_3 mu^3,   mu_f = (m a L_r + I_z r')/(L F_zf),   mu_r = (m a L_f - I_z r')/(L F_zr)

A single-track car whose side slip follows its forces, with stiffnesses that adapt (P5 adapts one number per axle): no
friction coefficient enters. alpha is positive where F_y is (P4, P5), the opposite of P1. The accelerometer feels forces
alone, so mu needs no bank.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.faults import BoolArray
from estimators.interpolate import FloatArray
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.speed_filter import NEVER, SpeedFilter

SPEED, BIAS, YAW_BIAS, SCALE, YAW_SCALE, BANK, TIRES = 0, 1, 2, 3, 4, 5, 6  # TIRES: c_1, c_3 front, c_1, c_3 rear
SIZE = 10
_LARGEST_FRICTION = 1.5  # a larger |mu| is no tire's


class AxleVerdict(NamedTuple):
    """What became of the two axle conditions (front, rear), each (b, 2)."""

    innovation: FloatArray  # m/s
    used: BoolArray


class LateralFusion:
    """V_y filter of b runs."""

    def __init__(self, vehicle: VehicleParameters, settings: FusionSettings, count: int) -> None:
        s = self.settings = settings
        mean, rates, spatial = np.zeros((3, SIZE))
        mean[TIRES:] = [s.side_compliance, s.side_cubic] * 2
        tires = [s.side_compliance_spread, s.side_cubic_spread] * 2
        body = [1.0, s.acceleration_bias, s.yaw_rate_bias, s.scale, s.scale, GRAVITY * s.bank]
        rates[BIAS:BANK], rates[TIRES:] = 1.0 / s.sensor_memory, 1.0 / s.side_memory
        spatial[BANK] = 1.0 / s.road_length
        self.filter = SpeedFilter(mean, np.diag(np.square([*body, *tires])), rates, spatial, count)
        m, L = vehicle.mass, vehicle.wheelbase
        front, rear = vehicle.front_axle_distance, vehicle.rear_axle_distance
        self._arms = np.array([front, -rear])
        self._share = m * np.array([rear, front]) / L  # N of the axles per m/s^2 of lateral acceleration
        self._spin = vehicle.yaw_inertia / L * np.array([1.0, -1.0])
        self._tilt = m * vehicle.cg_height / L * np.array([-1.0, 1.0])
        self._yaw_noise = (self._arms * s.yaw_rate_noise) ** 2
        self._C = np.zeros((count, 2, SIZE))
        self._C[:, :, SPEED] = 1.0
        self._C[:, :, YAW_BIAS] = -self._arms
        self._still = np.zeros((count, 2, SIZE))
        self._still[:, 0, SPEED] = self._still[:, 1, YAW_BIAS] = 1.0
        self._coupling = np.zeros((count, SIZE - 1))

    @property
    def speed(self) -> FloatArray:
        """V_y (b,), m/s: a view."""
        return self.filter.mean[:, SPEED]

    def yaw_rate(self, measured: FloatArray) -> FloatArray:
        """r (b,), rad/s, without bias and scale error."""
        x = self.filter.mean
        out: FloatArray = measured * (1.0 - x[:, YAW_SCALE]) - x[:, YAW_BIAS]
        return out

    def predict(
        self,
        elapsed: FloatArray,
        measured: FloatArray,
        noise: FloatArray,
        yaw_rate: FloatArray,
        yaw_noise: FloatArray,
        speed: FloatArray,
    ) -> None:
        """`measured` a_y and `yaw_rate` as the unit gives them, with their standard deviations; `speed` V_x."""
        coupling, travel = self._coupling, elapsed * speed
        coupling[:, BIAS - 1] = coupling[:, BANK - 1] = -elapsed
        coupling[:, YAW_BIAS - 1] = travel
        coupling[:, SCALE - 1] = -elapsed * measured
        coupling[:, YAW_SCALE - 1] = travel * yaw_rate
        variance = (elapsed * noise) ** 2 + (travel * yaw_noise) ** 2
        self.filter.move(elapsed, np.absolute(speed), coupling, elapsed * measured - travel * yaw_rate, variance)

    def correct(
        self,
        elapsed: FloatArray,
        measured: FloatArray,
        yaw_rate: FloatArray,
        yaw_acceleration: FloatArray,
        steer: FloatArray,
        speed: FloatArray,
        acceleration: FloatArray,
        usable: BoolArray,
    ) -> AxleVerdict:
        """`steer` (b, 2) of the axles, rad; `acceleration` a_x, for the loads; `usable` (b, 2): tires do not slip."""
        s, x, C = self.settings, self.filter.mean, self._C
        speed = speed[:, None]
        pace = np.absolute(speed)
        load = np.maximum(self._share * GRAVITY + self._tilt * acceleration[:, None], 0.1 * GRAVITY * self._share)
        own = measured * (1.0 - x[:, SCALE]) - x[:, BIAS]
        force = self._share * own[:, None] + self._spin * yaw_acceleration[:, None]
        mu = np.clip(force / load, -_LARGEST_FRICTION, _LARGEST_FRICTION)
        cubed = mu**3
        c1, c3 = x[:, TIRES::2], x[:, TIRES + 1 :: 2]
        side = c1 * mu + c3 * cubed
        innovation = speed * np.tan(steer) - x[:, :1] - self._arms * self.yaw_rate(yaw_rate)[:, None] - pace * side
        steep = -pace * (c1 + 3.0 * c3 * mu**2) * self._share / load
        C[:, :, BIAS], C[:, :, SCALE] = steep, steep * measured[:, None]
        C[:, :, YAW_SCALE] = -self._arms * yaw_rate[:, None]
        for axle in (0, 1):
            C[:, axle, TIRES + 2 * axle] = pace[:, 0] * mu[:, axle]
            C[:, axle, TIRES + 2 * axle + 1] = pace[:, 0] * cubed[:, axle]
        model = (pace * (s.side_floor + s.side_linear * np.absolute(side)) + s.slip_speed) ** 2
        white = self._yaw_noise + (speed * [s.steering_noise, 0.0]) ** 2
        explained = ((C @ self.filter.spread) * C).sum(axis=2) + white + model
        used = usable & (innovation * innovation < s.gate**2 * explained)
        held = np.maximum(1.0, 2.0 * s.side_error_memory / elapsed)[:, None]
        self.filter.weigh(np.where(used, innovation, 0.0), C, np.where(used, white + model * held, NEVER))
        return AxleVerdict(innovation, used)

    def blind(self, elapsed: FloatArray, where: BoolArray) -> None:
        """V_y near zero for the entries `where` (b,) that have no lateral motion sensor: nothing else is known."""
        if where.any():
            variance = np.where(where, 2.0 * self.settings.side_error_memory / elapsed, NEVER)  # 1 m/s
            self.filter.weigh((-self.speed * where)[:, None], self._still[:, :1], variance[:, None])

    def stand(self, where: BoolArray, yaw_rate: FloatArray) -> None:
        """V_y = 0 and r = 0 for the entries `where` (b,)."""
        if not where.any():
            return
        s = self.settings
        self._still[:, 1, YAW_SCALE] = yaw_rate
        seen = np.stack([-self.speed, self.yaw_rate(yaw_rate)], axis=1)
        variance = np.where(where[:, None], [s.still_speed**2, s.yaw_rate_noise**2], NEVER)
        self.filter.weigh(np.where(where[:, None], seen, 0.0), self._still, variance)
