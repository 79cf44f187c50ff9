"""The plant over a sample as polynomials in the parameters, for a design in discrete time."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel
from synthesis.models.numeric import NumericModel

FIT = 1e-10  # relative
LOOSE = 1e-4  # beyond it a fit is none: what comes out is proved anyway, but was designed for another plant
DEGREES = (4, 8, 12, 16, 24)


def fitted_update(model: LpvModel, scale: FloatArray, period: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """e^(TA), T phi(TA) B and T phi(TA) E in the states diag(scale) x, as polynomials in u, fitted to 1e-10 if degree 24 does.

    Coefficients (d_1+1, ..., d_p+1, rows, columns). What comes out of a design is proved for the exact matrices. Raises
    ProblemError for a fit that is worse than 1e-4.
    """
    n, inputs = len(model.states), len(model.inputs)

    def update(at: NumericModel) -> FloatArray:
        driven = np.concatenate([at.B, at.E], axis=-1) * scale[:, None]
        return np.concatenate(zero_order_hold(at.A * scale[:, None] / scale, driven, period), axis=-1)

    series = _fitted(model, update)
    return series[..., :n], series[..., n : n + inputs], series[..., n + inputs :]


def fitted_outputs(model: LpvModel, scale: FloatArray, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """C and F for the states diag(scale) x and outputs over their sizes: of a polynomial model as they are, else fitted."""
    below = sizes[:, None]
    if model.polynomial.is_polynomial:
        scaled = model.polynomial.with_states_scaled(scale)
        return scaled.C / below, scaled.F / below
    series = _fitted(model, lambda at: np.concatenate([at.C / scale, at.F], axis=-1) / below)
    return series[..., : len(model.states)], series[..., len(model.states) :]


def _fitted(model: LpvModel, values: Callable[[NumericModel], FloatArray]) -> FloatArray:
    """Monomial coefficients of the Chebyshev series of least degree that leaves no more than `FIT` of any column.

    Of any column, as each has a unit of its own: the size of an input or a disturbance must not decide how well another is met.
    """
    for degree in DEGREES:
        nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        count = len(model.parameters)
        points = np.array(list(product(nodes, repeat=count))).reshape(len(nodes) ** count, count)
        middle, half = (np.array([getattr(p, key) for p in model.parameters]) for key in ("middle", "half_width"))
        found = values(model.on(middle + half * points))
        series = found.reshape(*(len(nodes),) * count, *found.shape[1:])
        inverse = np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, degree))
        for axis in range(count):
            series = np.moveaxis(np.tensordot(inverse, series, axes=(1, axis)), 0, axis)
        size = np.abs(series).max(axis=tuple(range(count + 1)))
        tails = [np.abs(np.take(series, -1, axis=axis)).max(axis=tuple(range(count))) for axis in range(count)]
        if all((tail <= FIT * size).all() for tail in tails):
            break
    off = max((float((tail / np.where(size > 0.0, size, 1.0)).max()) for tail in tails), default=0.0)
    if off > LOOSE:
        raise ProblemError(
            f"model '{model.name}': no polynomial of degree {DEGREES[-1]} comes close to it over its range "
            f"(off by {off:.1g}); shrink the range"
        )
    powers = np.zeros((degree + 1, degree + 1))
    for k in range(degree + 1):
        column = np.polynomial.chebyshev.cheb2poly(np.eye(degree + 1)[k])
        powers[: len(column), k] = column
    for axis in range(count):
        series = np.moveaxis(np.tensordot(powers, series, axes=(1, axis)), 0, axis)
    return np.asarray(series)
