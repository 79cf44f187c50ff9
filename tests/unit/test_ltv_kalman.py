"""The corner's time-varying Kalman filter: exact sampling, the published recursion, what is observable, and faults."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
from scipy.linalg import expm

from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.velocity import BristleTire, LtvKalmanObserver
from estimators.velocity.ltv_kalman import HIGH_SLIP, NORMAL
from estimators.velocity.ltv_model import sampled

TIRE = BristleTire()
STEP = 0.005
B3 = np.array([0.0, 1.0, 1.0])


def continuous(w: float, dw: float, states: int) -> np.ndarray:
    a, da = TIRE.kappa * TIRE.radius * abs(w), TIRE.kappa * TIRE.radius * dw * np.sign(w)
    full = np.array([[-a, 1, 0], [0, 0, 0], [-da, 0, -a]])
    return full[:states, :states]


def steady(q: float, r: float, w: float) -> tuple[np.ndarray, np.ndarray]:
    """Predictor gain and poles of A - K C at constant speed."""
    A, _ = (m[0] for m in sampled(TIRE, np.array([w]), np.array([0.0]), STEP, 3))
    C = TIRE.output(np.array([w]), 3)[0]
    P = np.eye(3)
    for _ in range(3000):
        K = A @ P @ C.T / (C @ P @ C.T + r)
        P = A @ P @ A.T + q * np.outer(B3, B3) - K @ C @ P @ A.T
    return K[:, 0], np.sort(np.abs(np.linalg.eigvals(A - K @ C)))


@pytest.mark.parametrize("states", [2, 3])
@pytest.mark.parametrize("w", [0.0, 1e-6, 0.3, 20.0, 36.0, 40.0, 180.0, -40.0])
@pytest.mark.parametrize("dw", [0.0, 800.0, -300.0])
@pytest.mark.parametrize("time", [0.005, 0.1])
def test_sampling_equals_the_matrix_exponential(states: int, w: float, dw: float, time: float) -> None:
    block = np.zeros((states + 1, states + 1))
    block[:states, :states], block[:states, states] = continuous(w, dw, states), B3[:states]
    expected = expm(time * block)
    A, B = sampled(TIRE, np.array([w]), np.array([dw]), time, states)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(A[0], expected[:states, :states], rtol=1e-10, atol=1e-13 * scale)
    np.testing.assert_allclose(B[0], expected[:states, states], rtol=1e-10, atol=1e-13 * scale)


def test_steps_are_the_published_recursion() -> None:
    """P2 (21)-(22), written out."""
    rng = np.random.default_rng(2)
    observer = LtvKalmanObserver(TIRE, STEP, (4,))
    x, P = observer.filter.state, observer.filter.covariance
    w = np.array([5.0, 40.0, 90.0, -30.0])
    for _ in range(60):
        u, dw, mu = rng.normal(size=(3, 4)) * [[3], [50], [0.3]]
        high = rng.random(4) < 0.3
        step = observer.step(u, mu, w, dw, high)
        A, B = sampled(TIRE, w, dw, STEP, 3)
        for i in range(4):
            q, r = HIGH_SLIP if high[i] else NORMAL
            C = np.array([[TIRE.sigma0, TIRE.sigma2, TIRE.sigma1]])
            K = A[i] @ P[i] @ C.T / (C @ P[i] @ C.T + r)
            x[i] = A[i] @ x[i] + B[i] * u[i] + K[:, 0] * (mu[i] - C[0] @ x[i])
            P[i] = A[i] @ P[i] @ A[i].T + q * np.outer(B3, B3) - K @ C @ P[i] @ A[i].T
            np.testing.assert_allclose(step.gain[i], K[:, 0], rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(step.estimate, x, rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(observer.filter.covariance, P, rtol=1e-5, atol=1e-8)
        w = w + dw * STEP


def test_structured_noise_gives_the_gains_of_the_sheet() -> None:
    """P2 notes 10, at 40 rad/s: K_V 0.47, poles 0.23; high slip 0.036 and 0.59, 0.63, 0.77.

    The poles of the observable part are recomputed here; the hidden one is e^(-kappa R w T) = 0.59.
    """
    gain, poles = steady(*NORMAL, 40.0)
    assert gain[1] == pytest.approx(0.47, abs=0.005)
    assert poles[0] == pytest.approx(0.23, abs=0.01)
    gain, poles = steady(*HIGH_SLIP, 40.0)
    assert gain[1] == pytest.approx(0.036, abs=0.0005)
    np.testing.assert_allclose(poles, [0.59, 0.63, 0.77], atol=0.006)
    observer = LtvKalmanObserver(TIRE, STEP, (2,))
    for _ in range(3000):
        step = observer.step(0.0, 0.0, 40.0, 0.0, np.array([False, True]))
    np.testing.assert_allclose(step.gain[:, 1], [0.47, 0.036], atol=0.005)


def test_two_states_are_the_same_filter_at_constant_speed() -> None:
    """From a state that obeys z' = V - a z, in mean and covariance, the third state adds nothing."""
    rng = np.random.default_rng(3)
    w = np.array([3.0, 40.0, 120.0])
    two, three = (LtvKalmanObserver(TIRE, STEP, (3,), states=n) for n in (2, 3))
    lift = np.zeros((3, 3, 2))
    lift[:, :2] = np.eye(2)
    lift[:, 2, 0], lift[:, 2, 1] = -TIRE.kappa * TIRE.radius * w, 1.0
    start = lift @ two.filter.covariance @ np.swapaxes(lift, 1, 2)
    three.filter.reset(covariance=start + 1e-12 * np.eye(3))
    for _ in range(200):
        u, mu = rng.normal(size=(2, 3)) * [[3], [0.3]]
        a, b = two.step(u, mu, w), three.step(u, mu, w)
        np.testing.assert_allclose(a.relative_velocity, b.relative_velocity, atol=1e-6)


