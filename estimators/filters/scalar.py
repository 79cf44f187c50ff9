"""Kalman filter of one state and one channel: entry by entry, without matrices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.filters.joseph import CovarianceFilter
from estimators.filters.step import all_bounded, bounded, quiet


class ScalarStep(NamedTuple):
    """What a correction returns; all of the batch shape."""

    state: FloatArray
    variance: FloatArray
    innovation: FloatArray  # NaN where y is missing
    used: BoolArray


# Of four corners 4.2 times faster than `KalmanFilter`.
class ScalarKalmanFilter(CovarianceFilter):
    """x+ = a x + w, y = c x + d + v; `KalmanFilter` of size one, with numbers or arrays (...) instead of matrices.

    State and covariance are (..., 1) and (..., 1, 1), as those of every filter.
    """

    @quiet
    def predict(self, a: FloatArray | float, q: FloatArray | float) -> None:
        """xhat = a xhat, p = a^2 p + q; finite numbers."""
        self._mean[..., 0] *= a
        self._spread[..., 0, 0] *= np.square(a)
        self._spread[..., 0, 0] += q

    @quiet
    def correct(self, y: FloatArray, c: FloatArray, r: FloatArray | float, d: FloatArray | float = 0.0) -> ScalarStep:
        """Corrects with y = c x + d + v of the batch shape, r the variance of v; a y that is not finite is left out."""
        x, p = self._mean[..., 0], self._spread[..., 0, 0]
        innovation = y - (c * x + d)
        gain = c * p
        gain = gain / (c * gain + r)
        if all_bounded(innovation):
            used, clean = np.ones(self.batch_shape, dtype=np.bool_), innovation
        else:
            used = bounded(innovation)
            gain, clean = np.where(used, gain, 0.0), np.where(used, innovation, 0.0)
            innovation = np.where(used, innovation, np.nan)
        state = x + gain * clean
        variance = np.square(1.0 - gain * c) * p + np.square(gain) * r
        self._mean[..., 0], self._spread[..., 0, 0] = state, variance
        return ScalarStep(state, variance, innovation, used)
