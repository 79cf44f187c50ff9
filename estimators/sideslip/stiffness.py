"""Sideslip observers on axle forces: with adaptive cornering stiffness by zones, and with fixed stiffness."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, broadcast, mask, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.filters import ExtendedKalmanFilter, FilterStep
from estimators.memory import Renewable
from estimators.sideslip.cornering_model import CorneringModel
from estimators.signals import limits
from estimators.signals.held import Clipped
from estimators.vehicle import SingleTrack

GOOD_NOISE = (0.1, 0.1, 0.1)  # zones 5, 6: N^2, N^2, (m/s^2)^2, per sample; P5 notes 5
POOR_NOISE = (1e6, 1e6, 1e6)  # zones 1 to 4
SIDESLIP_NOISE = 1e-13  # rad^2 per sample
STIFFNESS_NOISE = 0.24  # (N/rad)^2 per sample, zones 5, 6 alone
PUBLISHED_TIME = 0.01  # s between the samples of the paper
_MOST = np.array([limits.FORCE, limits.FORCE, limits.ACCELERATION])  # of the measurement
_LIMITS = ((-1.0, 1.0), (-10.0, 10.0), (0.0, 200.0), (-1e5, 1e5))  # rad, rad/s, m/s, N


class StiffnessStep(NamedTuple):
    """What one sample returns; `...` are the batch axes."""

    sideslip: FloatArray  # (...) rad at the centre of gravity
    rear_sideslip: FloatArray  # (...) rad, beta_2 of (11)
    stiffness: FloatArray  # (..., 2) N/rad of front and rear axle
    excited: BoolArray  # (..., 2) axle in zone 5 or 6
    flags: FlagArray  # (...) sums of `Flag`
    at_rest: BoolArray  # (...) standstill or reverse: sideslip fades to zero, stiffness is frozen
    filter: FilterStep


class AdaptiveStiffnessObserver(Renewable):
    """Extended Kalman filter on P5 (10)-(17): sideslip and the corrections of two axle stiffnesses.

    Zones in the (slip angle, force) plane of each axle: 1, 2 where beta_i F_yi < 0; 3, 4 where |F_yi| < `threshold`;
    5, 6 the rest. In zones 1 to 4 the stiffness is frozen by large measurement noise and no process noise. The paper
    has one pair of matrices for both axles; here, declared, each axle switches for itself (`switching="axle"`), with
    the acceleration channel poor as soon as one axle is; "both" makes both poor as soon as one is. An axle whose force
    is missing gets no process noise either, so covariances stay bounded. Input noise (F_u Q_e F_u') is not published
    and left out.

    Stiffnesses are kept between 0.05 and 2 times the given ones. Below `standstill_speed`, where (16) is singular, the
    entry is at rest: sideslip fades to zero with 0.1 s and measurements are not used.

    With `noise_time` the covariances hold for samples at that distance, and keep their density in continuous time at any
    other: process noise times Ts/noise_time, measurement noise times noise_time/Ts. Then the estimate's variance does not
    depend on how often the same sensors are read.

    Args:
        vehicle: parameters; the stiffnesses are the starting ones.
        batch_shape: shape of each input.
        sample_time: s; the published covariances are per 0.01 s step.
        threshold: lambda_i in N of front and rear axle (not published).
        switching: "axle" or "both".
        initial_covariance: variances rad^2, (N/rad)^2, (N/rad)^2 (not published).
        standstill_speed: m/s.
        gate: probability with which a good channel passes, or None.
        noise_time: s, `PUBLISHED_TIME` for the paper's; None: the covariances are per sample, whatever the sample time.

    Raises:
        EstimatorError: an option that means nothing; a standstill speed at which Euler steps are unstable.

    >>> car = SingleTrack(1400.0, 2400.0, 1.1, 1.6, 80000.0, 90000.0)
    >>> observer = AdaptiveStiffnessObserver(car)
    >>> step = observer.step(steering=0.0, yaw_rate=0.0, speed=20.0, drive_force=0.0, measurement=[0.0, 0.0, 0.0])
    >>> float(step.sideslip)  # rad, straight ahead
    0.0
    """

    parts = ("filter", "inputs")
    _states = 3

    def __init__(
        self,
        vehicle: SingleTrack,
        batch_shape: tuple[int, ...] = (),
        sample_time: float = 0.01,
        threshold: tuple[float, float] = (1000.0, 1000.0),
        switching: Literal["axle", "both"] = "axle",
        initial_covariance: tuple[float, float, float] = (1e-2, 1e6, 1e6),
        standstill_speed: float = 3.0,
        gate: float | None = None,
        noise_time: float | None = None,
    ) -> None:
        if switching not in ("axle", "both"):
            raise EstimatorError(f"switching = {switching!r} is not known; use 'axle' or 'both'")
        super().__init__(batch(batch_shape))
        self.vehicle, self.switching, self.gate = vehicle, switching, gate
        self.sample_time = setting(sample_time, "sample_time", "s")
        self.standstill_speed = setting(standstill_speed, "standstill_speed", "m/s")
        self._share = 1.0 if noise_time is None else self.sample_time / setting(noise_time, "noise_time", "s")
        rate = 2 * (vehicle.front_stiffness + vehicle.rear_stiffness) / (vehicle.mass * self.standstill_speed)
        if rate * self.sample_time > 1.5:
            raise EstimatorError(
                f"standstill_speed = {standstill_speed} m/s is too low for Euler steps of {sample_time} s; use at least "
                f"{rate * self.sample_time / 1.5 * self.standstill_speed:.3g} m/s"
            )
        self.threshold = np.array([setting(value, "threshold", "N") for value in threshold])
        spread = [setting(value, "initial_covariance", "") for value in initial_covariance[: self._states]]
        self.filter = ExtendedKalmanFilter(np.zeros((*self.batch_shape, self._states)), np.diag(spread))
        names = ("steering", "yaw_rate", "speed", "drive_force")
        self.inputs = [
            Clipped(name, np.zeros(self.batch_shape), *limits) for name, limits in zip(names, _LIMITS, strict=True)
        ]

    @property
    def state(self) -> FloatArray:
        """A copy of the estimate, (..., 3): rad, N/rad, N/rad."""
        return self.filter.state

    @property
    def covariance(self) -> FloatArray:
        """A copy of the covariance, (..., 3, 3)."""
        return self.filter.covariance

    def step(
        self,
        steering: npt.ArrayLike,
        yaw_rate: npt.ArrayLike,
        speed: npt.ArrayLike,
        drive_force: npt.ArrayLike,
        measurement: npt.ArrayLike,
    ) -> StiffnessStep:
        """Predicts with the inputs (...) of the previous sample, corrects with those and the measurement of this one.

        Measurement (..., 3): F_yw1 and F_yw2 in N, for instance of `SlidingModeObserver`, and the lateral acceleration in
        m/s^2. Inputs in rad, rad/s, m/s and N (F_xw1).

        Raises:
            EstimatorError: shapes that do not fit, not numbers.
        """
        flags: FlagArray = np.zeros(self.batch_shape, dtype=np.int32)
        before = self._model([held.last for held in self.inputs])
        given = (steering, yaw_rate, speed, drive_force)
        measured = broadcast(measurement, (*self.batch_shape, 3), "measurement")
        shaped = [broadcast(value, self.batch_shape, held.what) for held, value in zip(self.inputs, given, strict=True)]
        model = self._model([held.within(value, flags) for held, value in zip(self.inputs, shaped, strict=True)])
        present = np.absolute(measured) <= _MOST  # False for NaN
        excited = self._excited(model, measured, present)
        process = self._share * self._process(excited)
        self.filter.predict(before.transition, before.transition_jacobian, process)
        usable = np.where(present & ~model.at_rest[..., None], measured, np.nan)
        variances = np.where(self._good(excited), GOOD_NOISE, POOR_NOISE) / self._share
        noise = variances[..., None] * np.eye(3)
        step = self.filter.correct(usable, model.measurement, model.measurement_jacobian, noise, self.gate)
        step = self._limited(step)
        raise_flag(flags, np.logical_not(present.all(axis=-1)), Flag.MISSING_MEASUREMENT)
        self._flag_renewed(flags)
        beta = step.state[..., 0]
        stiffness = np.stack(model.stiffness(step.state), axis=-1)
        return StiffnessStep(beta, model.slip_angles(beta)[1], stiffness, excited, flags, model.at_rest, step)

    def reset(self, where: npt.ArrayLike | None = None, state: npt.ArrayLike = 0.0) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to `state`, with the initial covariance.

        Raises:
            EstimatorError: another shape, or a state that is not finite.
        """
        chosen = mask(where, self.batch_shape, "where")
        self.filter.reset(chosen, state=broadcast(state, (*self.batch_shape, self._states), "state"))
        for held in self.inputs:
            held.forget(chosen)
        self._renew(chosen)

    def _model(self, inputs: list[FloatArray]) -> CorneringModel:
        steering, yaw_rate, speed, drive = inputs
        at_rest = np.asarray(speed < self.standstill_speed)
        floor = np.maximum(speed, self.standstill_speed)
        return CorneringModel(self.vehicle, self.sample_time, steering, yaw_rate, floor, drive, at_rest)

    def _excited(self, model: CorneringModel, measured: FloatArray, present: BoolArray) -> BoolArray:
        """Axles in zone 5 or 6, (..., 2); the slip angles are those of the estimate before the step."""
        slip = np.stack(model.slip_angles(self.filter.state[..., 0]), axis=-1)
        force = np.where(present[..., :2], measured[..., :2], 0.0)
        large = (slip * force > 0) & (np.absolute(force) >= self.threshold)
        return np.asarray(large & ~model.at_rest[..., None])

    def _good(self, excited: BoolArray) -> BoolArray:
        """Channels (..., 3) with small measurement noise."""
        both = excited.all(axis=-1, keepdims=True)
        axles = excited if self.switching == "axle" else np.broadcast_to(both, excited.shape)
        return np.concatenate((axles, both), axis=-1)

    def _process(self, excited: BoolArray) -> FloatArray:
        axles = self._good(excited)[..., :2]
        variances = np.concatenate((np.full((*self.batch_shape, 1), SIDESLIP_NOISE), STIFFNESS_NOISE * axles), axis=-1)
        return np.asarray(variances[..., None] * np.eye(3))

    def _limited(self, step: FilterStep) -> FilterStep:
        """Keeps sideslip and stiffnesses physical."""
        nominal = np.array([self.vehicle.front_stiffness, self.vehicle.rear_stiffness])[: self._states - 1]
        clipped = step.state.copy()
        clipped[..., 0] = np.clip(clipped[..., 0], -limits.ANGLE, limits.ANGLE)
        clipped[..., 1:] = np.clip(clipped[..., 1:], -0.95 * nominal, nominal)
        if np.array_equal(clipped, step.state):
            return step
        changed = (clipped != step.state).any(axis=-1)
        self.filter.reset(np.asarray(changed), state=clipped, covariance=step.covariance)
        return step._replace(state=clipped)


class FixedStiffnessObserver(AdaptiveStiffnessObserver):
    """The same observer with a fixed linear tire, F = C beta: ORL of P5 (12), for comparison.

    Its only state is the sideslip, its measurement noise that of zones 5 and 6 everywhere; `excited` is reported and
    not used. Right stiffnesses give good estimates, wrong ones do not: too small ones overestimate the sideslip, too
    large ones underestimate it (the paper says overestimate twice).

    >>> car = SingleTrack(1400.0, 2400.0, 1.1, 1.6, 80000.0, 90000.0)
    >>> observer = FixedStiffnessObserver(car)
    >>> step = observer.step(steering=0.0, yaw_rate=0.0, speed=20.0, drive_force=0.0, measurement=[0.0, 0.0, 0.0])
    >>> float(step.sideslip)  # rad, straight ahead
    0.0
    """

    _states = 1

    def _good(self, excited: BoolArray) -> BoolArray:
        return np.ones((*excited.shape[:-1], 3), dtype=np.bool_)

    def _process(self, excited: BoolArray) -> FloatArray:
        return np.array([[SIDESLIP_NOISE]])
