"""The filter inside the fusion, against the general Kalman filter, and its settings."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.filters import KalmanFilter
from estimators.velocity import FusionSettings
from estimators.velocity.speed_filter import NEVER, SpeedFilter

RNG = np.random.default_rng(0)
N, RUNS = 5, 7
MEAN = RNG.normal(size=N)
ROOT = RNG.normal(size=(N, N))
SPREAD = ROOT @ ROOT.T + np.eye(N)
RATES, SPATIAL = np.array([9.0, 0.1, 2.0, 0.0, 0.5]), np.array([9.0, 0.0, 0.0, 0.01, 0.0])


def fresh() -> SpeedFilter:
    return SpeedFilter(MEAN, SPREAD, RATES, SPATIAL, RUNS)


def moved(filter_: SpeedFilter) -> tuple[np.ndarray, ...]:
    elapsed, pace = RNG.random(RUNS), 20 * RNG.random(RUNS)
    coupling, shift, noise = RNG.normal(size=(RUNS, N - 1)), RNG.normal(size=RUNS), RNG.random(RUNS)
    filter_.move(elapsed, pace, coupling, shift, noise)
    return elapsed, pace, coupling, shift, noise


def test_moving_is_the_prediction_of_a_kalman_filter() -> None:
    one, two = fresh(), KalmanFilter(np.broadcast_to(MEAN, (RUNS, N)), SPREAD)
    for _ in range(3):
        elapsed, pace, coupling, shift, noise = moved(one)
        phi = np.exp(-elapsed[:, None] * (RATES[1:] + SPATIAL[1:] * pace[:, None]))
        A, Q = np.zeros((2, RUNS, N, N))
        A[:, 0, 0], A[:, 0, 1:] = 1.0, coupling
        Q[:, 0, 0] = noise
        for i in range(1, N):
            A[:, i, i], Q[:, i, i] = phi[:, i - 1], SPREAD[i, i] * (1 - phi[:, i - 1] ** 2)
        u = np.concatenate([shift[:, None], (1 - phi) * MEAN[1:]], axis=1)
        two.predict(A, Q, np.eye(N), u)
        np.testing.assert_allclose(one.state, two.state, rtol=1e-12)
        np.testing.assert_allclose(one.covariance, two.covariance, rtol=1e-10, atol=1e-12)


def test_weighing_is_the_correction_of_a_kalman_filter() -> None:
    one = fresh()
    moved(one)
    two = KalmanFilter(one.state, one.covariance)
    y, C, variance = RNG.normal(size=(RUNS, 3)), RNG.normal(size=(RUNS, 3, N)), 0.1 + RNG.random((RUNS, 3))
    lost = RNG.random((RUNS, 3)) < 0.4
    innovation = y - (C @ one.state[..., None])[..., 0]
    one.weigh(np.where(lost, 0.0, innovation), C, np.where(lost, NEVER, variance))
    step = two.correct(np.where(lost, np.nan, y), C, variance[..., None] * np.eye(3))
    np.testing.assert_allclose(one.state, step.state, rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(one.covariance, step.covariance, rtol=1e-8, atol=1e-8)


def test_a_considered_state_stays_and_is_not_forgotten() -> None:
    """Schmidt: the mean and the variance of the state do not change, and the others know less than if it had moved."""
    one, free = fresh(), fresh()
    C, learning = RNG.normal(size=(RUNS, 2, N)), np.ones((RUNS, 2, N))
    learning[:, :, 3] = 0.0
    before = one.state[:, 3], one.covariance[:, 3, 3]
    one.weigh(np.ones((RUNS, 2)), C, np.full((RUNS, 2), 0.1), learning)
    free.weigh(np.ones((RUNS, 2)), C, np.full((RUNS, 2), 0.1))
    np.testing.assert_array_equal(one.state[:, 3], before[0])
    np.testing.assert_allclose(one.covariance[:, 3, 3], before[1], rtol=1e-12)
    gap = one.covariance - free.covariance
    assert np.linalg.eigvalsh(gap).min() > -1e-9  # the optimal gain is never worse
    assert np.linalg.eigvalsh(one.covariance).min() > 0


def test_unexcited_parameters_return_to_their_prior() -> None:
    one = fresh()
    one.weigh(np.ones((RUNS, N)), np.broadcast_to(np.eye(N), (RUNS, N, N)), np.full((RUNS, N), 1e-3))
    zero = np.zeros(RUNS)
    for _ in range(1000):
        one.move(np.ones(RUNS), np.full(RUNS, 10.0), np.zeros((RUNS, N - 1)), zero, zero)
    np.testing.assert_allclose(one.state[:, 1:], np.broadcast_to(MEAN[1:], (RUNS, N - 1)), atol=1e-12)
    variances = np.diagonal(one.covariance, axis1=1, axis2=2)[:, 1:]
    np.testing.assert_allclose(variances, np.broadcast_to(np.diagonal(SPREAD)[1:], variances.shape), rtol=1e-9)


def test_renewing_some_entries() -> None:
    one = fresh()
    moved(one)
    kept = one.state[1]
    where = np.arange(RUNS) == 0
    one.renew(where, np.full(RUNS, 5.0), np.full(RUNS, 4.0))
    np.testing.assert_allclose(one.state[0], [5.0, *MEAN[1:]])
    np.testing.assert_allclose(one.covariance[0, 0], [4.0, 0, 0, 0, 0])
    np.testing.assert_array_equal(one.state[1], kept)


@pytest.mark.parametrize("name", [entry.name for entry in dataclasses.fields(FusionSettings)])
def test_every_setting_is_checked(name: str) -> None:
    for bad in (0.0, -1.0, float("nan"), "1", True):
        with pytest.raises(EstimatorError, match=name):
            FusionSettings(**{name: bad})


def test_the_believed_side_is_the_wider_one() -> None:
    with pytest.raises(EstimatorError, match="wrong_way_gate"):
        FusionSettings(wrong_way_gate=2.0)
