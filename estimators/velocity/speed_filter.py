"""The Kalman filter of a speed and of the parameters that disturb it.

The speed, the first state, moves by its own input and by the others, which keep to themselves:

    x_0+ = x_0 + sum_j a_j x_j + u + w_0,      x_i+ = m_i + phi_i (x_i - m_i) + w_i,   Var w_i = s_i^2 (1 - phi_i^2).

Every parameter is a first-order Gauss-Markov process around its prior mean m_i: however long nothing excites it, its
variance never grows beyond the prior s_i^2.
"""

from __future__ import annotations

import numpy as np

from estimators.faults import BoolArray
from estimators.filters import KalmanFilter
from estimators.interpolate import FloatArray

NEVER = 1e12
"""Noise variance of a channel that is not used: next to it, that of any estimate is nothing."""


class SpeedFilter(KalmanFilter):
    """Mean (b, n) and covariance (b, n, n) of b runs.

    Args:
        mean: (n,) prior means m.
        spread: (n, n) prior covariance.
        rates: (n,) 1/s and `spatial`: (n,) 1/m, how fast the parameters forget in time and along the road; phi =
            exp(-elapsed (rate + spatial |speed|)). The first entries are not used.
        count: b.
    """

    def __init__(
        self, mean: FloatArray, spread: FloatArray, rates: FloatArray, spatial: FloatArray, count: int
    ) -> None:
        n = mean.size
        super().__init__(np.broadcast_to(mean, (count, n)), spread)
        self.prior_mean = mean.copy()
        self._prior_variance = np.diagonal(spread).copy()
        self._rates, self._spatial = rates.copy(), spatial.copy()
        self._rates[0] = self._spatial[0] = 0.0
        self._A, self._Q = np.zeros((2, count, n, n))
        self._A_diagonal, self._Q_diagonal = np.einsum("bii->bi", self._A), np.einsum("bii->bi", self._Q)

    @property
    def mean(self) -> FloatArray:
        """The state (b, n) itself: not to be written to."""
        return self._mean

    @property
    def spread(self) -> FloatArray:
        """The covariance (b, n, n) itself: not to be written to."""
        return self._spread

    def move(
        self, elapsed: FloatArray, pace: FloatArray, coupling: FloatArray, shift: FloatArray, noise: FloatArray
    ) -> None:
        """One sample on: `elapsed` s, `pace` m/s, `shift` u and `noise` Var w_0 (b,); `coupling` (b, n - 1) a_j."""
        memory = np.exp(-elapsed[:, None] * (self._rates + self._spatial * pace[:, None]))
        self._A_diagonal[:] = memory
        self._A[:, 0, 1:] = coupling
        self._Q_diagonal[:] = self._prior_variance * (1.0 - memory * memory)
        self._Q_diagonal[:, 0] = noise
        mean: FloatArray = self.prior_mean + memory * (self._mean - self.prior_mean)
        mean[:, 0] = self._mean[:, 0] + shift + (coupling * self._mean[:, 1:]).sum(axis=1)
        self._mean = mean
        self._spread = self._A @ self._spread @ np.swapaxes(self._A, 1, 2) + self._Q  # `weigh` keeps it symmetric

    def weigh(
        self, innovation: FloatArray, C: FloatArray, variance: FloatArray, learning: FloatArray | None = None
    ) -> None:
        """Corrects with independent channels: innovation, variance (b, m), C (b, m, n), all finite.

        `learning` (b, m, n) is 0 where a channel must not move a state: the error of that state is considered, but
        not corrected (Schmidt (1966)); 1 elsewhere. The Joseph form holds for any gain.
        """
        cross = self._spread @ np.swapaxes(C, 1, 2)
        total = C @ cross
        diagonal = np.einsum("bii->bi", total)
        diagonal += variance
        gain = np.linalg.solve(total, np.swapaxes(cross, 1, 2))  # (b, m, n), transposed
        if learning is not None:
            gain *= learning
        moved = np.einsum("bm,bmn->bn", innovation, gain)
        left = self._identity - np.swapaxes(gain, 1, 2) @ C
        spread = left @ self._spread @ np.swapaxes(left, 1, 2)
        spread += np.swapaxes(gain, 1, 2) @ (variance[:, :, None] * gain)
        self._mean += moved
        self._spread = 0.5 * (spread + np.swapaxes(spread, 1, 2))

    def renew(self, where: BoolArray, first: FloatArray, first_variance: FloatArray) -> None:
        """Back to the priors for the entries `where` (b,), with the speed and its variance (b,)."""
        self.reset(where)
        self._mean[where, 0] = first[where]
        self._spread[where, 0, :] = 0.0
        self._spread[where, :, 0] = 0.0
        self._spread[where, 0, 0] = first_variance[where]
