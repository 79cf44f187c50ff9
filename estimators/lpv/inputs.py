"""What reaches an observer of any size is finite, in range and flagged: missing, stale, out of range, too fast."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arguments import LIMIT, quiet
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import RangeError
from estimators.faults import Flag, raise_flag
from estimators.memory import Memory, Saved
from estimators.schedule import SchedulingParameter
from estimators.schedule.constraints import ParameterSet
from estimators.velocity.input_monitor import InputMonitor, place_of


class CheckedSignals(NamedTuple):
    """Arrays (n, signals); `coast`, `missing` and `flags` are None where nothing is wrong with any entry."""

    held_input: FloatArray
    measurement: FloatArray
    parameter: FloatArray
    coast: BoolArray | None
    missing: BoolArray | None  # (n, outputs)
    flags: FlagArray | None


class SignalMonitor(Memory):
    """Remembers the last good values of `count` entries; every parameter has a monitor of its own.

    An entry of which one output is missing coasts: what is proved of lost measurements is that all of them are.
    """

    memory = ("input", "measurement", "run")
    parts = ("parameters",)
    unknowns = ("measurement",)

    def __init__(
        self,
        parameters: tuple[SchedulingParameter, ...],
        sizes: tuple[int, int],
        sample_time: float,
        count: int,
        refuse: bool,
        stale_after: int | None,
        constraints: ParameterSet | None = None,
    ) -> None:
        self.constraints = constraints
        self.parameters = [InputMonitor(entry, sample_time, count, refuse, None) for entry in parameters]
        self.stale_after, self.nothing = stale_after, np.zeros(count)
        self.input: FloatArray = np.zeros((count, sizes[0]))
        self.measurement: FloatArray = np.full((count, sizes[1]), np.nan)
        self.run = np.zeros(count, dtype=np.int64)  # how many samples the measurements have been repeating

    def forget(self, where: BoolArray) -> None:
        """Starts the entries `where` afresh."""
        for monitor in self.parameters:
            monitor.forget(where)
        self.input[where] = 0.0
        self.measurement[where] = np.nan
        self.run[where] = 0

    def __call__(
        self, u: FloatArray, y: FloatArray, p: FloatArray, sample: int, shape: tuple[int, ...]
    ) -> CheckedSignals:
        """Replaces what cannot be used; `sample` and `shape` are for the message of a refusal.

        Raises:
            RangeError: a parameter or rate outside the certified box, if the observer refuses these; nothing is remembered then.
        """
        before = [monitor.save() for monitor in self.parameters] if self.parameters[0].refuse else []
        values, raised = np.empty_like(p), []
        for axis, monitor in enumerate(self.parameters):
            try:
                seen = monitor(self.nothing, self.nothing, np.ascontiguousarray(p[:, axis]), sample, shape)
            except Exception:
                for earlier, saved in zip(self.parameters[:axis], before, strict=False):
                    earlier.restore(saved)
                raise
            values[:, axis] = seen.parameter
            raised += [] if seen.flags is None else [seen.flags]
        raised += self._constrained(values, p, before, sample, shape)
        calm = not raised and quiet(u.reshape(-1)) and quiet(y.reshape(-1))
        if calm and self.stale_after is None:
            self.input[:] = u
            return CheckedSignals(u, y, values, None, None, None)
        flags: FlagArray = np.zeros(len(p), dtype=np.int32)
        for one in raised:
            flags |= one
        missing = ~(np.absolute(y) <= LIMIT)
        absent: BoolArray = np.asarray(missing.any(axis=1))
        raise_flag(flags, absent, Flag.MISSING_MEASUREMENT)
        no_input = ~(np.absolute(u) <= LIMIT)
        raise_flag(flags, np.asarray(no_input.any(axis=1)), Flag.MISSING_INPUT)
        held = np.where(no_input, self.input, u)
        self.input[:] = held
        coast = absent | self._stale(y, absent, flags)
        return CheckedSignals(
            held,
            np.where(missing, 0.0, y),
            values,
            coast if coast.any() else None,
            missing if missing.any() else None,
            flags if flags.any() else None,
        )

    def _constrained(
        self, values: FloatArray, raw: FloatArray, before: list[Saved], sample: int, shape: tuple[int, ...]
    ) -> list[FlagArray]:
        """Draws values, in place, that break an inequality between the parameters into the set; flags or refuses them."""
        if self.constraints is None or not (outside := self.constraints.outside(values)).any():
            return []
        seen = outside & (np.absolute(raw) <= LIMIT).all(axis=1)
        if before and seen.any():
            for monitor, saved in zip(self.parameters, before, strict=True):
                monitor.restore(saved)
            entry = int(np.argmax(seen))
            names = [monitor.box.name for monitor in self.parameters]
            raise RangeError(self.constraints.refusal(names, values[entry], place_of(sample, entry, shape)))
        values[outside] = self.constraints.drawn_in(values[outside])
        flags: FlagArray = np.zeros(len(values), dtype=np.int32)
        raise_flag(flags, seen, Flag.PARAMETER_OUT_OF_RANGE)
        return [flags]

    def _stale(self, y: FloatArray, absent: BoolArray, flags: FlagArray) -> BoolArray:
        """Entries whose measurements all repeat for more than `stale_after` samples; missing ones do not count."""
        if self.stale_after is None:
            return np.zeros(len(y), dtype=np.bool_)
        run = np.where((y == self.measurement).all(axis=1), self.run + 1, 1)
        self.run = np.where(absent, self.run, run)
        self.measurement = np.where(absent[:, None], self.measurement, y)
        stale: BoolArray = (self.run > self.stale_after) & ~absent
        raise_flag(flags, stale, Flag.STALE_MEASUREMENT)
        return stale
