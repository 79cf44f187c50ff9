"""Longitudinal half of the fusion: one speed, the errors of the inertial unit, the radii, and how far to trust a wheel.

    dV_x/dt = a (1 - s) - b - g + r V_y                                            P2 (15) with bias, grade and scale
    R_i w_i = v_xt,i + |V_x| c mu_i - rho_i R_i w_i + error                         a wheel: slip follows the force

s scale error, b bias, g gravity along the road, c slip compliance, mu_i = F_x/F_z, rho_i relative radius error, v_xt,i
speed of the wheel centre along the tire. The slip error grows with the friction used; a wheel whose surface leaves the
car, or whose innovation is larger than its own model can explain, is left out while that lasts (the high-slip
detection of P2 section 7 asks the same two questions). The force tells the side to which a wheel slips: towards the
other side a wheel is believed twice as far. Radii are learned from wheels that roll freely, where no slip hides them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.faults import BoolArray
from estimators.interpolate import FloatArray
from estimators.vehicle import GRAVITY
from estimators.velocity.fusion_settings import FusionSettings
from estimators.velocity.speed_filter import NEVER, SpeedFilter

SPEED, BIAS, GRADE, SCALE, SLIP, RADIUS = 0, 1, 2, 3, 4, 5  # columns of the state; RADIUS is the first of four
SIZE = 9


class WheelVerdict(NamedTuple):
    """What became of the four wheels of a sample, each (b, 4)."""

    innovation: FloatArray  # m/s, R w - prediction; NaN where there is no wheel speed
    used: BoolArray
    gated: BoolArray  # present, but further from the estimate than its model explains


class LongitudinalFusion:
    """Speed filter of b runs; `radius` (4,) m."""

    def __init__(self, radius: FloatArray, settings: FusionSettings, count: int) -> None:
        s = self.settings = settings
        self.radius = radius.copy()
        mean, rates, spatial = np.zeros((3, SIZE))
        mean[SLIP] = s.slip_compliance
        deviations = [1.0, s.acceleration_bias, GRAVITY * s.grade, s.scale, s.slip_compliance_spread]
        spread = np.diag(np.square([*deviations, *[s.radius_single] * 4]))
        spread[RADIUS:, RADIUS:] += s.radius_common**2
        rates[[BIAS, SCALE]], rates[SLIP] = 1.0 / s.sensor_memory, 1.0 / s.slip_memory
        rates[RADIUS:] = 1.0 / s.radius_memory
        spatial[GRADE] = 1.0 / s.road_length
        self.filter = SpeedFilter(mean, spread, rates, spatial, count)
        self._C = np.zeros((count, 4, SIZE))
        self._own_radius = np.einsum("bii->bi", self._C[:, :, RADIUS:])
        self._coupling = np.zeros((count, SIZE - 1))
        self._still = np.zeros((count, 1, SIZE))
        self._still[:, 0, SPEED] = 1.0
        self._radii_columns = np.arange(SIZE) >= RADIUS

    @property
    def speed(self) -> FloatArray:
        """V_x (b,), m/s: a view."""
        return self.filter.mean[:, SPEED]

    def acceleration(self, measured: FloatArray) -> FloatArray:
        """a (1 - s) - b - g (b,), m/s^2: what is left of the measured one along the road."""
        x = self.filter.mean
        out: FloatArray = measured * (1.0 - x[:, SCALE]) - x[:, BIAS] - x[:, GRADE]
        return out

    def predict(
        self, elapsed: FloatArray, measured: FloatArray, noise: FloatArray, yaw_rate: FloatArray, lateral: FloatArray
    ) -> None:
        """`measured` a_x with the standard deviation `noise` of its mean over the sample, m/s^2; `lateral` V_y."""
        self._coupling[:, BIAS - 1] = self._coupling[:, GRADE - 1] = -elapsed
        self._coupling[:, SCALE - 1] = -elapsed * measured
        shift = elapsed * (measured + yaw_rate * lateral)
        self.filter.move(elapsed, np.absolute(self.speed), self._coupling, shift, (elapsed * noise) ** 2)

    def correct(
        self,
        elapsed: FloatArray,
        wheel_speed: FloatArray,
        fresh: BoolArray,
        slipping: BoolArray,
        normalised_force: FloatArray,
        centre: tuple[FloatArray, FloatArray],
        acceleration: FloatArray,
    ) -> WheelVerdict:
        """`wheel_speed` finite (b, 4); `centre` = (g, h) with v_xt = g V_x + h; `acceleration` (b, 4) along the tires."""
        s, x = self.settings, self.filter.mean
        gain, shift = centre
        speed = x[:, :1]
        surface, pace = self.radius * wheel_speed, np.absolute(speed)
        slip = x[:, SLIP, None] * normalised_force
        innovation = surface * (1.0 + x[:, RADIUS:]) - gain * speed - shift - pace * slip
        C = self._C
        C[:, :, SPEED] = gain + np.sign(speed) * slip
        C[:, :, SLIP] = pace * normalised_force
        self._own_radius[:] = -surface
        strain = np.absolute(normalised_force)
        model = self._slip_error(pace, strain, surface, acceleration) ** 2
        white = (self.radius * s.wheel_speed_noise) ** 2
        explained = ((C @ self.filter.spread) * C).sum(axis=2) + white + model
        limit = np.where(innovation * normalised_force > 0, s.gate, s.wrong_way_gate)
        gated = fresh & (innovation * innovation > limit * limit * explained)
        used = fresh & ~gated & ~slipping
        held = np.maximum(1.0, 2.0 * s.error_memory / elapsed)[:, None]
        variance = np.where(used, white + model * held, NEVER)
        learning = np.where(self._radii_columns, (strain < s.free_rolling)[:, :, None], 1.0)
        self.filter.weigh(np.where(used, innovation, 0.0), C, variance, learning)
        return WheelVerdict(np.where(fresh, innovation, np.nan), used, gated)

    def stand(self, where: BoolArray) -> None:
        """V_x = 0 for the entries `where` (b,): what it takes to hold them there is bias or grade."""
        if where.any():
            variance = np.where(where, self.settings.still_speed**2, NEVER)[:, None]
            self.filter.weigh((-self.speed * where)[:, None], self._still, variance)

    def calm(self, measured: FloatArray) -> BoolArray:
        """Whether the body (b,) accelerates no more than a standing one may, given what is known of bias and grade."""
        P = self.filter.spread
        unknown = P[:, BIAS, BIAS] + P[:, GRADE, GRADE] + 2.0 * P[:, BIAS, GRADE]
        limit = 3.0 * np.sqrt(unknown + self.settings.still_acceleration**2)
        out: BoolArray = np.absolute(self.acceleration(measured)) < limit
        return out

    def _slip_error(
        self, pace: FloatArray, strain: FloatArray, surface: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        """Standard deviation (b, 4), m/s, of what slip compliance and pulse ring leave unexplained; `strain` |mu|."""
        s = self.settings
        slip = pace * (s.slip_floor + s.slip_linear * strain + s.slip_cubic * strain**3) + s.slip_speed
        late = np.absolute(acceleration) * (s.tooth_pitch / np.maximum(pace, s.dead_speed))
        silent = np.where(np.absolute(surface) < s.still_speed, s.dead_speed, 0.0)
        out: FloatArray = np.maximum(np.hypot(slip, late), silent)
        return out
