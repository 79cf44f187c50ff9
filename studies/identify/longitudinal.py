"""The slip equation of every wheel: R_e w - v_xt is the slip velocity that its longitudinal force asks for.

Force and load as in a replay: F_x = (T - I_w dw/dt)/R_e - c_rr F_z, or, without torques, m a_x shared by load. Shared
forces are right in sum only: then the load-weighted mean of the four equations is used, and each single one only in free
rolling, |mu| < 0.05, where there is no force to share wrongly. That is also what tells the radii of the axles apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.vehicle import GRAVITY
from studies.drives.corner_inputs import shared_forces, wheel_forces
from studies.identify.bristle import FELT, KEPT, filtered_parts, slip_velocity, tire_unknowns
from studies.identify.data import DriveSignals
from studies.identify.estimate import Unknown
from studies.identify.prefilter import pitched
from studies.identify.settings import IdentifySettings
from synthesis.models.parameter_set import Tire

RADII = ("radius_front", "radius_rear")
SIDES = ("side_front", "side_rear")
DAMPINGS = ("pitch_damping_front", "pitch_damping_rear")
PITCHING = ("torque_delay", "pitch_frequency", *DAMPINGS)


class LongitudinalSlip:
    """Rows (n, 5): the four corners and their load-weighted mean, m/s.

    Unknowns: the tire, R_e of both axles relative to the drive file, half of what left has more than right, the delay of the
    torques (``delay``: value and standard deviation, s, as the balance of the whole car tells; at one speed v it acts like
    a relaxation length v*delay), and the pitching of the body: springs and dampers carry the load that an acceleration transfers,

        (2 z w s + w^2)/(s^2 + 2 z w s + w^2),   w = 2 pi f,

    a tenth of a second late and with an overshoot. The quasi-static loads of a replay would bend mu by as much as 13 %
    under pulsed brakes, and look like a longer relaxation. Heave makes the dampings of the axles differ.
    """

    direction = "longitudinal"

    def __init__(
        self, data: DriveSignals, tire: Tire, inertia: float, settings: IdentifySettings, delay: tuple[float, float]
    ) -> None:
        self.data, self.settings = data, settings
        inputs, load, s = data.inputs, data.load, settings
        side, late, damped = s.side_spread, s.pitch_frequency_spread, s.pitch_damping_spread
        self.unknowns: tuple[Unknown, ...] = (
            *tire_unknowns(tire, s),
            *(Unknown(name, 1.0, s.radius_spread, s.radius_width, (-0.1, 0.1)) for name in RADII),
            *(Unknown(name, 0.0, side, side, (-0.05, 0.05), positive=False) for name in SIDES),
            Unknown("torque_delay", delay[0], delay[1], delay[1], (-0.2, 0.2), positive=False),
            Unknown("pitch_frequency", s.pitch_frequency, late, late, (-1.5, 2.5)),
            *(Unknown(name, s.pitch_damping, damped, damped, (-2.0, 2.5)) for name in DAMPINGS),
        )
        self.along, self.surface = data.along, inputs.surface_speed
        self.torques_known = data.torque is not None
        force = wheel_force(data, inertia)
        self.force = np.where(np.isfinite(force), force, 0.0)
        self._late = np.zeros_like(force)
        if data.torque is not None:
            self._late = np.where(np.isfinite(force), np.gradient(data.torque, data.step, axis=0) / inputs.radius, 0.0)
        self.viscous = tire.sigma2.value * (self.surface - self.along)
        self.mu = self.force / load - self.viscous
        car, g = data.drive.vehicle, GRAVITY
        lengths = np.array([car.rear_axle_distance, car.front_axle_distance])
        self._static = np.repeat(lengths / lengths.sum() * car.mass * g / 2, 2)
        self._least = 0.05 * car.mass * g / 4
        self.share = load / load.sum(axis=1, keepdims=True)
        ay = data.ay if data.ay is not None else np.zeros_like(data.vx)
        self._turning = np.abs(data.filter.smooth(ay)) > settings.cross_force * GRAVITY
        self._measured = data.filter.smooth(self.surface), data.filter.smooth(self.along)
        self._pitched = lru_cache(KEPT)(self._pitched_friction)
        self._parts = lru_cache(KEPT)(self._filtered_parts)

    def residual(self, p: Mapping[str, float]) -> FloatArray:
        """F[R_e w - v_xt] minus what the force asks for, m/s."""
        ratio = self._ratio(p)
        surface, along = self._measured
        pitching = tuple(p[name] for name in PITCHING) if self.torques_known else ()
        damping, saturation, bend = (p[name] for name in FELT)
        asked = slip_velocity(p, self._parts(tuple(ratio.tolist()), pitching, (damping, saturation, bend)))
        corners = surface * ratio - along - asked
        return np.concatenate([corners, np.sum(self.share * corners, axis=1, keepdims=True)], axis=1)

    def _ratio(self, p: Mapping[str, float]) -> FloatArray:
        """R_e of the corners (4,) relative to the drive file."""
        sides = np.outer([p.get(name, 0.0) for name in SIDES], [1.0, -1.0]).ravel()
        return np.asarray(np.repeat([p.get(name, 1.0) for name in RADII], 2) * (1.0 + sides))

    def _filtered_parts(
        self, ratio: tuple[float, ...], pitching: tuple[float, ...], curve: tuple[float, float, float]
    ) -> tuple[FloatArray, FloatArray]:
        radii = np.array(ratio)
        # shared by load mu is a_x/g at every wheel, whatever the radii
        mu = self._pitched(*pitching) / radii if pitching else self.mu
        return filtered_parts(curve, mu, np.abs(self.surface) * radii, self.data.filter, self.data.step)

    def _pitched_friction(self, delay: float, frequency: float, *dampings: float) -> FloatArray:
        """mu (n, 4): transferred load follows acceleration as the body pitches."""
        moved, step, runs = self.data.load - self._static, self.data.step, self.data.filter.runs
        sides = [
            pitched(moved[:, axle], step, frequency, damping, runs)
            for axle, damping in zip((slice(0, 2), slice(2, 4)), dampings, strict=True)
        ]
        load = np.maximum(self._static + np.concatenate(sides, axis=1), self._least)
        return np.asarray((self.force - delay * self._late) / load - self.viscous)

    def slip(self, p: Mapping[str, float]) -> FloatArray:
        """F[R_e w - v_xt]/F[v_xt] (n, 4) [1]: what the slip limit is compared with."""
        ratio = self._ratio(p)
        surface, along = self._measured
        size = np.maximum(np.abs(along), self.settings.least_speed)
        return np.asarray((surface * ratio - along) / size)

    def mask(self, limit: float, p: Mapping[str, float]) -> BoolArray:
        """Rows within the slip ``limit`` ever since the filters remember."""
        beyond = ~(np.abs(self.slip(p)) <= limit) | self.data.bad | self._turning[:, None]
        good = self.data.filter.settled(beyond)
        if self.torques_known:
            return np.concatenate([good, np.zeros((len(good), 1), dtype=bool)], axis=1)
        all_good = good.all(axis=1, keepdims=True)
        pushed = np.abs(self.mu).max(axis=1, keepdims=True) >= self.settings.free_rolling
        rolling = good & self.data.filter.settled(pushed)
        return np.concatenate([rolling, all_good & ~rolling.any(axis=1, keepdims=True)], axis=1)

    def force_and_speed(self) -> tuple[FloatArray, FloatArray]:
        """Filtered normalised force and rolling speed (n, k), of the corners, or of their mean without torques."""
        mu, speed = self.data.filter.smooth(self.mu), self.data.filter.smooth(np.abs(self.along))
        mean = [np.sum(self.share * value, axis=1, keepdims=True) for value in (mu, speed)]
        return np.concatenate([mu, mean[0]], axis=1), np.concatenate([speed, mean[1]], axis=1)


def wheel_force(data: DriveSignals, inertia: float) -> FloatArray:
    """F_x (n, 4), N; NaN at held wheels. Central differences of w: the prefilter comes after them."""
    car, inputs = data.drive.vehicle, data.inputs
    nothing = np.zeros((len(data.vx), 4))
    if data.torque is None:
        known = np.zeros(4, dtype=bool)
        return shared_forces(inputs.ax, data.load, car.mass, nothing, known)
    return wheel_forces(
        data.torque, inputs.wheel_speed, np.gradient(inputs.wheel_speed, data.step, axis=0), data.load, inertia,
        inputs.radius, car.rolling_resistance, data.drive.observer.stopped_below, car.bearing_friction,
    )  # fmt: skip
