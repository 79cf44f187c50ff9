"""Gain switching by slip: two gain schedules for every corner, P3 (19) and Example 2.

    mode 1 (normal) while |lambda| < limit, mode 2 (high slip) from there on; limit 0.15 in P3

In high slip the force says little about the slip velocity, and mode 2 follows the kinematics instead. A hysteresis keeps
the mode until the slip has fallen below (1 - hysteresis) limit; 0, as in P3, switches at the limit in both directions.
Both modes share one state, and each advances it by the exact closed-loop update of its own gains (`exact_update`).
"""

from __future__ import annotations

import dataclasses
import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import batch, entries, mask
from estimators.arrays import BoolArray, FlagArray, FloatArray
from estimators.errors import EstimatorError
from estimators.memory import Memory
from estimators.schedule import GainSchedule
from estimators.velocity.lpv import TwoStateObserver

HIGH_SLIP_GAIN = (0.22, 0.1)
"""L_x of P3's second mode, m/s and m/s^2."""


def with_constant_gain(schedule: GainSchedule, gain: tuple[float, float] = HIGH_SLIP_GAIN) -> GainSchedule:
    """The plant of a schedule with one constant gain L of the update "held", unproved, so without a digest.

    Raises:
        EstimatorError: a gain that is not two finite numbers.
    """
    pair = np.asarray(gain, dtype=np.float64)
    if pair.shape != (2,) or not np.isfinite(pair).all():
        raise EstimatorError(f"gain = {gain!r} must be two finite numbers, L_1 in m/s and L_2 in m/s^2")
    table = np.tile(pair[None, :, None], (len(schedule.breakpoints), 1, 1))
    table.flags.writeable = False
    name = f"{schedule.name} with L = [{pair[0]:g}, {pair[1]:g}]"
    return dataclasses.replace(schedule, name=name, table=table, update="held", sha256="")


class SlipSwitch(Memory):
    """Which mode each corner is in; a missing slip changes nothing.

    Raises:
        EstimatorError: a limit not above 0, a hysteresis outside [0, 1).
    """

    memory = ("high",)

    def __init__(self, batch_shape: tuple[int, ...] = (4,), limit: float = 0.15, hysteresis: float = 0.0) -> None:
        if not (math.isfinite(limit) and limit > 0 and 0.0 <= hysteresis < 1.0):
            raise EstimatorError(f"limit = {limit!r} must be above 0 and hysteresis = {hysteresis!r} in [0, 1)")
        self.limit, self.release = limit, limit * (1.0 - hysteresis)
        self.high: BoolArray = np.zeros(batch(batch_shape), dtype=np.bool_)

    def __call__(self, slip: FloatArray) -> BoolArray:
        """Mode 2 where True, from the slip ratios of the batch shape."""
        size = np.absolute(slip)
        above = np.where(self.high, size >= self.release, size >= self.limit)
        self.high = np.where(np.isfinite(size), above, self.high)
        return self.high.copy()


class SwitchedStep(NamedTuple):
    """As the step of `LpvVelocityObserver`, with the mode."""

    estimate: FloatArray  # (..., 2) z in m, V_r in m/s at the end of the sample
    innovation: FloatArray  # (...) NaN where the measurement is missing
    used: BoolArray
    flags: FlagArray
    high_slip: BoolArray  # (...) mode 2


class SwitchedVelocityObserver(TwoStateObserver):
    """Two-state observer of every corner with two gain schedules over one plant.

    Args:
        normal: gains of mode 1.
        high_slip: gains of mode 2; None: P3's, on the plant of `normal`.
        batch_shape: shape of every argument of `step`.
        limit: of |slip|, and
        hysteresis: share of it below which mode 1 returns.
        stale_after: samples after which a measurement that repeats exactly is stale; None: never.

    Raises:
        EstimatorError: schedules of another size or for different sample times, settings as in `SlipSwitch`.
        ScheduleError: gains whose error grows beyond all bounds within a sample.

    >>> import numpy as np
    >>> observer = SwitchedVelocityObserver(GainSchedule.shipped("resilient-velocity-longitudinal"))
    >>> observer.step(np.zeros(4), np.zeros(4), np.full(4, 60.0), slip=np.zeros(4)).estimate.shape  # two states a wheel
    (4, 2)
    """

    parts = ("switch", "monitor")

    def __init__(
        self,
        normal: GainSchedule,
        high_slip: GainSchedule | None = None,
        batch_shape: tuple[int, ...] = (4,),
        limit: float = 0.15,
        hysteresis: float = 0.0,
        stale_after: int | None = None,
    ) -> None:
        second = with_constant_gain(normal) if high_slip is None else high_slip
        if second.sample_time != normal.sample_time:
            raise EstimatorError(
                f"schedules '{normal.name}' and '{second.name}' are for sample times {normal.sample_time:g} s and "
                f"{second.sample_time:g} s; design both for one"
            )
        super().__init__((normal, second), batch_shape, stale_after=stale_after)
        self.switch = SlipSwitch(self.batch_shape, limit, hysteresis)

    def step(
        self, held_input: npt.ArrayLike, measurement: npt.ArrayLike, parameter: npt.ArrayLike, slip: npt.ArrayLike
    ) -> SwitchedStep:
        """u in m/s^2, mu, w in rad/s and the slip ratio, each of the batch shape.

        Raises:
            EstimatorError: another shape.
        """
        high = self.switch(entries(slip, self.batch_shape, "slip"))
        return SwitchedStep(*self._step(held_input, measurement, parameter, high.reshape(-1))[:4], high)

    def reset(self, where: npt.ArrayLike | None = None, state: npt.ArrayLike = 0.0) -> None:
        """Sets the entries `where` (mask of the batch shape; None: all) to `state` (2,), in mode 1.

        Raises:
            EstimatorError: another shape, or a state that is not finite.
        """
        super().reset(where, state)
        self.switch.high[mask(where, self.batch_shape, "where")] = False
