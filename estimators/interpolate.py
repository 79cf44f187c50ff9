"""Piecewise linear interpolation over one parameter, with slopes and segment lookup prepared once."""

from __future__ import annotations

from bisect import bisect_right

import numpy as np

from estimators.arrays import BoolArray, FloatArray, IndexArray

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
        self.columns: list[list[float]] = self.rows.T.tolist()
        self.upper: FloatArray = np.append(breakpoints[1:], np.inf)
        self.inner: list[float] = breakpoints[1:].tolist()
        self.low = float(breakpoints[0])
        span = float(breakpoints[-1]) - self.low
        buckets = int(min(np.ceil(span / gaps.min()), _MOST_BUCKETS))
        self.searched = buckets == _MOST_BUCKETS  # breakpoints nearly coincide: search instead
        self.scale = buckets / span
        edges = self.low + np.arange(buckets + 1) / self.scale
        self.first: IndexArray = np.searchsorted(self.inner, edges, "right")

    def workspace(self, count: int) -> tuple[FloatArray, IndexArray, BoolArray]:
        """Scratch memory for `into` with `count` parameters."""
        return np.empty((self.rows.shape[0], count)), np.empty(count, dtype=np.intp), np.empty(count, dtype=np.bool_)

    def into(
        self,
        parameter: FloatArray,
        workspace: tuple[FloatArray, IndexArray, BoolArray],
        out: FloatArray,
    ) -> None:
        """Writes the values at `parameter` (m,), which must lie in the range, to `out` (k, m)."""
        gathered, segment, above = workspace
        offset, count = gathered[0], out.shape[0]
        if self.searched:
            segment[:] = self.upper.searchsorted(parameter, "right")
        else:
            np.subtract(parameter, self.low, offset)
            np.multiply(offset, self.scale, offset)
            np.copyto(segment, offset, casting="unsafe")
            self.first.take(segment, None, segment, "clip")
            self.upper.take(segment, None, offset, "clip")
            np.greater_equal(parameter, offset, above)
            np.add(segment, above, segment)
        self.rows.take(segment, 1, gathered, "clip")
        np.subtract(parameter, offset, offset)
        np.multiply(gathered[1 + count :], offset, out)
        np.add(out, gathered[1 : 1 + count], out)

    def __call__(self, parameter: FloatArray) -> FloatArray:
        """The values at `parameter` (m,), shape (k, m)."""
        out = np.empty(((self.rows.shape[0] - 1) // 2, parameter.size))
        self.into(parameter, self.workspace(parameter.size), out)
        return out

    def column(self, parameter: float) -> list[float]:
        """p - b_i, the k values v_i and the k slopes s_i of the segment of one parameter."""
        found = self.columns[bisect_right(self.inner, parameter)]
        return [parameter - found[0], *found[1:]]
