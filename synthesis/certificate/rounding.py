"""Numbers that leave the solver, cut to the digits that a proof needs: the rest differs from machine to machine."""

from __future__ import annotations

import numpy as np
from flint import fmpq_mat

from estimators.arrays import FloatArray
from synthesis.polynomials.chebyshev import from_chebyshev, to_chebyshev
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import as_float, decimal, rational

LYAPUNOV_DIGITS = 8  # of P, relative to its largest value in each entry's own units
LEVEL_DIGITS = 4


def rounded_lyapunov(
    coefficients: FloatArray, scale: FloatArray, parameters: int, digits: int = LYAPUNOV_DIGITS
) -> PolynomialMatrix:
    """diag(scale) P diag(scale), exactly symmetric, with Chebyshev coefficients of few decimals.

    `coefficients` (d_1+1, ..., 1, ..., n, n) are those of powers of (u, r).
    """
    array = coefficients.reshape(*coefficients.shape[:parameters], *coefficients.shape[-2:])
    n = array.shape[-1]
    powers = {
        index: fmpq_mat([[rational(float(0.5 * (x + y))) for x, y in zip(row, column, strict=True)]
                         for row, column in zip(array[index], array[index].T, strict=True)])
        for index in np.ndindex(*array.shape[:parameters])
    }  # fmt: skip
    chebyshev = to_chebyshev(PolynomialMatrix(powers, (n, n), parameters))
    largest = max(abs(float(array.max(initial=0.0))), abs(float(array.min(initial=0.0)))) or 1.0
    unit = np.outer(scale, scale) * largest
    terms = {}
    for index, entries in chebyshev.terms.items():
        rows = [
            [decimal(significant(as_float(x) * scale[i] * scale[j], unit[i, j], digits)) for j, x in enumerate(row)]
            for i, row in enumerate(entries.tolist())
        ]
        if any(x != 0 for row in rows for x in row):
            terms[index] = fmpq_mat(rows)
    return from_chebyshev(PolynomialMatrix(terms, (n, n), parameters))


def significant(value: float, largest: float, digits: int = LYAPUNOV_DIGITS) -> float:
    """The value to so many digits of `largest`, as the decimal that is written."""
    if not largest > 0.0:
        return 0.0
    places = digits - 1 - int(np.floor(np.log10(largest)))
    return float(f"{value:.{places}f}") if places >= 0 else float(round(value, places))


def round_up(value: float, digits: int = LEVEL_DIGITS) -> float:
    """Up to so many significant digits, so that a printed bound is a bound."""
    step = 10.0 ** (np.floor(np.log10(value)) - digits + 1)
    return float(f"{np.ceil(value / step) * step:.{digits}g}")


def round_down(value: float, digits: int = LEVEL_DIGITS) -> float:
    """Down to so many significant digits; zero for what is not positive."""
    if not value > 0.0:
        return 0.0
    step = 10.0 ** (np.floor(np.log10(value)) - digits + 1)
    return float(f"{np.floor(value / step) * step:.{digits}g}")
