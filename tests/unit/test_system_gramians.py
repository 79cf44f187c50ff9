"""Gramians, Hankel singular values and balanced realisations against closed forms and python-control."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy import signal
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

from analysis import (
    balanced_realization,
    controllability_gramian,
    h2_norm,
    hankel_singular_values,
    hinf_norm,
    linf_norm,
    observability_gramian,
    stability_margin,
)
from analysis.errors import AnalysisError
from analysis.norms import gramians
from analysis.norms.planar import planar_hinf_norm, planar_margin
from tests.support.level_crossing import crosses_level


def random_system(seed: int, discrete: bool, n: int = 5) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    poles = np.linalg.eigvals(A)
    A = A * (0.95 / np.abs(poles).max()) if discrete else A - (poles.real.max() + 0.2) * np.eye(n)
    return A, rng.normal(size=(n, 2)), rng.normal(size=(3, n)), rng.normal(size=(3, 2))


def test_first_order_closed_forms() -> None:
    a, b, c = np.array([0.1, 2.0, 300.0])[:, None, None], np.array([[3.0]]), np.array([[-0.5]])
    np.testing.assert_allclose(controllability_gramian(-a, b), b**2 / (2.0 * a), rtol=1e-13)
    np.testing.assert_allclose(observability_gramian(-a, c), c**2 / (2.0 * a), rtol=1e-13)
    np.testing.assert_allclose(hankel_singular_values(-a, b, c), np.abs(b * c)[0] / (2.0 * a[:, 0]), rtol=1e-13)
    r = np.array([0.0, 0.5, -0.999])[:, None, None]
    np.testing.assert_allclose(controllability_gramian(r, b, discrete=True), b**2 / (1.0 - r**2), rtol=1e-12)


@pytest.mark.parametrize("discrete", [False, True])
def test_against_scipy_and_control(discrete: bool) -> None:
    A, B, C, D = random_system(3, discrete)
    solve = solve_discrete_lyapunov if discrete else lambda M, Q: solve_continuous_lyapunov(M, -Q)
    X, Y = solve(A, B @ B.T), solve(A.T, C.T @ C)
    np.testing.assert_allclose(controllability_gramian(A, B, discrete), X, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(observability_gramian(A, C, discrete), Y, rtol=1e-9, atol=1e-9)
    values = np.sqrt(np.sort(np.linalg.eigvals(X @ Y).real)[::-1])
    np.testing.assert_allclose(hankel_singular_values(A, B, C, D, discrete), values, rtol=1e-8)
    system = control.ss(A, B, C, D, 0.1 if discrete else 0)
    np.testing.assert_array_equal(controllability_gramian(system), controllability_gramian(A, B, discrete))
    np.testing.assert_array_equal(observability_gramian(system), observability_gramian(A, C, discrete))
    np.testing.assert_array_equal(hankel_singular_values(system), hankel_singular_values(A, B, C, D, discrete))


@pytest.mark.parametrize("discrete", [False, True])
def test_balanced_realizations_are_control_objects_with_equal_diagonal_gramians(discrete: bool) -> None:
    A, B, C, D = random_system(4, discrete)
    system = control.ss(A, B, C, D, 0.1 if discrete else 0)
    found = balanced_realization(system)
    assert isinstance(found.system, control.StateSpace) and found.system.dt == system.dt and found.error_bound == 0.0
    diagonal = np.diag(found.singular_values)
    for gramian in (controllability_gramian(found.system), observability_gramian(found.system)):
        np.testing.assert_allclose(gramian, diagonal, atol=1e-10 * diagonal[0, 0])
    s = np.exp(0.7j) if discrete else 0.7j
    np.testing.assert_allclose(found.system(s), system(s), rtol=1e-10)
    np.testing.assert_allclose(found.transformation @ found.system.A, A @ found.transformation, atol=1e-9)
    small = balanced_realization(system, order=3)
    error = control.ss(system - small.system)
    assert 0.0 < hinf_norm(error).norm <= small.error_bound * (1.0 + 1e-9)
    assert hinf_norm(error).norm >= small.singular_values[3] * (1.0 - 1e-9)  # no model of three states is nearer
    assert balanced_realization(A, B, C, D, discrete).system.dt == (True if discrete else 0)


def test_small_hankel_values_keep_their_digits() -> None:
    """Two modes that do not meet, the second 1e-9 as strong: eigenvalues of X Y lose it, factors do not."""
    T = np.linalg.qr(np.random.default_rng(0).normal(size=(2, 2)))[0]
    A, B, C = np.diag([-1.0, -2.0]), np.diag([1.0, 1e-5]), np.diag([1.0, 1e-5])
    found = hankel_singular_values(T @ A @ T.T, T @ B, C @ T.T)
    np.testing.assert_allclose(found, [0.5, 1e-10 / 4.0], rtol=1e-5)


def test_what_has_no_gramian_is_refused() -> None:
    A, B, C, _ = random_system(5, False)
    for bad, words in ((-A, "system 0 of 1 is unstable"), ([[3.0, -9.0], [1.0, -3.0]], "boundary")):
        n = len(bad)
        for call in (
            lambda bad=bad, n=n: controllability_gramian(bad, np.eye(n)),
            lambda bad=bad, n=n: observability_gramian(bad, np.eye(n)),
            lambda bad=bad, n=n: hankel_singular_values(bad, np.eye(n), np.eye(n)),
            lambda bad=bad, n=n: balanced_realization(bad, np.eye(n), np.eye(n)),
        ):
            with pytest.raises(AnalysisError, match=words):
                call()
    with pytest.raises(AnalysisError, match="give order = 1 to 1"):
        balanced_realization(np.diag([-1.0, -2.0]), [[1.0], [0.0]], [[1.0, 1.0]])
    assert balanced_realization(np.diag([-1.0, -2.0]), [[1.0], [0.0]], [[1.0, 1.0]], order=1).system.nstates == 1
    with pytest.raises(AnalysisError, match="nothing is both"):
        balanced_realization(np.diag([-1.0, -2.0]), [[1.0], [0.0]], [[0.0, 1.0]])
    with pytest.raises(AnalysisError, match="one system"):
        balanced_realization(A[None], B, C)
    with pytest.raises(AnalysisError, match="B is missing"):
        controllability_gramian(A)
    with pytest.raises(AnalysisError, match="does not fit 5 states"):
        observability_gramian(A, np.ones((1, 4)))


@pytest.mark.parametrize("wrong", range(3))
def test_a_wrong_factor_is_noticed(monkeypatch: pytest.MonkeyPatch, wrong: int) -> None:
    """The equations are recomputed: a factor that is off by 1e-4 in any of the calls is refused."""
    A, B, C, D = random_system(6, False)
    calls, right = iter(range(10)), gramians.gramian_factor
    monkeypatch.setattr(
        gramians, "gramian_factor", lambda *given: right(*given) * (1.0 + 1e-4 * (next(calls) == wrong))
    )
    with pytest.raises(AnalysisError, match="recomputed gramians differ"):
        balanced_realization(A, B, C, D)
    calls = iter([wrong])
    with pytest.raises(AnalysisError, match="leaves a residual"):
        controllability_gramian(A, B)


def test_transfer_functions_static_gains_and_numbers() -> None:
    peak = 1.0 / (0.2 * np.sqrt(1.0 - 0.01))
    for system in (control.tf([1.0], [1.0, 0.2, 1.0]), signal.TransferFunction([1.0], [1.0, 0.2, 1.0])):
        assert hinf_norm(system).norm == pytest.approx(peak, rel=1e-9)
        assert linf_norm(system).norm == pytest.approx(peak, rel=1e-9)
        assert stability_margin(system) == pytest.approx(-0.1)
        assert hankel_singular_values(system).shape == (2,)
    assert hinf_norm(control.tf([1.0], [1.0, -0.5], 0.1)).norm == pytest.approx(2.0)
    for no_system in (control.tf([1.0, 2.0, 3.0], [1.0, 1.0]), control.frd([1.0, 2.0], [1.0, 2.0])):
        with pytest.raises(AnalysisError, match="has no state-space form"):
            hinf_norm(no_system)
    system = control.tf([1.0], [1.0, 0.2, 1.0])
    assert crosses_level(system, gamma=0.999 * peak) and not crosses_level(system, gamma=1.001 * peak)
    assert planar_hinf_norm(control.ss(system))[0] == pytest.approx(peak, rel=1e-12)
    assert planar_margin(system) == pytest.approx(-0.1)
    for closed_form in (planar_hinf_norm, planar_margin):
        with pytest.raises(AnalysisError, match="continuous systems"):
            closed_form(control.ss(-0.5 * np.eye(2), [[1.0], [1.0]], [[1.0, 1.0]], 0.0, 0.1))
    static = control.ss([], [], [], [[3.0, 4.0]])
    assert hinf_norm(static).norm == pytest.approx(5.0) and hinf_norm(static).upper >= 5.0
    assert h2_norm(static, discrete=True) == pytest.approx(5.0) and h2_norm(static) == np.inf
    for numbers in ((-1.0, 2.0, 3.0, 0.0), ([[-1.0]], [2.0], [3.0]), (-1.0, [1.2, 1.6], 3.0)):
        assert hinf_norm(*numbers).norm == pytest.approx(6.0)
        assert hinf_norm(*numbers).norm == pytest.approx(
            control.linfnorm(control.ss(*numbers, *([0.0] * (4 - len(numbers)))))[0]
        )
