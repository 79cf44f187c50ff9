"""The filter of `LtvKalmanObserver` for a handful of corners: the same recursion on plain numbers.

Two states are three of which the last stays at zero, with the output row of the two-state form.
"""

from __future__ import annotations

import math

import numpy as np

from estimators.errors import EstimatorError
from estimators.faults import BoolArray
from estimators.filters.joseph import CovarianceFilter
from estimators.filters.step import LIMIT
from estimators.interpolate import FloatArray
from estimators.velocity.ltv_model import BristleTire, integrals

FEW = 16  # corners up to which plain numbers are faster than arrays
LARGEST_SPREAD = 50.0  # m/s of standard deviation: an entry without a measurement for long knows nothing
_Row = list[float]


class LtvFew(CovarianceFilter):
    """Corrects with mu, then predicts with u: P2 (21)-(22) with the correction in the form of Joseph.

    Args:
        covariance: (n, n), initial, of 2 or 3 states; an entry with more than `LARGEST_SPREAD` returns to it.
        batch_shape: one entry a corner.
        tire: constants of the bristle model.
        time: T_s, s.
    """

    def __init__(self, covariance: FloatArray, batch_shape: tuple[int, ...], tire: BristleTire, time: float) -> None:
        super().__init__(np.zeros((*batch_shape, len(covariance))), covariance)
        self.tire, self.time = tire, time
        wide = np.zeros((3, 3))
        wide[: self.size, : self.size] = covariance
        self._wide: list[_Row] = wide.tolist()

    def step(self, given: FloatArray, mu: FloatArray, noise: FloatArray) -> tuple[FloatArray, BoolArray]:
        """One sample of all entries: innovation, its variance, and the n predictor gains (..., 2+n); used (...).

        Args:
            given: (3, ...) finite u in m/s^2, w in rad/s, dw/dt in rad/s^2.
            mu: (...) normalised force, not finite where missing.
            noise: (..., 2) q and r.

        Raises:
            EstimatorError: the correction is not finite.
        """
        n, shape = self.size, self.batch_shape
        inputs = given.reshape(3, -1).T.tolist()
        columns = (self._mean.reshape(-1, n), self._spread.reshape(-1, n, n), mu.reshape(-1), noise.reshape(-1, 2))
        cars = zip(inputs, *(column.tolist() for column in columns), strict=True)
        found = [self._one(x, P, force, u, w, dw, q, r) for (u, w, dw), x, P, force, (q, r) in cars]
        states, spreads, outputs, used = zip(*found, strict=True)
        self._mean = np.array(states)[:, :n].reshape(*shape, n)
        self._spread = np.array(spreads)[:, :n, :n].reshape(*shape, n, n)
        return np.array(outputs)[:, : 2 + n].reshape(*shape, 2 + n), np.array(used).reshape(shape)

    def _one(
        self, x: _Row, P: list[_Row], mu: float, u: float, w: float, dw: float, q: float, r: float
    ) -> tuple[_Row, list[_Row], _Row, bool]:
        """State and covariance at the end of the sample; what `step` returns; whether mu was used."""
        tire, T = self.tire, self.time
        a = tire.kappa * tire.radius * abs(w)
        if self.size == 3:
            x1, x2, x3 = x
            (p11, p12, p13), (_, p22, p23), (_, _, p33) = P
            c1, c2, c3 = tire.sigma0, tire.sigma2, tire.sigma1
        else:
            (x1, x2), x3 = x, 0.0
            (p11, p12), (_, p22) = P
            p13 = p23 = p33 = 0.0
            c1, c2, c3 = tire.sigma0 - tire.sigma1 * a, tire.sigma1 + tire.sigma2, 0.0

        h1, h2, h3 = p11 * c1 + p12 * c2 + p13 * c3, p12 * c1 + p22 * c2 + p23 * c3, p13 * c1 + p23 * c2 + p33 * c3
        total = c1 * h1 + c2 * h2 + c3 * h3 + r
        nu = mu - c1 * x1 - c2 * x2 - c3 * x3
        used = -LIMIT <= nu <= LIMIT
        k1 = k2 = k3 = 0.0
        if used:
            k1, k2, k3 = h1 / total, h2 / total, h3 / total
            x1, x2, x3 = x1 + k1 * nu, x2 + k2 * nu, x3 + k3 * nu
            # W = (I - K C) P, then W (I - K C)' + K r K'
            w11, w12, w13 = p11 - k1 * h1, p12 - k1 * h2, p13 - k1 * h3
            w22, w23, w33 = p22 - k2 * h2, p23 - k2 * h3, p33 - k3 * h3
            g1 = k1 * r - w11 * c1 - w12 * c2 - w13 * c3
            g2 = k2 * r - w12 * c1 - w22 * c2 - w23 * c3
            g3 = k3 * r - w13 * c1 - w23 * c2 - w33 * c3
            p11, p12, p13 = w11 + g1 * k1, w12 + g1 * k2, w13 + g1 * k3
            p22, p23, p33 = w22 + g2 * k2, w23 + g2 * k3, w33 + g3 * k3

        p0, p1, q1, q2 = integrals(a * T)
        E, s0, b1 = math.exp(-a * T), T * p0, T * T * p1
        d1 = d2 = d3 = b3 = 0.0  # last row of A, last entry of B
        if self.size == 3:
            rise = math.copysign(tire.kappa * tire.radius, w) * dw if w else 0.0
            d1, d2, d3, b3 = -rise * T * E, -rise * T * T * q1, E, s0 - rise * T**3 * q2
        x1, x2, x3 = E * x1 + s0 * x2 + b1 * u, x2 + T * u, d1 * x1 + d2 * x2 + d3 * x3 + b3 * u
        gain = [E * k1 + s0 * k2, k2, d1 * k1 + d2 * k2 + d3 * k3]
        # rows of A P, then A P A' + q on V_r and z'
        e1, e2, e3 = E * p11 + s0 * p12, E * p12 + s0 * p22, E * p13 + s0 * p23
        f1, f2, f3 = d1 * p11 + d2 * p12 + d3 * p13, d1 * p12 + d2 * p22 + d3 * p23, d1 * p13 + d2 * p23 + d3 * p33
        third = q if self.size == 3 else 0.0
        p13, p23 = e1 * d1 + e2 * d2 + e3 * d3, p12 * d1 + p22 * d2 + p23 * d3 + third
        p11, p12, p22 = E * e1 + s0 * e2, e2, p22 + q
        p33 = f1 * d1 + f2 * d2 + f3 * d3 + third
        if not -LIMIT < abs(x1) + abs(x2) + abs(x3) < LIMIT:
            raise EstimatorError("the correction is not finite; check the acceleration and the force")
        spread = [[p11, p12, p13], [p12, p22, p23], [p13, p23, p33]] if p22 < LARGEST_SPREAD**2 else self._wide
        return [x1, x2, x3], spread, [nu if used else math.nan, total, *gain], used
