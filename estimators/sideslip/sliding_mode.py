"""Sliding-mode observer of axle forces from yaw rate and accelerations, independent of the road."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, broadcast, finite, mask, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.memory import Renewable
from estimators.signals import limits
from estimators.signals.held import Clipped
from estimators.vehicle import SingleTrack

_STEERING_LIMIT = 1.0  # rad
_IMPOSSIBLE = np.array([limits.YAW_RATE, limits.ACCELERATION, limits.ACCELERATION])  # of the measurement


@dataclass(frozen=True)
class SlidingGains:
    """Omega_1 in rad/s^2, the others in N/s; all further gains of P5 (6) are zero by (7)."""

    yaw: float = 10.0  # Omega_1
    split: float = 40_000.0  # Omega_4 = -Omega_7
    front: float = 52_000.0  # Omega_5, as printed; L2/L1 Omega_8 = 52143 by (7): `condition_residual`
    rear: float = 40_000.0  # Omega_8
    longitudinal: float = 50_000.0  # Omega_12

    def __post_init__(self) -> None:
        for field in fields(self):
            setting(getattr(self, field.name), field.name, "rad/s^2" if field.name == "yaw" else "N/s")


class SlidingStep(NamedTuple):
    """Forces after one sample; body axes are those of the car, wheel axes those of the steered front wheels."""

    state: FloatArray  # (..., 4) yaw rate rad/s, F_y1 and F_yw2 and F_x1 N (axles, body axes)
    wheel_forces: FloatArray  # (..., 3) F_xw1, F_yw1 (wheel axes), F_yw2; N, P5 (9)
    innovation: FloatArray  # (..., 3) yaw rate, lateral and longitudinal acceleration; NaN where missing
    switching: FloatArray  # (..., 3) s(innovation) in [-1, 1]; 0 where missing
    used: BoolArray  # (..., 3)
    flags: FlagArray  # (...) sums of `Flag`


class SlidingModeObserver(Renewable):
    """P5 (1)-(7), (9): constant-force model, corrected by s(e) = clip(e / width, -1, 1) of each innovation.

    Euler steps. `widths` are the half-widths of the linear zone of the switching function (not published; rad/s and
    m/s^2). Inside the zone the error follows e+ = M e; with M unstable the observer chatters, so such widths are refused.
    Speed does not enter: standstill is nothing special. A channel that is missing is left out; without the yaw rate its
    estimate is held, as forces alone would drive it away.

    Args:
        vehicle: mass, yaw inertia and levers are used.
        batch_shape: shape of the steering input.
        sample_time: s.
        gains: see `SlidingGains`.
        widths: of yaw rate, lateral and longitudinal acceleration.

    Raises:
        EstimatorError: parameters without meaning; an unstable linear zone.

    >>> observer = SlidingModeObserver(SingleTrack(1400.0, 2400.0, 1.1, 1.6, 80000.0, 90000.0), sample_time=0.001)
    >>> observer.step([0.1, 1.0, 0.0]).state.shape
    (4,)
    """

    memory = ("_state", "renewed")
    parts = ("steering",)

    def __init__(
        self,
        vehicle: SingleTrack,
        batch_shape: tuple[int, ...] = (),
        sample_time: float = 0.01,
        gains: SlidingGains | None = None,
        widths: tuple[float, float, float] = (0.2, 1.0, 1.0),
    ) -> None:
        super().__init__(batch(batch_shape))
        self.vehicle = vehicle
        self.sample_time = setting(sample_time, "sample_time", "s")
        self.gains = gains or SlidingGains()
        units = ("yaw rate width", "rad/s"), ("lateral width", "m/s^2"), ("longitudinal width", "m/s^2")
        if len(widths) != 3:
            raise EstimatorError(f"widths = {widths!r} must be three numbers")
        self.widths = np.array([setting(width, *unit) for width, unit in zip(widths, units, strict=True)])
        self._model, self._outputs, self._injection = _matrices(vehicle, self.gains)
        self.spectral_radius = float(np.absolute(np.linalg.eigvals(self.zone_matrix())).max())
        if not self.spectral_radius < 1:
            raise EstimatorError(
                f"widths {widths} make the linear zone unstable at {sample_time} s (spectral radius "
                f"{self.spectral_radius:.3g}): the observer would chatter; widen them or sample faster"
            )
        self._state = np.zeros((*self.batch_shape, 4))
        self.steering = Clipped("steering", np.zeros(self.batch_shape), -_STEERING_LIMIT, _STEERING_LIMIT)

    @property
    def state(self) -> FloatArray:
        """A copy of the estimate, (..., 4)."""
        return self._state.copy()

    @property
    def condition_residual(self) -> float:
        """L_2 Omega_8 - L_1 Omega_5 in N m/s, zero by (7) and (A.8); +160 with the printed gains (harmless)."""
        return self.vehicle.rear_axle_distance * self.gains.rear - self.vehicle.front_axle_distance * self.gains.front

    @property
    def split_rate(self) -> float:
        """Decay rate in 1/s of the error L_1 x_2 - L_2 x_3 on the sliding surface, Omega_4 (L1+L2) / (Omega_1 I_z), (A.12)."""
        v = self.vehicle
        return self.gains.split * (v.front_axle_distance + v.rear_axle_distance) / (self.gains.yaw * v.yaw_inertia)

    @property
    def moment_limit(self) -> float:
        """|L_1 x_2 - L_2 x_3| in N m below which Omega_1 dominates: Omega_1 I_z, (A.4) with a minus sign."""
        return self.gains.yaw * self.vehicle.yaw_inertia

    def zone_matrix(self) -> FloatArray:
        """M of e+ = M e inside the linear zone, (4, 4), for constant true forces."""
        feedback = (self._injection / self.widths) @ self._outputs
        return np.asarray(np.eye(4) + self.sample_time * (self._model - feedback), dtype=np.float64)

    def step(self, measurement: npt.ArrayLike, steering: npt.ArrayLike = 0.0) -> SlidingStep:
        """Moves by one sample; measurement (..., 3) yaw rate in rad/s, lateral and longitudinal acceleration in m/s^2.

        The steering angle (...) in rad serves the wheel axes (9) alone.

        Raises:
            EstimatorError: shapes that do not fit, not numbers.
        """
        flags: FlagArray = np.zeros(self.batch_shape, dtype=np.int32)
        measured = broadcast(measurement, (*self.batch_shape, 3), "measurement")
        angle = self.steering.within(steering, flags)
        used = np.absolute(measured) <= _IMPOSSIBLE  # False for NaN
        innovation = np.where(used, measured, 0.0) - self._state @ self._outputs.T
        switching = np.where(used, np.clip(innovation / self.widths, -1.0, 1.0), 0.0)
        drift = self._state @ self._model.T
        drift[..., 0] = np.where(used[..., 0], drift[..., 0], 0.0)
        self._state = self._state + self.sample_time * (drift + switching @ self._injection.T)
        raise_flag(flags, np.logical_not(used.all(axis=-1)), Flag.MISSING_MEASUREMENT)
        self._flag_renewed(flags)
        innovation = np.where(used, innovation, np.nan)
        return SlidingStep(self.state, wheel_axes(self._state, angle), innovation, switching, used, flags)

    def reset(self, where: npt.ArrayLike | None = None, state: npt.ArrayLike = 0.0) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to `state`, which broadcasts to (..., 4).

        Raises:
            EstimatorError: another shape, or a state that is not finite.
        """
        chosen = mask(where, self.batch_shape, "where")
        full = finite(state, (*self.batch_shape, 4), "state")
        self._state = np.where(chosen[..., None], full, self._state)
        self.steering.forget(chosen)
        self._renew(chosen)


