"""Longitudinal force by the PID-type state observer of the corner estimation paper."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.arguments import entries, mask, setting
from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.forces.wheel import WheelForceStep, WheelInputs, WheelSignals
from estimators.memory import Memory
from estimators.phi import phi_of
from estimators.signals.held import Held
from estimators.vehicle import VehicleParameters

PUBLISHED_GAINS = (1.8, 11.4, 50.6)
"""eta_1 N s, eta_2 N m, eta_3 1/s of P1 notes 1."""


class PidForceObserver(Memory):
    """F = m - eta_1 e_w + eta_3 int e_F dt,  m = (T - I_w dw/dt)/R_e,  e_w = w - what: P1 (2)-(8).

    dwhat/dt = dw/dt + (R_e eta_1 e_w + eta_2 int e_w dt)/I_w, (5), is integrated exactly over the sample. Started at
    the measured speed, e_w stays near zero: it holds what dw/dt lost against w (the lag of its filter, say).

    int e_F dt follows the note of the paper: m of this sample minus F of the last one. Then F/m = ((1 + a) - 1/z)/(1 - (1
    - a)/z), a = eta_3 Ts: it leads a ramp by one sample, and amplifies noise by (2 + a)/(2 - a); dw/dt has to come
    filtered (`estimators.signals.FilteredDerivative`). With m for the unknown F_x, F ends at m, and so does not see an
    error of the equation itself, Omega_f. Proposition 1, |e_F| <= sup |dOmega_f/dt|/eta_3, holds for a measured force:
    `reference_force` (a wheel force transducer, or an estimate of another kind) takes the place of m under the integral.

    A force that cannot be known (wheel stopped, torque or acceleration missing) fades to zero and is flagged; behind
    that, the observer starts afresh. A missing or repeated wheel speed leaves e_w out.

    Args:
        vehicle: radii, wheel inertia, rolling resistance.
        sample_time: Ts, s.
        batch_shape: ends with the four corners.
        gains: eta_1 N s, eta_2 N m, eta_3 1/s.
        speed_deviation: rad/s, of the wheel speed sensor; for the reported deviation alone.
        stopped_below, fade_time: as `WheelInputs`.

    Raises:
        EstimatorError: a shape without corners, gains that are not positive, eta_3 Ts of 2 or more (unstable).

    >>> import numpy as np
    >>> observer = PidForceObserver(VehicleParameters.published_suv(), sample_time=0.005)
    >>> step = observer.step(wheel_speed=np.full(4, 60.0), wheel_acceleration=np.zeros(4), torque=np.full(4, 200.0))
    >>> step.force.shape  # N, one a wheel
    (4,)
    """

    memory = ("force", "integral", "speed", "speed_integral", "before", "starts", "flowing")
    parts = ("inputs", "acceleration")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (4,),
        gains: tuple[float, float, float] = PUBLISHED_GAINS,
        speed_deviation: float = 0.05,
        stopped_below: float = 1.0,
        fade_time: float = 0.2,
    ) -> None:
        self.inputs = WheelInputs(vehicle, sample_time, batch_shape, stopped_below, fade_time)
        self.batch_shape = self.inputs.batch_shape
        units = ("N s", "N m", "1/s")
        self.gains = tuple(
            setting(gain, f"eta_{i + 1}", unit) for i, (gain, unit) in enumerate(zip(gains, units, strict=True))
        )
        if self.gains[2] * sample_time >= 2.0:
            raise EstimatorError(
                f"eta_3 = {self.gains[2]:g} 1/s times sample_time = {sample_time:g} s is not below 2: the force would "
                f"oscillate without end; take eta_3 below {2.0 / sample_time:g} 1/s"
            )
        self._noise = self.inputs.sensor_gain * setting(speed_deviation, "speed_deviation", "rad/s", low_allowed=True)
        self._move = np.stack([_transition(self.gains, r, self.inputs.inertia, sample_time) for r in vehicle.radii])
        self.acceleration = Held(self.batch_shape, "wheel_acceleration")
        zeros = np.zeros(self.batch_shape)
        self.force, self.integral, self.speed = zeros.copy(), zeros.copy(), zeros.copy()
        self.speed_integral, self.before = zeros.copy(), zeros.copy()
        self.starts = np.ones(self.batch_shape, dtype=np.bool_)
        self.flowing = False  # every corner was used in the last sample

    def step(
        self,
        wheel_speed: npt.ArrayLike,
        wheel_acceleration: npt.ArrayLike,
        torque: npt.ArrayLike,
        vertical_load: npt.ArrayLike | None = None,
        reference_force: npt.ArrayLike | None = None,
        fresh: npt.ArrayLike | None = None,
    ) -> WheelForceStep:
        """Takes one sample of the batch shape: rad/s, rad/s^2, N m, N, N; the innovation is m minus the last F, N.

        `fresh` marks new wheel speeds; None: all. A `reference_force` that is not finite is left out for its entry.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        signals = self.inputs(wheel_speed, torque, vertical_load)
        rate, no_rate = self.acceleration(wheel_acceleration)
        if self.flowing and signals.calm and no_rate is None and reference_force is None and fresh is None:
            return self._calm(signals, rate)
        used = ~signals.broken
        if no_rate is not None:
            raise_flag(signals.flags, no_rate, Flag.MISSING_INPUT)
            used = used & ~no_rate
        seen = ~signals.no_speed
        if fresh is not None:
            seen = seen & mask(fresh, self.batch_shape, "fresh")
        time, (eta1, _, eta3) = self.inputs.sample_time, self.gains
        m = self._measured(signals, rate)
        again = self.starts | ~used
        error = np.where(seen & ~again, signals.speed - self.speed - time * rate, 0.0)
        last = np.where(again, m, self.force)
        kept = np.where(again, 0.0, self.integral)
        integral = kept + time * (m - last)
        force = m - eta1 * error + eta3 * integral
        if reference_force is not None:
            given = entries(reference_force, self.batch_shape, "reference_force")
            a = eta3 * time
            measured = (m - eta1 * error + eta3 * kept + a * given) / (1.0 + a)
            force = np.where(np.isfinite(given), measured, force)
            integral = np.where(np.isfinite(given), kept + time * (given - force), integral)
        self._move_speed(signals.speed, rate, error, again)
        innovation: FloatArray = np.where(used, m - self.force, np.nan)
        self.integral = integral
        self.force = np.where(used, force, self.inputs.fade * self.force)
        change = np.where(again, 0.0, 0.5 * np.absolute(m - self.before))
        deviation: FloatArray = np.where(used, np.hypot(self._noise, change), signals.load)
        self.before, self.starts = m, ~used
        self.flowing = bool(used.all())
        return WheelForceStep(self.force.copy(), deviation, innovation, used, signals.stopped, ~used, signals.flags)

    def _calm(self, signals: WheelSignals, rate: FloatArray) -> WheelForceStep:
        """The step where everything is there: the same equations, without the choices."""
        # twice as fast for one car
        time, (eta1, _, eta3) = self.inputs.sample_time, self.gains
        m = self._measured(signals, rate)
        virtual = self.speed + time * rate
        error = signals.speed - virtual
        innovation = m - self.force
        self.integral = self.integral + time * innovation
        self.force = m - eta1 * error + eta3 * self.integral
        move, total = self._move, self.speed_integral
        self.speed_integral = move[:, 0, 0] * total + move[:, 0, 1] * error
        self.speed = signals.speed - move[:, 1, 0] * total - move[:, 1, 1] * error
        deviation: FloatArray = np.hypot(self._noise, 0.5 * (m - self.before))
        self.before = m
        used, none = np.ones(self.batch_shape, dtype=np.bool_), signals.stopped.copy()
        return WheelForceStep(self.force.copy(), deviation, innovation, used, none, none.copy(), signals.flags)

    def _measured(self, signals: WheelSignals, rate: FloatArray) -> FloatArray:
        """The force of the wheel equation, N."""
        torque = signals.torque - self.inputs.friction * signals.speed if self.inputs.friction else signals.torque
        force: FloatArray = (torque - self.inputs.inertia * rate) / self.inputs.radius
        return force

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh; flagged RESET at the next step."""
        chosen = self.inputs.forget(where)
        self.acceleration.forget(chosen)
        self.force = np.where(chosen, 0.0, self.force)
        self.starts = self.starts | chosen
        self.flowing = False

    def _move_speed(self, speed: FloatArray, rate: FloatArray, error: FloatArray, again: BoolArray) -> None:
        """what at the end of the sample: (5) over one sample, exactly."""
        both = np.stack((np.where(again, 0.0, self.speed_integral), error), axis=-1)
        moved = np.einsum("cij,...cj->...ci", self._move, both)
        self.speed_integral = moved[..., 0]
        virtual = self.speed + self.inputs.sample_time * rate + error - moved[..., 1]
        self.speed = np.where(again, speed, virtual)


def _transition(gains: tuple[float, ...], radius: float, inertia: float, time: float) -> FloatArray:
    """e^(K Ts) of (int e_w, e_w), K of (7), from Cayley-Hamilton: e^M = 1 + M phi(M)."""
    M = time * np.array([[0.0, 1.0], [-gains[1] / inertia, -radius * gains[0] / inertia]])
    moved: FloatArray = np.eye(2) + M @ phi_of(M)
    return moved
