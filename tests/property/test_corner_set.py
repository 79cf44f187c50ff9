"""The corner observers of one car, in plain numbers, are those of many cars, in arrays: whatever comes in."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators import GainSchedule
from estimators.arrays import FloatArray
from estimators.pipeline import CornerObservers, KalmanCorners, SwitchedCorners
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire, SlipWeights
from tests.support.schedule_content import schedule_content

CAR = VehicleParameters.published_suv()
SCHEDULES = [GainSchedule.from_content(schedule_content(n), n) for n in ("longitudinal", "lateral")]
FAULTS = st.lists(
    st.tuples(st.integers(0, 9), st.integers(0, 18), st.sampled_from([math.nan, math.inf, -math.inf, 1e150])),
    max_size=12,
)
SPEEDS = st.lists(st.sampled_from([20.0, 3.0, 0.0, -4.0]), min_size=10, max_size=10)


def observers(lateral: bool, weights: SlipWeights | None, kind: str = "scheduled") -> list[CornerObservers]:
    """Of one car, of a batch of one, and of a batch of two."""
    along, across = SCHEDULES

    def make(shape: tuple[int, ...]) -> Any:
        kinds = {"switched": SwitchedCorners, "Kalman": lambda _, four: KalmanCorners(BristleTire(), 0.005, four)}
        return kinds[kind](along, (*shape, 4)) if kind in kinds else along

    return [CornerObservers(CAR, make(b), across if lateral else None, b, weights) for b in ((), (1,), (2,))]


def stepped(corners: CornerObservers, row: FloatArray, speed: float) -> Any:
    shape = corners.batch_shape

    def wide(values: Any) -> Any:
        return np.broadcast_to(values, (*shape, *np.shape(values)))

    with np.errstate(invalid="ignore"):
        wheels, steer = speed * (1.0 + 0.1 * row[:4]) / 0.33, 0.3 * row[4:8]
    body = (5.0 * row[8], 5.0 * row[9], row[10])
    use = 0.5 * row[11:15], 0.5 * row[15:19]
    signals = [wide(value) for value in (wheels, steer, *body, *use, row[19])]
    return corners.step(*signals)


def alike(first: Any, second: Any, name: str) -> None:
    np.testing.assert_allclose(first, second, rtol=1e-9, atol=1e-9, err_msg=name)


@pytest.mark.parametrize("lateral", [True, False])
@pytest.mark.parametrize("weights", [None, SlipWeights()])
@pytest.mark.parametrize("kind", ["scheduled", "switched", "Kalman"])
@settings(max_examples=10, deadline=None)
@given(st.integers(0, 1000), FAULTS, SPEEDS)
def test_one_car_is_an_entry_of_many(
    kind: str,
    lateral: bool,
    weights: SlipWeights | None,
    seed: int,
    faults: list[tuple[int, int, float]],
    speeds: list[float],
) -> None:
    """Forwards, at standstill and in reverse, with samples missing, infinite or absurd, and a reset on the way."""
    signals = np.random.default_rng(seed).uniform(-1.0, 1.0, (10, 20))
    for sample, channel, value in faults:
        signals[sample, channel] = value
    one, alone, many = observers(lateral, weights, kind)
    for k, row in enumerate(signals):
        if k == 6:
            for each in (one, alone, many):
                each.reset()
        step, single, batch = (stepped(each, row, speeds[k]) for each in (one, alone, many))
        for name in step._fields:
            alike(getattr(step, name), getattr(single, name)[0], name)
            alike(getattr(step, name), getattr(batch, name)[1], name)
        assert np.isfinite([step.vx, step.vy]).all()


def test_a_car_that_is_reset_alone_leaves_the_others() -> None:
    rows = 0.2 * np.random.default_rng(0).normal(size=(12, 20))
    still, touched = (observers(True, SlipWeights())[2] for _ in range(2))
    for row in rows[:6]:
        stepped(still, row, 15.0)
        stepped(touched, row, 15.0)
    touched.reset(np.array([True, False]))
    first, second = stepped(still, rows[6], 15.0), stepped(touched, rows[6], 15.0)
    assert first.vx[1] == second.vx[1]
    assert first.vx[0] != second.vx[0]


@pytest.mark.parametrize("kind", ["scheduled", "switched", "Kalman"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_memory_continues_bit_for_bit(place: int, kind: str) -> None:
    rows = np.random.default_rng(1).uniform(-0.3, 0.3, size=(12, 20))
    rows[4, 2] = math.nan
    going, other = (observers(True, SlipWeights(), kind)[place] for _ in range(2))
    for row in rows[:6]:
        stepped(going, row, 12.0)
    other.restore(going.save())
    for row in rows[6:]:
        expected, found = stepped(going, row, 12.0), stepped(other, row, 12.0)
        for name in expected._fields:
            np.testing.assert_array_equal(getattr(found, name), getattr(expected, name), err_msg=name)
