"""The filter inside the fusion, for many cars and for one, against the general Kalman filter; and its settings."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.filters import KalmanFilter
from estimators.velocity import FusionSettings
from estimators.velocity.speed_filter import SpeedFilter
from estimators.velocity.speed_filter_few import SpeedFilterFew, speed_filter

RNG = np.random.default_rng(0)
N, RUNS, LEARNED = 5, 7, 3
MEAN = RNG.normal(size=N)
SPREAD = np.diag(1.0 + RNG.random(N))
SPREAD[1, 4] = SPREAD[4, 1] = 0.6  # these two forget alike
RATES, PLACE, PER_METRE = np.array([9.0, 0.5, 2.0, 9.0, 0.5]), 3, 0.01
SEEN = ((0, 2, 4), (1, 3, 0), (0, 1, 3))
MOVING = (1, 2, 4)
COUNTS = pytest.mark.parametrize("count", [1, RUNS], ids=["one car", "many cars"])


def fresh(count: int, every: int = 1, learned: int = LEARNED) -> SpeedFilter:
    return speed_filter(MEAN, SPREAD, RATES, (PLACE, PER_METRE), learned, every, count)


def told(rows: np.ndarray, count: int) -> list[Any]:
    """Rows (k, count) as numbers of one car or arrays of many."""
    return rows[:, 0].tolist() if count == 1 else list(rows)


def moved(filter_: SpeedFilter, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    count = filter_.count
    elapsed, pace, noise = rng.random((3, count))
    pace, coupling, shift = 20 * pace, rng.normal(size=(3, count)), rng.normal(size=count)
    time, speed, u, w = told(np.stack([elapsed, pace, shift, noise]), count)
    filter_.move(time, speed, MOVING, tuple(told(coupling, count)), u, w)
    return elapsed, pace, coupling, shift, noise


def asked(filter_: SpeedFilter, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Puts the channels of SEEN to the filter; H (count, 3, n), and what the filter says of H P H' (count, 3)."""
    H = np.zeros((filter_.count, len(SEEN), N))
    values = rng.normal(size=(3, len(SEEN), filter_.count))  # of the first state of every channel, of the second ...
    for k, columns in enumerate(SEEN):
        H[:, k, list(columns)] = values[:, k].T
    explained = filter_.expect(SEEN, [told(over, filter_.count) for over in values])
    return H, np.stack([np.atleast_1d(value) for value in explained], axis=1)


def test_the_kind_follows_the_count() -> None:
    assert type(fresh(1)) is SpeedFilterFew
    assert type(fresh(2)) is SpeedFilter


@COUNTS
def test_moving_is_the_prediction_of_a_kalman_filter(count: int) -> None:
    rng = np.random.default_rng(1)
    one, two = fresh(count), KalmanFilter(np.broadcast_to(MEAN, (count, N)), SPREAD)
    for _ in range(3):
        elapsed, pace, coupling, shift, noise = moved(one, rng)
        A, Q = np.broadcast_to(np.eye(N), (count, N, N)).copy(), np.zeros((count, N, N))
        A[:, 0, list(MOVING)] = coupling.T
        Q[:, 0, 0] = noise
        u = np.zeros((count, N))
        u[:, 0] = shift
        two.predict(A, Q, np.eye(N), u)
        phi = np.exp(-elapsed[:, None] * RATES)
        phi[:, PLACE] = np.exp(-elapsed * PER_METRE * pace)
        phi[:, 0] = 1.0
        prior = SPREAD.copy()
        prior[0] = prior[:, 0] = 0.0
        Q = (1.0 - phi[:, :, None] * phi[:, None, :]) * prior
        Q[:, 0, 0] = 1e-300  # the speed forgets nothing; a Kalman filter wants it positive
        two.predict(phi[:, :, None] * np.eye(N), Q, np.eye(N), (1.0 - phi) * MEAN)
        np.testing.assert_allclose(one.state, two.state, rtol=1e-10, atol=1e-12)
        np.testing.assert_allclose(one.covariance, two.covariance, rtol=1e-9, atol=1e-12)


