"""Longitudinal force as a parameter that an unscented Kalman filter finds in the wheel dynamics."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from estimators.arguments import setting
from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.filters import UnscentedKalmanFilter
from estimators.filters.scalar import ScalarKalmanFilter, ScalarStep
from estimators.forces.interval import IntervalObserver, MeanForce
from estimators.forces.wheel import WheelForceStep, WheelSignals
from estimators.vehicle import VehicleParameters

METHODS = ("unscented", "linear")


class WheelForceFilter(IntervalObserver):
    """f_k+1 = f_k + rho_k, z_k = w_k = w_j + n Ts/I_w (T - R_e f - C_b w_j) + nu_k: P2 (10)-(12), per corner.

    w_j is the last new wheel speed, n samples ago, T the mean torque since then; with n = 1 this is P2 with its function
    G written out. It is linear in f, so the filter equals a scalar Kalman filter with H = -R_e n Ts/I_w.

    The random walk has the intensity `force_rate`, so that its variance grows with time, not with the number of samples;
    the two speeds of an interval give the measurement the variance 2 `speed_deviation`^2 (P2 leaves both open), and the
    walk of the force within an interval of several samples, of which w shows the mean alone, the variance q (n-1)(2n-1)/(6n).

    While a force cannot be known (wheel stopped, torque or speed missing) it fades to zero, with a variance that
    returns to the square of the load (friction about 1): covariances do not run away. The reported deviation adds to the
    filter's own half of what the measured force changed since the last sample: m is a mean over the interval. The
    innovation of a step is w - what, rad/s.

    Args:
        vehicle: radii, wheel inertia, rolling resistance.
        sample_time: Ts, s.
        batch_shape: ends with the four corners.
        force_rate: N/sqrt(s); 4000 lets the force move by 280 N in a sample of 5 ms.
        speed_deviation: rad/s, of the wheel speed sensor.
        bearing_friction: C_b, N m s/rad; None: that of the vehicle.
        stopped_below, fade_time: as `WheelInputs`.
        method: "unscented", as published, or "linear": the same filter, faster, as the model is linear.

    Raises:
        EstimatorError: a shape without corners, a setting that is not positive, an unknown method.

    >>> import numpy as np
    >>> observer = WheelForceFilter(VehicleParameters.published_suv(), sample_time=0.005)
    >>> step = observer.step(wheel_speed=np.full(4, 60.0), torque=np.full(4, 200.0))
    >>> step.force.shape  # N, one a wheel
    (4,)
    """

    memory = ("before",)
    parts = ("inputs", "interval", "filter")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (4,),
        force_rate: float = 4000.0,
        speed_deviation: float = 0.05,
        bearing_friction: float | None = None,
        stopped_below: float = 1.0,
        fade_time: float = 0.2,
        method: Literal["unscented", "linear"] = "unscented",
    ) -> None:
        if method not in METHODS:
            raise EstimatorError(f"method = {method!r} is not known; use 'unscented' or 'linear'")
        super().__init__(vehicle, sample_time, batch_shape, stopped_below, fade_time)
        self.method = method
        self.process_variance = setting(force_rate, "force_rate", "N/sqrt(s)") ** 2 * self.inputs.sample_time
        self.measurement_variance = 2.0 * setting(speed_deviation, "speed_deviation", "rad/s") ** 2
        friction = vehicle.bearing_friction if bearing_friction is None else bearing_friction
        self._friction = setting(friction, "bearing_friction", "N m s/rad", low_allowed=True)
        self._prior = np.broadcast_to(vehicle.static_loads**2, self.batch_shape)
        self.before: FloatArray = np.zeros(self.batch_shape)
        start, spread = np.zeros((*self.batch_shape, 1)), self._prior[..., None, None]
        self.filter: UnscentedKalmanFilter | ScalarKalmanFilter = (
            UnscentedKalmanFilter(start, spread) if method == "unscented" else ScalarKalmanFilter(start, spread)
        )

    def _observed(self, signals: WheelSignals, mean: MeanForce) -> WheelForceStep:
        n, walk = mean.samples, self.process_variance
        reach = n * (self.inputs.sample_time / self.inputs.inertia)
        free = mean.before + reach * (mean.torque - self._friction * mean.before)
        pull = reach * self.inputs.radius
        if mean.complete and n is self.interval.one:
            lost = np.zeros(self.batch_shape, dtype=np.bool_)
            found = self._filtered(1.0, walk, signals.speed, pull, free, self.measurement_variance)
            change = 0.5 * (mean.force - self.before)
            self.before = mean.force
        else:
            lost = ~(mean.used | mean.waiting)
            fade = np.where(lost, self.inputs.fade, 1.0)
            process = np.where(lost, (1.0 - self.inputs.fade**2) * self._prior, walk)
            within = walk * pull**2 * (n - 1.0) * (2.0 * n - 1.0) / (6.0 * n)
            speed = np.where(mean.used, signals.speed, np.nan)
            found = self._filtered(fade, process, speed, pull, free, self.measurement_variance + within)
            change = np.where(found.used, 0.5 * (mean.force - self.before), 0.0)
            self.before = np.where(found.used, mean.force, found.state)
        deviation: FloatArray = np.sqrt(found.variance + change * change)
        return WheelForceStep(
            found.state, deviation, found.innovation, found.used, signals.stopped.copy(), lost, signals.flags
        )

    def _restart(self, chosen: BoolArray) -> None:
        self.filter.reset(chosen)
        self.before = np.where(chosen, 0.0, self.before)

    def _filtered(
        self,
        fade: FloatArray | float,
        process: FloatArray | float,
        speed: FloatArray,
        pull: FloatArray,
        free: FloatArray,
        noise: FloatArray | float,
    ) -> ScalarStep:
        """f = fade f + rho, then speed = free - pull f + nu."""
        if isinstance(self.filter, ScalarKalmanFilter):
            self.filter.predict(fade, process)
            return self.filter.correct(speed, -pull, noise, free)
        kept, drag, offset = (np.asarray(value)[..., None] for value in (fade, pull, free))
        Q, R = (np.asarray(value)[..., None, None] for value in (process, noise))
        self.filter.predict(lambda f: kept * f, Q)
        found = self.filter.correct(speed[..., None], lambda f: offset - drag * f, R)
        return ScalarStep(
            found.state[..., 0], found.covariance[..., 0, 0], found.innovation[..., 0], found.used[..., 0]
        )

    @staticmethod
    def steady_gain(process_variance: float, noise_variance: float) -> float:
        """Gain k of the scalar filter in its steady state, from force measured with `noise_variance` (N^2).

        p = k r and p = (1 - k)(p + q) give k^2 r = (1 - k) q, with the forces' own variances q and r.
        """
        ratio = process_variance / noise_variance
        return 0.5 * (math.sqrt(ratio * ratio + 4.0 * ratio) - ratio)
