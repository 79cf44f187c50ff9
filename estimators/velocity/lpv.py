"""Two-state velocity observer whose gains follow a schedule: bristle deflection and relative velocity of a corner."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arrays import AnyArray, BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.faults import Flag, raise_flag
from estimators.schedule import GainSchedule
from estimators.signals.checks import quiet
from estimators.velocity.exact_update import ExactUpdate, refuse_explosive
from estimators.velocity.exact_update_few import ExactUpdateFew
from estimators.velocity.screening import FEW, LIMIT, MEMORY, Screen

_CHUNK = 8192  # entries worked on at once: the scratch memory of one chunk stays in the cache


class LpvStep(NamedTuple):
    """What one step returns, ready for a log; leading axes are those of the batch.

    Where nothing is wrong, `used` and `flags` are read-only arrays that steps share.
    """

    estimate: FloatArray  # (..., 2) states at the end of the sample
    innovation: FloatArray  # (...) y - C xhat - D u at its start; NaN where the measurement is missing
    used: BoolArray  # (...) whether the measurement corrected the estimate
    flags: FlagArray  # (...) sums of `Flag`; 0 where nothing is wrong
    parameter: FloatArray  # (...) the scheduling parameter that was used


class LpvVelocityObserver:
    """xhat' = A(p) xhat + B u + L(p) (y - C(p) xhat - D u), P1 (24), (38) and P3 (7), (12), updated exactly.

    Over one sample u, y and p are held and the closed loop is integrated exactly (P1 section 9); a schedule whose update is
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
    """

    def __init__(
        self,
        schedule: GainSchedule,
        batch_shape: tuple[int, ...] = (4,),
        outside: Literal["flag", "refuse"] = "flag",
        stale_after: int | None = None,
    ) -> None:
        sizes = (len(schedule.states), len(schedule.inputs), len(schedule.outputs))
        if sizes != (2, 1, 1):
            raise EstimatorError(
                f"schedule '{schedule.name}' has {sizes[0]} states, {sizes[1]} inputs and {sizes[2]} outputs; "
                "this observer is for 2, 1 and 1"
            )
        if outside not in ("flag", "refuse"):
            raise EstimatorError(f"outside = {outside!r} is not known; use 'flag' or 'refuse'")
        if stale_after is not None and stale_after < 1:
            raise EstimatorError(f"stale_after = {stale_after} samples must be at least 1, or None")
        refuse_explosive(schedule)
        count = math.prod(batch_shape)
        if count < 1:
            raise EstimatorError(f"batch_shape = {batch_shape} holds no entries")
        self.schedule = schedule
        self.batch_shape = tuple(batch_shape)
        self._update = ExactUpdate(schedule)
        self._few = ExactUpdateFew(schedule) if count <= FEW else None
        self._screen = Screen(schedule.parameter, schedule.sample_time, count, outside == "refuse", stale_after)
        self._state: FloatArray = np.zeros((2, count))
        self._renewed: BoolArray = np.zeros(count, dtype=np.bool_)  # to be flagged RESET at the next step
        self._any_renewed = False
        self._samples = 0
        self._all_used: BoolArray = np.ones(self.batch_shape, dtype=np.bool_)
        self._no_flags: FlagArray = np.zeros(self.batch_shape, dtype=np.int32)
        self._all_used.flags.writeable = self._no_flags.flags.writeable = False

    @property
    def state(self) -> FloatArray:
        """A copy of the estimate, shape (*batch_shape, 2)."""
        return self._state.T.copy().reshape(*self.batch_shape, 2)

    def step(self, held_input: npt.ArrayLike, measurement: npt.ArrayLike, parameter: npt.ArrayLike) -> LpvStep:
        """Moves every entry by one sample; all arguments have the batch shape.

        Raises:
            EstimatorError: another shape, or not numbers.
            RangeError: outside the certified box, if the observer refuses that; the state is then unchanged.
        """
        u = self._entries(held_input, "input")
        y = self._entries(measurement, "measurement")
        p = self._entries(parameter, "parameter")
        if self._few is not None and self._screen.stale_after is None and not self._any_renewed:
            quick = self._quick(self._few, u, y, p)
            if quick is not None:
                return quick
        seen = self._screen(u, y, p, self._samples, self.batch_shape)
        innovation: FloatArray = np.empty(p.size)
        self._advance(seen.held_input, seen.measurement, seen.parameter, seen.coast, innovation)
        self._samples += 1
        flags = self._guarded(seen.flags)
        if seen.missing is not None:
            innovation[seen.missing] = np.nan
        shape = self.batch_shape
        return LpvStep(
            self.state,
            innovation.reshape(shape),
            self._all_used if seen.coast is None else ~seen.coast.reshape(shape),
            self._no_flags if flags is None else flags.reshape(shape),
            seen.parameter.reshape(shape),
        )

    def reset(self, where: npt.ArrayLike | None = None, state: npt.ArrayLike = 0.0) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to `state` and forgets what they have seen.

        `state` broadcasts to (*batch_shape, 2). The next step carries the flag RESET for these entries.

        Raises:
            EstimatorError: another shape, or a state that is not finite.
        """
        mask = np.ones(self.batch_shape, dtype=np.bool_) if where is None else np.asarray(where)
        if mask.dtype != np.bool_ or mask.shape != self.batch_shape:
            raise EstimatorError(f"where: {mask.dtype} {mask.shape}, expected a bool mask of shape {self.batch_shape}")
        try:
            full = np.broadcast_to(np.asarray(state, dtype=np.float64), (*self.batch_shape, 2))
        except (TypeError, ValueError) as error:
            raise EstimatorError(f"state does not broadcast to {(*self.batch_shape, 2)}: {error}") from error
        if not (np.absolute(full) <= LIMIT).all():
            raise EstimatorError("state is not finite; reset to finite numbers")
        chosen = mask.reshape(-1)
        self._state[:, chosen] = full.reshape(-1, 2)[chosen].T
        self._screen.forget(chosen)
        self._renewed |= chosen
        self._any_renewed = True

    def save(self) -> dict[str, AnyArray]:
        """Everything needed to continue later, as plain arrays."""
        screen = self._screen
        return {
            "schedule_sha256": np.array(self.schedule.sha256),
            "samples": np.array(self._samples),
            "state": self._state.copy(),
            "renewed": self._renewed.copy(),
            **{key: getattr(screen, key).copy() for key in MEMORY},
        }

    def restore(self, saved: Mapping[str, AnyArray]) -> None:
        """Continues from `save`, bit for bit.

        Raises:
            EstimatorError: saved by another schedule, another batch size, or incomplete; nothing is changed then.
        """
        own = self.save()
        for key, array in own.items():
            if key not in saved:
                raise EstimatorError(f"saved state lacks '{key}'")
            if np.shape(saved[key]) != array.shape:
                raise EstimatorError(f"saved '{key}' has shape {np.shape(saved[key])}, expected {array.shape}")
        if str(saved["schedule_sha256"]) != self.schedule.sha256:
            raise EstimatorError(f"saved with another schedule than '{self.schedule.name}' {self.schedule.sha256[:12]}")
        if not (np.absolute(saved["state"]) <= LIMIT).all():
            raise EstimatorError("saved 'state' is not finite")
        self._samples = int(saved["samples"])
        self._state[:], self._renewed[:] = saved["state"], saved["renewed"]
        self._any_renewed = bool(self._renewed.any())
        for key in MEMORY:
            getattr(self._screen, key)[:] = saved[key]
        self._screen.gaps = bool(self._screen.gap.any())

    def _entries(self, value: npt.ArrayLike, what: str) -> FloatArray:
        try:
            array = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise EstimatorError(f"{what} is not an array of numbers: {error}") from error
        if array.shape != self.batch_shape:
            raise EstimatorError(f"{what} has shape {array.shape}, expected the batch shape {self.batch_shape}")
        return array.reshape(-1)

    def _quick(self, few: ExactUpdateFew, u: FloatArray, y: FloatArray, p: FloatArray) -> LpvStep | None:
        """`step` in plain numbers; None, and nothing done, where more is wrong than missing measurements."""
        plain = self._screen.plain(u, y, p)
        if plain is None:
            return None
        missing, measured = plain.missing, plain.measurement
        coast = [False] * p.size
        for place in missing:
            coast[place], measured[place] = True, 0.0
        columns = (*self._state.tolist(), plain.held_input, measured, plain.parameter, coast)
        first, second, told = zip(*map(few.advance, *columns), strict=True)
        state = np.array(first + second)
        if not quiet(state):
            return None
        self._state, innovation, shape = state.reshape(2, -1), np.array(told), self.batch_shape
        self._screen.remember(u, p)
        self._samples += 1
        used, flags = self._all_used, self._no_flags
        if missing:
            innovation[missing] = np.nan
            used = np.logical_not(coast).reshape(shape)
            flags = np.where(used, 0, np.int32(Flag.MISSING_MEASUREMENT))
        return LpvStep(self.state, innovation.reshape(shape), used, flags, np.array(plain.parameter).reshape(shape))

    def _advance(
        self, u: FloatArray, y: FloatArray, p: FloatArray, coast: BoolArray | None, innovation: FloatArray
    ) -> None:
        if self._few is not None:
            masks = [False] * p.size if coast is None else coast.tolist()
            columns = (*self._state.tolist(), u.tolist(), y.tolist(), p.tolist(), masks)
            moved = [self._few.advance(*entry) for entry in zip(*columns, strict=True)]
            self._state[0], self._state[1], innovation[:] = zip(*moved, strict=True)
            return
        for start in range(0, p.size, _CHUNK):
            part = slice(start, start + _CHUNK)
            mask = None if coast is None else coast[part]
            self._update.advance(self._state[:, part], u[part], y[part], p[part], mask, innovation[part])

    def _guarded(self, flags: FlagArray | None) -> FlagArray | None:
        """Flags resets; a state beyond all bounds (an unstable model coasting for long) starts again from zero."""
        lost = not quiet(self._state)
        if not lost and not self._any_renewed:
            return flags
        if lost:
            gone = ~(np.absolute(self._state) <= LIMIT).all(axis=0)
            self._state[:, gone] = 0.0
            self._renewed |= gone
        marked: FlagArray = np.zeros(self._renewed.size, dtype=np.int32) if flags is None else flags
        raise_flag(marked, self._renewed, Flag.RESET)
        self._renewed[:] = self._any_renewed = False
        return marked
