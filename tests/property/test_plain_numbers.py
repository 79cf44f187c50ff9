"""What is done in plain numbers for one car, or a few, is what arrays do for many: to round-off, whatever comes in."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from estimators import GainSchedule, LpvVelocityObserver
from estimators.arguments import quiet
from estimators.arrays import FloatArray
from estimators.filters import KalmanFilter
from estimators.filters.scalar import ScalarKalmanFilter
from estimators.filters.three_states import informed
from estimators.forces import AttitudeObserver, BodyResponse, LateralForceEstimator, VerticalLoads, WheelForceFilter
from estimators.forces.lateral_few import FEW, LateralFew
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire, LtvKalmanObserver, SwitchedVelocityObserver
from tests.support.schedule_content import schedule_content

TIME = 0.005
CAR = VehicleParameters.published_suv()
BAD = st.sampled_from([math.nan, math.inf, -math.inf, 1e150])
SIZED = st.floats(-20, 20, width=32)
ANY = SIZED | SIZED | BAD | st.just(0.0)


def same(one: Any, many: Any, entry: Any, rtol: float = 1e-9, atol: float = 1e-9) -> None:
    """Every field of a step of the one beside that entry of the many."""
    for name in one._fields:
        np.testing.assert_allclose(getattr(one, name), getattr(many, name)[entry], rtol=rtol, atol=atol, err_msg=name)


def remembers_the_same(one: Any, many: Any, entry: Any) -> None:
    there, batch = many.save(), many.batch_shape
    for name, array in one.save().items():
        kept = there[name] if there[name].shape[: len(batch)] == batch else np.moveaxis(there[name], 0, -1)  # signals
        np.testing.assert_allclose(array, kept[entry], rtol=1e-9, atol=1e-9, err_msg=name)


@settings(max_examples=100, deadline=None)
@given(arrays(np.float64, (3, 3), elements=st.floats(-3, 3)), arrays(np.float64, (4, 3), elements=st.floats(-30, 30)))
def test_information_added_to_three_states(root: FloatArray, C: FloatArray) -> None:
    """Start from the inverse: P^-1 and C'C are added, and inverted by numpy."""
    lower = np.tril_indices(3)
    P, G = root @ root.T + 0.01 * np.eye(3), C.T @ C
    found = np.empty((3, 3))
    found[lower] = found[lower[::-1]] = informed(tuple(P[lower].tolist()), tuple(G[lower].tolist()))  # type: ignore[arg-type]
    expected = np.linalg.inv(np.linalg.inv(P) + G)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-7)
    assert np.linalg.eigvalsh(found)[0] > 0


@pytest.mark.parametrize("shape", [(), (4,), (6,), (7,), (2, 3), (5000,)])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e150])
def test_one_bad_entry_is_found_whatever_the_size(shape: tuple[int, ...], bad: float) -> None:
    value = np.full(shape, -30.0)
    assert quiet(value)
    value.flat[-1] = bad
    assert not quiet(value)


