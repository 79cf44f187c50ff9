"""Unscented Kalman filter in square-root form, over any batch."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.filters.affine import Affine
from estimators.filters.gaussian import GaussianFilter
from estimators.filters.sigma import SigmaWeights
from estimators.filters.step import FilterStep, broadcast, fits, gate_threshold, numbers, quiet
from estimators.filters.triangular import FEW, semidefinite_factor
from estimators.filters.unscented_few import Directions, FewPoints
from estimators.filters.unscented_many import ManyPoints

StateFunction = Callable[[FloatArray], FloatArray]


class UnscentedKalmanFilter(GaussianFilter):
    """x+ = f(x) + w, y = h(x) + v, without Jacobians; f and h take states (2n+1, ..., n), sigma points in front.

    The filter carries a triangular factor S of P = S S'. With the values at a pair of sigma points split into an odd
    part b_i and an even part a_i, c_0 the centre, and the points for y drawn anew around the prediction,

        P-  = sum (b_i b_i' + a_i a_i') / tau^2 + W0c c_0 c_0' + Q       (one triangularisation)
        Pyy = G' G + R_e,  Pxy = S G,  G_i = b_i / tau,  R_e = R + even parts of y
        P+  = S (I + G R_e^-1 G')^-1 S'                                  (one triangularisation, nothing subtracted)

    which is the usual filter in exact arithmetic, and positive definite in any. A negative centre weight (n >= 12 with
    the default scaling) takes c_0 c_0' away; it is limited to what leaves a positive definite matrix.

    Drawing anew makes the filter equal the Kalman filter on a linear model; the listing of the source reuses the
    propagated points for y and so leaves Q out of Pyy.

    A function that is affine in its last states, from k on with those before them held, has no even part along the
    columns k, k+1, ... of a lower triangular factor, for these move the last states alone: told so by an `Affine`, the
    filter asks the function for 1 + 2k points, and for its slope along the other columns. Where the measurement is
    affine everywhere, many entries at once take P+ = P- - K Pyy K', whose factor is as good as the orthogonal one while
    none of its pivots is small, which is checked; the form above otherwise (`predicted.Predicted`).

    Source: weights of the corner estimation paper (P1 notes 3, with W_i = 1/(2 (N + eta))); Van der Merwe, Wan (2001)
    for the square-root form; Kaminski, Bryson, Schmidt (1971) for square-root measurement updates.

    Args:
        state: (..., n).
        covariance: (..., n, n), positive definite.
        epsilon: spread of the sigma points, tau = epsilon sqrt(n); None: sqrt(3 / n).
        beta: weight of the fourth moment, 2 for Gaussian densities.

    Raises:
        EstimatorError: as `GaussianFilter`; a spread that is not positive.

    >>> kalman = UnscentedKalmanFilter([1.0], [[1.0]])
    >>> step = kalman.correct([4.0], lambda x: x**2, [[0.1]])
    >>> bool(1.0 < kalman.state[0] < 3.0)
    True
    """

    def __init__(
        self, state: npt.ArrayLike, covariance: npt.ArrayLike, epsilon: float | None = None, beta: float = 2.0
    ) -> None:
        super().__init__(state, covariance)
        self.weights = SigmaWeights.scaled(self.size, epsilon, beta)
        self._count = math.prod(self.batch_shape)
        self._points: FewPoints | ManyPoints = (FewPoints if self._count <= FEW else ManyPoints)(
            self.weights, self._count, self.size
        )
        self._write(np.ones(self.batch_shape, dtype=np.bool_), *self._initial)
        self._process = _Remembered.nothing()
        self._sensor = _Remembered.nothing()

    @property
    def state(self) -> FloatArray:
        """A copy of the mean, shape (..., n)."""
        return self._points.centre().copy(order="K").reshape(*self.batch_shape, self.size)

    @quiet
    def predict(self, transition: StateFunction, Q: npt.ArrayLike, affine: Affine | None = None) -> BoolArray:
        """xhat = sum W f(X_i), P = sum W (f(X_i) - xhat)(.)' + Q; Q (..., n, n) positive semidefinite.

        `affine`: where f is affine, see the class; None: nowhere.

        Returns a mask (...) of the entries that stayed as they were because the prediction was not finite.

        Raises:
            EstimatorError: shapes that do not fit, Q not positive semidefinite, no such state.
        """
        noise = numbers(Q, "Q")
        if not self._process.holds(noise):
            self._process = self._factored(noise, self.size, "Q", definite=False)
        moved, slope = self._through(transition, self.size, "transition", affine)
        return self._points.absorb(moved, slope, self._process.each, self._process.factor).reshape(self.batch_shape)

    @quiet
    def correct(
        self,
        y: npt.ArrayLike,
        measurement: StateFunction,
        R: npt.ArrayLike,
        gate: float | None = None,
        affine: Affine | None = None,
    ) -> FilterStep:
        """Corrects with y = h(x) + v, y (..., m), R (..., m, m); missing channels and gate as `KalmanFilter`.

        `affine`: where h is affine, as for `predict`.

        Raises:
            EstimatorError: shapes that do not fit, a gate outside (0, 1), R not positive definite, no such state.
        """
        noise = numbers(R, "R")
        m = noise.shape[-1] if noise.ndim else 0
        if not self._sensor.holds(noise):
            self._sensor = self._factored(noise, m, "R", definite=True)
        shape = self.batch_shape
        measured = broadcast(y, (*shape, m), "y").reshape(self._count, m)
        seen, slope = self._through(measurement, m, "measurement", affine)
        innovation, total, gain, used, gated = self._points.correct(
            seen, slope, measured, self._sensor.each, self._sensor.factor, gate_threshold(gate)
        )
        return FilterStep(
            *self._read(),
            innovation.reshape(*shape, m),
            total.reshape(*shape, m, m),
            gain.reshape(*shape, self.size, m),
            used.reshape(*shape, m),
            gated.reshape(*shape, m),
        )

    def _through(
        self, function: StateFunction, rows: int, what: str, affine: Affine | None
    ) -> tuple[FloatArray, Directions | None]:
        """f or h at the sigma points, (1+2k, b, rows), and, where k < n, its slope along directions (count, b, n)."""
        n, shape, entries = self.size, self.batch_shape, self._count
        k = n if affine is None else affine.start
        if not 0 <= k <= n:
            raise EstimatorError(f"affine.start = {k!r} must be the index of a state, 0 to {n - 1}, or {n} for none")

        def checked(found: FloatArray, count: int) -> FloatArray:
            if np.ndim(found) < 1 or found.shape[-1] != rows:
                raise EstimatorError(f"{what} has shape {np.shape(found)}, expected {rows} on the last axis")
            return broadcast(found, (count, *shape, rows), what).reshape(count, entries, rows)

        count = 1 + 2 * k
        values = checked(function(self._points.points(k).reshape(count, *shape, n)), count)
        if affine is None or k == n:
            return values, None
        centre = self._points.centre().reshape(*shape, n)

        def slope(directions: FloatArray) -> FloatArray:
            count = len(directions)
            return checked(affine.slope(centre, directions.reshape(count, *shape, n)), count)

        return values, slope

    def _factored(self, noise: FloatArray, rows: int, what: str, definite: bool) -> _Remembered:
        """Factor of a noise covariance; one that stays the same is factored once."""
        if noise.ndim < 2 or noise.shape[-2:] != (rows, rows) or rows < 1:
            size = "m" if definite else str(self.size)
            raise EstimatorError(f"{what} has shape {noise.shape}, expected (..., {size}, {size})")
        factor = semidefinite_factor(noise, what, definite)
        if not fits(noise.shape[:-2], self.batch_shape):
            raise EstimatorError(f"{what} {noise.shape} does not fit batch {self.batch_shape}")
        each, full = (
            array
            if array.ndim == 2
            else np.broadcast_to(array, (*self.batch_shape, rows, rows)).reshape(-1, rows, rows)
            for array in (noise, factor)
        )
        return _Remembered(noise.copy(), self._points.prepared(each), self._points.prepared(full))

    def _read(self) -> tuple[FloatArray, FloatArray]:
        n, shape = self.size, self.batch_shape
        state, covariance = self._points.moments()
        return state.reshape(*shape, n), covariance.reshape(*shape, n, n)

    def _write(self, where: BoolArray, mean: FloatArray, spread: FloatArray) -> None:
        chosen, n = where.reshape(-1), self.size
        state, factor = self._points.arrays()
        state[chosen] = mean.reshape(-1, n)[chosen]
        factor[chosen] = np.linalg.cholesky(spread.reshape(-1, n, n)[chosen])

    def _memory(self) -> dict[str, FloatArray]:
        state, factor = self._points.arrays()
        return {"state": state, "factor": factor}


class _Remembered(NamedTuple):
    """A noise covariance as it was given, and as `prepared` for the arithmetic: itself and its lower factor."""

    given: FloatArray
    each: FloatArray
    factor: FloatArray

    @classmethod
    def nothing(cls) -> _Remembered:
        return cls(*(np.empty(0) for _ in cls._fields))

    def holds(self, noise: FloatArray) -> bool:
        return noise.shape == self.given.shape and bool((noise == self.given).all())
