"""An observer of any size that follows a schedule over any number of parameters, for a batch of entries at once."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import finite, mask, vectors
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.display import displayed
from estimators.lpv.exact_step import ExactStep
from estimators.lpv.runtime import LpvRuntime, beyond_bounds
from estimators.schedule import GainSchedule

_CHUNK = 4096  # entries worked on at once: what lies between the operations stays in the cache


@displayed({})
class LpvObserverStep(NamedTuple):
    """What one step returns, ready for a log; leading axes are those of the batch."""

    estimate: FloatArray  # (..., nx) states at the end of the sample
    innovation: FloatArray  # (..., ny) y - C xhat - D u at its start; NaN where that measurement is missing
    used: BoolArray  # (...) whether the measurements corrected the estimate
    flags: FlagArray  # (...) sums of `Flag`; 0 where nothing is wrong
    parameter: FloatArray  # (..., parameters) that were used


class LpvObserver(LpvRuntime):
    """xhat' = A(p) xhat + B(p) u + L(p) (y - C(p) xhat - D(p) u), updated exactly with u, y and p held over a sample.

    A schedule whose update is "sampled" instead predicts exactly with u and p held and adds K(p) (y - C(p) xhat - D(p) u) once a
    sample. Plant and gains are the polynomial and the table that were proved (`gainsmith certify`).

    Measurements that are missing (one of them not finite) or stale are not used: the entry coasts with L = 0. A missing input
    or parameter is held at its last finite value; a parameter outside its certified range is clipped to it, parameters that
    break a constraint between them are drawn to the border of their set. All of this is flagged,
    and estimates are finite always. `LpvVelocityObserver` is the faster form for two states, one input and one output.

    Args:
        schedule: of any size.
        batch_shape: shape of every entry's signals given to `step`; () for one plant, (10000,) for many runs.
        outside: a parameter or a rate outside the certified box is clipped and flagged ("flag") or raises ("refuse").
        stale_after: measurements that all repeat exactly for more than so many samples are stale; None: never.

    Raises:
        EstimatorError: an option that means nothing.
        ScheduleError: gains or a model whose error grows beyond all bounds within one sample.

    >>> observer = LpvObserver(GainSchedule.shipped("longitudinal-speed"))
    >>> step = observer.step(held_input=0.0, measurement=0.1, parameter=50.0)
    >>> bool(step.used), Flag(int(step.flags)) == Flag(0)
    (True, True)
    """

    def __init__(
        self,
        schedule: GainSchedule,
        batch_shape: tuple[int, ...] = (),
        outside: Literal["flag", "refuse"] = "flag",
        stale_after: int | None = None,
    ) -> None:
        self.exact = ExactStep(schedule)
        self.sizes = self.exact.sizes
        super().__init__(schedule, batch_shape, outside, stale_after, *self.sizes)

    def step(self, held_input: npt.ArrayLike, measurement: npt.ArrayLike, parameter: npt.ArrayLike) -> LpvObserverStep:
        """Moves every entry by one sample; arguments have the shapes (*batch_shape, nu), (.., ny) and (.., parameters).

        The last axis may be left out where it is one long.

        Raises:
            EstimatorError: another shape, or not numbers.
            RangeError: outside the certified box, if the observer refuses that; the state is then unchanged.
        """
        shape = self.batch_shape
        seen = self._signals(vectors(held_input, shape, self.sizes[1], "input"), measurement, parameter)
        used = None if seen.coast is None else ~seen.coast
        innovation = np.empty_like(seen.measurement)
        moved = np.empty_like(self._state)
        for start in range(0, len(moved), _CHUNK):
            part = slice(start, start + _CHUNK)
            moved[part], innovation[part] = self.exact.advance(
                self._state[part], seen.held_input[part], seen.measurement[part], seen.parameter[part],
                None if used is None else used[part],
            )  # fmt: skip
        gone = beyond_bounds(moved)  # an unstable model coasting for long
        if gone is not None:
            moved[gone] = 0.0
        self._state = moved
        flags = self._flagged(seen, gone)
        if seen.missing is not None:
            innovation[seen.missing] = np.nan
        everywhere: BoolArray = np.ones(shape, dtype=np.bool_) if used is None else used.reshape(shape)
        return LpvObserverStep(self.state, self._shaped(innovation), everywhere, flags, self._shaped(seen.parameter))

    def reset(self, where: npt.ArrayLike | None = None, state: npt.ArrayLike = 0.0) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to `state` and forgets what they have seen.

        `state` broadcasts to (*batch_shape, states). The next step carries the flag RESET for these entries.

        Raises:
            EstimatorError: another shape, or a state that is not finite.
        """
        chosen = mask(where, self.batch_shape, "where")
        full = finite(state, (*self.batch_shape, self.sizes[0]), "state").reshape(self._state.shape)
        flat = self._forget(chosen)
        self._state[flat] = full[flat]
