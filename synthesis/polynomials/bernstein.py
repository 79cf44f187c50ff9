"""Bernstein coefficients on [-1, 1]^v in float64: from powers, and those of both halves of a box."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import numpy as np

from estimators.arrays import FloatArray
from synthesis.polynomials import definite
from synthesis.polynomials.rational import as_float


@cache
def to_bernstein(degree: int) -> FloatArray:
    """Matrix from powers to Bernstein coefficients; exact but for one rounding, and no entry is larger than one."""
    return np.array([[as_float(x) for x in row] for row in definite.to_bernstein(degree)])


def in_bernstein(powers: FloatArray, axes: Iterable[int]) -> FloatArray:
    """Bernstein coefficients in the place of coefficients of powers, along some axes of an array."""
    for axis in axes:
        powers = np.moveaxis(np.tensordot(to_bernstein(powers.shape[axis] - 1), powers, axes=(1, axis)), 0, axis)
    return powers


def halved(coefficients: FloatArray, axis: int) -> tuple[FloatArray, FloatArray]:
    """The Bernstein coefficients of the lower and of the upper half along one axis (de Casteljau): averages, nothing grows."""
    levels = np.moveaxis(coefficients, axis, 0)
    low, high = [levels[0]], [levels[-1]]
    while len(levels) > 1:
        levels = 0.5 * (levels[:-1] + levels[1:])
        low.append(levels[0])
        high.append(levels[-1])
    return np.moveaxis(np.stack(low), 0, axis), np.moveaxis(np.stack(high[::-1]), 0, axis)
