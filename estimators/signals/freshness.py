"""Is this sample new? A 50 Hz device read at 200 Hz repeats every reading four times, and says nothing three times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, bounded, entries, mask
from estimators.arrays import BoolArray, FlagArray, FloatArray, IntArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.memory import Memory


class FreshStep(NamedTuple):
    """Leading axes are those of the batch."""

    fresh: BoolArray  # a new reading: use it as a measurement
    age: IntArray  # samples since the last new one, 0 where it is new
    flags: FlagArray  # MISSING_MEASUREMENT, STALE_MEASUREMENT


class Freshness(Memory):
    """Counts a sample as new when it changes, and an unchanged one once in `hold` samples.

    A reading that repeats its predecessor to the last bit is the old one repeated, until it has been repeated for as
    long as the device takes for a new one (`hold`): from then on it is a new reading that happens to be equal, as at
    standstill or with coarse ticks. So a constant signal of a 50 Hz device at 200 Hz (`hold` 4) counts 50 times a
    second, never 200, whatever the phase of the device. A jittering device needs its longest interval as `hold`.

    Args:
        batch_shape: shape of the signal.
        hold: samples for which the device may repeat one reading; 1: every finite sample is new.
        stale_after: unchanged for more than so many samples, a signal is stale, and not new any more; None: never.

    Raises:
        EstimatorError: no entries, `hold` below 1, `stale_after` below `hold`.
    """

    memory = ("last", "age", "run")
    unknowns = ("last",)

    def __init__(self, batch_shape: tuple[int, ...] = (4,), hold: int = 1, stale_after: int | None = None) -> None:
        if hold < 1:
            raise EstimatorError(f"hold = {hold} samples must be at least 1: how often the device repeats a reading")
        if stale_after is not None and stale_after < hold:
            raise EstimatorError(f"stale_after = {stale_after} samples must be at least hold = {hold}, or None")
        self.batch_shape, self.hold, self.stale_after = batch(batch_shape), hold, stale_after
        self.last: FloatArray = np.full(self.batch_shape, np.nan)
        self.age: IntArray = np.zeros(self.batch_shape, dtype=np.int64)
        self.run: IntArray = np.zeros(self.batch_shape, dtype=np.int64)

    def step(self, value: npt.ArrayLike) -> FreshStep:
        """Classifies one sample of the batch shape.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        array = entries(value, self.batch_shape, "signal")
        missing = ~bounded(array)
        changed = (array != self.last) & ~missing
        self.age = self.age + 1
        self.run = np.where(changed, 1, self.run + ~missing)
        fresh = changed | ((self.age >= self.hold) & ~missing)
        flags: FlagArray = np.zeros(self.batch_shape, dtype=np.int32)
        raise_flag(flags, missing, Flag.MISSING_MEASUREMENT)
        if self.stale_after is not None:
            stale = (self.run > self.stale_after) & ~missing
            raise_flag(flags, stale, Flag.STALE_MEASUREMENT)
            fresh &= ~stale
        self.age = np.where(fresh, 0, self.age)
        self.last = np.where(missing, self.last, array)
        return FreshStep(fresh, self.age.copy(), flags)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Forgets what the entries `where` (bool mask; None: all) have seen."""
        chosen = mask(where, self.batch_shape, "where")
        self.last = np.where(chosen, np.nan, self.last)
        self.age, self.run = np.where(chosen, 0, self.age), np.where(chosen, 0, self.run)
