"""Velocities from the inertial unit alone, with its biases: the kinematic model of P2 (15) as a Kalman filter.

    u_x' = a_x + r u_y + a_xb,   u_y' = a_y - r u_x + a_yb,   a_xb, a_yb first-order Gauss-Markov processes

Measured: u_x, u_y or both, whichever a sample has (wheel speeds, corner observers, GNSS). While r = 0 nothing links
u_y to u_x: u_y is then known only as far as it is measured, and its covariance says so, up to a bound.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import any_missing, batch, entries, mask, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.faults import Flag, raise_flag
from estimators.filters import KalmanFilter
from estimators.filters.step import broadcast
from estimators.memory import Renewable

_LARGEST_SPREAD = 30.0  # m/s of standard deviation: more is no knowledge of a car's velocity


class KinematicStep(NamedTuple):
    """What one step returns, ready for a log; leading axes are those of the batch."""

    velocity: FloatArray  # (..., 2) u_x, u_y, m/s
    bias: FloatArray  # (..., 2) a_xb, a_yb, m/s^2: what must be added to the measured accelerations
    covariance: FloatArray  # (..., 4, 4)
    innovation: FloatArray  # (..., 2) NaN where there was no measurement
    used: BoolArray  # (..., 2)
    flags: FlagArray  # (...)


class KinematicKalman(Renewable):
    """State [u_x, u_y, a_xb, a_yb].

    Args:
        sample_time: s.
        batch_shape: shape of accelerations and yaw rate.
        acceleration_noise: m/s^2, standard deviation of a sample.
        bias: m/s^2, standard deviation of the biases, which they never exceed.
        bias_memory: s, their correlation time.
        missing: m/s^2, how far a held acceleration may be off.

    Raises:
        EstimatorError: a value that is not above zero.

    >>> observer = KinematicKalman(sample_time=0.01)
    >>> step = observer.step(ax=0.0, ay=0.0, yaw_rate=0.0, velocity=[20.0, 0.0])
    >>> step.velocity.shape
    (2,)
    """

    memory = ("seen", "renewed")
    parts = ("filter",)

    def __init__(
        self,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        acceleration_noise: float = 0.1,
        bias: float = 0.15,
        bias_memory: float = 3600.0,
        missing: float = 2.0,
    ) -> None:
        super().__init__(batch(batch_shape))
        self.sample_time = setting(sample_time, "sample_time", "s")
        self._quiet = setting(acceleration_noise, "acceleration_noise", "m/s^2")
        self._loud = setting(missing, "missing", "m/s^2")
        self._bias = setting(bias, "bias", "m/s^2")
        self._kept = float(np.exp(-self.sample_time / setting(bias_memory, "bias_memory", "s")))
        self._initial = np.diag([1.0, 1.0, self._bias**2, self._bias**2])
        self.filter = KalmanFilter(np.zeros((*self.batch_shape, 4)), self._initial)
        self.seen: FloatArray = np.zeros((3, *self.batch_shape))  # last finite a_x, a_y, r

    def step(
        self,
        ax: npt.ArrayLike,
        ay: npt.ArrayLike,
        yaw_rate: npt.ArrayLike,
        velocity: npt.ArrayLike = np.nan,
        deviation: npt.ArrayLike = 0.1,
    ) -> KinematicStep:
        """`ax`, `ay` m/s^2, `yaw_rate` rad/s, each (...), held over the sample that ends now.

        `velocity` (..., 2): measured u_x, u_y at its end, NaN where there is none; `deviation` (..., 2) of them, m/s.

        Raises:
            EstimatorError: another shape.
        """
        shape, two = self.batch_shape, (*self.batch_shape, 2)
        given = np.stack([entries(v, shape, n) for v, n in ((ax, "ax"), (ay, "ay"), (yaw_rate, "yaw_rate"))])
        measured, spread = entries(velocity, two, "velocity"), entries(deviation, two, "deviation")
        good: BoolArray = np.absolute(given) < 1e3
        flags: FlagArray = np.zeros(shape, dtype=np.int32)
        missing = any_missing(~np.moveaxis(good, 0, -1), shape)
        raise_flag(flags, missing, Flag.MISSING_INPUT)
        self.seen = np.where(good, given, self.seen)
        A, B, Q = self._model(self.seen[2], missing)
        self.filter.predict(A, Q, B, np.moveaxis(self.seen[:2], 0, -1))
        lost = ~(np.einsum("...ii->...i", self.filter.covariance)[..., :2] < _LARGEST_SPREAD**2).all(axis=-1)
        if lost.any():
            self.filter.reset(lost, state=self.filter.state, covariance=self._widest())
        usable = np.isfinite(measured) & (spread > 0)
        R = np.where(usable, np.square(np.where(usable, spread, 1.0)), 1.0)[..., None] * np.eye(2)
        step = self.filter.correct(np.where(usable, measured, np.nan), np.eye(2, 4), R)
        raise_flag(flags, ~any_missing(usable, shape), Flag.MISSING_MEASUREMENT)
        self._flag_renewed(flags)
        x = step.state
        return KinematicStep(x[..., :2], x[..., 2:], step.covariance, step.innovation, step.used, flags)

    def reset(self, where: npt.ArrayLike | None = None, velocity: npt.ArrayLike = 0.0) -> None:
        """Starts the entries `where` (mask of the batch shape; None: all) at `velocity` (..., 2), m/s, with unknown biases.

        Raises:
            EstimatorError: another shape, or a velocity that is not finite.
        """
        chosen = mask(where, self.batch_shape, "where")
        first = np.where(chosen[..., None], broadcast(velocity, (*self.batch_shape, 2), "velocity"), 0.0)
        self.filter.reset(chosen, state=np.concatenate((first, np.zeros_like(first)), axis=-1))
        self.seen[:, chosen] = 0.0
        self._renew(chosen)

    def _model(self, turn: FloatArray, missing: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Exact for held inputs: the velocity turns by -r T while it is driven; S = int_0^T of that rotation."""
        T = self.sample_time
        angle = turn * T
        sine, cosine = np.sin(angle), np.cos(angle)
        along = T * np.sinc(angle / np.pi)
        across = T * np.sin(0.5 * angle) * np.sinc(0.5 * angle / np.pi)  # (1 - cos(r T))/r
        A, B, Q = np.zeros((*turn.shape, 4, 4)), np.zeros((*turn.shape, 4, 2)), np.zeros((*turn.shape, 4, 4))
        A[..., 0, 0] = A[..., 1, 1] = cosine
        A[..., 0, 1], A[..., 1, 0] = sine, -sine
        B[..., 0, 0] = B[..., 1, 1] = along
        B[..., 0, 1], B[..., 1, 0] = across, -across
        A[..., :2, 2:] = B[..., :2, :]
        A[..., 2, 2] = A[..., 3, 3] = self._kept
        noise = (T * np.where(missing, self._loud, self._quiet)) ** 2
        Q[..., 0, 0] = Q[..., 1, 1] = noise
        Q[..., 2, 2] = Q[..., 3, 3] = self._bias**2 * (1.0 - self._kept**2)
        return A, B, Q

    def _widest(self) -> FloatArray:
        """Covariance of an entry that has lost its velocity: unknown within the bound, biases as before a drive."""
        return np.diag([0.25 * _LARGEST_SPREAD**2, 0.25 * _LARGEST_SPREAD**2, self._bias**2, self._bias**2])
