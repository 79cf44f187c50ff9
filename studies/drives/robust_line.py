"""The slope of one signal over another, found so that a few wild samples do not move it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import BoolArray, FloatArray, IntArray

MOST_POINTS = 300  # pairs of points grow with the square
FEWEST_POINTS = 12
LEAST_QUALITY = 0.8
ANCHORED = 4.0
"""Multiple of ``moves`` that a signal which never changes must reach to be compared with zero instead."""


@dataclass(frozen=True)
class Line:
    """y = a + slope x over ``points`` samples; ``quality`` is 1 on a line and 0 for unrelated signals.

    ``anchored``: x hardly changes, so the line is taken through the origin, and an offset of y is in its slope.
    """

    slope: float
    quality: float
    points: int
    anchored: bool = False

    @property
    def clear(self) -> bool:
        """Whether the two signals follow one another closely enough to compare sign and size."""
        return self.quality >= LEAST_QUALITY


def robust_line(x: FloatArray, y: FloatArray, moves: float) -> Line | None:
    """The line through (n,) samples; None where neither leaves its median by ``moves``, in the unit of y, often enough to tell.

    The slope is the median of the slopes of all pairs (Theil 1950, Sen 1968), weighted by |x_i - x_j| (Jaeckel 1972): offsets
    drop out, pairs that are close say little, and outliers are borne while less than half of the weight has one. It is taken of
    y over x and of x over y; their geometric mean is the slope, and their ratio the quality, a robust r^2.
    """
    good = np.isfinite(x) & np.isfinite(y)
    x, y = x[good], y[good]
    far = _far(x, moves) | _far(y, moves)
    anchored = bool(np.count_nonzero(far) < FEWEST_POINTS)
    if anchored:
        far = np.maximum(np.abs(x), np.abs(y)) > ANCHORED * moves
        if np.count_nonzero(far) < FEWEST_POINTS:
            return None
        origin = np.zeros(np.count_nonzero(far))
        x, y, far = np.append(x[far], origin), np.append(y[far], origin), np.arange(2 * origin.size) < origin.size
    keep = np.concatenate([_spread(np.flatnonzero(far)), _spread(np.flatnonzero(~far))])
    x, y = x[keep], y[keep]
    up, across = _slope(x, y), _slope(y, x)
    if up * across <= 0.0:
        return Line(0.0, 0.0, x.size, anchored)
    quality = min(up * across, 1.0 / (up * across))
    return Line(float(np.sign(up) * np.sqrt(up / across)), float(quality), x.size, anchored)


def _far(value: FloatArray, moves: float) -> BoolArray:
    return np.asarray(np.abs(value - np.median(value)) > moves) if value.size else np.zeros(0, dtype=np.bool_)


def _spread(rows: IntArray) -> IntArray:
    """At most half of the points, evenly."""
    most = MOST_POINTS // 2
    return rows if rows.size <= most else rows[np.linspace(0, rows.size - 1, most).astype(np.int64)]


def _slope(x: FloatArray, y: FloatArray) -> float:
    first, second = np.triu_indices(x.size, 1)
    dx, dy = x[second] - x[first], y[second] - y[first]
    pairs = dx != 0.0
    slopes, weight = dy[pairs] / dx[pairs], np.abs(dx[pairs])
    order = np.argsort(slopes)
    total = np.cumsum(weight[order])
    return float(slopes[order][np.searchsorted(total, 0.5 * total[-1])]) if total.size else 0.0
