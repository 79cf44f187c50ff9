"""Filters on random linear models: three ways to one answer, and an order of channels that does not matter."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.filters import ExtendedKalmanFilter, KalmanFilter, UnscentedKalmanFilter


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 6), st.integers(1, 4), st.sampled_from([(), (2,), (50,)]))
def test_three_ways(seed: int, n: int, m: int, batch: tuple[int, ...]) -> None:
    draw = np.random.default_rng(seed)
    A, C = draw.normal(size=(n, n)), draw.normal(size=(*batch, m, n))
    root = draw.normal(size=(n, n))
    P, Q = root @ root.T + 0.1 * np.eye(n), np.diag(draw.random(n))
    R = np.diag(0.1 + draw.random(m))
    x, y = draw.normal(size=(*batch, n)), draw.normal(size=(*batch, m))
    y[draw.random(y.shape) < 0.3] = np.nan

    def f(s: np.ndarray) -> np.ndarray:
        return s @ A.T

    def h(s: np.ndarray) -> np.ndarray:
        return (C @ s[..., None])[..., 0]

    kalman, extended, unscented = (kind(x, P) for kind in (KalmanFilter, ExtendedKalmanFilter, UnscentedKalmanFilter))
    kalman.predict(A, Q)
    extended.predict(f, lambda s: A, Q)
    unscented.predict(f, Q)
    steps = [kalman.correct(y, C, R), extended.correct(y, h, lambda s: C, R), unscented.correct(y, h, R)]
    scale = float(np.absolute(kalman.covariance).max()) + 1
    for step in steps[1:]:
        np.testing.assert_allclose(step.state, steps[0].state, atol=1e-9 * scale)
        np.testing.assert_allclose(step.covariance, steps[0].covariance, atol=1e-9 * scale)
        np.testing.assert_array_equal(step.used, steps[0].used)
        assert (np.linalg.eigvalsh(step.covariance) > 0).all()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 4))
def test_order_of_the_channels_does_not_matter_and_one_by_one_is_the_same(seed: int, m: int) -> None:
    """Independent channels corrected together or one after the other give one posterior."""
    draw = np.random.default_rng(seed)
    C, R, y = draw.normal(size=(m, 3)), np.diag(0.1 + draw.random(m)), draw.normal(size=m)
    together, single = KalmanFilter(np.zeros(3), np.eye(3)), UnscentedKalmanFilter(np.zeros(3), np.eye(3))
    shuffled = draw.permutation(m)
    step = together.correct(y[shuffled], C[shuffled], R[np.ix_(shuffled, shuffled)])
    for k in range(m):
        single.correct(y[k : k + 1], lambda x, k=k: x @ C[k : k + 1].T, R[k : k + 1, k : k + 1])
    np.testing.assert_allclose(single.state, step.state, atol=1e-10)
    np.testing.assert_allclose(single.covariance, step.covariance, atol=1e-10)


@settings(max_examples=25, deadline=None)
@given(st.floats(0.05, 3.0), st.floats(0.05, 3.0), st.floats(-2, 2))
def test_scalar_steady_state_is_the_closed_form(q: float, r: float, a: float) -> None:
    """P- solves P = a^2 P r / (P + r) + q: a quadratic."""
    b = r * (1 - a * a) - q
    expected = (-b + np.sqrt(b * b + 4 * q * r)) / 2
    kalman, unscented = KalmanFilter([0.0], [[1.0]]), UnscentedKalmanFilter([0.0], [[1.0]])
    for _ in range(150):
        kalman.correct([0.0], [[1.0]], [[r]])
        kalman.predict([[a]], [[q]])
        unscented.correct([0.0], lambda x: x, [[r]])
        unscented.predict(lambda x: a * x, [[q]])
    np.testing.assert_allclose(kalman.covariance, expected, rtol=1e-6)
    np.testing.assert_allclose(unscented.covariance, expected, rtol=1e-6)
