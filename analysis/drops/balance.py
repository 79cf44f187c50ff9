"""States of a pair of loops in sizes that suit both: mean-square stability does not depend on units, rounding does."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray

SWEEPS = 20


def balanced(first: FloatArray, second: FloatArray) -> tuple[FloatArray, FloatArray]:
    """D^-1 A D of both stacks (..., n, n) with one diagonal D of powers of two: no rounding, the same second-moment radius.

    Row and column sums of |A0| + |A1| beside the diagonal come within a factor of two of each other [Osborne1960].
    """
    first, second = np.broadcast_arrays(first, second)
    n = first.shape[-1]
    size = (np.abs(first) + np.abs(second)) * (1.0 - np.eye(n))
    exponent = np.zeros(first.shape[:-1])
    for _ in range(SWEEPS):
        moved = False
        for i in range(n):
            scaled = size * np.exp2(exponent[..., None, :] - exponent[..., :, None])
            row, column = scaled[..., i, :].sum(axis=-1), scaled[..., :, i].sum(axis=-1)
            both = (row > 0.0) & (column > 0.0)
            step = np.where(both, np.rint(0.5 * np.log2(np.where(both, row, 1.0) / np.where(both, column, 1.0))), 0.0)
            exponent[..., i] += step
            moved |= bool(step.any())
        if not moved:
            break
    factor = np.exp2(exponent[..., None, :] - exponent[..., :, None])
    return first * factor, second * factor
