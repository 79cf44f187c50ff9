"""The methods of the norms one by one: what leaves one of them without proof goes on to the next, and never out as a bound."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
import pytest

from analysis import h2_norm, hinf_norm, linf_norm
from analysis.norms import peaks, two_states
from analysis.norms.exact_peak import exact_peak
from analysis.norms.frequency_response import Systems
from analysis.norms.gramians import gramian_factor, gramian_matrix
from analysis.norms.hamiltonian import near_axis

BAND = np.array([[0.0], [inf]])


def resonance(w0: float, z: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """w0^2/(s^2 + 2 z w0 s + w0^2): norm 1/(2 z sqrt(1 - z^2))."""
    return np.array([[0.0, 1.0], [-w0 * w0, -2.0 * z * w0]]), np.array([[0.0], [w0 * w0]]), np.array([[1.0, 0.0]])


def test_a_zero_gain_at_the_first_guess_proves_no_zero_norm() -> None:
    """s/((s + 1)(s + 2)) vanishes at both ends of the band, and has the norm 1/3."""
    A, B, C = np.array([[0.0, 1.0], [-2.0, -3.0]]), np.array([[0.0], [1.0]]), np.array([[0.0, 1.0]])
    D = np.zeros((1, 1))
    band = Systems(A[None], B[None], C[None], D[None])
    assert exact_peak(band, 0.0, 0.0, (0.0, inf), 1e-9) == (0.0, 0.0, inf)
    assert exact_peak(band, 0.1, 0.3, (0.0, inf), 1e-9)[0] == pytest.approx(1.0 / 3.0, rel=1e-9)
    nothing = Systems(A[None], B[None], 0.0 * C[None], D[None])
    assert exact_peak(nothing, 0.0, 0.0, (0.0, inf), 1e-9)[2] == 0.0


def test_two_states_without_a_proof_take_another_method(monkeypatch: pytest.MonkeyPatch) -> None:
    A, B, C = resonance(7.0, 0.1)
    truth = 1.0 / (0.2 * sqrt(1.0 - 0.01))
    systems = Systems(A[None], B[None], C[None], np.zeros((1, 1, 1)))
    assert two_states.planar_peaks(systems, BAND, 1e-9)[3].all()
    monkeypatch.setattr(two_states, "ROUNDS", 0)
    assert not two_states.planar_peaks(systems, BAND, 1e-9)[3].any()
    found = hinf_norm(A, B, C)
    assert truth * (1.0 - 1e-9) <= found.norm <= found.upper <= truth * (1.0 + 1e-7)


def test_levels_without_a_proof_are_no_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three states: neither the Taylor bounds nor the Hamiltonian matrix may say what they did not prove."""
    A, B, C = resonance(7.0, 0.1)
    A, B, C = np.block([[A, np.zeros((2, 1))], [np.zeros((1, 2)), -1.0]]), np.vstack([B, 0.0]), np.hstack([C, [[0.0]]])
    truth = 1.0 / (0.2 * sqrt(1.0 - 0.01))
    used: list[int] = []
    monkeypatch.setattr(peaks, "hamiltonian_peaks", lambda systems, *_: used.append(len(systems)))
    assert hinf_norm(A, B, C).upper == pytest.approx(truth, rel=1e-7) and not used  # proved by the first method alone
    monkeypatch.undo()
    monkeypatch.setattr(peaks, "level_proof", lambda parts, gamma, *_: (np.zeros(len(gamma), bool), 0.0 * gamma))
    found = hinf_norm(A, B, C)
    assert truth * (1.0 - 1e-9) <= found.norm <= found.upper <= truth * (1.0 + 1e-7)
    monkeypatch.setattr(peaks, "proved_peaks", lambda systems, norm, at, *_: (norm, at, np.full(len(norm), inf)))
    assert hinf_norm(A, B, C).upper == pytest.approx(truth, rel=1e-7)  # by Hamiltonian matrices
    monkeypatch.setattr(peaks, "ROUNDS", 1)
    monkeypatch.setattr(peaks, "first_guess", lambda modal, direct, band: (0.0 * direct, 0.0 * direct))
    assert hinf_norm(A, B, C).upper == inf  # one round from the gain at zero is not enough


def test_default_tolerances_are_tight() -> None:
    A, B, C = resonance(3.0, 0.05)
    truth = 1.0 / (0.1 * sqrt(1.0 - 0.0025))
    for found in (hinf_norm(A, B, C), linf_norm(A, B, C), linf_norm(-A, B, -C)):
        assert truth * (1.0 - 1e-12) <= found.upper <= truth * (1.0 + 1e-8)


@pytest.mark.parametrize("discrete", [False, True])
def test_doubling_ends_for_no_state_before_all_have_converged(discrete: bool) -> None:
    """First orders, slow beside fast in units 1e9 apart: b_i b_j/(1 - a_i a_j), or b_i b_j/(a_i + a_j), at (i, j)."""
    a = np.array([0.1, 0.5, 1.0 - 1e-9]) if discrete else np.array([30.0, 1.0, 1e-7])
    b = np.array([1e9, 1.0, 1e-9])
    A = np.diag(a if discrete else -a)
    wanted = np.outer(b, b) / (1.0 - np.outer(a, a) if discrete else a[:, None] + a)
    # and a member that converges at once in the same stack
    stack, forces = np.stack([A, A[:1, :1] * np.eye(3)]), np.stack([b[:, None], np.ones((3, 1))])
    factor = gramian_factor(stack, forces, discrete)[0]
    np.testing.assert_allclose(factor @ factor.T, wanted, rtol=1e-7)
    np.testing.assert_allclose(gramian_matrix(stack, forces, discrete)[0], wanted, rtol=1e-7)


def test_only_eigenvalues_near_the_axis_are_crossings() -> None:
    """1/(s + 1) passes the level 0.8 at sqrt(1/0.64 - 1) = 0.75, and the level 2 nowhere."""
    one = np.ones((1, 1, 1))
    systems = Systems(-one, one, one, 0.0 * one)
    found = near_axis(systems, np.array([0.8]))[0]
    np.testing.assert_allclose(found[np.isfinite(found)], 0.75, rtol=1e-12)
    assert np.isfinite(found).sum() == 1 and np.isnan(near_axis(systems, np.array([2.0]))).all()


def test_doubling_goes_on_to_the_last_digits() -> None:
    """1/(1 - a^2) and 1/(2 a) where the step that would be left out is still 1e-5 or 1e-9 of the sum."""
    one = np.ones((1, 1, 1))
    for exponent in (9.5, 9.9, 18.5, 20.0):
        a = np.exp(-exponent / 64.0)
        factor = gramian_factor(a * one, one, True)[0]
        assert (factor @ factor.T).item() == pytest.approx(1.0 / (1.0 - a * a), rel=1e-13)
        assert gramian_matrix(a * one, one, True).item() == pytest.approx(1.0 / (1.0 - a * a), rel=1e-13)
        assert h2_norm(-a * one, one, one).item() ** 2 == pytest.approx(0.5 / a, rel=1e-13)
