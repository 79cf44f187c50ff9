r"""The slip equation of both axles: the sideways slip velocity that the axle force of planar dynamics asks for.

m a_y = F_yf cos d + F_xf sin d + F_yr,  and P1 (10) with its tracks (l_i = +T/2 left, -T/2 right):

    I_z r' = L_f (F_yf cos d + F_xf sin d) - L_r F_yr - sum l_i (F_xi cos d_i - F_yi sin d_i),

F_yi shared by load on the steered axle, F_xi from the torques (none known: none counted). Left out, drag of the outer
tires and the side force of steered ones turn up as 6 % of yaw inertia in a bend. Solved for both axle forces, linear in
I_z. v_ry = -v_yt = v_x sin d - (V_y + r L_f) cos d at the front axle, -(V_y - r L_r) at the rear one. The zeros of steering
and of the sideslip reference are unknown: each axle has an angle of its own. Axles differ in stiffness, C exp(+-q), by load,
camber and compliance: C is their geometric mean. Yaw inertia is fitted with them.

The noise of r' multiplies I_z and, through l D[.], the tire: it would pull both down (errors in variables). Its power falls
with the third and fifth power of the filter's lag, so the filter here is slower than that of the wheels.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from studies.identify.bristle import FELT, KEPT, filtered_parts, slip_velocity, tire_unknowns
from studies.identify.data import DriveSignals
from studies.identify.estimate import Unknown
from studies.identify.prefilter import Prefilter
from studies.identify.settings import IdentifySettings
from synthesis.models.parameter_set import Tire

ANGLES = ("angle_front", "angle_rear")


class LateralSlip:
    """Rows (n, 2): front and rear axle, m/s; unknowns: tire, yaw inertia, zero of each slip angle, rad, axle ratio q."""

    direction = "lateral"

    def __init__(
        self, data: DriveSignals, tire: Tire, force_x: FloatArray, yaw_inertia: float, settings: IdentifySettings
    ) -> None:
        if data.ay is None or data.yaw_rate is None:
            raise ValueError("lateral identification needs ay and yaw_rate")
        self.data, self.settings = data, settings
        self.filter = Prefilter(data.filter.known, data.step, settings.slow_lag, settings.settling)
        angle, axle = settings.angle_spread, settings.axle_spread
        self.unknowns: tuple[Unknown, ...] = (
            *tire_unknowns(tire, settings),
            Unknown("yaw_inertia", yaw_inertia, settings.inertia_spread, settings.inertia_width, (-1.2, 1.2)),
            *(Unknown(name, 0.0, angle, angle, (-0.1, 0.1), positive=False) for name in ANGLES),
            Unknown("axle_ratio", 0.0, axle, axle, (-1.0, 1.0), positive=False),
        )
        car, inputs = data.drive.vehicle, data.inputs
        self.axles = np.array([car.front_axle_distance, car.rear_axle_distance])
        base = self.axles.sum()
        steer = inputs.steer[:, :2].mean(axis=1)
        sine, cosine = np.sin(steer), np.cos(steer)
        axle_x = np.stack([force_x[:, :2].sum(axis=1), force_x[:, 2:].sum(axis=1)], axis=1)
        dragged = float(data.torque is not None) * np.sum(force_x * np.cos(inputs.steer) * inputs.y, axis=1)
        outward = np.sum(data.load[:, :2] * inputs.y[:2], axis=1) / np.sum(data.load[:, :2], axis=1)
        across, pulled = car.mass * data.ay, axle_x[:, 0] * sine
        lever = base * cosine + outward * sine
        front = (self.axles[1] * across + dragged - base * pulled) / lever
        turn = np.gradient(data.yaw_rate, data.step) / lever
        self._static = np.stack([front, across - front * cosine - pulled], axis=1)
        self._turn = np.stack([turn, -turn * cosine], axis=1)
        self._cosine = np.stack([cosine, np.ones_like(steer)], axis=1)
        self.load = np.stack([data.load[:, :2].sum(axis=1), data.load[:, 2:].sum(axis=1)], axis=1)
        self._pulled = np.abs(self.filter.smooth(axle_x / self.load)) > settings.cross_force
        ends = data.vy[:, None] + data.yaw_rate[:, None] * self.axles * np.array([1.0, -1.0])
        steered = np.stack([sine, np.zeros_like(sine)], axis=1)
        self.relative = data.vx[:, None] * steered - ends * self._cosine
        self.speed = np.abs(data.vx[:, None] * self._cosine + ends * steered)
        self._viscous = tire.sigma2.value * self.relative
        self._measured = self.filter.smooth(self.relative), self.filter.smooth(self.speed)
        self._parts = lru_cache(KEPT)(self._filtered_parts)

    def force(self, yaw_inertia: float) -> FloatArray:
        """F_y of both axles in the tire frame (n, 2), N."""
        return np.asarray(self._static + yaw_inertia * self._turn)

    def residual(self, p: Mapping[str, float]) -> FloatArray:
        """F[v_ry] minus what the axle force asks for, m/s."""
        damping, saturation, bend = (p[name] for name in FELT)
        asked = slip_velocity(p, self._parts(p["yaw_inertia"], (damping, saturation, bend)))
        asked = asked * np.exp(p.get("axle_ratio", 0.0) * np.array([-1.0, 1.0]))
        relative, speed = self._measured
        return np.asarray(relative + np.array([p[name] for name in ANGLES]) * speed - asked)

    def _filtered_parts(self, yaw_inertia: float, curve: tuple[float, float, float]) -> tuple[FloatArray, FloatArray]:
        mu = self.force(yaw_inertia) / self.load - self._viscous
        return filtered_parts(curve, mu, self.speed, self.filter, self.data.step)

    def slip(self, p: Mapping[str, float]) -> FloatArray:
        """F[v_ry]/F[v_xt] (n, 2) [1], the tangent of the slip angle."""
        relative, speed = self._measured
        offset = np.array([p.get(name, 0.0) for name in ANGLES])
        return np.asarray(relative / np.maximum(speed, self.settings.least_speed) + offset)

    def mask(self, limit: float, p: Mapping[str, float]) -> BoolArray:
        """Rows within the slip ``limit`` ever since the filters remember; an axle counts only with both its wheels."""
        bad = np.stack([self.data.bad[:, :2].any(axis=1), self.data.bad[:, 2:].any(axis=1)], axis=1)
        return self.filter.settled(~(np.abs(self.slip(p)) <= limit) | bad | self._pulled)

    def force_and_speed(self) -> tuple[FloatArray, FloatArray]:
        """Filtered normalised force (at the prior yaw inertia) and speed (n, 2)."""
        prior = next(u.prior for u in self.unknowns if u.name == "yaw_inertia")
        return self.filter.smooth(self.force(prior) / self.load), self._measured[1]
