"""The plant of a schedule in float64: Chebyshev polynomials of the scaled parameters, evaluated as they were proved."""

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

    @property
    def largest(self) -> FloatArray:
        """Bounds (rows, columns) of |M(p)| on the whole range, entry by entry."""
        return np.asarray(np.abs(self.coefficients).sum(axis=0))


class PlantPolynomials(NamedTuple):
    """M(p) = sum over (i, j, ..) of coefficients[i, j, ..] T_i(u_1) T_j(u_2) .., u = (p - middle) / half of every parameter."""

    middle: FloatArray  # (parameters,)
    half: FloatArray
    coefficients: FloatArray  # (orders of each parameter, rows, columns)

    def at(self, parameter: FloatArray) -> FloatArray:
        """M(p) of parameters (..., parameters), shape (..., rows, columns)."""
        u = (np.asarray(parameter) - self.middle) / self.half
        lead, shape = u.shape[:-1], self.coefficients.shape[-2:]
        basis = chebyshev(u.reshape(-1, u.shape[-1]), self.coefficients.shape[:-2])
        flat = self.coefficients.reshape(basis.shape[1], shape[0] * shape[1])
        return np.asarray((basis @ flat).reshape(*lead, *shape))

    @property
    def largest(self) -> FloatArray:
        """Bounds (rows, columns) of |M(p)| on the whole range, entry by entry."""
        return np.asarray(np.abs(self.coefficients).sum(axis=tuple(range(self.coefficients.ndim - 2))))


def chebyshev(u: FloatArray, sizes: Sequence[int]) -> FloatArray:
    """T_i(u_1) T_j(u_2) .. at (g, parameters): array (g, number of products), the last parameter's order running fastest."""
    found: FloatArray = np.ones((len(u), 1))
    for axis, size in enumerate(sizes):
        single = np.empty((len(u), size))
        single[:, 0] = 1.0
        if size > 1:
            single[:, 1] = u[:, axis]
        for k in range(2, size):
            single[:, k] = 2.0 * u[:, axis] * single[:, k - 1] - single[:, k - 2]
        found = (found[:, :, None] * single[:, None]).reshape(len(u), -1)
    return found


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


def plant_of(
    stored: Mapping[str, Any], ranges: Sequence[tuple[float, float]], shape: Sequence[int]
) -> PlantPolynomial | PlantPolynomials:
    """From the stored form; with one parameter the form that two-state observers unroll."""
    if len(ranges) == 1:
        return plant_polynomial(stored, *ranges[0], shape)
    orders = [max((order[i] for order in stored["orders"]), default=0) for i in range(len(ranges))]
    coefficients = np.zeros((*(order + 1 for order in orders), *shape))
    for order, matrix in zip(stored["orders"], stored["coefficients"], strict=True):
        coefficients[tuple(order)] = np.array(matrix, dtype=np.float64).reshape(shape)
    coefficients.flags.writeable = False
    middle, half = np.array([scaling(low, high) for low, high in ranges]).T
    return PlantPolynomials(middle, half, coefficients)
