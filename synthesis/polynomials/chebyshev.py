"""Exact change between powers and Chebyshev polynomials, T_0 = 1, T_1 = u, T_k+1 = 2 u T_k - T_k-1, on [-1, 1]^p.

Chebyshev coefficients are how polynomials are stored: whatever the degree, a coefficient that is off by x moves the value by at
most x. Powers are how they are multiplied.
"""

from __future__ import annotations

from functools import cache
from math import comb

from flint import fmpq

from synthesis.polynomials.enclosure import PolynomialMatrix


def to_chebyshev(matrix: PolynomialMatrix) -> PolynomialMatrix:
    """The coefficients of T_i(u_1) T_j(u_2) ... by their orders (i, j, ...), from those of powers."""
    return _changed(matrix, _power)


def from_chebyshev(matrix: PolynomialMatrix) -> PolynomialMatrix:
    """Back to powers."""
    return _changed(matrix, _chebyshev)


def _changed(matrix: PolynomialMatrix, column: object) -> PolynomialMatrix:
    for axis in range(matrix.variables):
        terms: dict[tuple[int, ...], object] = {}
        for powers, entries in matrix.terms.items():
            for k, weight in enumerate(column(powers[axis])):  # type: ignore[operator]
                if weight != 0:
                    place = (*powers[:axis], k, *powers[axis + 1 :])
                    terms[place] = terms[place] + entries * weight if place in terms else entries * weight
        matrix = PolynomialMatrix(terms, matrix.shape, matrix.variables)
    return matrix


@cache
def _power(n: int) -> tuple[fmpq, ...]:
    """u^n in Chebyshev polynomials: 2^(1-n) times binomial coefficients, the one of T_0 halved."""
    out = [fmpq(0)] * (n + 1)
    for k in range(n // 2 + 1):
        order = n - 2 * k
        out[order] = fmpq(comb(n, k), 2**n) * (1 if order == 0 else 2)
    return tuple(out)


@cache
def _chebyshev(n: int) -> tuple[fmpq, ...]:
    """T_n in powers."""
    before, here = [fmpq(1)], [fmpq(0), fmpq(1)]
    if n == 0:
        return tuple(before)
    for _ in range(n - 1):
        after = [fmpq(0), *(2 * c for c in here)]
        for k, c in enumerate(before):
            after[k] -= c
        before, here = here, after
    return tuple(here)
