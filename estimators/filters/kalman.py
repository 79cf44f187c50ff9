"""Kalman filter for time-varying linear models, over any batch."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.filters.joseph import CovarianceFilter
from estimators.filters.step import FilterStep, broadcast, fits, numbers, quiet


class KalmanFilter(CovarianceFilter):
    """x+ = A x + B u + w, y = C x + d + v with w ~ (0, Q), v ~ (0, R); the matrices may change at every call.

    Matrices have any leading axes that broadcast against the batch. Source: Kalman (1960); correction in the form of
    Bucy, Joseph (1968), which keeps P symmetric and positive definite.

    >>> kalman = KalmanFilter(state=[0.0], covariance=[[1.0]])
    >>> _ = kalman.predict([[1.0]], [[0.0]])
    >>> step = kalman.correct([1.0], [[1.0]], [[1.0]])
    >>> float(kalman.state[0])  # half way: measurement and estimate are worth the same
    0.5
    """

    @quiet
    def predict(
        self,
        A: npt.ArrayLike,
        Q: npt.ArrayLike,
        B: npt.ArrayLike | None = None,
        u: npt.ArrayLike | None = None,
    ) -> BoolArray:
        """xhat = A xhat + B u, P = A P A' + Q. Shapes A, Q (..., n, n), B (..., n, k), u (..., k).

        Returns a mask (...) of the entries that stayed as they were because the prediction was not finite.

        Raises:
            EstimatorError: shapes that do not fit, B without u, variances of Q below zero.
        """
        matrix = self._shaped(numbers(A, "A"), "A", self.size)
        mean: FloatArray = (matrix @ self._mean[..., None])[..., 0]
        if (B is None) != (u is None):
            raise EstimatorError("B and u belong together: give both, or neither")
        if B is not None and u is not None:
            mean = mean + self._input(numbers(B, "B"), numbers(u, "u"))
        return self._advance(mean, matrix, Q)

    @quiet
    def correct(
        self,
        y: npt.ArrayLike,
        C: npt.ArrayLike,
        R: npt.ArrayLike,
        offset: npt.ArrayLike | None = None,
        gate: float | None = None,
    ) -> FilterStep:
        """Corrects with y = C x + offset + v. Shapes y, offset (..., m), C (..., m, n), R (..., m, m).

        A channel that is not finite is missing: it is left out, for its batch entry alone. `gate` is the probability
        with which a good channel passes: one with nu_i^2 / S_ii beyond that chi-square quantile is left out too.

        Raises:
            EstimatorError: shapes that do not fit, a gate outside (0, 1), variances of R below zero, C P C' + R singular.
        """
        matrix = self._shaped(numbers(C, "C"), "C", None)
        expected: FloatArray = (matrix @ self._mean[..., None])[..., 0]
        if offset is not None:
            expected = expected + broadcast(offset, expected.shape, "offset")
        return self._correct(y, expected, matrix, R, gate)

    def _input(self, B: FloatArray, u: FloatArray) -> FloatArray:
        """B u (..., n)."""
        n, k = self.size, u.shape[-1] if u.ndim else 0
        fit = B.shape[-2:] == (n, k) and fits(B.shape[:-2], self.batch_shape) and fits(u.shape[:-1], self.batch_shape)
        if not fit:
            raise EstimatorError(f"B {B.shape} and u {u.shape} do not fit {n} states of batch {self.batch_shape}")
        return np.asarray((B @ u[..., None])[..., 0])
