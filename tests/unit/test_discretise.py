"""Exact discretisation against closed forms, an integrator, and the observer that it replaces."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete

from synthesis.models.discretise import closed_loop_update, zero_order_hold
from tests.support.lmi_cases import corner

T = 0.005


def test_double_integrator() -> None:
    """A is singular and not diagonalisable: Phi = [[1, T], [0, 1]], Gamma = [T^2/2, T]."""
    Phi, Gamma = zero_order_hold(np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]]), 0.2)
    np.testing.assert_allclose(Phi, [[1.0, 0.2], [0.0, 1.0]], atol=1e-15)
    np.testing.assert_allclose(Gamma, [[0.02], [0.2]], atol=1e-15)


@pytest.mark.parametrize("a", [-300.0, -1.0, 0.0, 2.0])
def test_first_order_lag(a: float) -> None:
    Phi, Gamma = zero_order_hold(np.array([[a]]), np.array([[3.0]]), T)
    assert Phi[0, 0] == pytest.approx(np.exp(a * T), rel=1e-13)
    assert Gamma[0, 0] == pytest.approx(3.0 * (np.expm1(a * T) / a if a else T), rel=1e-12)


def test_oscillator_turns_by_its_angle() -> None:
    Phi, _ = zero_order_hold(np.array([[0.0, 40.0], [-40.0, 0.0]]), np.zeros((2, 1)), T)
    c, s = np.cos(40.0 * T), np.sin(40.0 * T)
    np.testing.assert_allclose(Phi, [[c, s], [-s, c]], atol=1e-14)


def test_stacks_are_what_single_matrices_are() -> None:
    rng = np.random.default_rng(3)
    A, B = 20.0 * rng.standard_normal((4, 3, 3)), rng.standard_normal((3, 2))
    Phi, Gamma = zero_order_hold(A, B, T)
    assert (Phi.shape, Gamma.shape) == ((4, 3, 3), (4, 3, 2))
    for i in range(4):
        expected = cont2discrete((A[i], B, np.eye(3), np.zeros((3, 2))), T)
        np.testing.assert_allclose(Phi[i], expected[0], rtol=1e-12)
        np.testing.assert_allclose(Gamma[i], expected[1], rtol=1e-11, atol=1e-15)


def test_two_half_steps_are_one_step() -> None:
    rng = np.random.default_rng(4)
    A, B = 50.0 * rng.standard_normal((3, 3)), rng.standard_normal((3, 1))
    half, half_input = zero_order_hold(A, B, T / 2)
    whole, whole_input = zero_order_hold(A, B, T)
    np.testing.assert_allclose(half @ half, whole, rtol=1e-11)
    np.testing.assert_allclose(half @ half_input + half_input, whole_input, rtol=1e-10)


def test_closed_loop_update_is_the_observer_integrated_over_one_sample() -> None:
    model, published = corner("corner-estimation", "longitudinal")
    assert published.gains is not None
    gain = np.array(published.gains)[:, None]
    numeric = model.on([60.0])
    A, B, C, D = numeric.A[0], numeric.B[0], numeric.C[0], numeric.D[0]
    Phi, Gamma = closed_loop_update(A, B, C, D, gain, T)
    start, u, y = np.array([1e-3, 0.4]), np.array([2.0]), np.array([0.3])

    def observer(_: float, x: np.ndarray) -> np.ndarray:
        return np.asarray(A @ x + B @ u + gain @ (y - C @ x - D @ u))

    reached = solve_ivp(observer, (0.0, T), start, method="DOP853", rtol=1e-11, atol=1e-14).y[:, -1]
    np.testing.assert_allclose(Phi @ start + Gamma @ np.concatenate([u, y]), reached, rtol=1e-8)


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
def test_the_exact_update_contracts_where_the_obvious_ones_do_not(direction: str) -> None:
    """P1 notes 9: with printed gains at 200 Hz, forward Euler is unstable at low speed longitudinally, and a sampled
    innovation is unstable; the exact closed-loop update has the spectral radius exp(T max Re(pole)) < 1 everywhere."""
    model, published = corner("corner-estimation", direction)  # type: ignore[arg-type]
    assert published.gains is not None
    gain = np.array(published.gains)[:, None]
    numeric = model.on(np.linspace(0.0, 180.0, 19))
    Phi, _ = closed_loop_update(numeric.A, numeric.B, numeric.C, numeric.D, gain, T)
    A_e = numeric.error_dynamics(gain)[0]
    slowest = np.linalg.eigvals(A_e).real.max(axis=1)
    np.testing.assert_allclose(np.abs(np.linalg.eigvals(Phi)).max(axis=1), np.exp(T * slowest), rtol=1e-9)
    assert np.exp(T * slowest).max() < 1.0
    open_loop, held_gain = zero_order_hold(numeric.A, gain, T)
    sampled = np.abs(np.linalg.eigvals(open_loop - held_gain @ numeric.C)).max(axis=1)
    euler = np.abs(np.linalg.eigvals(np.eye(2) + T * A_e)).max(axis=1)
    if direction == "longitudinal":
        assert sampled.max() > 1.0
        assert euler[0] == pytest.approx(1.02, abs=0.005)


def test_gains_may_change_from_point_to_point() -> None:
    model, _ = corner("corner-estimation", "lateral")
    numeric = model.on([10.0, 120.0])
    gains = np.array([[[1.0], [12.0]], [[1.2], [8.0]]])
    Phi, Gamma = closed_loop_update(numeric.A, numeric.B, numeric.C, numeric.D, gains, T)
    for i in range(2):
        alone = closed_loop_update(numeric.A[i], numeric.B[i], numeric.C[i], numeric.D[i], gains[i], T)
        np.testing.assert_allclose(Phi[i], alone[0], rtol=1e-12)
        np.testing.assert_allclose(Gamma[i], alone[1], rtol=1e-11, atol=1e-16)
