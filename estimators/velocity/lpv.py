"""Two-state velocity observer whose gains follow a schedule: bristle deflection and relative velocity of a corner."""

from __future__ import annotations

import math
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import LIMIT, batch, entries, finite, mask, quiet
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.display import displayed
from estimators.errors import EstimatorError
from estimators.memory import Renewable
from estimators.schedule import GainSchedule
from estimators.schedule.runtime import SavedWithSchedule, check_options
from estimators.velocity.exact_update import ExactUpdate, refuse_explosive
from estimators.velocity.input_monitor import FEW, InputMonitor, MonitoredInputs

_CHUNK = 4096  # entries worked on at once: what lies between the operations stays in the cache


@displayed({})
class LpvStep(NamedTuple):
    """What one step returns, ready for a log; leading axes are those of the batch.

    Where nothing is wrong, `used` and `flags` are read-only arrays that steps share.
    """

    estimate: FloatArray  # (..., 2) states at the end of the sample
    innovation: FloatArray  # (...) y - C xhat - D u at its start; NaN where the measurement is missing
    used: BoolArray  # (...) whether the measurement corrected the estimate
    flags: FlagArray  # (...) sums of `Flag`; 0 where nothing is wrong
    parameter: FloatArray  # (...) the scheduling parameter that was used


