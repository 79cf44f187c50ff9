"""A signal that stays finite: what is missing is held at the last good value."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.arrays import BoolArray, FloatArray
from estimators.signals.checks import LIMIT, bounded, entries, quiet
from estimators.signals.memory import Memory


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
