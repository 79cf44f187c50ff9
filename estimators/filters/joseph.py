"""Linear prediction and Joseph-form correction of a mean and a covariance: the core of two filters."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.filters.gaussian import GaussianFilter
from estimators.filters.step import (
    FilterStep,
    all_bounded,
    bounded,
    broadcast,
    diagonal,
    fits,
    gate_threshold,
    numbers,
    refused,
)


class CovarianceFilter(GaussianFilter):
    """Keeps mean and covariance as they are."""

    def __init__(self, state: npt.ArrayLike, covariance: npt.ArrayLike) -> None:
        super().__init__(state, covariance)
        self._mean, self._spread = (array.copy() for array in self._initial)
        self._identity = np.eye(self.size)

    @property
    def state(self) -> FloatArray:
        """A copy of the mean, shape (..., n)."""
        return self._mean.copy()

    def _read(self) -> tuple[FloatArray, FloatArray]:
        return self._mean.copy(), self._spread.copy()

    def _write(self, where: BoolArray, mean: FloatArray, spread: FloatArray) -> None:
        self._mean[where], self._spread[where] = mean[where], spread[where]

    def _memory(self) -> dict[str, FloatArray]:
        return {"state": self._mean, "covariance": self._spread}

    def _shaped(self, matrix: FloatArray, what: str, rows: int | None) -> FloatArray:
        """A matrix (..., rows, n) whose batch axes fit; rows None: any number."""
        m = matrix.shape[-2] if matrix.ndim > 1 else 0
        batch, n = matrix.shape[:-2], self.size
        if m < 1 or matrix.shape[-1] != n or (rows is not None and m != rows) or not fits(batch, self.batch_shape):
            expected = f"(..., {'m' if rows is None else rows}, {n})"
            raise EstimatorError(
                f"{what} {matrix.shape} does not fit {n} states of batch {self.batch_shape}: {expected}"
            )
        return matrix

    def _advance(self, mean: FloatArray, A: FloatArray, Q: npt.ArrayLike) -> BoolArray:
        """P = A P A' + Q; entries whose result is not finite stay as they were. Returns these, shape (...)."""
        n = self.size
        A, added = self._shaped(A, "A", n), self._shaped(numbers(Q, "Q"), "Q", n)
        if not np.minimum.reduce(diagonal(added), None) >= 0.0:
            raise EstimatorError("Q has a variance below zero, or one that is not a number; it is a covariance")
        spread = _symmetric(A @ self._spread @ A.swapaxes(-1, -2) + added)
        mean = broadcast(mean, self._mean.shape, "predicted state")
        if all_bounded(mean) and all_bounded(spread):
            self._mean, self._spread = np.array(mean), spread
            return np.zeros(self.batch_shape, dtype=np.bool_)
        good = bounded(mean, -1) & bounded(spread, -2, -1)
        self._mean = np.where(good[..., None], mean, self._mean)
        self._spread = np.where(good[..., None, None], spread, self._spread)
        return np.logical_not(good)

    def _correct(
        self, y: npt.ArrayLike, expected: FloatArray, C: FloatArray, R: npt.ArrayLike, gate: float | None
    ) -> FilterStep:
        """K = P C' (C P C' + R)^-1, P = (I - K C) P (I - K C)' + K R K'.

        A channel that is missing (y, its prediction or its row of C not finite) or gated gets a zero row in C and
        unit noise of its own: its column of K is zero.
        """
        m = self._shaped(C, "C", None).shape[-2]
        noise = numbers(R, "R")
        if noise.shape[-2:] != (m, m) or not fits(noise.shape[:-2], self.batch_shape):
            raise EstimatorError(f"R {noise.shape} does not fit {m} channels of batch {self.batch_shape}: (..., m, m)")
        if not np.minimum.reduce(diagonal(noise), None) >= 0.0:
            raise EstimatorError("R has a variance below zero, or one that is not a number; it is a covariance")
        if expected.shape[-1] != m:
            raise EstimatorError(f"predicted measurement has {expected.shape[-1]} channels, C and R have {m}")
        innovation = broadcast(y, (*self.batch_shape, m), "y") - expected
        if innovation.shape != (*self.batch_shape, m):
            raise EstimatorError(f"predicted measurement {np.shape(expected)} does not fit batch {self.batch_shape}")
        missing: BoolArray | None = None
        if not (all_bounded(innovation) and all_bounded(C)):
            missing = ~(bounded(innovation) & bounded(C, -1))
            C = np.where(np.isfinite(C), C, 0.0)
        cross = self._spread @ C.swapaxes(-1, -2)  # (..., n, m)
        total = C @ cross + noise
        gated, out = refused(innovation, diagonal(total), missing, gate_threshold(gate))
        solved, clean, kept = total, innovation, C
        if out is not None:
            keep = ~out
            both = keep[..., :, None] & keep[..., None, :]
            solved, noise = np.where(both, total, np.eye(m)), np.where(both, noise, np.eye(m))
            cross = np.where(keep[..., None, :], cross, 0.0)
            kept, clean = np.where(keep[..., None], C, 0.0), np.where(keep, innovation, 0.0)
        gain = _gain(solved, cross)
        left = self._identity - gain @ kept
        spread = left @ self._spread @ left.swapaxes(-1, -2) + gain @ noise @ gain.swapaxes(-1, -2)
        spread = _symmetric(spread)
        mean = self._mean + (gain @ clean[..., None])[..., 0]
        if not (all_bounded(mean) and all_bounded(spread)):
            raise EstimatorError("the correction is not finite; check that R is finite and positive definite")
        self._mean, self._spread = mean, spread
        if missing is not None:
            innovation = np.where(missing, np.nan, innovation)
        used = np.ones(innovation.shape, dtype=np.bool_) if out is None else np.logical_not(out)
        return FilterStep(mean.copy(), spread.copy(), innovation, total, gain, used, gated)


def _symmetric(matrix: FloatArray) -> FloatArray:
    return 0.5 * (matrix + matrix.swapaxes(-1, -2))


def _gain(total: FloatArray, cross: FloatArray) -> FloatArray:
    """P C' S^-1 (..., n, m); one channel needs no solver."""
    if total.shape[-1] == 1:
        if not np.minimum.reduce(total, None) > 0:
            raise EstimatorError("C P C' + R is not positive; give every channel a noise variance above zero")
        return cross / total
    try:
        solved = np.linalg.solve(total, cross.swapaxes(-1, -2)).swapaxes(-1, -2)
    except np.linalg.LinAlgError as error:
        raise EstimatorError("C P C' + R is singular; give every channel a noise variance above zero") from error
    return np.asarray(solved, dtype=np.float64)
