"""Sums of products of arrays to the last digits, with the rounding errors of sums and products [Dekker1971]."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray


def determinant(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """a d - b c of arrays, to the last digits even where the products cancel."""
    return expanded(a, b, c, d, 0, 0)


def expanded(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, one: int, trace: int) -> FloatArray:
    """one + trace (a + d) + a d - b c of arrays."""
    first, first_error = _product(a, d)
    second, second_error = _product(-b, c)
    total, error = _sum(first, second)
    error = error + (first_error + second_error)
    if one or trace:
        for term in (trace * a, trace * d, np.full_like(a, float(one))) if trace else (np.full_like(a, float(one)),):
            total, more = _sum(total, term)
            error = error + more
    return total + error


def _sum(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    total = x + y
    part = total - x
    return total, (x - (total - part)) + (y - part)


def _product(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    product = x * y
    x_high, y_high = _head(x), _head(y)
    x_low, y_low = x - x_high, y - y_high
    error = x_low * y_low - (((product - x_high * y_high) - x_low * y_high) - x_high * y_low)
    return product, np.where(np.isfinite(error), error, 0.0)


def _head(x: FloatArray) -> FloatArray:
    """The upper half of the digits."""
    scaled = 134217729.0 * x  # 2^27 + 1
    return scaled - (scaled - x)
