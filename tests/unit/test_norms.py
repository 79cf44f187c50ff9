"""Norms against closed forms, independent ways and negative controls."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov, solve_discrete_lyapunov

from analysis.errors import AnalysisError
from analysis.norms.h2 import h2_norm
from analysis.norms.hinf import hinf_norm, stability_margin
from analysis.norms.observer_error import error_hinf_norm
from estimators.errors import GainsmithError
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.parameter_set import load_parameter_set
from tests.support.level_crossing import crosses_level


def oscillator(frequency, damping):
    """w^2/(s^2 + 2 z w s + w^2): peak 1/(2 z sqrt(1 - z^2)) at w sqrt(1 - 2 z^2) for z < 1/sqrt(2)."""
    frequency, damping = np.broadcast_arrays(np.asarray(frequency, float), np.asarray(damping, float))
    A = np.zeros((*frequency.shape, 2, 2))
    A[..., 0, 1], A[..., 1, 0], A[..., 1, 1] = 1.0, -(frequency**2), -2.0 * damping * frequency
    B = np.stack([np.zeros_like(frequency), frequency**2], axis=-1)[..., None]
    return A, B, np.array([[1.0, 0.0]])


def test_resonance_peaks_have_a_closed_form() -> None:
    frequency = np.geomspace(1e-3, 1e4, 15)[:, None]
    damping = np.geomspace(1e-6, 0.7, 12)
    found = hinf_norm(*oscillator(frequency, damping))
    peak = 1.0 / (2.0 * damping * np.sqrt(1.0 - damping**2))
    place = frequency * np.sqrt(1.0 - 2.0 * damping**2)
    assert found.norm.shape == (15, 12)
    np.testing.assert_allclose(found.norm, np.broadcast_to(peak, (15, 12)), rtol=2e-9)
    # the gain is flat at its peak: a relative 1e-9 in gain is 3e-5 half-widths in frequency
    assert (np.abs(found.frequency - place) <= 1e-4 * damping * frequency + 1e-3 * place * (damping > 0.5)).all()


def test_overdamped_systems_peak_at_zero() -> None:
    found = hinf_norm(*oscillator([1.0, 30.0], [0.75, 4.0]))
    np.testing.assert_allclose(found.norm, 1.0, rtol=1e-12)
    np.testing.assert_array_equal(found.frequency, 0.0)


def test_a_peak_at_infinite_frequency() -> None:
    found = hinf_norm([[-2.0]], [[1.0]], [[-1.0]], [[1.0]])  # (s + 1)/(s + 2)
    assert found.norm == 1.0
    assert found.frequency == np.inf


def test_all_pass_and_pure_gain() -> None:
    all_pass = hinf_norm([[-3.0]], [[6.0]], [[-1.0]], [[1.0]])  # (s - 3)/(s + 3)
    assert all_pass.norm == pytest.approx(1.0, rel=1e-9)
    D = np.array([[1.0, 2.0], [3.0, 4.0], [0.0, 1.0]])
    gain = hinf_norm(-np.eye(2), np.zeros((2, 2)), np.zeros((3, 2)), D)
    assert gain.norm == pytest.approx(np.linalg.norm(D, 2), rel=1e-9)


def test_zero_systems_have_norm_zero() -> None:
    A, B, C = np.diag([-1.0, -2.0]), np.array([[1.0], [0.0]]), np.array([[0.0, 1.0]])
    T = np.array([[1.0, 0.3], [-0.7, 2.0]])
    hidden = (
        T @ A @ np.linalg.inv(T),
        T @ B,
        C @ np.linalg.inv(T),
    )  # controllable part is unobservable, up to rounding
    for system in ((A, B, C), hidden, (A, 0 * B, C), (A, B, 0 * C)):
        found = hinf_norm(*system)
        assert found.norm == 0.0 and 0.0 <= found.upper < 1e-15
        assert found.upper == 0.0 or system is hidden  # which rounding leaves a little of
        assert h2_norm(*system) == pytest.approx(0.0, abs=1e-9)


def test_a_small_transfer_function_is_not_taken_for_zero() -> None:
    for size in (1e-30, 1e-12, 1.0):  # 1/(s+1)^2 with one state scaled by `size`
        A, B, C = np.array([[-1.0, size], [0.0, -1.0]]), np.array([[0.0], [1.0]]), np.array([[1.0 / size, 0.0]])
        assert hinf_norm(A, B, C).norm == pytest.approx(1.0, rel=1e-9)


def test_unstable_and_marginal_systems_give_inf() -> None:
    A = np.array([[[-1.0]], [[0.0]], [[2.0]]])
    found = hinf_norm(A, [[1.0]], [[1.0]])
    np.testing.assert_array_equal(found.norm, [1.0, np.inf, np.inf])
    assert np.isnan(found.frequency[1:]).all()
    np.testing.assert_array_equal(
        hinf_norm([[[1.0]], [[-1.0]], [[0.5]]], [[1.0]], [[1.0]], discrete=True).norm, [np.inf, np.inf, 2.0]
    )
    np.testing.assert_array_equal(np.isinf(h2_norm(A, [[1.0]], [[1.0]])), [False, True, True])
    # an unstable pole that inputs do not reach is still an unstable system
    assert hinf_norm(np.diag([-1.0, 1.0]), [[1.0], [0.0]], [[1.0, 0.0]]).norm == np.inf


def test_the_level_test_brackets_the_norm() -> None:
    rng = np.random.default_rng(3)
    A = rng.normal(size=(200, 4, 4))
    A -= (stability_margin(A)[:, None, None] + rng.uniform(1e-3, 1.0, (200, 1, 1))) * np.eye(4)
    B, C, D = rng.normal(size=(200, 4, 2)), rng.normal(size=(200, 3, 4)), rng.normal(size=(200, 3, 2))
    found = hinf_norm(A, B, C, D)
    assert crosses_level(A, B, C, D, found.norm * (1 - 1e-8)).all()
    assert not crosses_level(A, B, C, D, found.norm * (1 + 1e-8)).any()
    assert (found.upper <= found.norm * (1 + 1e-6)).all() and np.median(found.upper / found.norm) < 1 + 1.01e-9


def test_discrete_norms_with_singular_matrices() -> None:
    delay = hinf_norm([[0.0]], [[1.0]], [[1.0]], discrete=True)  # 1/z
    assert delay.norm == pytest.approx(1.0, rel=1e-9)
    chain = np.diag([1.0, 1.0], 1)  # three delays
    assert hinf_norm(chain, [[0.0], [0.0], [2.0]], [[1.0, 0.0, 0.0]], discrete=True).norm == pytest.approx(
        2.0, rel=1e-9
    )
    first_order = hinf_norm([[[0.9]], [[-0.9]]], [[1.0]], [[1.0]], discrete=True)  # 1/(z - a): 10 at 0 or at pi
    np.testing.assert_allclose(first_order.norm, 10.0, rtol=1e-9)
    np.testing.assert_allclose(first_order.frequency, [0.0, np.pi], atol=1e-4)
    radius, angle = 0.999, 1.1
    A = radius * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    rotation = hinf_norm(A, np.eye(2), np.eye(2), discrete=True)  # normal matrix: 1/(1 - r) at the pole's angle
    assert rotation.norm == pytest.approx(1.0 / (1.0 - radius), rel=1e-8)
    assert rotation.frequency == pytest.approx(angle, rel=1e-6)


def test_normal_matrices_give_the_distance_to_the_axis() -> None:
    rng = np.random.default_rng(0)
    decay, turn = rng.uniform(0.01, 2.0, (50, 3)), rng.uniform(0.0, 50.0, (50, 3))
    A = np.zeros((50, 6, 6))
    for k in range(3):
        A[:, 2 * k, 2 * k] = A[:, 2 * k + 1, 2 * k + 1] = -decay[:, k]
        A[:, 2 * k, 2 * k + 1], A[:, 2 * k + 1, 2 * k] = turn[:, k], -turn[:, k]
    Q = np.linalg.qr(rng.normal(size=(50, 6, 6)))[0]
    found = hinf_norm(Q @ A @ np.swapaxes(Q, -1, -2), np.eye(6), np.eye(6))
    np.testing.assert_allclose(found.norm, 1.0 / decay.min(axis=1), rtol=1e-8)


def test_stability_margin_is_negative_for_stable_systems() -> None:
    np.testing.assert_allclose(stability_margin([[[-1.0, 9.0], [0.0, -3.0]], [[2.0, 0.0], [0.0, 1.0]]]), [-1.0, 2.0])
    assert stability_margin(np.diag([0.5, -0.9]), discrete=True) == pytest.approx(-0.1)


def test_h2_norm_closed_form_and_two_ways() -> None:
    w, z = np.array([0.1, 3.0, 500.0]), np.array([1e-3, 0.2, 0.9])
    np.testing.assert_allclose(h2_norm(*oscillator(w, z)), np.sqrt(w / (4.0 * z)), rtol=1e-10)
    rng = np.random.default_rng(5)
    A = rng.normal(size=(20, 5, 5)) * np.geomspace(1e-3, 1e3, 5)  # stiff
    A -= (stability_margin(A)[:, None, None] + 0.3) * np.eye(5)
    B, C = rng.normal(size=(20, 5, 2)), rng.normal(size=(20, 2, 5))
    for i, value in enumerate(h2_norm(A, B, C)):
        X = solve_continuous_lyapunov(A[i], -B[i] @ B[i].T)
        assert value == pytest.approx(np.sqrt(np.trace(C[i] @ X @ C[i].T)), rel=1e-7)
    Ad = 0.97 * A / np.abs(np.linalg.eigvals(A)).max(axis=-1)[:, None, None]
    D = rng.normal(size=(20, 2, 2))
    for i, value in enumerate(h2_norm(Ad, B, C, D, discrete=True)):
        X = solve_discrete_lyapunov(Ad[i], B[i] @ B[i].T)
        assert value == pytest.approx(np.sqrt(np.trace(C[i] @ X @ C[i].T + D[i] @ D[i].T)), rel=1e-7)


def test_h2_norm_with_feedthrough_is_infinite_in_continuous_time_only() -> None:
    system = ([[-1.0]], [[1.0]], [[1.0]], [[0.5]])
    assert h2_norm(*system) == np.inf
    assert h2_norm([[0.0]], [[1.0]], [[1.0]], [[0.5]], discrete=True) == pytest.approx(np.sqrt(1.25))


@pytest.mark.parametrize(
    ("A", "B", "C", "D", "words"),
    [
        (np.zeros((2, 3)), np.zeros((2, 1)), np.zeros((1, 2)), None, "square"),
        (-np.eye(2), np.zeros((3, 1)), np.zeros((1, 2)), None, "B is 3 x 1"),
        (-np.eye(2), np.zeros((2, 1)), np.zeros((1, 3)), None, "C is 1 x 3"),
        (-np.eye(2), np.zeros((2, 1)), np.zeros((1, 2)), np.zeros((2, 2)), "D is 2 x 2"),
        (np.array([[-1.0, np.nan], [0.0, -1.0]]), np.zeros((2, 1)), np.zeros((1, 2)), None, r"A\[0, 1\] = nan"),
        (-np.eye(2), np.full((2, 1), np.inf), np.zeros((1, 2)), None, "not finite"),
        (-np.eye(2) + 1j, np.zeros((2, 1)), np.zeros((1, 2)), None, "complex"),
        (-np.ones((3, 2, 2)), np.zeros((2, 2, 1)), np.zeros((1, 2)), None, "do not broadcast"),
        ([[-1.0, 0.0], [1.0]], np.zeros((2, 1)), np.zeros((1, 2)), None, "not an array of numbers"),
        (-np.eye(2), np.zeros((2, 0)), np.zeros((1, 2)), None, "at least one"),
        (np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), None, "n >= 1"),
    ],
)
def test_bad_input_is_refused(A, B, C, D, words) -> None:
    for norm in (hinf_norm, h2_norm):
        with pytest.raises(GainsmithError, match=words):
            norm(A, B, C, D)


def test_levels_of_unstable_systems_and_bad_levels_are_refused() -> None:
    with pytest.raises(AnalysisError, match="unstable"):
        crosses_level([[1.0]], [[1.0]], [[1.0]], None, 2.0)
    with pytest.raises(AnalysisError, match="gamma"):
        crosses_level([[-1.0]], [[1.0]], [[1.0]], None, -2.0)
    for tolerance in (0.0, 1e-16, 2.0):
        with pytest.raises(AnalysisError, match="tolerance"):
            hinf_norm([[-1.0]], [[1.0]], [[1.0]], tolerance=tolerance)


def test_an_empty_stack_has_no_norms() -> None:
    assert hinf_norm(np.zeros((0, 2, 2)), np.zeros((2, 1)), np.zeros((1, 2))).norm.shape == (0,)
    assert h2_norm(np.zeros((0, 2, 2)), np.zeros((2, 1)), np.zeros((1, 2))).shape == (0,)


def test_unknown_signals_and_wrong_gains_are_refused() -> None:
    model = corner_velocity_model(load_parameter_set("resilient-velocity"), "lateral")
    with pytest.raises(AnalysisError, match="did you mean friction"):
        error_hinf_norm(model, [1.21, 16.8], [0.0], ("frction",))
    with pytest.raises(AnalysisError, match="gain"):
        error_hinf_norm(model, [1.21, 16.8, 3.0], [0.0], ("friction",))
    with pytest.raises(AnalysisError, match="at least one"):
        error_hinf_norm(model, [1.21, 16.8], [0.0], ())


def test_a_resonance_over_a_plateau_is_not_missed() -> None:
    """c + oscillator: the level just above the plateau c is crossed far from the peak. Independent check: a dense sweep."""
    rng = np.random.default_rng(11)
    w, z = 10.0 ** rng.uniform(-1, 3, 300), 10.0 ** rng.uniform(-4, -0.5, 300)
    A, B, C = oscillator(w, z)
    D = (rng.uniform(0.5, 3.0, 300) * rng.choice([-1, 1], 300))[:, None, None]
    found = hinf_norm(A, B, C, D)
    around = w[:, None] * (1.0 + z[:, None] * np.linspace(-30.0, 30.0, 6001))
    swept = np.abs(D[:, 0] + w[:, None] ** 2 / (w[:, None] ** 2 - around**2 + 2j * z[:, None] * w[:, None] * around))
    assert (found.norm >= swept.max(axis=1) * (1 - 1e-12)).all()
    assert (
        found.norm
        <= np.maximum(
            swept.max(axis=1) * (1 + 1e-4), np.maximum(np.abs(D[:, 0, 0]), np.abs(1 + D[:, 0, 0])) * (1 + 1e-9)
        )
    ).all()
    assert not crosses_level(A, B, C, D, found.norm * (1 + 1e-8)).any()
