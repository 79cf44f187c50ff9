r"""The slip equation of both axles: the sideways slip velocity that the axle force of planar dynamics asks for.

m a_y = F_yf cos d + F_xf sin d + F_yr,  I_z r' = L_f (F_yf cos d + F_xf sin d) - L_r F_yr  (P1 (9)-(10), tracks left out):

    F_yf = ((L_r m a_y + I_z r')/L - F_xf sin d)/cos d,   F_yr = (L_f m a_y - I_z r')/L,

v_ry = -v_yt = v_x sin d - (V_y + r L_f) cos d at the front axle, -(V_y - r L_r) at the rear one. The zeros of steering and
of the sideslip reference are unknown: each axle has an angle of its own. Yaw inertia is fitted with them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from studies.identify.bristle import slip_velocity, tire_unknowns
from studies.identify.data import DriveSignals
from studies.identify.settings import IdentifySettings
from studies.identify.unknowns import Unknown
from synthesis.models.parameter_set import Tire

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
ANGLES = ("angle_front", "angle_rear")


class LateralSlip:
    """Rows (n, 2): front and rear axle, m/s; unknowns: tire, yaw inertia, the zero of each slip angle, rad."""

    direction = "lateral"

    def __init__(
        self, data: DriveSignals, tire: Tire, force_x: Array, yaw_inertia: float, settings: IdentifySettings
    ) -> None:
        if data.ay is None or data.yaw_rate is None:
            raise ValueError("lateral identification needs ay and yaw_rate")
        self.data, self.settings = data, settings
        angle = settings.angle_spread
        self.unknowns: tuple[Unknown, ...] = (
            *tire_unknowns(tire, settings),
            Unknown("yaw_inertia", yaw_inertia, settings.inertia_spread, settings.inertia_width, (-1.2, 1.2)),
            *(Unknown(name, 0.0, angle, angle, (-0.1, 0.1), positive=False) for name in ANGLES),
        )
        car, inputs = data.drive.vehicle, data.inputs
        self.axles = np.array([car.front_axle_to_cg, car.rear_axle_to_cg])
        base = self.axles.sum()
        steer = inputs.steer[:, :2].mean(axis=1)
        axle_x = np.stack([force_x[:, :2].sum(axis=1), force_x[:, 2:].sum(axis=1)], axis=1)
        self._sideways = axle_x[:, 0] * np.sin(steer)
        across = car.mass * data.ay
        self._static = np.stack(
            [(self.axles[1] * across / base - self._sideways), self.axles[0] * across / base], axis=1
        )
        self._turn = np.gradient(data.yaw_rate, data.step)[:, None] * np.array([1.0, -1.0]) / base
        self._cosine = np.stack([np.cos(steer), np.ones_like(steer)], axis=1)
        self.load = np.stack([data.load[:, :2].sum(axis=1), data.load[:, 2:].sum(axis=1)], axis=1)
        self._pulled = np.abs(data.filter.smooth(axle_x / self.load)) > settings.cross_force
        ends = data.vy[:, None] + data.yaw_rate[:, None] * self.axles * np.array([1.0, -1.0])
        sine = np.stack([np.sin(steer), np.zeros_like(steer)], axis=1)
        self.relative = data.vx[:, None] * sine - ends * self._cosine
        self.speed = np.abs(data.vx[:, None] * self._cosine + ends * sine)
        self._viscous = tire.sigma2.value * self.relative
        self._measured = data.filter.smooth(self.relative), data.filter.smooth(self.speed)

    def force(self, yaw_inertia: float) -> Array:
        """F_y of both axles in the tire frame (n, 2), N."""
        return np.asarray((self._static + yaw_inertia * self._turn) / self._cosine)

    def residual(self, p: Mapping[str, float]) -> Array:
        """F[v_ry] minus what the axle force asks for, m/s."""
        mu = self.force(p["yaw_inertia"]) / self.load - self._viscous
        asked = slip_velocity(p, mu, self.speed, self.data.filter, self.data.step)
        relative, speed = self._measured
        return np.asarray(relative + np.array([p[name] for name in ANGLES]) * speed - asked)

    def slip(self, p: Mapping[str, float]) -> Array:
        """F[v_ry]/F[v_xt] (n, 2) [1], the tangent of the slip angle."""
        relative, speed = self._measured
        offset = np.array([p.get(name, 0.0) for name in ANGLES])
        return np.asarray(relative / np.maximum(speed, self.settings.least_speed) + offset)

    def mask(self, limit: float, p: Mapping[str, float]) -> Mask:
        """Rows within the slip ``limit`` ever since the filters remember; an axle counts only with both its wheels."""
        bad = np.stack([self.data.bad[:, :2].any(axis=1), self.data.bad[:, 2:].any(axis=1)], axis=1)
        return self.data.filter.settled(~(np.abs(self.slip(p)) <= limit) | bad | self._pulled)

    def picture(self) -> tuple[Array, Array]:
        """Filtered normalised force (at the prior yaw inertia) and speed (n, 2)."""
        prior = next(u.prior for u in self.unknowns if u.name == "yaw_inertia")
        return self.data.filter.smooth(self.force(prior) / self.load), self._measured[1]
