"""The filter of `LateralForceEstimator` for a handful of cars: the same linear model on plain numbers."""

from __future__ import annotations

import math

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError
from estimators.filters.joseph import CovarianceFilter
from estimators.filters.step import LIMIT
from estimators.filters.three_states import informed
from estimators.forces.planar import planar_entries
from estimators.vehicle import VehicleParameters

FEW = 8  # cars up to which plain numbers are faster than arrays: 6.6 times for one
KILO = 1000.0  # the filter works in kN: with newtons the covariances would span eleven decades
_Row = list[float]


class LateralFew(CovarianceFilter):
    """x = (F_yf, F_yr, dF_yf) in kN of every car; P+ = (P^-1 + C'R^-1 C)^-1 and x+ = x + P+ C'R^-1 nu for diagonal R.

    A channel that is left out adds nothing to the sums.

    Args:
        prior: kN^2, (3,) initial variances, to which those of an unseen car return.
        batch_shape: one entry a car.
        vehicle: for the model (`planar_entries`).
        walk: kN^2 a sample, variance of the random walk.
        noise: variances of a_x, a_y, dr/dt (SI) and of the split by load (kN^2).
        fade: factor on the forces of an unseen car.
    """

    def __init__(
        self,
        prior: FloatArray,
        batch_shape: tuple[int, ...],
        vehicle: VehicleParameters,
        walk: float,
        noise: _Row,
        fade: float,
    ) -> None:
        super().__init__(np.zeros((*batch_shape, 3)), np.diag(prior))
        self.vehicle, self.noise, self.fade = vehicle, noise, fade
        self._seen = (walk, walk, walk)
        self._unseen = tuple((1.0 - fade * fade) * value for value in prior.tolist())

    def step(
        self,
        y: FloatArray,
        steer: FloatArray,
        force: FloatArray,
        load: FloatArray,
        unseen: BoolArray | None,
        threshold: float | None,
    ) -> tuple[FloatArray, BoolArray]:
        """One sample of all cars: F_yf, F_yr, four corners, three deviations (N), innovations (..., 12+); used (..., 3).

        Args:
            y: (..., 3) m/s^2, m/s^2, rad/s^2; missing ones not finite.
            steer: (...) rad.
            force, load: (..., 4) N.
            unseen: (...) cars whose forces fade; None: none.
            threshold: of squared normalised innovations, beyond which a channel is left out.

        Raises:
            EstimatorError: the correction is not finite.
        """
        shape = self.batch_shape
        if shape:
            given = [self._mean, self._spread, y, steer, force, load]
            if len(shape) > 1:
                given = [array.reshape(-1, *array.shape[len(shape) :]) for array in given]
            cars = zip(*(array.tolist() for array in given), strict=True)
            fades = [False] * math.prod(shape) if unseen is None else unseen.reshape(-1).tolist()
            found = [
                self._one(x, P, z, angle, push, weight, fading, threshold)
                for (x, P, z, angle, push, weight), fading in zip(cars, fades, strict=True)
            ]
            table, used = np.array([row for row, _ in found]).reshape(*shape, 24), np.array([good for _, good in found])
        else:
            fading = unseen is not None and bool(unseen)
            mean, spread, turned = self._mean.tolist(), self._spread.tolist(), steer.item()
            row, good = self._one(mean, spread, y.tolist(), turned, force.tolist(), load.tolist(), fading, threshold)
            table, used = np.array(row), np.array(good)
        self._mean, self._spread = table[..., 12:15], table[..., 15:].reshape(*shape, 3, 3)
        return table, used.reshape(*shape, 3)

    def _one(
        self,
        x: _Row,
        P: list[_Row],
        y: _Row,
        steer: float,
        force: _Row,
        load: _Row,
        fading: bool,
        threshold: float | None,
    ) -> tuple[_Row, list[bool]]:
        """One car: what `step` returns, then the new state and covariance (24); and which channels were used."""
        fade, (q1, q2, q3) = (self.fade, self._unseen) if fading else (1.0, self._seen)
        x1, x2, x3 = fade * x[0], fade * x[1], fade * x[2]
        square = fade * fade
        (p11, _, _), (p21, p22, _), (p31, p32, p33) = P
        p11, p21, p31 = square * p11 + q1, square * p21, square * p31
        p22, p32, p33 = square * p22 + q2, square * p32, square * p33 + q3

        rows, offset = planar_entries(self.vehicle, math.sin(steer), math.cos(steer), *force)
        a1, b1, b2, c1, c2, c3 = (KILO * entry for entry in rows)
        e1 = 2.0 * left_share(load[0], load[1]) - 1.0
        nu = [
            y[0] - offset[0] - a1 * x1,
            y[1] - offset[1] - b1 * x1 - b2 * x2,
            y[2] - offset[2] - c1 * x1 - c2 * x2 - c3 * x3,
            -e1 * x1 - x3,
        ]
        used = [-LIMIT <= value <= LIMIT for value in nu]
        if threshold is not None:
            spread = (
                a1 * p11 * a1,
                b1 * (p11 * b1 + 2.0 * p21 * b2) + b2 * p22 * b2,
                c1 * (p11 * c1 + 2.0 * (p21 * c2 + p31 * c3)) + c2 * (p22 * c2 + 2.0 * p32 * c3) + c3 * p33 * c3,
                e1 * (p11 * e1 + 2.0 * p31) + p33,
            )
            for i, noise in enumerate(self.noise):
                used[i] = used[i] and nu[i] * nu[i] <= threshold * (spread[i] + noise)
        wa, wb, wc, we = (1.0 / noise if good else 0.0 for noise, good in zip(self.noise, used, strict=True))
        ta, tb, tc, te = (w * value if good else 0.0 for w, value, good in zip((wa, wb, wc, we), nu, used, strict=True))
        p11, p21, p22, p31, p32, p33 = informed(
            (p11, p21, p22, p31, p32, p33),
            (
                wa * a1 * a1 + wb * b1 * b1 + wc * c1 * c1 + we * e1 * e1,
                wb * b1 * b2 + wc * c1 * c2,
                wb * b2 * b2 + wc * c2 * c2,
                wc * c1 * c3 + we * e1,
                wc * c2 * c3,
                wc * c3 * c3 + we,
            ),
        )
        t1, t2, t3 = ta * a1 + tb * b1 + tc * c1 + te * e1, tb * b2 + tc * c2, tc * c3 + te
        x1 += p11 * t1 + p21 * t2 + p31 * t3
        x2 += p21 * t1 + p22 * t2 + p32 * t3
        x3 += p31 * t1 + p32 * t2 + p33 * t3
        if not -LIMIT < abs(x1) + abs(x2) + abs(x3) < LIMIT:
            raise EstimatorError("the correction is not finite; check the accelerations and forces")
        front, back, difference = KILO * x1, KILO * x2, KILO * x3
        left = left_share(load[2], load[3]) * back
        outputs = [value if -LIMIT <= value <= LIMIT else math.nan for value in nu[:3]]
        return [
            *(front, back, 0.5 * (front - difference), 0.5 * (front + difference), left, back - left),
            *(KILO * math.sqrt(p11), KILO * math.sqrt(p22), KILO * math.sqrt(p33)),
            *(*outputs, x1, x2, x3, p11, p21, p31, p21, p22, p32, p31, p32, p33),
        ], used[:3]


def left_share(left: float, right: float) -> float:
    """Share of an axle's load on its left wheel; a half where it carries nothing."""
    both = left + right
    return left / both if both > 0 else 0.5
