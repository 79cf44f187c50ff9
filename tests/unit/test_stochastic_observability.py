"""The two tests for an unknown initial covariance, against a Riccati recursion with 80 digits."""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are

from analysis.errors import AnalysisError
from analysis.observability.stochastic import stochastic_observability, stochastic_observability_along
from synthesis.models.catalogue.longitudinal_speed import longitudinal_speed_model
from synthesis.models.parameter_set import load_parameter_set

Array = Any
PSI = 10**30  # what is left of order 1/psi must not show, even where C is nearly singular (seed 41360: N = 7e10)
SPEED = longitudinal_speed_model(load_parameter_set("longitudinal-speed"))


def precise_riccati(A: Array, C: Array, Q: Array, R: Array, psi: int = PSI) -> list[Any]:
    """P2 (21)-(22) started at psi I, in mpmath with 80 digits."""
    with mp.workdps(80):
        P = mp.mpf(psi) * mp.eye(A.shape[-1])
        noise, measured, out = mp.matrix(Q.tolist()), mp.matrix(R.tolist()), [P]
        for a, c in zip(map(mp.matrix, A.tolist()), map(mp.matrix, C.tolist()), strict=True):
            gain = P * c.T * (c * P * c.T + measured) ** -1
            P = a * (P - gain * c * P) * a.T + noise
            out.append(P)
        return out


def random_problem(seed: int, n: int, m: int, count: int = 7) -> tuple[Array, Array, Array, Array]:
    random = np.random.default_rng(seed)
    half_Q, half_R = random.normal(size=(n, n)), random.normal(size=(m, m))
    A, C = random.normal(size=(count, n, n)), random.normal(size=(count, m, n))
    return A, C, half_Q @ half_Q.T, half_R @ half_R.T + 0.1 * np.eye(m)


