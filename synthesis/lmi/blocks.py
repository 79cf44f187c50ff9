"""Matrix inequalities stacked for the interior-point method: those of one size and with the same decisions stand together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from estimators.arrays import FloatArray, IndexArray

IN_CACHE = 1 << 17  # numbers that are worked on together


class Blocks:
    """S_j = F_j0 + sum_i x_i F_ji: `fixed` (g, k, k) and `free` (g, k, k, n) for each group, and `columns`, its decisions.

    Of an output feedback one half knows nothing of the other's unknowns, and P > 0 nothing of gains: their zeros are not carried.
    """

    def __init__(self, given: Sequence[FloatArray], margins: Sequence[float] = ()) -> None:
        groups: dict[tuple[int, bytes], list[FloatArray]] = {}
        taken: dict[tuple[int, bytes], list[FloatArray]] = {}
        for block, margin in zip(given, margins or (0.0,) * len(given), strict=True):
            used = block[..., 1:].any(axis=(0, 1, 2))
            key = block.shape[1], used.tobytes()
            groups.setdefault(key, []).append(block)
            taken.setdefault(key, []).append(np.full(len(block), margin))
        ordered = sorted(groups.items(), key=lambda entry: entry[0][0])  # stable: one order for one set of blocks
        self.count = given[0].shape[-1] - 1
        chosen = [np.flatnonzero(np.frombuffer(used, bool)) for (_, used), _ in ordered]
        # A slice where all are used: no copy is made of what is large.
        self.columns = [slice(None) if len(c) == self.count else c for c in chosen]
        stacked = [np.concatenate(blocks) for _, blocks in ordered]
        self.margins = [np.concatenate(taken[key]) for key, _ in ordered]
        self.fixed = [np.ascontiguousarray(block[..., 0]) for block in stacked]
        self.free = [np.ascontiguousarray(b[..., 1:][..., c]) for b, c in zip(stacked, self.columns, strict=True)]
        self.triangles = [triangle_by_rows(size) for (size, _), _ in ordered]
        self.order = sum(part.shape[0] * part.shape[1] for part in self.fixed)

    def linear(self, x: FloatArray) -> list[FloatArray]:
        """sum_i x_i F_i."""
        return [
            (free.reshape(fixed.size, free.shape[-1]) @ x[columns]).reshape(fixed.shape)
            for fixed, free, columns in zip(self.fixed, self.free, self.columns, strict=True)
        ]

    def adjoint(self, Y: Sequence[FloatArray]) -> FloatArray:
        """<F_i, Y> summed over the blocks."""
        total = np.zeros(self.count)
        for free, columns, part in zip(self.free, self.columns, Y, strict=True):
            total[columns] += free.reshape(part.size, free.shape[-1]).T @ part.reshape(-1)
        return total

    def inner(self, Y: Sequence[FloatArray]) -> float:
        """<F_0, Y>."""
        return float(sum(np.vdot(fixed, part) for fixed, part in zip(self.fixed, Y, strict=True)))

    def without_margins(self, Y: Sequence[FloatArray]) -> float:
        """<F_0, Y> of the inequalities before their `margins` were taken off: what dual bounds are about."""
        back = (np.einsum("gii,g->", part, margin) for part, margin in zip(Y, self.margins, strict=True))
        return self.inner(Y) + float(sum(back))

    def flat(self, matrices: Sequence[FloatArray]) -> list[FloatArray]:
        """Scaled triangles, one vector for each group."""
        return [
            (matrix[:, rows, columns] * weights).reshape(-1)
            for matrix, (rows, columns, weights) in zip(matrices, self.triangles, strict=True)
        ]

    def turned(self, left: Sequence[FloatArray]) -> list[FloatArray]:
        """Scaled triangles of R^-1 F_i R^-T, one column for every decision of a group; `left` holds R^-1."""
        parts = []
        for inverse, free, (_, _, weights) in zip(left, self.free, self.triangles, strict=True):
            size, count = inverse.shape[-1], free.shape[-1]
            flat = np.empty((len(free), len(weights), count))
            places = max(1, IN_CACHE // (size * size * count))
            for first in range(0, len(free), places):
                here = slice(first, first + places)
                left_here, out = inverse[here], flat[here]
                once = (left_here @ free[here].reshape(-1, size, size * count)).reshape(-1, size, size, count)
                start = 0
                for row in range(
                    size
                ):  # the F_i are symmetric, and only the upper triangle of what comes out is wanted
                    rest = left_here[:, row:] * weights[start : start + size - row, None]
                    np.matmul(rest, once[:, row], out=out[:, start : start + size - row])
                    start += size - row
            parts.append(flat.reshape(len(free) * len(weights), count))
        return parts

    def gram(self, turned: Sequence[FloatArray]) -> FloatArray:
        """Inner products of all pairs of columns (N, N)."""
        total = np.zeros((self.count, self.count))
        for part, columns in zip(turned, self.columns, strict=True):
            here = columns if isinstance(columns, slice) else np.ix_(columns, columns)
            total[here] += part.T @ part
        return total

    def against(self, turned: Sequence[FloatArray], matrices: Sequence[FloatArray]) -> FloatArray:
        """Inner products of the columns with given matrices (N,)."""
        total = np.zeros(self.count)
        for part, columns, vector in zip(turned, self.columns, self.flat(matrices), strict=True):
            total[columns] += part.T @ vector
        return total


def triangle_by_rows(size: int) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Rows and columns of the upper triangle, and the weights sqrt(2) that keep inner products."""
    rows, columns = np.triu_indices(size)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0))