@pytest.mark.parametrize("gate", [None, 0.99])
@pytest.mark.parametrize("shape", [(), (1, 2)])
@settings(max_examples=25, deadline=None)
@given(arrays(np.float64, (12, 12), elements=ANY), st.floats(-0.5, 0.5))
def test_lateral_forces(shape: tuple[int, ...], gate: float | None, signals: FloatArray, steer: float) -> None:
    few, many = (LateralForceEstimator(CAR, TIME, batch, "linear", gate=gate) for batch in (shape, (FEW + 1,)))
    assert isinstance(few.filter, LateralFew)
    assert isinstance(many.filter, KalmanFilter)
    for k, row in enumerate(signals):
        if k == 6:
            few.reset()
            many.reset()
        forces = 200 * row[4:8], 4000 + 150 * row[8:]
        one = few.step(row[0], row[1], row[2], steer if k else row[3], *(np.tile(f, (*shape, 1)) for f in forces))
        all_ = many.step(row[0], row[1], row[2], steer if k else row[3], *(np.tile(f, (FEW + 1, 1)) for f in forces))
        entry = np.zeros(shape, dtype=int)
        same(one, all_, entry, atol=1e-5)
        np.testing.assert_allclose(few.filter.state, many.filter.state[entry], rtol=1e-9, atol=1e-8)
        np.testing.assert_allclose(few.filter.covariance, many.filter.covariance[entry], rtol=1e-7, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(arrays(np.float64, (12, 9), elements=ANY))
def test_attitude(signals: FloatArray) -> None:
    one, many = AttitudeObserver(TIME), AttitudeObserver(TIME, (5,))
    for k, row in enumerate(signals):
        if k == 6:
            one.reset(roll=0.2)
            many.reset(roll=0.2)
        rest = {"yaw_rate": row[6], "grade": row[7], "bank": row[8]} if k % 3 else {}
        motion = row[4:6] if k % 4 else (None, None)
        same(one.step(*row[:4], *motion, **rest), many.step(*row[:4], *motion, **rest), 0, atol=1e-12)
        remembers_the_same(one, many, 0)


@pytest.mark.parametrize("dynamic", [True, False])
@settings(max_examples=30, deadline=None)
@given(arrays(np.float64, (12, 5), elements=ANY))
def test_loads(dynamic: bool, signals: FloatArray) -> None:
    one, many = (VerticalLoads(CAR, TIME, shape, dynamic) for shape in ((), (5,)))
    for k, row in enumerate(signals):
        if k == 6:
            one.reset()
            many.reset()
        az = None if k % 3 == 0 else row[2]
        tilt = (None, None) if k % 4 == 0 else (0.05 * row[3], None if k % 5 == 0 else 0.05 * row[4])
        same(one.step(*row[:2], az, *tilt), many.step(*row[:2], az, *tilt), 0, atol=1e-8)
        remembers_the_same(one, many, 0)


@settings(max_examples=30, deadline=None)
@given(arrays(np.float64, (12, 2), elements=ANY))
def test_body_response(signals: FloatArray) -> None:
    one, many = BodyResponse(TIME), BodyResponse(TIME, (5,))
    for row in signals:
        np.testing.assert_allclose(one.step(row), many.step(np.tile(row, (5, 1)))[0], rtol=1e-12, atol=1e-12)
        remembers_the_same(one, many, 0)


@settings(max_examples=40, deadline=None)
@given(arrays(np.float64, (12, 3, 4), elements=ANY), arrays(np.bool_, (12, 4)))
def test_wheel_forces(signals: FloatArray, fresh: Any) -> None:
    """The linear road of the wheel force filter is the unscented one, with every fault and interval."""
    linear, unscented = (WheelForceFilter(CAR, TIME, method=m) for m in ("linear", "unscented"))  # type: ignore[arg-type]
    for k in range(12):
        row = 40 + signals[k, 0], 20 * signals[k, 1], 5000 + 100 * signals[k, 2], fresh[k] if k % 3 else None
        same(linear.step(*row), unscented.step(*row), ..., rtol=1e-7, atol=1e-4)


@settings(max_examples=40, deadline=None)
@given(arrays(np.float64, (10, 2), elements=SIZED | st.just(math.nan)), st.floats(0.5, 1.0), st.floats(-2, 2))
def test_scalar_filter(y: FloatArray, a: float, c: float) -> None:
    scalar, matrix = (kind(np.zeros((2, 1)), np.eye(1)) for kind in (ScalarKalmanFilter, KalmanFilter))
    for row in y:
        scalar.predict(a, 0.3)
        matrix.predict([[a]], [[0.3]])
        found, expected = scalar.correct(row, c, 0.2, 0.5), matrix.correct(row[:, None], [[c]], [[0.2]], [0.5])
        np.testing.assert_allclose(found.state, expected.state[:, 0], rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(found.variance, expected.covariance[:, 0, 0], rtol=1e-12)
        np.testing.assert_allclose(found.innovation, expected.innovation[:, 0], rtol=1e-12, atol=1e-13)
        np.testing.assert_array_equal(found.used, expected.used[:, 0])


@pytest.mark.parametrize("stale_after", [None, 2])
@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 3), SIZED | BAD), min_size=1, max_size=8), SIZED)
def test_lost_measurements_of_corners(stale_after: int | None, lost: list[tuple[int, float]], push: float) -> None:
    """Four corners (plain numbers) beside forty (arrays), with measurements that come and go."""
    schedule = GainSchedule.from_content(schedule_content("longitudinal"), "longitudinal")
    few, many = (LpvVelocityObserver(schedule, shape, stale_after=stale_after) for shape in ((4,), (10, 4)))
    for k, (corner, value) in enumerate(lost):
        u, y, p = np.full(4, push), 0.1 * np.sin(np.arange(4) + 0.3 * k), np.full(4, 40.0) + 0.01 * k
        y[corner] = value
        one, all_ = few.step(u, y, p), many.step(*(np.tile(v, (10, 1)) for v in (u, y, p)))
        same(one, all_, 3, rtol=1e-10, atol=1e-13)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 3), SIZED | BAD, st.floats(0, 0.4) | BAD), min_size=2, max_size=10), SIZED)
def test_switched_gains(lost: list[tuple[int, float, float]], push: float) -> None:
    schedule = GainSchedule.from_content(schedule_content("longitudinal"), "longitudinal")
    few, many = (SwitchedVelocityObserver(schedule, batch_shape=shape) for shape in ((4,), (10, 4)))
    for k, (corner, value, slip) in enumerate(lost):
        given_ = [np.full(4, push), 0.1 * np.sin(np.arange(4) + 0.3 * k), np.full(4, 40.0) + 0.01 * k, np.zeros(4)]
        given_[1][corner], given_[3][corner] = value, slip
        same(few.step(*given_), many.step(*(np.tile(v, (10, 1)) for v in given_)), 3, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("states", [2, 3])
@settings(max_examples=30, deadline=None)
@given(arrays(np.float64, (14, 4), elements=ANY), arrays(np.bool_, (14,)))
def test_time_varying_kalman(states: Any, signals: FloatArray, high: Any) -> None:
    few, many = (LtvKalmanObserver(BristleTire(), TIME, shape, states=states) for shape in ((2,), (9, 2)))
    for k, row in enumerate(signals):
        if k == 7:
            few.reset(state=0.1)
            many.reset(state=0.1)
        one = few.step(row[0], row[1] / 40.0, 5 * row[2], 20 * row[3], high[k])
        same(one, many.step(row[0], row[1] / 40.0, 5 * row[2], 20 * row[3], high[k]), 4, rtol=1e-7, atol=1e-9)
        scale = np.sqrt(np.einsum("bii->bi", many.filter.covariance[4]))
        scale = scale[:, :, None] * scale[:, None]
        np.testing.assert_allclose(few.filter.covariance / scale, many.filter.covariance[4] / scale, atol=1e-7)


def test_time_varying_kalman_without_measurements_for_long() -> None:
    few, many = (LtvKalmanObserver(BristleTire(), TIME, shape, states=2, normal=(1.0, 1e-3)) for shape in ((), (40,)))
    for _ in range(2600):  # longer than the 50 m/s of the bound take
        one, all_ = few.step(0.0, np.nan, 50.0), many.step(0.0, np.nan, 50.0)
    same(one, all_, 0)
    np.testing.assert_allclose(few.filter.covariance, many.filter.covariance[0], rtol=1e-6)
    assert few.filter.covariance[1, 1] < 2600.0