@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 4), m=st.integers(1, 3))
@example(seed=41360, n=3, m=3)  # C is nearly singular
def test_m_and_n_are_the_expansion_of_the_riccati_recursion_in_psi(seed: int, n: int, m: int) -> None:
    A, C, Q, R = random_problem(seed, n, m)
    found = stochastic_observability(A, C, Q, R)
    with mp.workdps(80):
        for P, M, N, free in zip(precise_riccati(A, C, Q, R), found.M, found.N, found.directions, strict=True):
            exact = np.array((P / PSI).tolist(), dtype=float)
            np.testing.assert_allclose(exact, M, atol=1e-9 * max(1.0, np.abs(M).max()))
            if free == 0:
                known = np.array(P.tolist(), dtype=float)
                assert (M == 0.0).all()
                np.testing.assert_allclose(N, known, rtol=0.0, atol=1e-7 * np.abs(known).max())
    assert found.samples_needed == -(-n // m)


def test_n_before_test_one_is_met_is_the_constant_term_in_psi() -> None:
    """Two values of psi eliminate M: N = (psi_2 P_1 - psi_1 P_2) / (psi_2 - psi_1) + O(1/psi)."""
    A, C, Q, R = random_problem(3, 4, 1)
    found = stochastic_observability(A, C, Q, R)
    with mp.workdps(80):
        low, high = (precise_riccati(A, C, Q, R, psi) for psi in (10**18, 10**19))
        for k in range(1, 4):
            assert found.directions[k] > 0
            constant = np.array(((10 * low[k] - high[k]) / 9).tolist(), dtype=float)
            np.testing.assert_allclose(found.N[k], constant, atol=1e-9 * np.abs(constant).max())


def test_recursion_equals_its_multiplied_out_form_and_the_papers_start() -> None:
    """(A6) for M_1 and N_1, with pseudo-inverses written as they stand."""
    A, C, Q, R = random_problem(8, 3, 2)
    found = stochastic_observability(A, C, Q, R)
    Xi = np.linalg.cholesky(R).T
    Sigma = C[0].T @ np.linalg.inv(Xi)
    W = np.linalg.pinv(Sigma.T @ Sigma)
    np.testing.assert_allclose(found.M[1], A[0] @ (np.eye(3) - Sigma @ W @ Sigma.T) @ A[0].T, atol=1e-12)
    np.testing.assert_allclose(found.N[1], Q + A[0] @ Sigma @ W @ W @ Sigma.T @ A[0].T, atol=1e-12)
    # One step further: the general form, before test 1 is met.
    values, vectors = np.linalg.eigh(np.eye(3) - Sigma @ W @ Sigma.T)
    G = A[0] @ vectors[:, values > 0.5]
    N = found.N[1]
    Xi = np.linalg.cholesky(R + C[1] @ N @ C[1].T).T
    inverse = np.linalg.inv(Xi)
    S = G.T @ C[1].T @ inverse
    W = np.linalg.pinv(S.T @ S)
    Pi = np.eye(2) - S.T @ S @ W
    cross = G @ S @ W @ inverse.T @ C[1] @ N
    inner = N + G @ S @ W @ W @ S.T @ G.T - cross - cross.T - N @ C[1].T @ inverse @ Pi @ inverse.T @ C[1] @ N
    np.testing.assert_allclose(found.N[2], Q + A[1] @ inner @ A[1].T, atol=1e-10 * np.abs(found.N[2]).max())


def test_after_test_one_n_is_the_ordinary_riccati_recursion_and_settles_at_its_fixed_point() -> None:
    random = np.random.default_rng(2)
    A = random.normal(size=(3, 3))
    C, Q, R = random.normal(size=(1, 3)), np.diag([1.0, 0.1, 0.3]), np.array([[0.5]])
    count = 200
    found = stochastic_observability(np.broadcast_to(A, (count, 3, 3)), np.broadcast_to(C, (count, 1, 3)), Q, R)
    np.testing.assert_allclose(found.N[-1], solve_discrete_are(A.T, C.T, Q, R), rtol=1e-9)
    assert found.samples_needed == 3
    N = found.N[10]
    gain = A @ N @ C.T / (C @ N @ C.T + R)
    np.testing.assert_allclose(found.N[11], A @ N @ A.T + Q - gain @ C @ N @ A.T, rtol=1e-10)  # P2 (27)


def test_a_hidden_decaying_direction_never_gives_an_exact_zero() -> None:
    """x2 is never measured: M decays by its pole squared, and its rank stays one however long the record is."""
    count, pole = 4000, 0.9
    A = np.broadcast_to(np.diag([1.0, pole]), (count, 2, 2))
    C = np.broadcast_to([[1.0, 0.0]], (count, 1, 2))
    found = stochastic_observability(A, C, 0.01 * np.eye(2), [[1.0]])
    assert found.samples_needed is None
    assert (found.directions[1:] == 1).all()
    np.testing.assert_allclose(found.largest_unknown[1:60], pole ** (2 * np.arange(1, 60)), rtol=1e-12)
    assert found.largest_known[100:].max() < 1.0


def test_round_off_is_never_mistaken_for_a_seen_direction() -> None:
    """At constant wheel speed the hidden mode decays while round-off along the integrator does not: N must not explode."""
    count = 5000
    found = stochastic_observability_along(SPEED, np.tile([40.0, 0.0], (count, 1)), 0.005, 2.5e-3 * np.eye(3), [[1e-3]])
    assert found.samples_needed is None
    assert found.largest_known.max() < 200.0
    assert np.isfinite(found.N).all()


def test_undetectable_direction_is_neither_forgotten_nor_bounded() -> None:
    count = 50
    A = np.broadcast_to(np.diag([0.5, 1.0]), (count, 2, 2))
    C = np.broadcast_to([[1.0, 0.0]], (count, 1, 2))
    found = stochastic_observability(A, C, 0.1 * np.eye(2), [[1.0]])
    assert found.samples_needed is None
    np.testing.assert_allclose(found.largest_unknown[1:], 1.0)
    np.testing.assert_allclose(found.largest_known[-1], 0.1 * count)  # a random walk


def test_the_rank_tolerance_decides_where_data_is_nearly_silent() -> None:
    A = np.broadcast_to(np.eye(2), (6, 2, 2))
    C = np.stack([[[1.0, -1.0 + 1e-5 * k]] for k in range(6)])  # (1, 1) all but cancels
    fine = stochastic_observability(A, C, np.zeros((2, 2)), [[1.0]], rank_tolerance=1e-9)
    coarse = stochastic_observability(A, C, np.zeros((2, 2)), [[1.0]], rank_tolerance=1e-2)
    assert fine.samples_needed == 2 and coarse.samples_needed is None
    assert fine.largest_known.max() > 1e9
    assert coarse.largest_known.max() < 10.0


def test_noise_may_change_from_sample_to_sample() -> None:
    A, C, Q, R = random_problem(1, 2, 1)
    weights = np.linspace(1.0, 3.0, 7)
    found = stochastic_observability(A, C, weights[:, None, None] * Q, weights[:, None, None] * R)
    single = stochastic_observability(A[:1], C[:1], Q, R)
    np.testing.assert_allclose(found.N[1], single.N[1])
    assert not np.allclose(found.N[2], stochastic_observability(A, C, Q, R).N[2])


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"R": [[0.0]]}, "singular"),
        ({"R": [[-1.0]]}, "singular"),
        ({"Q": -np.eye(2)}, "positive semidefinite"),
        ({"Q": np.array([[1.0, 0.5], [0.0, 1.0]])}, "not symmetric"),
        ({"Q": np.eye(3)}, r"Q has the shape \(3, 3\)"),
        ({"R": np.eye(2)}, r"R has the shape \(2, 2\)"),
        ({"C": np.ones((4, 1, 2))}, "K >= 1"),
        ({"C": np.full((3, 1, 2), np.inf)}, "not finite"),
        ({"A": np.ones((3, 2, 3))}, "square"),
        ({"rank_tolerance": 0.0}, "rank_tolerance"),
    ],
)
def test_bad_input_is_refused(change: dict[str, Any], word: str) -> None:
    given: dict[str, Any] = {"A": np.ones((3, 2, 2)), "C": np.ones((3, 1, 2)), "Q": np.eye(2), "R": [[1.0]]}
    with pytest.raises(AnalysisError, match=word):
        stochastic_observability(**(given | change))


def test_a_covariance_that_overflows_is_refused() -> None:
    with pytest.raises(AnalysisError, match="overflows"):
        stochastic_observability(np.full((200, 1, 1), 1e9), np.zeros((200, 1, 1)), [[1.0]], [[1.0]])
