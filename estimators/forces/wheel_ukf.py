"""Longitudinal force as a parameter that an unscented Kalman filter finds in the wheel dynamics."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from estimators.filters import UnscentedKalmanFilter
from estimators.forces.interval import SpeedInterval
from estimators.forces.wheel import WheelForceStep, WheelInputs
from estimators.interpolate import FloatArray
from estimators.signals.checks import setting
from estimators.signals.memory import Memory
from estimators.vehicle import VehicleParameters


class WheelForceFilter(Memory):
    """f_k+1 = f_k + rho_k, z_k = w_k = w_j + n Ts/I_w (T - R_e f - C_b w_j) + nu_k: P2 (10)-(12), per corner.

    w_j is the last new wheel speed, n samples ago, T the mean torque since then; with n = 1 this is P2 with its function
    G written out. It is linear in f, so the filter equals a scalar Kalman filter with H = -R_e n Ts/I_w.

    The random walk has the intensity `force_rate`, so that its variance grows with time, not with the number of samples;
    the two speeds of an interval give the measurement the variance 2 `speed_deviation`^2 (P2 leaves both open), and the
    walk of the force within an interval of several samples, of which w shows the mean alone, the variance q (n-1)(2n-1)/(6n).

    While a force cannot be known (wheel stopped, torque or speed missing) it fades to zero, with a variance that
    returns to the square of the load (friction about 1): covariances do not run away. The reported deviation adds to the
    filter's own half of what the measured force changed since the last sample: m is a mean over the interval.

    Args:
        vehicle: radii, wheel inertia, rolling resistance.
        sample_time: Ts, s.
        batch_shape: ends with the four corners.
        force_rate: N/sqrt(s); 4000 lets the force move by 280 N in a sample of 5 ms.
        speed_deviation: rad/s, of the wheel speed sensor.
        bearing_friction: C_b, N m s/rad.
        stopped_below, fade_time: as `WheelInputs`.

    Raises:
        EstimatorError: a shape without corners, a setting that is not positive.
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
        bearing_friction: float = 0.0,
        stopped_below: float = 1.0,
        fade_time: float = 0.2,
    ) -> None:
        self.inputs = WheelInputs(vehicle, sample_time, batch_shape, stopped_below, fade_time)
        self.batch_shape = self.inputs.batch_shape
        self.interval = SpeedInterval(self.batch_shape, sample_time, self.inputs.radius, self.inputs.inertia)
        self.process_variance = setting(force_rate, "force_rate", "N/sqrt(s)") ** 2 * self.inputs.sample_time
        self.measurement_variance = 2.0 * setting(speed_deviation, "speed_deviation", "rad/s") ** 2
        self._friction = setting(bearing_friction, "bearing_friction", "N m s/rad", low_allowed=True)
        self._prior = np.broadcast_to(vehicle.static_loads**2, self.batch_shape)[..., None, None]
        self.before: FloatArray = np.zeros(self.batch_shape)
        self.filter = UnscentedKalmanFilter(np.zeros((*self.batch_shape, 1)), self._prior)

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        torque: npt.ArrayLike,
        vertical_load: npt.ArrayLike | None = None,
        fresh: npt.ArrayLike | None = None,
    ) -> WheelForceStep:
        """Takes one sample of the batch shape: rad/s, N m (what acted since the last sample), N.

        `fresh` marks new wheel speeds; None: all. The innovation is w - what, rad/s.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        signals = self.inputs(wheel_speed, torque, vertical_load)
        mean = self.interval(signals, fresh)
        lost = ~(mean.used | mean.waiting)
        fade = np.where(lost, self.inputs.fade, 1.0)[..., None]
        noise = np.where(lost, (1.0 - self.inputs.fade**2) * self._prior[..., 0, 0], self.process_variance)
        self.filter.predict(lambda f: fade * f, noise[..., None, None])
        reach = mean.samples * self.inputs.sample_time / self.inputs.inertia
        free = mean.before + reach * (mean.torque - self._friction * mean.before)
        pull = reach * self.inputs.radius
        y = np.where(mean.used, signals.speed, np.nan)[..., None]
        n = mean.samples
        within = self.process_variance * pull**2 * (n - 1.0) * (2.0 * n - 1.0) / (6.0 * n)
        noise = (self.measurement_variance + within)[..., None, None]
        found = self.filter.correct(y, lambda f: free[..., None] - pull[..., None] * f, noise)
        used = found.used[..., 0]
        change = np.where(used, 0.5 * np.absolute(mean.force - self.before), 0.0)
        deviation: FloatArray = np.sqrt(found.covariance[..., 0, 0] + change**2)
        self.before = np.where(used, mean.force, found.state[..., 0])
        return WheelForceStep(
            found.state[..., 0], deviation, found.innovation[..., 0], used, signals.stopped, lost, signals.flags
        )

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh; flagged RESET at the next step."""
        chosen = self.inputs.forget(where)
        self.interval.forget(chosen)
        self.filter.reset(chosen)
        self.before = np.where(chosen, 0.0, self.before)

    @staticmethod
    def steady_gain(process_variance: float, noise_variance: float) -> float:
        """Gain k of the scalar filter in its steady state, from force measured with `noise_variance` (N^2).

        p = k r and p = (1 - k)(p + q) give k^2 r = (1 - k) q, with the forces' own variances q and r.
        """
        ratio = process_variance / noise_variance
        return 0.5 * (math.sqrt(ratio * ratio + 4.0 * ratio) - ratio)
