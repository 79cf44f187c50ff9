"""Tensor Chebyshev polynomials through tables on rectilinear grids, and what they leave over; float64 arrays only."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, product
from math import comb

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from estimators.arrays import FloatArray

PARTS = 4
DIGITS = 12  # of coefficients, of the largest one of each entry: what is rounded away is part of the residual


def fitted(lines: Sequence[FloatArray], values: FloatArray, degrees: Sequence[int]) -> FloatArray:
    """Least squares on the grid of `lines` (u_1,) .. (u_p,) in [-1, 1]: values (g_1, .., g_p, rows, columns) to coefficients.

    The basis is T_i(u_1) T_j(u_2) ..; on a full grid the least squares of the product are those of the axes, one after another.
    """
    for axis, (line, degree) in enumerate(zip(lines, degrees, strict=True)):
        solve = np.linalg.pinv(chebvander(line, degree))
        values = np.moveaxis(np.tensordot(solve, values, axes=(1, axis)), 0, axis)
    return rounded(values, len(lines))


def rounded(coefficients: FloatArray, parameters: int) -> FloatArray:
    """Coefficients as short decimals."""
    size = (
        np.abs(coefficients).max(axis=tuple(range(parameters)), keepdims=True) if parameters else np.abs(coefficients)
    )
    exponent = np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
    step = 10.0 ** (DIGITS - 1 - exponent)
    return np.asarray(np.round(coefficients * step) / step)


def on_grid(coefficients: FloatArray, lines: Sequence[FloatArray]) -> FloatArray:
    """Values (g_1, .., g_p, rows, columns) on the grid of `lines`."""
    for axis, line in enumerate(lines):
        basis = chebvander(line, coefficients.shape[axis] - 1)
        coefficients = np.moveaxis(np.tensordot(basis, coefficients, axes=(1, axis)), 0, axis)
    return coefficients


def at_points(coefficients: FloatArray, lines: Sequence[FloatArray], values: FloatArray) -> FloatArray:
    """The largest residual of every entry at the grid points, (rows, columns)."""
    return np.asarray(np.abs(on_grid(coefficients, lines) - values).max(axis=tuple(range(len(lines)))))


def between_points(coefficients: FloatArray, lines: Sequence[FloatArray], values: FloatArray) -> FloatArray:
    """A bound on the residual of every entry over the whole box, the plant being multilinear between the grid points.

    On each part of a cell the residual is a polynomial, and none is larger than the largest of its Bernstein coefficients.
    """
    count = len(lines)
    lines, values = _finer(lines, values)
    sizes = [max(n, 2) for n in coefficients.shape[:count]]  # nodes on each axis of a cell
    inverse = [np.linalg.inv(_bernstein(n)) for n in sizes]
    worst = np.zeros(values.shape[count:])
    for cell in product(*(range(len(line) - 1) for line in lines)):
        corner = values[tuple(slice(k, k + 2) for k in cell)]
        nodes = [_nodes(*list(pairwise(line))[k], n) for line, k, n in zip(lines, cell, sizes, strict=True)]
        found = on_grid(coefficients, nodes)
        for axis, n in enumerate(sizes):
            share = np.linspace(0.0, 1.0, n)
            corner = np.moveaxis(np.tensordot(np.stack([1.0 - share, share], -1), corner, axes=(1, axis)), 0, axis)
        residual = found - corner
        for axis, matrix in enumerate(inverse):
            residual = np.moveaxis(np.tensordot(matrix, residual, axes=(1, axis)), 0, axis)
        worst = np.maximum(worst, np.abs(residual).max(axis=tuple(range(count))))
    return worst


def _finer(lines: Sequence[FloatArray], values: FloatArray) -> tuple[list[FloatArray], FloatArray]:
    """Every cell cut in `PARTS` along every axis: the coefficients of small parts are close to values."""
    fine = []
    for axis, line in enumerate(lines):
        places = np.linspace(0.0, len(line) - 1.0, PARTS * (len(line) - 1) + 1)
        weights = np.maximum(1.0 - np.abs(places[:, None] - np.arange(len(line))), 0.0)
        fine.append(weights @ line)
        values = np.moveaxis(np.tensordot(weights, values, axes=(1, axis)), 0, axis)
    return fine, values


def _nodes(low: float, high: float, count: int) -> FloatArray:
    return np.linspace(low, high, count)


def _bernstein(count: int) -> FloatArray:
    """Bernstein polynomials of degree count - 1 at as many equidistant nodes of [0, 1]."""
    t, d = np.linspace(0.0, 1.0, count), count - 1
    return np.stack([comb(d, k) * t**k * (1.0 - t) ** (d - k) for k in range(count)], axis=-1)
