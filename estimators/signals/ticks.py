"""Wheel speed from encoder ticks: the shortest window with enough of them, and how wrong it can be."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, bounded, entries, mask, setting
from estimators.arrays import BoolArray, FlagArray, FloatArray, IntArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.memory import Memory


class TickStep(NamedTuple):
    """Leading axes are those of the batch."""

    speed: FloatArray  # rad/s, mean over the window; late by half of it
    resolution: FloatArray  # rad/s: the mean speed over the window is off by less than this
    window: IntArray  # samples
    flags: FlagArray  # MISSING_MEASUREMENT


class TickSpeed(Memory):
    """w = (N_k - N_k-n) p/(n Ts) over the shortest window n in which `least_ticks` were counted, p = 2 pi/teeth.

    A counter is right to one tick, so the mean speed over the window is off by less than p/(n Ts). Fast wheels get short
    windows, slow ones long ones; below `least_ticks` in `longest_window` samples the whole window counts, and a wheel
    at rest reads 0. Counts are signed where the encoder knows the direction; reverse counts forward otherwise.

    Args:
        teeth: ticks a revolution.
        sample_time: Ts, s.
        batch_shape: shape of the counts.
        least_ticks: in a window.
        longest_window: samples.
        modulus: the count at which the counter wraps to 0; None: it does not.

    Raises:
        EstimatorError: a number below 1, a sample time that is not positive.
    """

    memory = ("counts", "turns", "last", "speed", "width")
    unknowns = ("counts", "last")

    def __init__(
        self,
        teeth: int,
        sample_time: float,
        batch_shape: tuple[int, ...] = (4,),
        least_ticks: int = 8,
        longest_window: int = 20,
        modulus: int | None = None,
    ) -> None:
        numbers = {"teeth": teeth, "least_ticks": least_ticks, "longest_window": longest_window}
        for name, number in (numbers if modulus is None else numbers | {"modulus": modulus}).items():
            if number < 1:
                raise EstimatorError(f"{name} = {number} must be at least 1")
        self.pitch = 2.0 * math.pi / teeth
        self.sample_time = setting(sample_time, "sample_time", "s")
        self.batch_shape = batch(batch_shape)
        self.least_ticks, self.longest_window, self.modulus = least_ticks, longest_window, modulus
        self.counts: FloatArray = np.full((longest_window, *self.batch_shape), np.nan)  # newest first
        self.turns: FloatArray = np.zeros(self.batch_shape)
        self.last: FloatArray = np.full(self.batch_shape, np.nan)
        self.speed: FloatArray = np.zeros(self.batch_shape)
        self.width: IntArray = np.full(self.batch_shape, longest_window, dtype=np.int64)

    def step(self, count: npt.ArrayLike) -> TickStep:
        """Takes one reading of the counters, of the batch shape; a missing one holds the speed.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        raw = entries(count, self.batch_shape, "tick count")
        missing = ~bounded(raw)
        unwrapped = self._unwrapped(raw, missing)
        moved = unwrapped - self.counts
        with np.errstate(invalid="ignore"):
            enough = np.absolute(moved) >= self.least_ticks
        known = ~np.isnan(moved)
        oldest = self.longest_window - 1 - np.argmax(known[::-1], axis=0)
        index = np.where(enough.any(axis=0), np.argmax(enough, axis=0), oldest)
        found = known.any(axis=0) & ~missing
        width = index + 1
        travel = np.take_along_axis(moved, index[None], axis=0)[0]
        self.speed = np.where(found, np.where(found, travel, 0.0) * self.pitch / (width * self.sample_time), self.speed)
        self.width = np.where(found, width, self.width)
        self.counts = np.concatenate((unwrapped[None], self.counts[:-1]))
        flags: FlagArray = np.zeros(self.batch_shape, dtype=np.int32)
        raise_flag(flags, missing, Flag.MISSING_MEASUREMENT)
        resolution = np.asarray(self.pitch / (self.width * self.sample_time), dtype=np.float64)
        return TickStep(self.speed.copy(), resolution, self.width.copy(), flags)

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Forgets the counts of the entries `where` (bool mask; None: all)."""
        chosen = mask(where, self.batch_shape, "where")
        self.counts = np.where(chosen, np.nan, self.counts)
        self.last = np.where(chosen, np.nan, self.last)
        self.turns, self.speed = np.where(chosen, 0.0, self.turns), np.where(chosen, 0.0, self.speed)
        self.width = np.where(chosen, self.longest_window, self.width)

    def _unwrapped(self, raw: FloatArray, missing: BoolArray) -> FloatArray:
        """The count without wraps, NaN where missing: a jump of more than half the modulus is a wrap."""
        clean = np.where(missing, np.nan, raw)
        if self.modulus is None:
            return clean
        jump = np.where(np.isnan(self.last) | missing, 0.0, clean - self.last)
        self.turns = self.turns - np.round(np.where(np.isnan(jump), 0.0, jump) / self.modulus)
        self.last = np.where(missing, self.last, clean)
        return clean + self.turns * self.modulus
