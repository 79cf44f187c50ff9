"""Exact order statistics of numbers that are too many to hold: a radix search over their bits, in constant memory."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np
from numpy.typing import NDArray

from estimators.arrays import FloatArray

DIGIT = 16  # bits settled in one pass
PASSES = 64 // DIGIT


class RadixSearch:
    """The numbers that would stand at `ranks` (from 0) if all were sorted; all of them are to be shown PASSES times.

    Infinite numbers have their place; NaN must not occur. The order and the portions in which they come do not matter.
    """

    def __init__(self, ranks: Sequence[int]) -> None:
        self.prefix = [0] * len(ranks)
        self.rest = list(ranks)
        self.step = 0
        self.counts = np.zeros((len(ranks), 1 << DIGIT), np.int64)

    def show(self, values: FloatArray) -> None:
        """Some of the numbers (n,) of the current pass."""
        keys = sortable(values)
        shift = 64 - DIGIT * (self.step + 1)
        digits = ((keys >> np.uint64(shift)) & np.uint64((1 << DIGIT) - 1)).astype(np.intp)
        for i, known in enumerate(self.prefix):
            chosen = digits if self.step == 0 else digits[keys >> np.uint64(shift + DIGIT) == known]
            np.add.at(self.counts[i], chosen, 1)

    def end_pass(self) -> None:
        """All numbers were shown once."""
        for i in range(len(self.rest)):
            below = np.cumsum(self.counts[i])
            digit = int(np.searchsorted(below, self.rest[i], side="right"))
            self.rest[i] -= int(below[digit - 1]) if digit else 0
            self.prefix[i] = (self.prefix[i] << DIGIT) | digit
        self.counts[:] = 0
        self.step += 1

    def found(self) -> FloatArray:
        """The numbers (k,), after PASSES passes."""
        keys = np.array(self.prefix, np.uint64)
        return np.where(keys >> np.uint64(63) == 1, keys ^ np.uint64(1 << 63), ~keys).view(np.float64)


def rank_of(share: float, count: int) -> int:
    """The rank of the least number that is not exceeded by a `share` of `count` numbers (the inverse of their distribution)."""
    return max(ceil(round(share * count, 9)) - 1, 0)


def sortable(values: FloatArray) -> NDArray[np.uint64]:
    """Unsigned integers in the order of the numbers: negative ones have all bits turned over, others the sign alone."""
    bits = (np.ascontiguousarray(values) + 0.0).view(np.uint64)  # -0 becomes 0
    negative = bits >> np.uint64(63) == 1
    return np.where(negative, ~bits, bits | np.uint64(1 << 63))
