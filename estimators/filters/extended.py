"""Extended Kalman filter: the model is linearised at the estimate."""

from __future__ import annotations

from collections.abc import Callable

import numpy.typing as npt

from estimators.arrays import BoolArray, FloatArray
from estimators.filters.joseph import CovarianceFilter
from estimators.filters.step import FilterStep, broadcast, numbers, quiet

StateFunction = Callable[[FloatArray], FloatArray]


class ExtendedKalmanFilter(CovarianceFilter):
    """x+ = f(x) + w, y = h(x) + v; f, h and their Jacobians take the states (..., n) of the whole batch.

    >>> kalman = ExtendedKalmanFilter([1.0], [[1.0]])
    >>> step = kalman.correct([4.0], lambda x: x**2, lambda x: 2.0 * x[..., None], [[0.1]])
    >>> round(float(kalman.state[0]), 3)  # on the way to 2
    2.463
    """

    @quiet
    def predict(self, transition: StateFunction, jacobian: StateFunction, Q: npt.ArrayLike) -> BoolArray:
        """xhat = f(xhat), P = F P F' + Q with F = jacobian(xhat) (..., n, n) at the estimate before.

        Returns a mask (...) of the entries that stayed as they were because the prediction was not finite.

        Raises:
            EstimatorError: shapes that do not fit.
        """
        before = self._mean.copy()
        F = numbers(jacobian(before), "jacobian")
        mean = numbers(transition(before), "transition")
        return self._advance(mean, F, Q)

    @quiet
    def correct(
        self,
        y: npt.ArrayLike,
        measurement: StateFunction,
        jacobian: StateFunction,
        R: npt.ArrayLike,
        gate: float | None = None,
    ) -> FilterStep:
        """Corrects with y = h(x) + v, H = jacobian(xhat) (..., m, n); missing channels and gate as `KalmanFilter`.

        Raises:
            EstimatorError: shapes that do not fit, a gate outside (0, 1), H P H' + R singular.
        """
        before = self._mean.copy()
        H = numbers(jacobian(before), "jacobian")
        expected = numbers(measurement(before), "measurement")
        expected = broadcast(expected, (*self.batch_shape, expected.shape[-1]), "predicted measurement")
        return self._correct(y, expected, H, R, gate)
