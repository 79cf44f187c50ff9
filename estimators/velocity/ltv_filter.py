"""The filter of `LtvKalmanObserver`: one recursion, on plain numbers for a handful of corners, on arrays for many.

Two states are three of which the last stays at zero, with the output row of the two-state form.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from estimators.arguments import LIMIT
from estimators.arithmetic import ManyCars, Number, OneCar
from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.filters.joseph import CovarianceFilter
from estimators.filters.step import all_bounded, quiet
from estimators.velocity.ltv_model import BristleTire, sampled_entries

FEW = 16  # corners up to which plain numbers are faster than arrays: 3 times for four
LARGEST_SPREAD = 50.0  # m/s of standard deviation: an entry without a measurement for long knows nothing


class LtvFilter(CovarianceFilter):
    """Corrects with mu, then predicts with u: P2 (21)-(22) with the correction in the form of Joseph.

    Args:
        covariance: (n, n), initial, of 2 or 3 states; an entry with more than `LARGEST_SPREAD` returns to it.
        batch_shape: one entry a corner.
        tire: constants of the bristle model.
        time: T_s, s.
        identity: Q = q I, else q B B' with B = [0 1 1]'.
    """

    def __init__(
        self,
        covariance: FloatArray,
        batch_shape: tuple[int, ...],
        tire: BristleTire,
        time: float,
        identity: bool = False,
    ) -> None:
        super().__init__(np.zeros((*batch_shape, len(covariance))), covariance)
        self.tire, self.time, self.identity = tire, time, identity
        rows, columns = np.tril_indices(self.size)
        square = np.zeros((self.size, self.size), dtype=np.int64)
        square[rows, columns] = square[columns, rows] = np.arange(rows.size)
        # places of the lower triangle in the matrix, and of each entry of the matrix in the lower triangle
        self._lower, self._square = rows * self.size + columns, square.reshape(-1)
        self._wide = covariance.reshape(-1)[self._lower].tolist()
        count = math.prod(batch_shape)
        self._kit = OneCar() if count <= FEW else ManyCars((count,))

    @quiet
    def step(self, given: FloatArray, mu: FloatArray, noise: FloatArray) -> tuple[FloatArray, BoolArray]:
        """One sample of all entries: innovation, its variance, and the n predictor gains (..., 2+n); used (...).

        Args:
            given: (3, ...) finite u in m/s^2, w in rad/s, dw/dt in rad/s^2.
            mu: (...) normalised force, not finite where missing.
            noise: (..., 2) q and r.

        Raises:
            EstimatorError: the correction is not finite.
        """
        n, shape, size = self.size, self.batch_shape, len(self._wide)
        columns = (
            self._mean.reshape(-1, n).T,
            self._spread.reshape(-1, n * n).T[self._lower],
            noise.reshape(-1, 2).T,
            mu.reshape(1, -1),
            given.reshape(3, -1),
        )
        if isinstance(self._kit, OneCar):
            table = np.array(self._kit.each(self._sample, *(row for part in columns for row in part.tolist())))
        else:
            table = np.stack(np.broadcast_arrays(*self._kit.each(self._sample, *np.concatenate(columns))))
        mean = table[:n].T.reshape(*shape, n)
        if not all_bounded(mean):
            raise EstimatorError("the correction is not finite; check the acceleration and the force")
        self._mean, self._spread = mean, table[n : n + size][self._square].T.reshape(*shape, n, n)
        return table[n + size : -1].T.reshape(*shape, n + 2), table[-1].reshape(shape) > 0.0

    def _sample(self, *given: Number) -> tuple[Number, ...]:
        """State and covariance (row by row) at the end of the sample; what `step` returns; whether mu was used."""
        tire, kit, three = self.tire, self._kit, self.size == 3
        choose: Any = kit.where
        if three:
            x1, x2, x3, p11, p12, p22, p13, p23, p33, q, r, mu, u, w, dw = given
        else:
            x1, x2, p11, p12, p22, q, r, mu, u, w, dw = given
            x3 = p13 = p23 = p33 = 0.0
        c1, c2, c3 = tire.row(w, self.size)
        h1, h2, h3 = p11 * c1 + p12 * c2 + p13 * c3, p12 * c1 + p22 * c2 + p23 * c3, p13 * c1 + p23 * c2 + p33 * c3
        total = c1 * h1 + c2 * h2 + c3 * h3 + r
        nu = mu - c1 * x1 - c2 * x2 - c3 * x3
        used = abs(nu) <= LIMIT  # False for NaN
        k1, k2, k3 = (choose(used, h / total, 0.0) for h in (h1, h2, h3))
        off = choose(used, nu, 0.0)
        x1, x2, x3 = x1 + k1 * off, x2 + k2 * off, x3 + k3 * off
        # W = (I - K C) P, then W (I - K C)' + K r K'
        w11, w12, w13 = p11 - k1 * h1, p12 - k1 * h2, p13 - k1 * h3
        w22, w23, w33 = p22 - k2 * h2, p23 - k2 * h3, p33 - k3 * h3
        g1 = k1 * r - w11 * c1 - w12 * c2 - w13 * c3
        g2 = k2 * r - w12 * c1 - w22 * c2 - w23 * c3
        g3 = k3 * r - w13 * c1 - w23 * c2 - w33 * c3
        p11, p12, p13 = w11 + g1 * k1, w12 + g1 * k2, w13 + g1 * k3
        p22, p23, p33 = w22 + g2 * k2, w23 + g2 * k3, w33 + g3 * k3

        T = self.time
        E, s0, b1, d1, d2, b3 = sampled_entries(kit, tire, w, dw, T)
        d3 = E
        if not three:
            d1 = d2 = d3 = b3 = 0.0  # last row of A, last entry of B
        x1, x2, x3 = E * x1 + s0 * x2 + b1 * u, x2 + T * u, d1 * x1 + d2 * x2 + d3 * x3 + b3 * u
        gain = (E * k1 + s0 * k2, k2, d1 * k1 + d2 * k2 + d3 * k3)
        # rows of A P, then A P A' + Q
        e1, e2, e3 = E * p11 + s0 * p12, E * p12 + s0 * p22, E * p13 + s0 * p23
        f1, f2, f3 = d1 * p11 + d2 * p12 + d3 * p13, d1 * p12 + d2 * p22 + d3 * p23, d1 * p13 + d2 * p23 + d3 * p33
        third = q if three else 0.0
        first, common = (q, 0.0) if self.identity else (0.0, third)
        p13, p23 = e1 * d1 + e2 * d2 + e3 * d3, p12 * d1 + p22 * d2 + p23 * d3 + common
        p11, p12, p22 = E * e1 + s0 * e2 + first, e2, p22 + q
        p33 = f1 * d1 + f2 * d2 + f3 * d3 + third
        known = p22 < LARGEST_SPREAD**2
        n, size = self.size, len(self._wide)
        spread = [
            choose(known, p, wide) for p, wide in zip((p11, p12, p22, p13, p23, p33)[:size], self._wide, strict=True)
        ]
        return (*(x1, x2, x3)[:n], *spread, choose(used, nu, math.nan), total, *gain[:n], used)
