"""Piecewise linear interpolation over one parameter, and multilinear over several, with their lookup prepared once."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from estimators.arrays import FloatArray, IndexArray

_MOST_BUCKETS = 65536


class PiecewiseLinear:
    """v(p) = v_i + s_i (p - b_i) on [b_i, b_i+1], for k values at once.

    The coefficients of segment i are one column of `rows`: b_i, then the k values, then the k slopes. A last column
    with slope zero starts at the last breakpoint, so that every stored value is returned as it is stored.

    Segments are found in constant time: uniform buckets no wider than the narrowest segment hold one breakpoint at
    most, so the segment at the left edge of a bucket is right or one too low. (A binary search costs 40 ns an entry
    on unsorted parameters, most of it mispredicted branches.)

    Args:
        breakpoints: (n,), strictly increasing, n >= 2.
        values: (n, k).
    """

    def __init__(self, breakpoints: FloatArray, values: FloatArray) -> None:
        count = values.shape[1]
        gaps = np.diff(breakpoints)
        self.rows: FloatArray = np.zeros((1 + 2 * count, len(breakpoints)))
        self.rows[0] = breakpoints
        self.rows[1 : 1 + count] = values.T
        self.rows[1 + count :, :-1] = (np.diff(values, axis=0) / gaps[:, None]).T
        columns = self.rows.T.tolist()
        self.columns = [(row[0], list(zip(row[1 : 1 + count], row[1 + count :], strict=True))) for row in columns]
        self.upper: FloatArray = np.append(breakpoints[1:], np.inf)
        self.inner: list[float] = breakpoints[1:].tolist()
        self.low = float(breakpoints[0])
        span = float(breakpoints[-1]) - self.low
        buckets = int(min(np.ceil(span / gaps.min()), _MOST_BUCKETS))
        self.searched = buckets == _MOST_BUCKETS  # breakpoints nearly coincide: search instead
        self.scale = buckets / span
        edges = self.low + np.arange(buckets + 1) / self.scale
        self.first: IndexArray = np.searchsorted(self.inner, edges, "right")

    def __call__(self, parameter: FloatArray) -> FloatArray:
        """The values at `parameter` (m,), which must lie in the range, shape (k, m)."""
        if self.searched:
            segment = self.upper.searchsorted(parameter, "right")
        else:
            segment = self.first.take(((parameter - self.low) * self.scale).astype(np.intp), mode="clip")
            segment += parameter >= self.upper.take(segment, mode="clip")
        found = self.rows.take(segment, 1, mode="clip")
        count = len(found) // 2
        out: FloatArray = found[1 + count :] * (parameter - found[0]) + found[1 : 1 + count]
        return out

    def at(self, parameter: float) -> list[float]:
        """The k values at one parameter."""
        start, pairs = self.columns[bisect_right(self.inner, parameter)]
        offset = parameter - start
        return [value + slope * offset for value, slope in pairs]


class Multilinear:
    """v(p) on a rectilinear grid: in every cell the sum over its corners of the value there times products of (1 - w) or w.

    A stored value is returned as it is stored (w is 0 or 1 there, exactly).

    Args:
        grid: breakpoints (b_i,) of each parameter, strictly increasing, two at least.
        table: (b_1, .., b_p, ...).
    """

    def __init__(self, grid: Sequence[FloatArray], table: FloatArray) -> None:
        self.grid = [np.ascontiguousarray(line) for line in grid]
        self.inner = [line[1:-1] for line in self.grid]
        counts = [len(line) for line in grid]
        self.strides = [int(np.prod(counts[axis + 1 :])) for axis in range(len(counts))]
        self.shape = table.shape[len(grid) :]
        self.rows: FloatArray = np.ascontiguousarray(table.reshape(int(np.prod(counts)), -1))

    def __call__(self, parameters: FloatArray) -> FloatArray:
        """Values at `parameters` (m, p), each in its range; shape (m, ...)."""
        places: IndexArray = np.zeros((1, len(parameters)), dtype=np.intp)
        weights: FloatArray = np.ones((1, len(parameters)))
        for axis, (line, inner, stride) in enumerate(zip(self.grid, self.inner, self.strides, strict=True)):
            value = parameters[:, axis]
            low = inner.searchsorted(value, "right")
            start = line.take(low)
            share = (value - start) / (line.take(low + 1) - start)
            places = np.concatenate([places + low * stride, places + (low + 1) * stride])
            weights = np.concatenate([weights * (1.0 - share), weights * share])
        found = weights[0][:, None] * self.rows.take(places[0], 0)
        for place, weight in zip(places[1:], weights[1:], strict=True):
            found += weight[:, None] * self.rows.take(place, 0)
        return np.asarray(found.reshape(len(parameters), *self.shape))
