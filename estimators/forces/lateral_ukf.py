"""Lateral axle forces from planar dynamics by an unscented Kalman filter, and its linear twin."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import any_missing, batch, entries, mask, quiet, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.filters import FilterStep, KalmanFilter, UnscentedKalmanFilter
from estimators.filters.step import gate_threshold
from estimators.forces.lateral_few import FEW, KILO, LateralFew
from estimators.forces.planar import PlanarModel, planar_model
from estimators.memory import Renewable
from estimators.signals import limits
from estimators.signals.held import Held
from estimators.vehicle import VehicleParameters

PUBLISHED_PROCESS = 0.13
"""kN a sample of 5 ms: Q = 0.13^2 I of P1 notes 1, read in kN (in N the filter would lag by a second, P1 notes 11)."""
PUBLISHED_MEASUREMENT = (0.012, 0.012, 0.012)
"""m/s^2, m/s^2, rad/s^2: R = 0.012^2 I of P1 notes 1. Real sensors need more, see the class."""
_LARGEST = np.array([limits.ACCELERATION, limits.ACCELERATION, limits.YAW_ACCELERATION])
_EYE = np.eye(3)
_DIAGONAL = np.arange(3)


class LateralForceStep(NamedTuple):
    """What one step returns, ready for a log; leading axes are those of the batch."""

    axle_force: FloatArray  # (..., 2) N, F_yf and F_yr in the tyre frame, positive to the left
    corner_force: FloatArray  # (..., 4) N; front from the model, rear by load
    deviation: FloatArray  # (..., 3) N, standard deviations of F_yf, F_yr and the front difference
    innovation: FloatArray  # (..., 3) m/s^2, m/s^2, rad/s^2; NaN where missing
    used: BoolArray  # (..., 3) whether a_x, a_y, dr/dt corrected the estimate
    flags: FlagArray  # (...) MISSING_MEASUREMENT, MISSING_INPUT (steering, F_x, load), RESET


class LateralForceEstimator(Renewable):
    """x = (F_yf, F_yr, dF_yf), a random walk, seen through y = (a_x, a_y, dr/dt) = C(delta) x + d: P1 (9)-(13).

    With the front wheels straight the front difference does not show in y (rank 2), and would wander without bounds.
    A fourth, weak measurement holds it: 0 = dF_yf - rho F_yf + noise, rho = (F_z,fr - F_z,fl)/(F_z,fr + F_z,fl), the
    split by load, with the standard deviation `split_deviation`. Then the variance of dF_yf - rho F_yf stays below
    r/2 + sqrt(r^2/4 + r s^2), r = q (1 + rho^2), s = split_deviation, whatever the steering, as long as the loads stand
    still; dF_yf has rho times the deviation of F_yf on top. F_yf and F_yr are seen for every angle below 90 degrees.
    Corners: F_yf,R/L = (F_yf +- dF_yf)/2 from the model; the rear ones, which the paper leaves open, share F_yr by load.

    Without a_y or dr/dt nothing tells the two axles apart, and the forces fade to zero with a variance that returns to
    the square of the axle's load: covariances do not run away.

    The noise of the measurement covers the sensors and what the model leaves out (F_x errors in a_x). The published
    one follows every sample, noise included; for an IMU with 0.05 m/s^2 and 0.002 rad/s, `without_gravity` and dr/dt from a
    filter of 20 ms, (0.3, 0.1, 0.3) suits.

    Args:
        vehicle: mass, yaw inertia, lengths.
        sample_time: s.
        batch_shape: one entry a car; () for one.
        method: "unscented", as published, or "linear": the same filter, faster, as the model is linear.
        process_deviation: N a sample, of the random walk of each state.
        measurement_deviation: of a_x, a_y (m/s^2) and dr/dt (rad/s^2).
        split_deviation: N.
        fade_time: s.
        gate: probability with which a good measurement passes; None: no gate.

    Raises:
        EstimatorError: a setting that is not positive, an unknown method.

    >>> import numpy as np
    >>> estimator = LateralForceEstimator(VehicleParameters.published_suv(), sample_time=0.005)
    >>> step = estimator.step(0.0, 2.0, 0.0, 0.02, np.zeros(4))
    >>> step.axle_force.shape  # front and rear, N
    (2,)
    """

    parts = ("filter", "steer", "force_x", "load")

    def __init__(
        self,
        vehicle: VehicleParameters,
        sample_time: float,
        batch_shape: tuple[int, ...] = (),
        method: Literal["unscented", "linear"] = "unscented",
        process_deviation: float = PUBLISHED_PROCESS * KILO,
        measurement_deviation: tuple[float, float, float] = PUBLISHED_MEASUREMENT,
        split_deviation: float = 1000.0,
        fade_time: float = 0.5,
        gate: float | None = None,
    ) -> None:
        if method not in ("unscented", "linear"):
            raise EstimatorError(f"method = {method!r} is not known; use 'unscented' or 'linear'")
        self.vehicle, self.method, self.gate = vehicle, method, gate
        super().__init__(batch(batch_shape))
        time = setting(sample_time, "sample_time", "s")
        self._fade = math.exp(-time / setting(fade_time, "fade_time", "s"))
        variance = (setting(process_deviation, "process_deviation", "N") / KILO) ** 2
        units = ("m/s^2", "m/s^2", "rad/s^2")
        sensors = [setting(v, "measurement_deviation", u) for v, u in zip(measurement_deviation, units, strict=True)]
        split = setting(split_deviation, "split_deviation", "N") / KILO
        axles = vehicle.static_loads.reshape(2, 2).sum(axis=-1)[[0, 1, 0]] / KILO
        self._prior = np.diag(axles**2)
        self._walk = variance * np.eye(3)
        noise = [*(value**2 for value in sensors), split**2]
        self._R = np.diag(noise)
        self._threshold = gate_threshold(gate)
        start = np.zeros((*self.batch_shape, 3))
        self.filter: UnscentedKalmanFilter | KalmanFilter | LateralFew
        if method == "unscented":
            self.filter = UnscentedKalmanFilter(start, self._prior)
        elif math.prod(self.batch_shape) <= FEW:
            self.filter = LateralFew(axles**2, self.batch_shape, vehicle, variance, noise, self._fade)
        else:
            self.filter = KalmanFilter(start, self._prior)
        self.steer = Held(self.batch_shape, "steer", limit=limits.ANGLE)
        self.force_x = Held((*self.batch_shape, 4), "longitudinal_force", limit=limits.FORCE)
        self.load = Held((*self.batch_shape, 4), "vertical_load", vehicle.static_loads, limits.FORCE)
        self._stay = np.ones((*self.batch_shape, 1))

    def step(
        self,
        acceleration_x: npt.ArrayLike,
        acceleration_y: npt.ArrayLike,
        yaw_acceleration: npt.ArrayLike,
        steer: npt.ArrayLike,
        longitudinal_force: npt.ArrayLike,
        vertical_load: npt.ArrayLike | None = None,
    ) -> LateralForceStep:
        """Takes one sample: m/s^2 without gravity (P1 (11)), m/s^2, rad/s^2, rad, each of the batch shape.

        `longitudinal_force` and `vertical_load` have the four corners on a last axis, N.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        shape = self.batch_shape
        flags: FlagArray = np.zeros(shape, dtype=np.int32)
        y: FloatArray = np.empty((*shape, 3))
        y[..., 0] = entries(acceleration_x, shape, "acceleration_x")
        y[..., 1] = entries(acceleration_y, shape, "acceleration_y")
        y[..., 2] = entries(yaw_acceleration, shape, "yaw_acceleration")
        angle, no_angle = self.steer(steer)
        force_x, no_force = self.force_x(longitudinal_force)
        load, no_load = (self.load.last, None) if vertical_load is None else self.load(vertical_load)
        for lost in (no_angle, no_force, no_load):
            if lost is not None:
                raise_flag(flags, any_missing(lost, shape), Flag.MISSING_INPUT)
        unseen = None
        if not quiet(y, limits.ACCELERATION):
            missing = ~(np.absolute(y) <= _LARGEST)  # True for NaN
            y[missing] = np.nan
            raise_flag(flags, any_missing(missing, shape), Flag.MISSING_MEASUREMENT)
            unseen = any_missing(missing[..., 1:], shape)
        self._flag_renewed(flags)
        if isinstance(self.filter, LateralFew):
            outputs, used = self.filter.step(y, angle, force_x, load, unseen, self._threshold)
            return LateralForceStep(
                outputs[..., :2], outputs[..., 2:6], outputs[..., 6:9], outputs[..., 9:12], used, flags
            )
        found = self._filtered(self.filter, y, planar_model(self.vehicle, angle, force_x), load, unseen)
        forces = found.state * KILO
        deviation: FloatArray = KILO * np.sqrt(found.covariance[..., _DIAGONAL, _DIAGONAL])
        return LateralForceStep(
            forces[..., :2], _corners(forces, load), deviation, found.innovation[..., :3], found.used[..., :3], flags
        )

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Starts the entries `where` (bool mask of the batch shape; None: all) afresh at zero; flagged RESET next."""
        chosen = mask(where, self.batch_shape, "where")
        self.filter.reset(chosen)
        self.steer.forget(chosen)
        self.force_x.forget(chosen[..., None])
        self.load.forget(chosen[..., None])
        self._renew(chosen)

    def _filtered(
        self,
        kalman: KalmanFilter | UnscentedKalmanFilter,
        y: FloatArray,
        model: PlanarModel,
        load: FloatArray,
        unseen: BoolArray | None,
    ) -> FilterStep:
        """Prediction and correction in kN, with the split by load, measured 0, as fourth channel; `unseen` axles fade."""
        shape = self.batch_shape
        y = np.concatenate((y, np.zeros((*shape, 1))), axis=-1)
        C: FloatArray = np.zeros((*shape, 4, 3))
        np.multiply(model.C, KILO, C[..., :3, :])
        C[..., 3, 0], C[..., 3, 2] = 2.0 * _left_share(load, 0) - 1.0, 1.0
        offset: FloatArray = np.zeros((*shape, 4))
        offset[..., :3] = model.d
        fade, noise = self._stay, self._walk
        if unseen is not None:
            fade = np.where(unseen, self._fade, 1.0)[..., None]
            noise = np.where(unseen[..., None, None], (1.0 - self._fade**2) * self._prior, self._walk)
        if isinstance(kalman, KalmanFilter):
            kalman.predict(fade[..., None] * _EYE, noise)
            return kalman.correct(y, C, self._R, offset, self.gate)
        kalman.predict(lambda x: fade * x, noise)
        return kalman.correct(y, lambda x: (C @ x[..., None])[..., 0] + offset, self._R, self.gate)


def _left_share(load: FloatArray, first: int) -> FloatArray:
    """Share of an axle's load on its left wheel; a half where it carries nothing."""
    left, both = load[..., first], load[..., first] + load[..., first + 1]
    if np.minimum.reduce(both, None) > 0:
        share: FloatArray = left / both
        return share
    return np.where(both > 0, left / np.where(both > 0, both, 1.0), 0.5)


def _corners(states: FloatArray, load: FloatArray) -> FloatArray:
    """Front: (F_yf -+ dF_yf)/2 left and right; rear: by load."""
    share = _left_share(load, 2)
    front, back, difference = states[..., 0], states[..., 1], states[..., 2]
    corners: FloatArray = np.empty((*states.shape[:-1], 4))
    corners[..., 0], corners[..., 1] = 0.5 * (front - difference), 0.5 * (front + difference)
    corners[..., 2] = left = share * back
    corners[..., 3] = back - left
    return corners