def wheel_axes(state: FloatArray, steering: FloatArray) -> FloatArray:
    """F_xw1, F_yw1, F_yw2 (..., 3) from the observer's state (..., 4) and the steering angle (...): P5 (9)."""
    sine, cosine = np.sin(steering), np.cos(steering)
    lateral, rear, longitudinal = state[..., 1], state[..., 2], state[..., 3]
    return np.stack((longitudinal * cosine + lateral * sine, lateral * cosine - longitudinal * sine, rear), axis=-1)


def _matrices(vehicle: SingleTrack, gains: SlidingGains) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Model (4, 4), outputs (3, 4) and injection (4, 3) of P5 (1)-(6)."""
    model, outputs, injection = np.zeros((4, 4)), np.zeros((3, 4)), np.zeros((4, 3))
    model[0, 1:3] = vehicle.front_axle_distance / vehicle.yaw_inertia, -vehicle.rear_axle_distance / vehicle.yaw_inertia
    outputs[0, 0] = 1.0
    outputs[1, 1:3] = outputs[2, 3] = 1.0 / vehicle.mass
    injection[:3, 0] = gains.yaw, gains.split, -gains.split
    injection[1:3, 1] = gains.front, gains.rear
    injection[3, 2] = gains.longitudinal
    return model, outputs, injection
