"""What an observer and a feedback law share: an entry that is reset is new, one that grows beyond bounds starts afresh."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators import Flag, GainSchedule, LpvController, LpvObserver
from estimators.arrays import FloatArray
from tests.support.any_size import any_schedule


def law(gain: float) -> GainSchedule:
    """u = gain x_1 of three states, for both inputs."""
    table = np.zeros((3, 2, 3))
    table[..., 0] = gain
    return any_schedule((3, 2, 2), 1, table=table, update="feedback", measured="states", order=0, limits=(None, None))


def observer() -> tuple[LpvObserver, Any]:
    runtime = LpvObserver(any_schedule((3, 2, 2), 1), (2,), stale_after=2)
    return runtime, lambda v, p: runtime.step(np.full((2, 2), v), np.full((2, 2), 0.3), np.full(2, p))


def controller() -> tuple[LpvController, Any]:
    runtime = LpvController(law(0.5), (2,), stale_after=2)
    return runtime, lambda _, p: runtime.step(np.full((2, 3), 0.3), np.full(2, p))


@pytest.mark.parametrize("build", [observer, controller])
def test_an_entry_that_is_reset_is_new(build: Any) -> None:
    """Input, parameter, the run of equal measurements and the state are forgotten, of this entry alone."""
    (runtime, step), (_, kept), (_, fresh) = build(), build(), build()
    for _ in range(4):
        step(1.0, 0.5)
        kept(1.0, 0.5)
    runtime.reset(np.array([True, False]))
    mine, other, new = (one(np.nan, np.nan) for one in (step, kept, fresh))
    assert mine.flags[0] == new.flags[0] | Flag.RESET
    assert mine.flags[1] & Flag.STALE_MEASUREMENT and not mine.flags[0] & Flag.STALE_MEASUREMENT
    for name in mine._fields:
        if name != "flags":
            np.testing.assert_array_equal(getattr(mine, name)[0], getattr(new, name)[0], err_msg=name)
        np.testing.assert_array_equal(getattr(mine, name)[1], getattr(other, name)[1], err_msg=name)


@pytest.mark.parametrize(("gain", "gone"), [(10.0, True), (0.1, False)])
def test_a_command_beyond_all_bounds_is_none(gain: float, gone: bool) -> None:
    runtime = LpvController(law(gain), (2,))
    measured: FloatArray = np.array([[3e99, 0.0, 0.0], [1.0, 0.0, 0.0]])
    step = runtime.step(measured, np.full(2, 0.5))
    assert bool(step.flags[0] & Flag.RESET) == gone
    np.testing.assert_allclose(step.command, gain * measured[:, :1] * [[not gone], [True]] * np.ones((1, 2)))
    assert not step.flags[1]
