"""Intervals from seeds: growth factors and crossings of 1, by the jackknife over seeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from synthesis.polynomials.matrix import FloatArray


@dataclass(frozen=True)
class Interval:
    """An estimate with the ends of its interval."""

    value: float
    low: float
    high: float

    def holds(self, expected: float) -> bool:
        """Whether the interval contains `expected` (never for NaN)."""
        return self.low <= expected <= self.high


def crossing(places: FloatArray, growth: FloatArray) -> FloatArray:
    """Where the parabola through three equally spaced places (3,) with log growths (..., 3) rises through 0; NaN if nowhere."""
    middle, step = places[1], places[2] - places[1]
    c = growth[..., 1]
    b = 0.5 * (growth[..., 2] - growth[..., 0])
    a = 0.5 * (growth[..., 2] + growth[..., 0]) - c
    with np.errstate(invalid="ignore", divide="ignore"):
        rise = np.sqrt(b * b - 4.0 * a * c)
        return np.asarray(middle + step * np.where(b + rise > 0.0, -2.0 * c / (b + rise), np.nan))


def interval(growth: FloatArray, steps: int, measure: Callable[[FloatArray], FloatArray], level: float) -> Interval:
    """`measure` of the log growths per sample (..., c) as a number, with a Student interval of the jackknife over seeds.

    `growth` (c, seeds) is the log of the growth of E h over `steps` samples, as each seed sees it. The mean over seeds is
    taken of the growth itself, which the simulation estimates without bias. `level` is the probability that the
    interval misses.
    """
    top = growth.max(axis=-1, keepdims=True)
    scaled = np.exp(growth - top)
    n = scaled.shape[-1]
    total = scaled.sum(axis=-1, keepdims=True)
    whole, left_out = (np.moveaxis((np.log(m) + top) / steps, 0, -1) for m in (total / n, (total - scaled) / (n - 1)))
    value = float(measure(whole)[0])
    parts = measure(left_out)
    error = float(np.sqrt((n - 1) / n * ((parts - parts.mean()) ** 2).sum()))
    half = float(student.ppf(1.0 - 0.5 * level, n - 1)) * error
    return Interval(value, value - half, value + half)