def test_at_constant_speed_two_states_are_observable_and_three_are_not() -> None:
    w = np.array([40.0])
    for states, rank in ((2, 2), (3, 2)):
        A, C = sampled(TIRE, w, 0 * w, STEP, states)[0][0], TIRE.output(w, states)[0]
        rows = np.vstack([C @ np.linalg.matrix_power(A, k) for k in range(states)])
        rows = rows @ np.diag(1.0 / np.linalg.norm(rows, axis=0))
        assert np.linalg.matrix_rank(rows, tol=1e-9) == rank


def test_high_slip_follows_the_kinematics() -> None:
    """A force that lies, as saturated friction does: the switched filter loses far less of a true slip."""
    ends = []
    for high in (False, True):
        observer = LtvKalmanObserver(TIRE, STEP, ())
        for _ in range(40):
            step = observer.step(20.0, 0.3, 60.0, 0.0, high)
        ends.append(float(step.relative_velocity))
    assert abs(ends[1] - 4.0) < abs(ends[0] - 4.0)  # 20 m/s^2 for 0.2 s
    assert ends[0] < 1.0


def test_faults_are_flagged_and_estimates_stay_finite() -> None:
    observer = LtvKalmanObserver(TIRE, STEP, (4,))
    observer.step(1.0, 0.1, 40.0, 10.0)
    u, mu = np.array([np.nan, 1.0, 1.0, 1.0]), np.array([0.1, np.nan, 0.1, 0.1])
    step = observer.step(u, mu, np.array([40.0, 40.0, np.inf, 40.0]), np.array([10.0, 10.0, 10.0, np.nan]))
    np.testing.assert_array_equal(
        step.flags, [Flag.MISSING_INPUT, Flag.MISSING_MEASUREMENT, Flag.MISSING_PARAMETER, Flag.MISSING_PARAMETER]
    )
    np.testing.assert_array_equal(step.used, [True, False, True, True])
    assert np.isnan(step.innovation[1])
    assert np.isfinite(step.estimate).all()
    twin = LtvKalmanObserver(TIRE, STEP, (4,))
    for _ in range(2):
        held = twin.step(1.0, 0.1, 40.0, 10.0)
    np.testing.assert_allclose(step.estimate[[0, 2, 3]], held.estimate[[0, 2, 3]])


@pytest.mark.parametrize("w", [0.0, 50.0])
@pytest.mark.parametrize("states", [2, 3])
def test_covariance_does_not_run_away_without_measurements(w: float, states: Literal[2, 3]) -> None:
    observer = LtvKalmanObserver(TIRE, STEP, (), states=states, normal=(1.0, 1e-3))
    for _ in range(3000):
        step = observer.step(0.0, np.nan, w)
    variances = np.diagonal(observer.filter.covariance)
    assert np.isfinite(variances).all()
    assert variances[1] <= 50.0**2
    for _ in range(400):
        step = observer.step(0.0, 0.0, 50.0)
    assert abs(step.relative_velocity) < 1e-6


def test_saved_restored_and_reset() -> None:
    rng = np.random.default_rng(5)
    observer, other = LtvKalmanObserver(TIRE, STEP, (4,)), LtvKalmanObserver(TIRE, STEP, (4,))
    for _ in range(10):
        observer.step(*rng.normal(size=(2, 4)), 30.0)
    other.restore(observer.save())
    arguments: list[Any] = [1.0, 0.2, 30.0, 5.0]
    np.testing.assert_array_equal(observer.step(*arguments).estimate, other.step(*arguments).estimate)
    observer.reset(np.array([True, False, False, False]), [0.0, 2.0, 2.0])
    assert observer.filter.state[0, 1] == 2.0
    assert observer.step(*arguments).flags[0] == Flag.RESET
    assert not observer.step(*arguments).flags.any()


def test_bad_settings_are_refused() -> None:
    with pytest.raises(EstimatorError, match="sigma0"):
        BristleTire(sigma0=-1.0)
    with pytest.raises(EstimatorError, match="measurement noise of high_slip"):
        LtvKalmanObserver(TIRE, STEP, high_slip=(1.0, 0.0))
    with pytest.raises(EstimatorError, match="states"):
        LtvKalmanObserver(TIRE, STEP, states=4)  # type: ignore[arg-type]
    with pytest.raises(EstimatorError, match="normalised_force"):
        LtvKalmanObserver(TIRE, STEP).step(0.0, np.zeros(3), 0.0)
