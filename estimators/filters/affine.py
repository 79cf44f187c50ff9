"""What a function can tell an unscented filter about itself: from which state on it is affine, and how."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from estimators.arrays import FloatArray

SlopeFunction = Callable[[FloatArray, FloatArray], FloatArray]


class Affine(NamedTuple):
    """f(x + d) = f(x) + slope(x, d) for every d that moves the states from `start` on alone.

    Columns of a triangular factor that begin at `start` are such d. They need neither a pair of sigma points nor a
    value of f, and the result is the same to round-off. Whether f is affine there is not checked.
    """

    start: int  # 0: everywhere
    slope: SlopeFunction  # x (..., n), d (count, ..., n) -> (count, ..., rows), linear in d
