"""The plant of a schedule in float64: Chebyshev polynomials of the scaled parameter, evaluated as they were proved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from estimators.arrays import FloatArray


class PlantPolynomial(NamedTuple):
    """M(p) = sum over k of coefficients[k] T_k(u), u = (p - middle) / half in [-1, 1]."""

    middle: float
    half: float
    coefficients: FloatArray  # (orders, rows, columns)

    def at(self, parameter: FloatArray) -> FloatArray:
        """M(p), shape (*parameter.shape, rows, columns)."""
        u = np.asarray((parameter - self.middle) / self.half)[..., None, None]
        later, here = np.zeros((2, *u.shape[:-2], *self.coefficients.shape[1:]))
        for coefficient in self.coefficients[:0:-1]:  # Clenshaw
            later, here = here, coefficient + 2.0 * u * here - later
        first = self.coefficients[0] if len(self.coefficients) else 0.0
        return np.asarray(first + u * here - later)


def scaling(low: float, high: float) -> tuple[float, float]:
    """Middle and half width of a range, correctly rounded from the decimals that are written."""
    first, last = Fraction(repr(float(low))), Fraction(repr(float(high)))
    return float((first + last) / 2), float((last - first) / 2)


def plant_polynomial(stored: Mapping[str, Any], low: float, high: float, shape: Sequence[int]) -> PlantPolynomial:
    """From the stored form of one parameter."""
    highest = max((order for (order,) in stored["orders"]), default=-1)
    coefficients = np.zeros((highest + 1, *shape))
    for (order,), matrix in zip(stored["orders"], stored["coefficients"], strict=True):
        coefficients[order] = np.array(matrix, dtype=np.float64).reshape(shape)
    coefficients.flags.writeable = False
    return PlantPolynomial(*scaling(low, high), coefficients)
