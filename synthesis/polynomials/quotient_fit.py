"""A polynomial near a quotient, from its values at Chebyshev nodes: only a guess, whose remainder is bounded by who takes it."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import chebyshev as series

from estimators.arrays import FloatArray
from synthesis.polynomials.boxes import orders


@cache
def nodes(variables: int, highest: int) -> FloatArray:
    """Tensor Chebyshev nodes (n, variables) in [-1, 1]^v that a polynomial of the degree `highest` is fitted on."""
    line = np.cos(np.pi * (np.arange(highest + 1) + 0.5) / (highest + 1))
    grid = np.meshgrid(*([line] * variables), indexing="ij") if variables else []
    return np.stack(grid, axis=-1).reshape(-1, variables) if variables else np.zeros((1, 0))


def monomials(points: FloatArray, powers: tuple[tuple[int, ...], ...]) -> FloatArray:
    """t^k at points (n, v): array (n, number of powers)."""
    exponents = np.array(powers, dtype=float).reshape(len(powers), points.shape[1])
    return np.asarray((points[:, None] ** exponents).prod(axis=-1))


@cache
def fit(variables: int, highest: int) -> FloatArray:
    """Matrix from values at the `nodes` to coefficients of the monomials `orders(variables, highest).powers`.

    Interpolation in Chebyshev polynomials, those of a total degree above `highest` left out.
    """
    powers = orders(variables, highest).powers
    line = np.cos(np.pi * (np.arange(highest + 1) + 0.5) / (highest + 1))
    inverse = np.linalg.inv(series.chebvander(line, highest))
    to_powers = np.zeros((highest + 1, highest + 1))
    for k in range(highest + 1):
        column = series.cheb2poly(np.eye(highest + 1)[k])
        to_powers[: len(column), k] = column
    coefficients = np.ones((len(powers), 1))
    change = np.ones((len(powers), len(powers)))
    chosen = np.array(powers, dtype=int).reshape(len(powers), variables)
    for axis in range(variables):
        coefficients = (coefficients[:, :, None] * inverse[chosen[:, axis]][:, None]).reshape(len(powers), -1)
        change = change * to_powers[chosen[:, axis][:, None], chosen[:, axis]]
    return np.asarray(change @ coefficients)


@cache
def to_chebyshev(variables: int, highest: int) -> FloatArray:
    """Matrix from coefficients of the monomials `orders(variables, highest).powers` to those of Chebyshev products.

    Entries are at most one and the entries of a column add up to one.
    """
    powers = np.array(orders(variables, highest).powers, dtype=int).reshape(-1, variables)
    single = np.zeros((highest + 1, highest + 1))
    for k in range(highest + 1):
        column = series.poly2cheb(np.eye(highest + 1)[k])
        single[: len(column), k] = column
    found = np.ones((len(powers), len(powers)))
    for axis in range(variables):
        found = found * single[powers[:, axis][:, None], powers[:, axis]]
    return found