class TwoStateObserver(Renewable):
    """What observers of two states, one input and one output share: checks of their inputs, the exact update, memory.

    Args:
        schedules: over one plant; each entry moves by one of them.
        batch_shape, outside, stale_after: as `LpvVelocityObserver`.

    Raises:
        EstimatorError, ScheduleError: as `LpvVelocityObserver`.
    """

    memory = ("_state", "samples", "renewed")
    parts: tuple[str, ...] = ("monitor",)

    def __init__(
        self,
        schedules: tuple[GainSchedule, ...],
        batch_shape: tuple[int, ...],
        outside: str = "flag",
        stale_after: int | None = None,
    ) -> None:
        for schedule in schedules:
            sizes = (len(schedule.states), len(schedule.inputs), len(schedule.outputs))
            if sizes != (2, 1, 1):
                raise EstimatorError(
                    f"schedule '{schedule.name}' has {sizes[0]} states, {sizes[1]} inputs and {sizes[2]} outputs; "
                    "this observer is for 2, 1 and 1"
                )
            refuse_explosive(schedule)
        check_options(outside, stale_after)
        super().__init__(batch(batch_shape))
        self.schedule, count = schedules[0], math.prod(self.batch_shape)
        self._updates = tuple(ExactUpdate(schedule) for schedule in schedules)
        self.monitor = InputMonitor(
            self.schedule.parameter, self.schedule.sample_time, count, outside == "refuse", stale_after
        )
        self._state: FloatArray = np.zeros((2, count))
        self.samples = 0
        self._all_used: BoolArray = np.ones(self.batch_shape, dtype=np.bool_)
        self._no_flags: FlagArray = np.zeros(self.batch_shape, dtype=np.int32)
        self._all_used.flags.writeable = self._no_flags.flags.writeable = False

    @property
    def state(self) -> FloatArray:
        """A copy of the estimate, shape (*batch_shape, 2)."""
        return self._state.T.copy().reshape(*self.batch_shape, 2)

    def _step(
        self,
        held_input: npt.ArrayLike,
        measurement: npt.ArrayLike,
        parameter: npt.ArrayLike,
        second: BoolArray | None = None,
    ) -> LpvStep:
        """One sample on; the entries `second` (n,) move by the second schedule."""
        shape = self.batch_shape
        u = entries(held_input, shape, "input").reshape(-1)
        y = entries(measurement, shape, "measurement").reshape(-1)
        p = entries(parameter, shape, "parameter").reshape(-1)
        seen = self.monitor(u, y, p, self.samples, shape)
        innovation = self._advance(seen, second)
        self.samples += 1
        flags = self._no_flags if seen.flags is None else seen.flags.reshape(shape)
        if not quiet(self._state):
            gone = ~(np.absolute(self._state) <= LIMIT).all(axis=0)  # an unstable model coasting for long
            self._state[:, gone] = 0.0
            self._renew(gone.reshape(shape))
        if self._any_renewed:
            flags = flags.copy()
            self._flag_renewed(flags)
        if seen.missing is not None:
            innovation[seen.missing] = np.nan
        used = self._all_used if seen.coast is None else ~seen.coast.reshape(shape)
        return LpvStep(self.state, innovation.reshape(shape), used, flags, seen.parameter.reshape(shape))

    def _advance(self, seen: MonitoredInputs, second: BoolArray | None) -> FloatArray:
        """Moves `_state` by one sample; returns the innovations (n,)."""
        count = seen.parameter.size
        used = None if seen.coast is None else ~seen.coast
        if count <= FEW:
            masks = [True] * count if used is None else used.tolist()
            modes = [False] * count if second is None else second.tolist()
            columns = (*self._state, seen.held_input, seen.measurement, seen.parameter)
            rows = zip(modes, *(column.tolist() for column in columns), masks, strict=True)
            first, other, outputs = zip(*(self._updates[mode].advance(*entry) for mode, *entry in rows), strict=True)
            self._state = np.array((first, other))
            return np.array(outputs)
        innovation: FloatArray = np.empty(count)
        if second is None:
            groups: list[tuple[ExactUpdate, Any]] = [
                (self._updates[0], slice(start, start + _CHUNK)) for start in range(0, count, _CHUNK)
            ]
        else:
            groups = [(update, np.flatnonzero(second == mode)) for mode, update in enumerate(self._updates)]
        for update, part in groups:
            given = seen.held_input[part], seen.measurement[part], seen.parameter[part]
            if given[0].size:
                x1, x2 = self._state[:, part]
                moved = update.advance(x1, x2, *given, True if used is None else used[part])
                self._state[0, part], self._state[1, part], innovation[part] = moved
        return innovation

    def reset(self, where: npt.ArrayLike | None = None, state: npt.ArrayLike = 0.0) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to `state` and forgets what they have seen.

        `state` broadcasts to (*batch_shape, 2). The next step carries the flag RESET for these entries.

        Raises:
            EstimatorError: another shape, or a state that is not finite.
        """
        chosen = mask(where, self.batch_shape, "where")
        full, flat = finite(state, (*self.batch_shape, 2), "state"), chosen.reshape(-1)
        self._state[:, flat] = full.reshape(-1, 2)[flat].T
        self.monitor.forget(flat)
        self._renew(chosen)


class LpvVelocityObserver(SavedWithSchedule, TwoStateObserver):
    """xhat' = A(p) xhat + B u + L(p) (y - C(p) xhat - D u), P1 (24), (38) and P3 (7), (12), updated exactly.

    Over one sample u, y and p are held and the closed loop is integrated exactly (P1 notes 9); a schedule whose update is
    "sampled" instead predicts exactly with u and p held and adds K(p) (y - C(p) xhat - D u) once a sample. For the corner models
    the states are bristle deflection in m and relative velocity in m/s, u is the relative acceleration in m/s^2, y the
    normalised force and p the wheel speed in rad/s.

    A measurement that is missing (not finite) or stale is not used: the entry coasts with L = 0. A missing input or
    parameter is held at its last finite value. All of this is flagged, and estimates are finite always.

    Args:
        schedule: two states, one input, one output.
        batch_shape: shape of every array given to `step`; (4,) for the corners of a car, (10000, 4) for many runs.
        outside: a parameter or a rate outside the certified box is clipped and flagged ("flag") or raises ("refuse").
        stale_after: a measurement that repeats exactly for more than so many samples is stale; None: never.

    Raises:
        EstimatorError: a schedule of another size, or an option that means nothing.
        ScheduleError: gains or a model whose error grows beyond all bounds within one sample.

    >>> observer = LpvVelocityObserver(GainSchedule.shipped("corner-estimation-longitudinal"), batch_shape=(2,))
    >>> step = observer.step(0.3, [0.21, float("nan")], 35.0)  # one corner lost its sample
    >>> step.used.tolist(), step.flags.tolist()
    ([True, False], [0, 1])
    """

    def __init__(
        self,
        schedule: GainSchedule,
        batch_shape: tuple[int, ...] = (4,),
        outside: Literal["flag", "refuse"] = "flag",
        stale_after: int | None = None,
    ) -> None:
        super().__init__((schedule,), batch_shape, outside, stale_after)

    def step(self, held_input: npt.ArrayLike, measurement: npt.ArrayLike, parameter: npt.ArrayLike) -> LpvStep:
        """Moves every entry by one sample; all arguments have the batch shape, or are one number for all.

        Raises:
            EstimatorError: another shape, or not numbers.
            RangeError: outside the certified box, if the observer refuses that; the state is then unchanged.
        """
        return self._step(held_input, measurement, parameter)
