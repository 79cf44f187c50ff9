"""Reset, save and restore."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest

from estimators import EstimatorError, Flag, GainSchedule, LpvStep, LpvVelocityObserver
from tests.support.schedule_content import schedule_content

SCHEDULE = GainSchedule.from_content(schedule_content())
SAMPLED = GainSchedule.from_content(schedule_content(gains=(1e-3, 0.05), update="sampled"))
SIZES = [(4,), (5, 4)]


def steps(runner: LpvVelocityObserver, seed: int, count: int) -> list[LpvStep]:
    """Noise with gaps in every channel."""
    draw = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        u, y, p = draw.normal(0, 1, (3, *runner.batch_shape))
        p = 40 + p
        for channel in (u, y, p):
            channel[draw.random(channel.shape) < 0.1] = np.nan
        found.append(runner.step(u, np.round(y), p))
    return found


@pytest.mark.parametrize("schedule", [SCHEDULE, SAMPLED], ids=["held", "sampled"])
@pytest.mark.parametrize("shape", SIZES)
def test_a_restored_observer_continues_bit_for_bit(shape: tuple[int, ...], schedule: GainSchedule) -> None:
    first, second = (LpvVelocityObserver(schedule, shape, stale_after=2) for _ in range(2))
    steps(first, 1, 40)
    first.reset(np.arange(np.prod(shape)).reshape(shape) % 3 == 0, [1e-3, 2.0])
    buffer = io.BytesIO()
    np.savez(buffer, **first.save())  # plain arrays: any array file will do
    buffer.seek(0)
    with np.load(buffer, allow_pickle=False) as saved:
        second.restore(saved)
    for one, other in zip(steps(first, 2, 40), steps(second, 2, 40), strict=True):
        for mine, theirs in zip(one, other, strict=True):
            assert mine.tobytes() == theirs.tobytes()


@pytest.mark.parametrize("shape", SIZES)
def test_reset_of_some_entries_forgets_only_those(shape: tuple[int, ...]) -> None:
    runner, fresh = (LpvVelocityObserver(SCHEDULE, shape) for _ in range(2))
    y, p = np.full(shape, 0.1), np.full(shape, 100.0)
    for _ in range(10):
        runner.step(np.ones(shape), y, p)
    kept = runner.state
    where = np.zeros(shape, dtype=bool)
    where[..., 1] = True
    runner.reset(where, state=[1e-4, 0.25])
    fresh.reset(where, state=[1e-4, 0.25])
    np.testing.assert_array_equal(runner.state[~where], kept[~where])
    np.testing.assert_array_equal(runner.state[where], fresh.state[where])
    lost = np.full(shape, np.nan)
    step, expected = runner.step(lost, y, p - 20), fresh.step(lost, y, p - 20)
    np.testing.assert_array_equal(step.estimate[where], expected.estimate[where])  # the held input is forgotten
    assert (step.flags[where] == Flag.RESET | Flag.MISSING_INPUT).all()  # and so is the last speed
    assert (step.flags[~where] == Flag.MISSING_INPUT | Flag.RATE_OUT_OF_RANGE).all()
    assert not runner.step(y, y, p - 20).flags.any()


def test_bad_resets_are_refused() -> None:
    runner = LpvVelocityObserver(SCHEDULE)
    for where, state, message in [
        (np.ones(3, dtype=bool), 0.0, r"where: bool \(3,\), expected a bool mask of shape \(4,\)"),
        (np.ones(4), 0.0, "where: float64"),
        (None, np.zeros(3), r"state has shape \(3,\), expected \(4, 2\)"),
        (None, [0.0, np.nan], "state is not finite"),
    ]:
        with pytest.raises(EstimatorError, match=message):
            runner.reset(where, state)
    assert not runner.state.any()


def test_bad_savings_are_refused_and_change_nothing() -> None:
    runner = LpvVelocityObserver(SCHEDULE)
    steps(runner, 3, 5)
    before = runner.save()
    other = GainSchedule.from_content(schedule_content("lateral"))
    bad: list[tuple[dict[str, Any], str]] = [
        ({key: value for key, value in before.items() if key != "monitor.gap"}, "lacks 'monitor.gap'"),
        ({**before, "state": np.zeros((2, 5))}, r"'state' is float64 \(2, 5\), expected float64 \(2, 4\)"),
        ({**before, "state": np.full((2, 4), np.nan)}, "'state' is not finite"),
        (LpvVelocityObserver(other).save(), "saved with another schedule than 'test-longitudinal'"),
        (LpvVelocityObserver(SAMPLED).save(), "saved with another schedule than 'test-longitudinal'"),
    ]
    for saved, message in bad:
        with pytest.raises(EstimatorError, match=message):
            runner.restore(saved)
    for key, array in runner.save().items():
        np.testing.assert_array_equal(array, before[key])


def test_what_a_step_returned_does_not_change_later() -> None:
    for shape in SIZES:
        runner = LpvVelocityObserver(SCHEDULE, shape)
        found = steps(runner, 4, 6)
        copies = [[array.copy() for array in step] for step in found]
        given = np.full(shape, 0.3)
        runner.step(given, given, given)
        steps(runner, 5, 6)
        assert (given == 0.3).all()
        for step, copied in zip(found, copies, strict=True):
            for array, copy in zip(step, copied, strict=True):
                np.testing.assert_array_equal(array, copy)
