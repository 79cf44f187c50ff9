"""What reaches an observer is finite, in range and flagged: missing, stale, out of range, too fast."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arguments import LIMIT
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import RangeError
from estimators.faults import Flag, raise_flag
from estimators.memory import Memory
from estimators.schedule import SchedulingParameter, outside_range

FEW = 12  # entries up to which plain numbers are faster than arrays
_SLACK = 1.0 + 1e-9  # the difference quotient of a ramp at the bound itself is not a violation


class MonitoredInputs(NamedTuple):
    """Arrays of shape (n,); `coast` and `flags` are None where nothing is wrong with any entry."""

    held_input: FloatArray
    measurement: FloatArray
    parameter: FloatArray
    coast: BoolArray | None
    missing: BoolArray | None
    flags: FlagArray | None


class InputMonitor(Memory):
    """Remembers the last good values of `count` entries."""

    memory = ("input", "raw", "gap", "measurement", "run")
    unknowns = ("raw", "measurement")

    def __init__(
        self, parameter: SchedulingParameter, sample_time: float, count: int, refuse: bool, stale_after: int | None
    ) -> None:
        self.box, self.time, self.refuse, self.stale_after = parameter, sample_time, refuse, stale_after
        self.calm = min(parameter.rate_max, -parameter.rate_min) * sample_time * _SLACK  # safe whatever the direction
        self.scratch = np.empty(count)
        self.input = np.zeros(count)
        self.raw = np.full(count, np.nan)  # last finite parameter, signed
        self.gap = np.zeros(count, dtype=np.int64)  # samples since then
        self.gaps = False
        self.measurement = np.full(count, np.nan)
        self.run = np.zeros(count, dtype=np.int64)  # how many samples the measurement has been repeating
        self.repeats = np.empty(count, dtype=np.bool_)

    def forget(self, where: BoolArray) -> None:
        """Starts the entries `where` afresh."""
        self.input[where] = 0.0
        self.raw[where] = self.measurement[where] = np.nan
        self.gap[where] = self.run[where] = 0
        self._recall()

    def _recall(self) -> None:
        self.gaps = bool(self.gap.any())

    def __call__(
        self, u: FloatArray, y: FloatArray, p: FloatArray, sample: int, shape: tuple[int, ...]
    ) -> MonitoredInputs:
        """Replaces what cannot be used; `sample` and `shape` are for the message of a refusal.

        Raises:
            RangeError: a parameter or rate outside the certified box, if the observer refuses these.
        """
        value = np.absolute(p) if self.box.absolute else p.copy()
        if p.size <= FEW:
            missing = self._only_missing(u, y, p, value)
            if missing is None or (missing and self.stale_after is not None):
                return self._repaired(u, y, p, sample, shape)
            if missing:
                return self._without(missing, u, y, p, value)
        elif not self._calm(u, y, p, value):
            return self._repaired(u, y, p, sample, shape)
        if self.stale_after is not None:
            np.equal(y, self.measurement, self.repeats)
            if np.count_nonzero(self.repeats):
                return self._repaired(u, y, p, sample, shape)
            self.run[:] = 1
            self.measurement[:] = y
        self.input[:] = u
        self.raw[:] = p
        return MonitoredInputs(u, y, value, None, None, None)

    def _calm(self, u: FloatArray, y: FloatArray, p: FloatArray, value: FloatArray) -> bool:
        """Whether nothing at all is wrong; comparisons with NaN are false, so NaN never passes."""
        scratch, largest = self.scratch, np.maximum.reduce
        box = self.box
        return bool(
            not self.gaps
            and largest(value) <= box.max
            and ((box.absolute and box.min == 0) or np.minimum.reduce(value) >= box.min)
            and largest(np.absolute(u, scratch)) <= LIMIT
            and largest(np.absolute(y, scratch)) <= LIMIT
            and largest(np.absolute(np.subtract(p, self.raw, scratch), scratch)) <= self.calm
        )

    def _only_missing(self, u: FloatArray, y: FloatArray, p: FloatArray, value: FloatArray) -> list[int] | None:
        """Where measurements are missing, if nothing else is wrong with a handful of entries; None where more is.

        On plain numbers: the step of one car's corners takes half as long, a third where a measurement is missing.
        """
        if self.gaps:
            return None
        low, high, calm, missing = self.box.min, self.box.max, self.calm, []
        columns = (u.tolist(), y.tolist(), p.tolist(), self.raw.tolist(), value.tolist())
        for place, (a, b, c, before, size) in enumerate(zip(*columns, strict=True)):
            if not (low <= size <= high and -LIMIT <= a <= LIMIT and abs(c - before) <= calm):
                return None
            if not -LIMIT <= b <= LIMIT:
                missing.append(place)
        return missing

    def _without(
        self, missing: list[int], u: FloatArray, y: FloatArray, p: FloatArray, value: FloatArray
    ) -> MonitoredInputs:
        """What is left when the measurements `missing` are all that is wrong."""
        self.input[:], self.raw[:] = u, p
        coast: BoolArray = np.zeros(u.size, dtype=np.bool_)
        coast[missing] = True
        flags = coast * np.int32(Flag.MISSING_MEASUREMENT)
        return MonitoredInputs(u, np.where(coast, 0.0, y), value, coast, coast, flags)

    def _repaired(
        self, u: FloatArray, y: FloatArray, p: FloatArray, sample: int, shape: tuple[int, ...]
    ) -> MonitoredInputs:
        """The slow path; nothing is remembered before every refusal has been considered."""
        flags: FlagArray = np.zeros(p.size, dtype=np.int32)
        missing = ~(np.absolute(y) <= LIMIT)
        raise_flag(flags, missing, Flag.MISSING_MEASUREMENT)
        no_input = ~(np.absolute(u) <= LIMIT)
        raise_flag(flags, no_input, Flag.MISSING_INPUT)
        unknown = ~(np.absolute(p) <= LIMIT)
        raise_flag(flags, unknown, Flag.MISSING_PARAMETER)
        raw = np.where(unknown, self.raw, p)
        value = self._ranged(raw, flags, sample, shape)
        self._rated(raw, unknown, flags, sample, shape)
        coast = missing | self._stale(y, missing, flags)

        held = np.where(no_input, self.input, u)
        self.input[:] = held
        self.gap = np.where(unknown & ~np.isnan(raw), self.gap + 1, 0)
        self.gaps = bool(self.gap.any())
        self.raw[:] = raw
        return MonitoredInputs(
            held,
            np.where(missing, 0.0, y),
            value,
            coast if coast.any() else None,
            missing if missing.any() else None,
            flags if flags.any() else None,
        )

    def _ranged(self, raw: FloatArray, flags: FlagArray, sample: int, shape: tuple[int, ...]) -> FloatArray:
        """The parameter inside the certified range; the value nearest to zero as long as none was ever seen."""
        value = np.where(np.isnan(raw), 0.0, np.absolute(raw) if self.box.absolute else raw)
        outside = ((value < self.box.min) | (value > self.box.max)) & ~np.isnan(raw)
        if self.refuse and outside.any():
            entry = int(np.argmax(outside))
            raise RangeError(outside_range(self.box, float(raw[entry]), place_of(sample, entry, shape)))
        raise_flag(flags, outside, Flag.PARAMETER_OUT_OF_RANGE)
        return np.clip(value, self.box.min, self.box.max)

    def _rated(
        self, raw: FloatArray, unknown: BoolArray, flags: FlagArray, sample: int, shape: tuple[int, ...]
    ) -> None:
        """Compares the difference quotient since the last finite sample with the certified rates.

        A magnitude whose sign changed went down to zero and up again: both rates occurred.
        """
        box = self.box
        if box.absolute:
            crossed = raw * self.raw < 0
            fall = np.where(crossed, -np.absolute(self.raw - raw), np.absolute(raw) - np.absolute(self.raw))
            rise = np.where(crossed, -fall, fall)
        else:
            fall = rise = raw - self.raw
        elapsed = self.time * (self.gap + 1)
        fast = ((rise > box.rate_max * elapsed * _SLACK) | (fall < box.rate_min * elapsed * _SLACK)) & ~unknown
        if self.refuse and fast.any():
            entry = int(np.argmax(fast))
            worst = rise[entry] if rise[entry] > box.rate_max * elapsed[entry] else fall[entry]
            rates = f"[{box.rate_min:g}, {box.rate_max:g}] {box.unit}/s"
            raise RangeError(
                f"{box.name} changes at {worst / elapsed[entry]:.6g} {box.unit}/s, outside the certified rates {rates}"
                f"{place_of(sample, entry, shape)}"
            )
        raise_flag(flags, fast, Flag.RATE_OUT_OF_RANGE)

    def _stale(self, y: FloatArray, missing: BoolArray, flags: FlagArray) -> BoolArray:
        """Entries whose measurement repeats for more than `stale_after` samples; missing ones do not count."""
        if self.stale_after is None:
            return np.zeros(y.size, dtype=np.bool_)
        run = np.where(y == self.measurement, self.run + 1, 1)
        self.run = np.where(missing, self.run, run)
        self.measurement = np.where(missing, self.measurement, y)
        stale: BoolArray = (self.run > self.stale_after) & ~missing
        raise_flag(flags, stale, Flag.STALE_MEASUREMENT)
        return stale


def place_of(sample: int, entry: int, shape: tuple[int, ...]) -> str:
    """` (sample 812)`, with the entry of a batch: ` (sample 812, entry 2)`."""
    if not shape:
        return f" (sample {sample})"
    index = tuple(int(axis) for axis in np.unravel_index(entry, shape))
    return f" (sample {sample}, entry {index[0] if len(index) == 1 else index})"
