"""Longitudinal force by an unknown-input observer: a virtual wheel that must be pushed to turn like the real one."""

from __future__ import annotations

import math

import numpy as np

from estimators.arguments import setting
from estimators.arrays import BoolArray, FloatArray
from estimators.forces.interval import IntervalObserver, MeanForce
from estimators.forces.wheel import WheelForceStep, WheelSignals
from estimators.vehicle import VehicleParameters


class UnknownInputForceObserver(IntervalObserver):
    """I_w dwhat/dt = T - R_e f_0 - C_b w + K_p (w - what),  F_x = f_0 - K_p (w - what)/R_e: P2 (1)-(3).

    Equal to a first-order lag of the force, F_x = f_0 + K/(s + K) (F_x - f_0) with K = K_p/I_w, and without dw/dt. Here
    it is integrated exactly for wheel speeds that are linear between samples and torques that are held:

        F_k = F_j + (1 - e^(-K n Ts)) (m_k - F_j),   m_k = (mean T - C_b (w_k + w_j)/2 - I_w (w_k - w_j)/(n Ts))/R_e,

    with C_b of the vehicle (P2 neglects it) and the last new speed w_j, n samples ago (`SpeedInterval`). The state is F; the
    virtual speed follows from it, w - what = (f_0 - F) R_e/K_p (`speed_error`). Theorem 1: |R_e (F_x - f_0)/I_w| < b bounds
    that error by b/K.

    A force that cannot be known (wheel stopped, torque or speed missing) fades to f_0 and is flagged; what a speed that
    is not new leaves open is decided when the next new one comes. The innovation of a step is m - F, N.

    Args:
        vehicle: radii, wheel inertia, rolling resistance, bearing friction.
        sample_time: Ts, s.
        batch_shape: ends with the four corners.
        lag: 1/K, s. 0 takes the mean force of the last interval as it is.
        nominal_force: f_0, N.
        speed_deviation: rad/s, of the wheel speed sensor; for the reported deviation alone.
        stopped_below, fade_time: as `WheelInputs`.

    Raises:
        EstimatorError: a shape without corners, a setting that is not positive (lag, f_0: not finite).

    >>> import numpy as np
    >>> observer = UnknownInputForceObserver(VehicleParameters.published_suv(), sample_time=0.005)
    >>> step = observer.step(wheel_speed=np.full(4, 60.0), torque=np.full(4, 200.0))
    >>> step.force.shape  # N, one a wheel
    (4,)
    """

    memory = ("force", "before", "deviation")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (4,),
        lag: float = 0.0025,
        nominal_force: float = 0.0,
        speed_deviation: float = 0.05,
        stopped_below: float = 1.0,
        fade_time: float = 0.2,
    ) -> None:
        super().__init__(vehicle, sample_time, batch_shape, stopped_below, fade_time)
        self.lag = setting(lag, "lag", "s", low_allowed=True)
        self.nominal_force = setting(nominal_force, "nominal_force", "N", low=-math.inf)
        self._keep = math.exp(-self.inputs.sample_time / self.lag) if self.lag > 0 else 0.0
        self._noise = self.inputs.sensor_gain * setting(speed_deviation, "speed_deviation", "rad/s", low_allowed=True)
        self.force: FloatArray = np.full(self.batch_shape, self.nominal_force)
        self.before: FloatArray = np.zeros(self.batch_shape)
        self.deviation: FloatArray = np.array(np.broadcast_to(vehicle.static_loads, self.batch_shape))

    @property
    def speed_error(self) -> FloatArray:
        """w - what = (f_0 - F) R_e/K_p, rad/s, as the batch."""
        error: FloatArray = (self.nominal_force - self.force) * self.inputs.radius * self.lag / self.inputs.inertia
        return error

    def _observed(self, signals: WheelSignals, mean: MeanForce) -> WheelForceStep:
        if mean.complete and mean.samples is self.interval.one:
            gap: FloatArray = mean.force - self.force
            self.force = self.force + (1.0 - self._keep) * gap
            self.deviation = np.hypot(self._noise, 0.5 * (mean.force - self.before))
            self.before = mean.force
            none = signals.stopped.copy()
            return WheelForceStep(
                self.force.copy(), self.deviation.copy(), gap, mean.used.copy(), none, none.copy(), signals.flags
            )
        innovation: FloatArray = np.where(mean.used, mean.force - self.force, np.nan)
        gain = 1.0 - self._keep**mean.samples
        held = np.where(mean.waiting, self.force, self._faded())
        self.force = np.where(mean.used, self.force + gain * (mean.force - self.force), held)
        change = np.absolute(mean.force - self.before)
        seen = np.where(mean.used, np.hypot(self._noise / mean.samples, 0.5 * change), signals.load)
        self.deviation = np.where(mean.waiting, self.deviation, seen)
        self.before = np.where(mean.used, mean.force, self.force)
        unknown = ~(mean.used | mean.waiting)
        return WheelForceStep(
            self.force.copy(), self.deviation.copy(), innovation, mean.used, signals.stopped, unknown, signals.flags
        )

    def _restart(self, chosen: BoolArray) -> None:
        self.force = np.where(chosen, self.nominal_force, self.force)
        self.before = np.where(chosen, 0.0, self.before)

    def _faded(self) -> FloatArray:
        return self.nominal_force + self.inputs.fade * (self.force - self.nominal_force)
