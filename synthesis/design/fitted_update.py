"""The plant over a sample as polynomials in the parameters, for a design in discrete time."""

from __future__ import annotations

from itertools import product

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError
from synthesis.models.discretise import zero_order_hold
from synthesis.models.lpv import LpvModel

FIT = 1e-10  # relative
DEGREES = (4, 8, 12, 16, 24)


def fitted_update(model: LpvModel, scale: FloatArray, period: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """e^(TA), T phi(TA) B and T phi(TA) E in the states diag(scale) x, as polynomials in u, fitted to 1e-10.

    Coefficients (d_1+1, ..., d_p+1, rows, columns). What comes out of a design is proved for the exact matrices. Raises
    ProblemError for a rational model.
    """
    if not model.polynomial.is_polynomial:
        raise ProblemError(f"model '{model.name}' is rational; a sampled design takes polynomial models")
    n, inputs = len(model.states), len(model.inputs)
    for degree in DEGREES:
        nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        count = len(model.parameters)
        points = np.array(list(product(nodes, repeat=count))).reshape(len(nodes) ** count, count)
        middle, half = (np.array([getattr(p, key) for p in model.parameters]) for key in ("middle", "half_width"))
        numeric = model.on(middle + half * points)
        driven = np.concatenate([numeric.B, numeric.E], axis=-1)
        values = np.concatenate(
            zero_order_hold(numeric.A * scale[:, None] / scale, driven * scale[:, None], period), axis=-1
        )
        series = values.reshape(*(len(nodes),) * count, *values.shape[1:])
        inverse = np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, degree))
        for axis in range(count):
            series = np.moveaxis(np.tensordot(inverse, series, axes=(1, axis)), 0, axis)
        size = np.abs(series).max()
        tail = max((np.abs(np.take(series, -1, axis=axis)).max() for axis in range(count)), default=0.0)
        if tail <= FIT * size:
            break
    powers = np.zeros((degree + 1, degree + 1))
    for k in range(degree + 1):
        column = np.polynomial.chebyshev.cheb2poly(np.eye(degree + 1)[k])
        powers[: len(column), k] = column
    for axis in range(count):
        series = np.moveaxis(np.tensordot(powers, series, axes=(1, axis)), 0, axis)
    return series[..., :n], series[..., n : n + inputs], series[..., n + inputs :]
