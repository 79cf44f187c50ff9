"""Signals that stay finite: what is missing is held at the last good value."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.arguments import LIMIT, bounded, broadcast, entries, quiet
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.faults import Flag, raise_flag
from estimators.memory import Memory


class Held(Memory):
    """Holds each entry at its last good value, `start` before the first.

    Args:
        shape: of the signal.
        what: its name, for messages.
        start: broadcasts to `shape`.
        limit: a magnitude beyond it is missing, see `limits`.
    """

    memory = ("last",)

    def __init__(self, shape: tuple[int, ...], what: str, start: npt.ArrayLike = 0.0, limit: float = LIMIT) -> None:
        self.shape, self.what, self.limit = shape, what, limit
        self._start: FloatArray = np.array(np.broadcast_to(np.asarray(start, dtype=np.float64), shape))
        self.last: FloatArray = self._start.copy()

    def __call__(self, value: npt.ArrayLike) -> tuple[FloatArray, BoolArray | None]:
        """The held signal and which entries are missing (None: none of them).

        Raises:
            EstimatorError: not numbers, or another shape.
        """
        array = entries(value, self.shape, self.what)
        if quiet(array, self.limit):
            self.last = array.copy()
            return self.last, None
        good = bounded(array, self.limit)
        self.last = np.where(good, array, self.last)
        return self.last, None if good.all() else ~good

    def forget(self, where: BoolArray) -> None:
        """Back to the start value for the entries `where`."""
        self.last = np.where(where, self._start, self.last)


class Clipped(Held):
    """Holds a missing input likewise, and clips one that is outside `low` to `high`.

    Args:
        what: its name, for messages.
        start: what is used as long as nothing finite was seen; shape (*batch, ...).
        low, high: range beyond which a value is clipped.
        axes: how many trailing axes belong to the input itself.
    """

    def __init__(self, what: str, start: FloatArray, low: float, high: float, axes: int = 0) -> None:
        super().__init__(start.shape, what, start)
        self.low, self.high, self._inner = low, high, tuple(range(-axes, 0))

    def within(self, value: npt.ArrayLike, flags: FlagArray) -> FloatArray:
        """The usable value; raises MISSING_INPUT and PARAMETER_OUT_OF_RANGE of the entries.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        array = broadcast(value, self.shape, self.what)
        if np.minimum.reduce(array, None) >= self.low and np.maximum.reduce(array, None) <= self.high:  # False for NaN
            self.last = array.copy()
            return self.last
        held, missing = self(array)
        if missing is not None:
            raise_flag(flags, np.asarray(missing.any(axis=self._inner)), Flag.MISSING_INPUT)
        self.last = np.clip(held, self.low, self.high)
        if not np.array_equal(self.last, held):
            raise_flag(flags, np.asarray((self.last != held).any(axis=self._inner)), Flag.PARAMETER_OUT_OF_RANGE)
        return self.last
