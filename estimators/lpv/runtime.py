"""What an observer and a feedback law of any size share: checked signals, a state, flags, and the reset of entries."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
import numpy.typing as npt

from estimators.arguments import LIMIT, batch, quiet, vectors
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.lpv.inputs import CheckedSignals, SignalMonitor
from estimators.schedule import GainSchedule
from estimators.schedule.runtime import SavedWithSchedule, check_options


class LpvRuntime(SavedWithSchedule):
    """A batch of entries that follow one schedule; a step takes `_signals`, moves `_state`, and ends with `_flagged`.

    Args:
        schedule, batch_shape, outside, stale_after: as `LpvObserver`.
        states, inputs, measured: how many of each an entry has.

    Raises:
        EstimatorError: an option that means nothing.
    """

    memory: tuple[str, ...] = ("_state", "samples", "renewed")
    parts: tuple[str, ...] = ("monitor",)

    def __init__(
        self,
        schedule: GainSchedule,
        batch_shape: tuple[int, ...],
        outside: Literal["flag", "refuse"],
        stale_after: int | None,
        states: int,
        inputs: int,
        measured: int,
    ) -> None:
        check_options(outside, stale_after)
        super().__init__(batch(batch_shape))
        self.schedule, count, sizes = schedule, math.prod(self.batch_shape), (inputs, measured)
        self.monitor = SignalMonitor(
            schedule.parameters, sizes, schedule.sample_time, count, outside == "refuse", stale_after,
            schedule.constraints,
        )  # fmt: skip
        self._state: FloatArray = np.zeros((count, states))
        self.samples = 0

    @property
    def state(self) -> FloatArray:
        """A copy of the own state, shape (*batch_shape, states)."""
        return self._shaped(self._state.copy())

    def _signals(self, u: FloatArray, y: npt.ArrayLike, p: npt.ArrayLike) -> CheckedSignals:
        """Of one sample: inputs (n, nu), measurements and parameters of the batch shape, refused or replaced.

        Raises:
            EstimatorError: another shape, or not numbers.
            RangeError: outside the certified box, if that is refused; nothing is changed then.
        """
        measurement = self._used(vectors(y, self.batch_shape, self.monitor.measurement.shape[1], "measurement"))
        parameter = vectors(p, self.batch_shape, len(self.schedule.parameters), "parameter")
        return self.monitor(u, measurement, parameter, self.samples, self.batch_shape)

    def _used(self, measurement: FloatArray) -> FloatArray:
        """Measurements (n, ny) as they count."""
        return measurement

    def _flagged(self, seen: CheckedSignals, gone: BoolArray | None) -> FlagArray:
        """Flags (...) of the sample that ends; entries that are `gone` (n,) have been started afresh."""
        shape = self.batch_shape
        flags: FlagArray = np.zeros(shape, dtype=np.int32) if seen.flags is None else seen.flags.reshape(shape)
        if gone is not None:
            self._renew(gone.reshape(shape))
        self.samples += 1
        self._flag_renewed(flags)
        return flags

    def _shaped(self, rows: FloatArray) -> FloatArray:
        """(n, k) as (*batch_shape, k)."""
        return rows.reshape(*self.batch_shape, rows.shape[-1])

    def _forget(self, chosen: BoolArray) -> BoolArray:
        """Starts the entries `chosen` at rest, to be flagged RESET; the mask (n,) of them."""
        flat = chosen.reshape(-1)
        self._state[flat] = 0.0
        self.monitor.forget(flat)
        self._renew(chosen)
        return flat


def beyond_bounds(*rows: FloatArray) -> BoolArray | None:
    """Entries (n,) of which any number in the (n, k) is too large, or none; None: no entry."""
    if all(quiet(values.reshape(-1)) for values in rows):
        return None
    return np.asarray(~(np.absolute(np.hstack(rows)) <= LIMIT).all(axis=1), dtype=np.bool_)