@COUNTS
def test_weighing_is_the_correction_of_a_kalman_filter(count: int) -> None:
    rng = np.random.default_rng(2)
    one = fresh(count)
    moved(one, rng)
    for _ in range(3):
        two = KalmanFilter(one.state, one.covariance)
        H, explained = asked(one, rng)
        np.testing.assert_allclose(explained, np.einsum("bki,bij,bkj->bk", H, one.covariance, H), rtol=1e-10)
        y, variance = rng.normal(size=(count, 3)), 0.1 + rng.random((count, 3))
        lost = rng.random((count, 3)) < 0.4
        innovation = y - (H @ one.state[..., None])[..., 0]
        R = variance[..., None] * np.eye(3)
        later, earlier, shared = 2, 1, -0.9 * np.sqrt(variance[:, 2] * variance[:, 1])
        R[:, later, earlier] = R[:, earlier, later] = shared
        pairs = [(later, earlier, told(shared[None], count)[0])]
        one.weigh(told(innovation.T, count), told(variance.T, count), told(~lost.T, count), shared=pairs)
        step = two.correct(np.where(lost, np.nan, y), H, R)
        np.testing.assert_allclose(one.state, step.state, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(one.covariance, step.covariance, rtol=1e-8, atol=1e-8)


@COUNTS
def test_a_considered_state_stays_and_is_not_forgotten(count: int) -> None:
    """Schmidt, in the form of Joseph, which holds for any gain: the best one, with nothing for what must stay."""
    rng = np.random.default_rng(3)
    one = fresh(count)
    moved(one, rng)
    P, x = one.covariance, one.state
    H, _ = asked(one, rng)
    R, nu = 0.1 * np.eye(3), rng.normal(size=(count, 3))
    one.weigh(told(nu.T, count), [0.1] * 3, told(np.ones((3, count), dtype=np.bool_), count), False)
    K = P @ np.swapaxes(H, 1, 2) @ np.linalg.inv(H @ P @ np.swapaxes(H, 1, 2) + R)
    K[:, LEARNED:] = 0.0
    left = np.eye(N) - K @ H
    np.testing.assert_allclose(one.state, x + (K @ nu[..., None])[..., 0], rtol=1e-9, atol=1e-12)
    expected = left @ P @ np.swapaxes(left, 1, 2) + K @ R @ np.swapaxes(K, 1, 2)
    np.testing.assert_allclose(one.covariance, expected, rtol=1e-9, atol=1e-10)
    np.testing.assert_array_equal(one.state[:, LEARNED:], x[:, LEARNED:])


@COUNTS
def test_unexcited_parameters_return_to_their_prior(count: int) -> None:
    one = fresh(count)
    asked(one, np.random.default_rng(4))
    one.weigh([1.0] * 3, [1e-3] * 3, told(np.ones((3, count), dtype=np.bool_), count))
    zero, long = (0.0, 1e3) if count == 1 else (np.zeros(count), np.full(count, 1e3))
    for _ in range(100):
        one.move(long, 10.0 + zero, (), (), zero, zero)
    np.testing.assert_allclose(one.state[:, 1:], np.broadcast_to(MEAN[1:], (count, N - 1)), atol=1e-12)
    own = one.covariance[:, 1:, 1:]
    np.testing.assert_allclose(own, np.broadcast_to(SPREAD[1:, 1:], own.shape), rtol=1e-9)


@COUNTS
def test_forgetting_now_and_then_is_forgetting_always(count: int) -> None:
    """Without coupling it makes no difference to the parameters when they forget."""
    always, rarely = fresh(count, 1), fresh(count, 10)
    rng = np.random.default_rng(5)
    for one in (always, rarely):
        asked(one, np.random.default_rng(6))
        one.weigh([1.0] * 3, [0.1] * 3, told(np.ones((3, count), dtype=np.bool_), count))
    zero = 0.0 if count == 1 else np.zeros(count)
    for elapsed, pace in rng.random((30, 2)):
        for one in (always, rarely):
            one.move(elapsed + zero, 20 * pace + zero, (), (), zero, zero)
    np.testing.assert_allclose(always.state, rarely.state, rtol=1e-10)
    np.testing.assert_allclose(always.covariance, rarely.covariance, rtol=1e-10)


def test_one_car_is_an_entry_of_many() -> None:
    one, many = fresh(1, 4), fresh(3, 4)
    for k in range(40):
        for filter_ in (one, many):
            rng = np.random.default_rng(k)
            time, pace, noise, *coupling = rng.normal(size=6).tolist()
            whole = (lambda v: v) if filter_ is one else (lambda v: np.full(3, v))
            filter_.move(
                *map(whole, (abs(time), abs(pace))), MOVING, tuple(map(whole, coupling)), whole(0.3), whole(noise**2)
            )
            filter_.expect(SEEN, [[*map(whole, over)] for over in rng.normal(size=(3, 3)).tolist()])
            used = [whole(bool(value)) for value in rng.random(3) < 0.7]
            filter_.weigh([*map(whole, rng.normal(size=3).tolist())], [whole(0.2)] * 3, used, whole(bool(k % 3)))
        np.testing.assert_allclose(many.state, np.repeat(one.state, 3, axis=0), rtol=1e-9, atol=1e-11)
        np.testing.assert_allclose(many.covariance, np.repeat(one.covariance, 3, axis=0), rtol=1e-9, atol=1e-11)


@COUNTS
def test_renewing(count: int) -> None:
    one = fresh(count)
    moved(one, np.random.default_rng(7))
    kept = one.state[-1]
    where = True if count == 1 else np.arange(count) == 0
    one.renew(where, 5.0, 4.0)
    np.testing.assert_allclose(one.state[0], [5.0, *MEAN[1:]])
    np.testing.assert_allclose(one.covariance[0, 0], [4.0, 0, 0, 0, 0])
    np.testing.assert_allclose(one.covariance[0, 1:, 1:], SPREAD[1:, 1:])
    if count > 1:
        np.testing.assert_array_equal(one.state[-1], kept)


@pytest.mark.parametrize("name", [entry.name for entry in dataclasses.fields(FusionSettings)])
def test_every_setting_is_checked(name: str) -> None:
    for bad in (0.0, -1.0, float("nan"), "1", True):
        with pytest.raises(EstimatorError, match=name):
            FusionSettings(**{name: bad})


def test_the_believed_side_is_the_wider_one() -> None:
    with pytest.raises(EstimatorError, match="wrong_way_gate"):
        FusionSettings(wrong_way_gate=2.0)
