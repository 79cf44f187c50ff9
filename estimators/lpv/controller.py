"""A feedback law of any size that follows a schedule over any number of parameters, for a batch of entries at once."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import finite, mask, vectors
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.display import displayed
from estimators.errors import EstimatorError, ScheduleError
from estimators.lpv.law import Law
from estimators.lpv.runtime import LpvRuntime, beyond_bounds
from estimators.schedule import GainSchedule


@displayed({})
class LpvControllerStep(NamedTuple):
    """What one step returns, ready for a log; leading axes are those of the batch."""

    command: FloatArray  # (..., nu) u to be held over the sample, within its limits
    limited: BoolArray  # (..., nu) whether a limit changed it
    used: BoolArray  # (...) whether the measurements were used
    flags: FlagArray  # (...) sums of `Flag`; 0 where nothing is wrong
    parameter: FloatArray  # (..., parameters) that were used


class LpvController(LpvRuntime):
    """u = Ck(p) xk + Dk(p) v, xk+ = Ak(p) xk + Bk(p) v once a sample, v the plant's states or outputs; static where it has no xk.

    The gains are the table that was proved (`gainsmith certify`); proofs are about commands within the limits.

    Where a limit cuts a command, the law's state is first moved to the nearest one that commands just that (conditioning, Hanus,
    Kinnaert, Henrotte 1987), so it does not wind up. Where the plant's input acts on a measured output at once (D), the
    measurement was taken while the command before was held: D (u - u before) is added.

    Measurements that are missing (one of them not finite) or stale are not used: the law waits, and the command before is held
    for `hold` samples, then halved with every sample towards the value within its limits that is nearest to zero. Nothing is
    proved of such samples. A missing parameter is held at its last finite value; one outside its certified range is clipped to
    it, and those that break a constraint between them are drawn to the border of their set. All of this is flagged, and commands
    are finite always.

    Args:
        schedule: of a feedback law, of any size.
        batch_shape: shape of every entry's signals given to `step`; () for one plant, (10000,) for many runs.
        outside: a parameter or a rate outside the certified box is clipped and flagged ("flag") or raises ("refuse").
        stale_after: measurements that all repeat exactly for more than so many samples are stale; None: never.
        hold: samples for which a command is held without measurements.

    Raises:
        EstimatorError: an option that means nothing.
        ScheduleError: the schedule of an observer, or gains beyond what float64 can multiply.

    >>> import sympy as sp
    >>> one = {key: (Signal(name, "1"),) for key, name in zip(("states", "inputs", "outputs", "disturbances"), "xuyw")}
    >>> A, B = sp.Matrix([[sp.Symbol("p")]]), sp.Matrix([[1]])
    >>> p = SchedulingParameter("p", "1", 1.0, 2.0, -1.0, 1.0)
    >>> plant = LpvModel(name="unstable", source="example", parameters=(p,), A=A, B=B, C=B, E=B, **one)
    >>> asked = StateFeedbackDesign((FeedbackChannel(("w",), ("x", "u")),), backoff=0.3)
    >>> deployment = deploy(design_sampled_state_feedback(plant, asked, 0.05), DeploySettings(sample_time=0.05))
    >>> controller = LpvController(GainSchedule.from_content(schedule_content(deployment, "unstable")))
    >>> float(controller.step(0.1, 1.5).command[0]) < 0.0  # pushes back
    True
    """

    memory = ("_state", "_command", "waiting", "samples", "renewed")

    def __init__(
        self,
        schedule: GainSchedule,
        batch_shape: tuple[int, ...] = (),
        outside: Literal["flag", "refuse"] = "flag",
        stale_after: int | None = None,
        hold: int = 10,
    ) -> None:
        if schedule.update != "feedback":
            raise ScheduleError(f"schedule '{schedule.name}' is that of an observer; take LpvObserver")
        if hold < 0:
            raise EstimatorError(f"hold = {hold} samples must not be negative")
        self.law, self.hold = Law(schedule), int(hold)
        super().__init__(schedule, batch_shape, outside, stale_after, self.law.order, 0, self.law.measured)
        count = len(self._state)
        self._command: FloatArray = np.tile(self.law.rest, (count, 1))
        self.waiting = np.zeros(count, dtype=np.int64)  # samples without measurements

    def _used(self, measurement: FloatArray) -> FloatArray:
        return self.law.used(measurement)

    def step(self, measurement: npt.ArrayLike, parameter: npt.ArrayLike) -> LpvControllerStep:
        """Commands for the sample that begins; arguments have the shapes (*batch_shape, nv) and (.., parameters).

        The last axis may be left out where it is one long. Where no gain uses a measurement it may be anything, NaN too.

        Raises:
            EstimatorError: another shape, or not numbers.
            RangeError: outside the certified box, if the controller refuses that; nothing is changed then.
        """
        count = len(self._state)
        seen = self._signals(np.zeros((count, 0)), measurement, parameter)
        found = self.law.advance(self._state, self._command, seen.measurement, seen.parameter)
        state, command, limited = found
        used: BoolArray = np.ones(count, dtype=np.bool_)
        if seen.coast is not None:
            used = ~seen.coast
            self.waiting = np.where(used, 0, self.waiting + 1)
            waits = seen.coast[:, None]
            fading = (self.waiting > self.hold)[:, None]
            kept = np.where(fading, self.law.rest + 0.5 * (self._command - self.law.rest), self._command)
            state, command = np.where(waits, self._state, state), np.where(waits, kept, command)
            limited = limited & ~waits
        else:
            self.waiting[:] = 0
        gone = beyond_bounds(state, command)
        if gone is not None:
            state, command = np.where(gone[:, None], 0.0, state), np.where(gone[:, None], self.law.rest, command)
        self._state, self._command = state, command
        flags = self._flagged(seen, gone)
        return LpvControllerStep(
            self._shaped(command.copy()),
            limited.reshape(*self.batch_shape, limited.shape[-1]),
            used.reshape(self.batch_shape),
            flags,
            self._shaped(seen.parameter),
        )

    def reset(self, where: npt.ArrayLike | None = None) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to rest: state zero, the command nearest to zero.

        The next step carries the flag RESET for these entries.

        Raises:
            EstimatorError: another shape.
        """
        self._forget(mask(where, self.batch_shape, "where"))

    def start(
        self,
        command: npt.ArrayLike,
        measurement: npt.ArrayLike,
        parameter: npt.ArrayLike,
        where: npt.ArrayLike | None = None,
    ) -> None:
        """Takes over from `command` without a bump: the next step with this measurement and parameter commands just that.

        The law's state is the one that does, and that moves least from there. A law without states commands what it commands, and
        one with too few comes as near as it can. Shapes as in `step`; the flag RESET follows.

        Raises:
            EstimatorError: another shape, or not finite.
            RangeError: parameters outside the certified range.
        """
        nu, count = len(self.schedule.inputs), len(self.schedule.parameters)
        chosen = mask(where, self.batch_shape, "where")
        flat = chosen.reshape(-1)
        seen = self.law.used(vectors(measurement, self.batch_shape, self.law.measured, "measurement"))
        sizes = (
            (vectors(command, self.batch_shape, nu, "command"), nu, "command"),
            (seen, self.law.measured, "measurement"),
            (vectors(parameter, self.batch_shape, count, "parameter"), count, "parameter"),
        )
        u, v, p = (finite(value, (len(flat), size), what)[flat] for value, size, what in sizes)
        within = self.schedule.certified(p if count > 1 else p[:, 0]).reshape(len(u), count)
        self._forget(chosen)
        self._command[flat] = np.clip(u, self.law.low, self.law.high)
        self._state[flat] = self.law.starting(self._command[flat], v, within)

    def _forget(self, chosen: BoolArray) -> BoolArray:
        flat = super()._forget(chosen)
        self._command[flat], self.waiting[flat] = self.law.rest, 0
        return flat
