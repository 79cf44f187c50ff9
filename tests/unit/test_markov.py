"""Markov jump systems against Kronecker products written out, closed forms and questions that must be refused."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.markov.chain import recurrent, stationary_distribution
from analysis.markov.montecarlo import check_second_moment
from analysis.markov.second_moment import lifted, smat, svec
from analysis.markov.system import MarkovJumpSystem, independent

DRAW = np.random.default_rng(7)
THREE = DRAW.normal(0, 0.45, (3, 3, 3))
CYCLIC = np.array([[0.1, 0.8, 0.1], [0.1, 0.1, 0.8], [0.8, 0.1, 0.1]])


def full_radius(modes: np.ndarray, transition: np.ndarray) -> float:
    """Radius of (P' (x) I) diag(A_i (x) A_i), P3 (22) word for word."""
    m, n = modes.shape[:2]
    diagonal = np.zeros((m * n * n, m * n * n))
    for i, A in enumerate(modes):
        block = slice(i * n * n, (i + 1) * n * n)
        diagonal[block, block] = np.kron(A, A)
    return float(np.abs(np.linalg.eigvals(np.kron(transition.T, np.eye(n * n)) @ diagonal)).max())


def test_symmetric_square_moves_a_second_moment() -> None:
    A, X = DRAW.normal(size=(5, 4, 4)), DRAW.normal(size=(5, 4, 4))
    X = X + np.swapaxes(X, 1, 2)
    moved = smat((lifted(A) @ svec(X)[..., None])[..., 0])
    np.testing.assert_allclose(moved, A @ X @ np.swapaxes(A, 1, 2), rtol=1e-13, atol=1e-12)
    np.testing.assert_allclose(lifted(np.swapaxes(A, 1, 2)), np.swapaxes(lifted(A), 1, 2))
    np.testing.assert_allclose((svec(X) ** 2).sum(-1), (X**2).sum((-2, -1)))


def test_radius_equals_the_full_kronecker_operator_with_three_modes() -> None:
    assert MarkovJumpSystem(THREE, CYCLIC).second_moment_radius() == pytest.approx(
        full_radius(THREE, CYCLIC), rel=1e-12
    )


def test_orientation_shows_with_three_modes_and_not_with_two() -> None:
    """Three modes in a cycle: the order in which they follow each other counts."""
    given, turned = (MarkovJumpSystem(THREE, P).second_moment_radius() for P in (CYCLIC, CYCLIC.T))
    assert abs(given - turned) > 1e-3
    # A deterministic cycle 0 -> 1 -> 2 -> 0 multiplies A2 A1 A0, and its transpose A0 A1 A2 (up to cyclic order A1 A2 A0).
    cycle = np.roll(np.eye(3), 1, axis=1)
    product = THREE[2] @ THREE[1] @ THREE[0]
    expected = np.abs(np.linalg.eigvals(product)).max() ** (2 / 3)
    assert MarkovJumpSystem(THREE, cycle).second_moment_radius() == pytest.approx(expected, rel=1e-10)
    reverse = np.abs(np.linalg.eigvals(THREE[0] @ THREE[1] @ THREE[2])).max() ** (2 / 3)
    assert abs(reverse - expected) > 1e-3
    two = np.array([[0.9, 0.1], [0.4, 0.6]])
    assert MarkovJumpSystem(THREE[:2], two).second_moment_radius() != pytest.approx(full_radius(THREE[:2], np.eye(2)))


def test_propagation_starts_in_the_given_mode() -> None:
    """From mode 0 with certainty, one step applies A_0 and lands in mode j with transition[0, j]: fixes the orientation."""
    system = MarkovJumpSystem(THREE, CYCLIC)
    x = np.array([1.0, -2.0, 0.5])
    X = system.propagate_second_moment(np.outer(x, x), [1.0, 0.0, 0.0], 2)
    first = np.outer(THREE[0] @ x, THREE[0] @ x)
    np.testing.assert_allclose(X[1], CYCLIC[0][:, None, None] * first, atol=1e-14)
    np.testing.assert_allclose(X[2].sum(axis=0), np.einsum("j,jkl,lm,jnm->kn", CYCLIC[0], THREE, first, THREE))


def test_growth_of_the_propagated_moment_is_the_radius() -> None:
    system = MarkovJumpSystem(THREE, CYCLIC)
    size = np.trace(system.propagate_second_moment(np.eye(3), [0.2, 0.3, 0.5], 300), axis1=-2, axis2=-1).sum(-1)
    assert (size[300] / size[200]) ** 0.01 == pytest.approx(float(system.second_moment_radius()), rel=1e-9)


def test_batches_broadcast_over_modes_and_transitions() -> None:
    modes, transitions = DRAW.normal(0, 0.4, (4, 1, 3, 2, 2)), DRAW.dirichlet(np.ones(3), (5, 3))
    radius = MarkovJumpSystem(modes, transitions).second_moment_radius()
    assert radius.shape == (4, 5)
    for i in range(4):
        for j in range(5):
            assert radius[i, j] == pytest.approx(full_radius(modes[i, 0], transitions[j]), rel=1e-10)


@pytest.mark.parametrize("modes", [2, 3])
def test_large_batches_of_two_states_equal_their_members(modes: int) -> None:
    """Repeated squaring with bounds, or eigenvalues where those do not meet: defective, rotating and singular ones included."""
    A, P = DRAW.normal(size=(600, modes, 2, 2)), DRAW.dirichlet(np.ones(modes), (600, modes))
    A[:20], A[20:40, :, 1], A[40:60] = 0.0, 0.0, np.array([[1.0, 5.0], [0.0, 1.0]])
    A[60:80] = np.array([[0.0, 1.0], [-1.0, 0.0]])
    P[80:100] = np.eye(modes)
    A[100:200] *= 1e-200
    A[200:300] *= 1e100
    together = MarkovJumpSystem(A, P).second_moment_radius()
    one_by_one = [float(MarkovJumpSystem(a, p).second_moment_radius()) for a, p in zip(A, P, strict=True)]
    # A defective eigenvalue is determined to a root of the rounding error only, in either way.
    np.testing.assert_allclose(together[40:60], 1.0, rtol=1e-4)
    keep = np.r_[0:40, 60:600]
    np.testing.assert_allclose(together[keep], np.array(one_by_one)[keep], rtol=1e-10, atol=1e-300)


def test_independent_modes_reduce_to_the_mean_operator() -> None:
    system = independent(THREE, [0.2, 0.5, 0.3])
    mean = np.einsum("i,ijk->jk", [0.2, 0.5, 0.3], lifted(THREE))
    assert system.second_moment_radius() == pytest.approx(np.abs(np.linalg.eigvals(mean)).max(), rel=1e-12)


def test_margin_and_verdict_have_the_sign_of_the_radius() -> None:
    radius = float(MarkovJumpSystem(THREE, CYCLIC).second_moment_radius())
    below, above = (MarkovJumpSystem(THREE * np.sqrt(f / radius), CYCLIC) for f in (0.999, 1.001))
    assert below.is_mean_square_stable() and not above.is_mean_square_stable()
    assert below.margin == pytest.approx(0.001, abs=1e-9) and above.margin == pytest.approx(-0.001, abs=1e-9)


def test_absorbing_chain_has_the_right_answers() -> None:
    """Mode 1 absorbs: the radius is max((1 - q) rho(A_0)^2, rho(A_1)^2), and an unstable transient mode may be left in time."""
    q = 0.5
    chain = [[1 - q, q], [0.0, 1.0]]
    for a0, a1 in ((1.3, 0.9), (1.5, 0.5), (0.5, 1.1)):
        system = MarkovJumpSystem([[[a0]], [[a1]]], chain)
        assert system.second_moment_radius() == pytest.approx(max((1 - q) * a0**2, a1**2), rel=1e-12)
        np.testing.assert_array_equal(system.stationary_distribution(), [0.0, 1.0])
    assert MarkovJumpSystem([[[1.3]], [[0.9]]], chain).is_mean_square_stable()
    np.testing.assert_array_equal(recurrent(np.array(chain)), [False, True])


def test_two_absorbing_modes_have_no_single_stationary_distribution() -> None:
    system = MarkovJumpSystem(np.zeros((3, 1, 1)), [[0.2, 0.3, 0.5], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(AnalysisError, match=r"modes 1 and 2 lie in different closed classes"):
        system.stationary_distribution()


def test_stationary_distribution_in_closed_form_periodic_chain_included() -> None:
    f, r = 0.3, 0.2
    np.testing.assert_allclose(stationary_distribution(np.array([[1 - f, f], [r, 1 - r]])), [r / (f + r), f / (f + r)])
    np.testing.assert_allclose(stationary_distribution(np.roll(np.eye(4), 1, axis=1)), np.full(4, 0.25))


@pytest.mark.parametrize(
    ("modes", "transition", "words"),
    [
        (np.zeros((2, 2, 3)), np.eye(2), "square"),
        (np.zeros((2, 2)), np.eye(2), "at least 3 axes"),
        (np.full((2, 1, 1), np.nan), np.eye(2), "not finite"),
        (np.zeros((2, 1, 1)), [[0.5, 0.6], [0.5, 0.5]], r"row \[0\] of transition sums to 1.1"),
        (np.zeros((2, 1, 1)), [[1.1, -0.1], [0.5, 0.5]], "negative"),
        (np.zeros((2, 1, 1)), [[0.9, 0.3], [0.1, 0.7]], "transposed"),
        (np.zeros((3, 1, 1)), np.eye(2), "3 modes"),
        (np.zeros((2, 1, 1)), [[np.nan, 1.0], [0.5, 0.5]], "not finite"),
        (np.zeros((4, 2, 1, 1)), np.tile(np.eye(2), (3, 1, 1)), "broadcast"),
    ],
)
def test_bad_input_is_refused(modes: object, transition: object, words: str) -> None:
    with pytest.raises(AnalysisError, match=words):
        MarkovJumpSystem(modes, transition)  # type: ignore[arg-type]


def test_bad_starts_are_refused() -> None:
    system = MarkovJumpSystem(THREE, CYCLIC)
    with pytest.raises(AnalysisError, match=r"sums to 0\.9"):
        system.propagate_second_moment(np.eye(3), [0.5, 0.4, 0.0], 1)
    with pytest.raises(AnalysisError, match="eigenvalue -1"):
        system.propagate_second_moment(-np.eye(3), [1, 0, 0], 1)
    with pytest.raises(AnalysisError, match="steps"):
        system.propagate_second_moment(np.eye(3), [1, 0, 0], -1)
    with pytest.raises(AnalysisError, match=r"a symmetric matrix of size n"):
        smat(np.zeros(4))


def test_simulation_agrees_with_the_exact_moment_and_not_with_a_wrong_one() -> None:
    system = MarkovJumpSystem(THREE, CYCLIC)
    found = check_second_moment(system, [1, 0, -1], [0.6, 0.3, 0.1], 8, 20_000, np.random.default_rng(11))
    assert found.agrees
    assert found.largest_share.max() < 0.05
    transposed = MarkovJumpSystem(THREE, CYCLIC.T)
    wrong = np.trace(
        transposed.propagate_second_moment(np.outer([1, 0, -1], [1, 0, -1]), [0.6, 0.3, 0.1], 8), axis1=-2, axis2=-1
    ).sum(-1)
    assert ((wrong < found.lower) | (wrong > found.upper)).any()


def test_simulation_is_repeatable_and_refuses_too_few_runs() -> None:
    system = MarkovJumpSystem(THREE, CYCLIC)
    first, second = (
        check_second_moment(system, [1, 0, 0], [1, 0, 0], 3, 100, np.random.default_rng(5)).estimate for _ in range(2)
    )
    np.testing.assert_array_equal(first, second)
    with pytest.raises(AnalysisError, match="at least 100"):
        check_second_moment(system, [1, 0, 0], [1, 0, 0], 3, 10, np.random.default_rng(5))
