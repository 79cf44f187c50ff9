"""Two-sided bounds of second-moment radii, without the operator as a matrix, and what they say of data near the border."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import ortho_group

from analysis.errors import AnalysisError
from analysis.markov.blocks import flow_blocks, step_blocks
from analysis.markov.bracket import Bracket, continuous_bracket, discrete_bracket
from analysis.markov.continuous import MarkovJumpProcess, second_moment_flow
from analysis.markov.coupled_lyapunov import expected_cost, solve_coupled_lyapunov
from analysis.markov.enclosure import DATA, enclosed, verdicts
from analysis.markov.power import abscissa_estimate, radius_estimate
from analysis.markov.second_moment import lifted
from analysis.markov.system import MarkovJumpSystem, second_moment_operator
from synthesis.lmi.result import Verdict


def draw(states: int, modes: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    return random.normal(0, 0.6 / np.sqrt(states), (modes, states, states)), random.dirichlet(np.ones(modes), modes)


def generator(modes: int, seed: int = 0) -> np.ndarray:
    rates = np.random.default_rng(seed).uniform(0.1, 1.0, (modes, modes)) * (1.0 - np.eye(modes))
    return rates - np.diag(rates.sum(axis=1))


def dense(modes: np.ndarray, transition: np.ndarray) -> float:
    return float(np.abs(np.linalg.eigvals(second_moment_operator(modes, transition))).max())


@pytest.mark.parametrize(("states", "modes"), [(2, 2), (5, 1), (5, 5), (9, 3)])
def test_steps_find_the_radius_of_the_operator(states: int, modes: int) -> None:
    A, P = draw(states, modes)
    found = radius_estimate(A, P)
    assert found.value == pytest.approx(dense(A, P), rel=1e-11)
    assert found.lower <= found.value <= found.upper <= found.lower * (1.0 + 1e-9)


@pytest.mark.parametrize(("states", "modes"), [(2, 2), (6, 4), (9, 3)])
def test_arnoldi_finds_the_abscissa_of_the_operator(states: int, modes: int) -> None:
    A, Q = draw(states, modes)[0] * 3.0, generator(modes)
    exact = float(np.linalg.eigvals(second_moment_flow(A, Q)).real.max())
    found = abscissa_estimate(A, Q)
    assert found.value == pytest.approx(exact, abs=1e-11)
    assert found.lower <= exact <= found.upper <= found.lower + 1e-4


def test_large_systems_go_without_the_operator_and_small_ones_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    A, P = draw(9, 4)
    system = MarkovJumpSystem(np.stack([A, 0.5 * A]), P)
    radius = system.second_moment_radius()
    assert "second_moment_operator" not in system.__dict__
    assert radius == pytest.approx([dense(A, P), 0.25 * dense(A, P)], rel=1e-11)
    lower, upper = system.radius_bounds()
    assert ((lower <= radius) & (radius <= upper) & (upper - lower <= 1e-9 * radius)).all()
    process = MarkovJumpProcess(A, generator(4))
    exact = np.linalg.eigvals(process.second_moment_operator).real.max()
    assert process.second_moment_abscissa() == pytest.approx(exact, abs=1e-11)
    assert process.verdict() is (Verdict.CERTIFIED if exact < 0.0 else Verdict.REFUTED)


def test_a_periodic_chain_is_the_product_of_its_modes() -> None:
    """0 -> 1 -> ... -> 4 -> 0 for certain: the radius is |eigenvalue of A4 A3 A2 A1 A0|^(2/5), its eigenvector of rank one."""
    A, _ = draw(7, 5, seed=3)
    cycle = np.roll(np.eye(5), 1, axis=1)
    product = A[4] @ A[3] @ A[2] @ A[1] @ A[0]
    expected = np.abs(np.linalg.eigvals(product)).max() ** 0.4
    found = radius_estimate(A, cycle)
    assert found.value == pytest.approx(expected, rel=1e-12)
    assert expected * (1.0 - 1e-9) <= found.lower <= expected <= found.upper <= expected * (1.0 + 1e-9)
    # A leak out of the cycle, into an absorbing mode that decays, costs its probability at every turn.
    modes = np.concatenate([A, 0.01 * np.eye(7)[None]])
    leaking = np.zeros((6, 6))
    leaking[:5, :5], leaking[4, 0], leaking[4, 5], leaking[5, 5] = cycle, 0.75, 0.25, 1.0
    assert radius_estimate(modes, leaking).value == pytest.approx(expected * 0.75**0.2, rel=1e-12)


def test_a_chain_of_period_two_with_choices() -> None:
    """Modes {0, 1} lead to {2, 3} and back: eigenvalues +-radius, which plain power iteration does not settle on."""
    A, _ = draw(6, 4, seed=5)
    P = np.zeros((4, 4))
    P[:2, 2:], P[2:, :2] = [[0.3, 0.7], [0.6, 0.4]], [[0.5, 0.5], [0.9, 0.1]]
    found = radius_estimate(A, P)
    assert found.value == pytest.approx(dense(A, P), rel=1e-10)
    assert found.upper - found.lower <= 1e-9 * found.value


def test_reducible_chains_and_states_take_the_fastest_block() -> None:
    A, P = draw(4, 3, seed=1)
    apart = np.zeros((6, 6))
    apart[:3, :3], apart[3:, 3:] = P, P
    both = np.concatenate([A, 1.3 * A])
    assert radius_estimate(both, apart).value == pytest.approx(1.69 * dense(A, P), rel=1e-11)
    block = np.zeros((3, 8, 8))
    block[:, :4, :4], block[:, 4:, 4:], block[:, :4, 4:] = A, 0.9 * A, 5.0
    found = radius_estimate(block, P)
    assert found.value == pytest.approx(dense(A, P), rel=1e-11) and found.upper <= found.value * (1.0 + 1e-8)
    assert len(step_blocks(block, P)) == 2


def test_what_never_returns_has_radius_zero() -> None:
    """Nilpotent in sight: exactly zero. A rotated one is bounded from above only, and says so."""
    N = np.triu(np.ones((5, 5)), 1)
    assert radius_estimate(np.stack([N, 2.0 * N]), np.full((2, 2), 0.5)) == (0.0, 0.0, 0.0)
    assert radius_estimate(np.ones((2, 3, 3)), np.array([[0.0, 1.0], [0.0, 1.0]])).value == pytest.approx(9.0)
    rotated = ortho_group.rvs(5, random_state=0) @ N @ ortho_group.rvs(5, random_state=0).T
    found = radius_estimate(np.stack([rotated, rotated]), np.full((2, 2), 0.5))
    assert found.lower == 0.0 <= found.value <= found.upper


def test_an_eigenvector_on_the_border_that_no_coordinates_show() -> None:
    """Commuting modes U diag U': the largest |entry|^2 of the mixture, though X is singular in the limit."""
    U, sizes = ortho_group.rvs(8, random_state=2), np.linspace(0.2, 0.9, 8)
    modes = np.stack([U @ np.diag(sizes) @ U.T, U @ np.diag(sizes[::-1]) @ U.T])
    expected = max(0.5 * (a**2 + b**2) for a, b in zip(sizes, sizes[::-1], strict=True))
    found = radius_estimate(modes, np.full((2, 2), 0.5))
    assert found.value == pytest.approx(expected, rel=1e-11)
    assert found.lower <= expected <= found.upper and found.upper - found.lower <= 1e-6


def test_blocks_of_a_process_let_a_jump_leave_the_state_where_it_is() -> None:
    modes = np.stack([np.diag([-1.0, -2.0]), np.diag([-3.0, 0.5])])
    assert len(flow_blocks(modes, generator(2))) == 2
    assert len(flow_blocks(modes, np.zeros((2, 2)))) == 4
    found = abscissa_estimate(modes, np.array([[-1.0, 1.0], [0.0, 0.0]]))
    assert found.value == pytest.approx(1.0, abs=1e-12)  # 2 * 0.5 in the absorbing mode
    ahead = abscissa_estimate(modes, np.array([[0.0, 0.0], [3.0, -3.0]]))
    assert ahead.value == pytest.approx(-2.0, abs=1e-12)  # max(2 * -1, 2 * 0.5 - 3)


@pytest.mark.parametrize("seed", range(6))
def test_any_definite_matrix_bounds_and_the_eigenvector_bounds_tightly(seed: int) -> None:
    random = np.random.default_rng(seed)
    A, P = draw(3, 3, seed)
    kept = np.ones((3, 3), dtype=bool)
    root = random.normal(size=(3, 3, 3))
    X = root @ np.swapaxes(root, -1, -2)
    found, radius = discrete_bracket(A, P, X, kept), dense(A, P)
    # the same numbers from generalised eigenvalues
    Y = np.einsum("ij,iab->jab", P, A @ X @ np.swapaxes(A, -1, -2))
    ratios = np.linalg.eigvals(np.linalg.solve(X, Y)).real
    assert found.lower <= radius <= found.upper
    assert found == pytest.approx((ratios.min(), ratios.max()), rel=1e-7, abs=1e-9)
    Q = generator(3, seed)
    drift = A @ X
    Z = drift + np.swapaxes(drift, -1, -2) + np.einsum("ij,iab->jab", Q, X)
    rates = np.linalg.eigvals(np.linalg.solve(X, Z)).real
    flow = continuous_bracket(A, Q, X, kept)
    assert flow.lower <= np.linalg.eigvals(second_moment_flow(A, Q)).real.max() <= flow.upper
    assert flow == pytest.approx((rates.min(), rates.max()), rel=1e-6, abs=1e-7)
    assert discrete_bracket(A, P, -X, kept) == (0.0, np.inf) and continuous_bracket(A, Q, -X, kept) == (-np.inf, np.inf)


def test_bounds_hold_for_data_within_their_error_and_not_beyond() -> None:
    A, P = draw(4, 3, seed=2)
    X = np.tile(np.eye(4), (3, 1, 1))
    for _ in range(400):
        X = np.einsum("ij,iab->jab", P, A @ X @ np.swapaxes(A, -1, -2))
        X /= X.max()
    kept = np.ones((3, 4), dtype=bool)
    sharp, wide = (discrete_bracket(A, P, X, kept, relative) for relative in (0.0, 1e-4))
    assert sharp.width < 1e-10 < wide.width < 1e-2
    for sign in (1.0, -1.0):
        moved = dense(A * (1.0 + sign * 1e-4), P)
        assert wide.lower <= moved <= wide.upper and not sharp.lower <= moved <= sharp.upper


def test_brackets_meet_and_measure() -> None:
    assert Bracket(0.0, 2.0).meet(Bracket(1.0, 3.0)) == (1.0, 2.0)
    assert Bracket(1.0, 2.0).width == 0.5 and Bracket(1.0, 2.0).middle == 1.5
    assert Bracket(0.0, 0.0).width == 0.0 and Bracket(0.0, np.inf).width == np.inf


def test_discs_hold_the_eigenvalues_of_all_matrices_within_the_error() -> None:
    random = np.random.default_rng(1)
    M = random.normal(size=(200, 5, 5))
    sharp, wide = enclosed(M, DATA * np.abs(M)), enclosed(M, 1e-6 * np.abs(M))
    radius = np.abs(np.linalg.eigvals(M)).max(axis=-1)
    assert ((sharp.lower <= radius) & (radius <= sharp.upper)).all() and (
        sharp.upper - sharp.lower < 1e-9 * radius
    ).all()
    for sign in (1.0, -1.0):
        moved = np.abs(np.linalg.eigvals(M * (1.0 + sign * 0.99e-6))).max(axis=-1)
        assert ((wide.lower <= moved) & (moved <= wide.upper)).all()
        assert not ((sharp.lower <= moved) & (moved <= sharp.upper)).any()
    part = enclosed(M, DATA * np.abs(M), modulus=False)
    real = np.linalg.eigvals(M).real.max(axis=-1)
    assert ((part.lower <= real) & (real <= part.upper) & (part.upper - part.lower < 1e-9)).all()


def test_discs_have_the_sums_of_rows_as_radii() -> None:
    """diag(2, 1) is its own eigenbasis: an error in the first row widens the disc about 2, one in the second the disc about 1."""
    error = np.array([[[0.0, 0.1], [0.0, 0.0]], [[0.0, 0.0], [0.1, 0.0]]])
    found = enclosed(np.tile(np.diag([2.0, 1.0]), (2, 1, 1)), error)
    np.testing.assert_allclose(found.upper, [2.1, 2.0], atol=1e-12)
    np.testing.assert_allclose(found.lower, [1.9, 2.0], atol=1e-12)
    joined = enclosed(
        np.diag([2.0, 1.0]), 0.6 * np.ones((2, 2))
    )  # both discs meet: the lower one may hold the eigenvalue
    assert joined.lower <= 1e-12 and joined.upper == pytest.approx(3.2)


def test_discs_of_a_rotated_jordan_block_are_as_wide_as_its_sensitivity() -> None:
    """An error e moves a double eigenvalue by sqrt(e): the enclosure must hold the worst of them."""
    U = ortho_group.rvs(2, random_state=4)
    M = U @ np.array([[0.5, 1.0], [0.0, 0.5]]) @ U.T
    error = 1e-8 * np.ones((2, 2))
    found = enclosed(M, error)
    worst = 0.5 + np.sqrt(1e-8)
    assert 0.5 - 1e-2 <= found.lower <= 0.5 and worst <= found.upper <= 0.5 + 1e-2
    moved = M + U @ np.array([[0.0, 0.0], [0.5e-8, 0.0]]) @ U.T
    assert np.abs(np.linalg.eigvals(moved)).max() <= found.upper
    # a matrix without enough eigenvectors, exactly: nothing is known but its size
    assert enclosed(np.zeros((2, 2)), np.zeros((2, 2))) == (0.0, 0.0, 0.0)


def test_three_answers() -> None:
    found = verdicts(np.array([0.2, 0.9, 1.0]), np.array([0.9, 1.0, 1.2]))
    assert list(np.asarray(found)) == [Verdict.CERTIFIED, Verdict.INCONCLUSIVE, Verdict.REFUTED]
    assert verdicts(np.array(-2.0), np.array(-1.0), border=0.0) is Verdict.CERTIFIED
    marginal = ortho_group.rvs(2, random_state=7) * 1.0
    systems = np.stack([0.999 * marginal, marginal, 1.001 * marginal])[:, None]
    batch = MarkovJumpSystem(systems, [[1.0]])
    assert list(np.asarray(batch.verdict())) == [Verdict.CERTIFIED, Verdict.INCONCLUSIVE, Verdict.REFUTED]
    np.testing.assert_array_equal(batch.is_mean_square_stable(), [True, False, False])
    for shift, answer in ((-1e-9, Verdict.CERTIFIED), (0.0, Verdict.INCONCLUSIVE), (1e-9, Verdict.REFUTED)):
        turning = np.array([[shift, 1.0], [-1.0, shift]])
        process = MarkovJumpProcess([turning], [[0.0]])
        assert process.verdict() is answer and bool(process.is_mean_square_stable()) is (answer is Verdict.CERTIFIED)
    growing = MarkovJumpProcess([[[0.2]], [[0.3]]], [[-1.0, 1.0], [1.0, -1.0]])
    assert not growing.is_mean_square_stable()
    assert growing.second_moment_abscissa() == pytest.approx(
        np.sqrt(1.01) - 0.5, abs=1e-14
    )  # of [[-0.6, 1], [1, -0.4]]


def test_nearly_defective_is_decided_where_the_family_is_regular() -> None:
    """Four rotated states in one Jordan block: discs reach over 1, one exact member of a regular family decides."""
    U = ortho_group.rvs(4, random_state=1)
    for eigenvalue, answer in ((0.95, Verdict.CERTIFIED), (1.0, Verdict.INCONCLUSIVE), (1.03, Verdict.REFUTED)):
        A = U @ (eigenvalue * np.eye(4) + np.diag(np.ones(3), 1)) @ U.T
        system = MarkovJumpSystem([A], [[1.0]])
        lower, upper = system.radius_bounds()
        assert lower < 1.0 < upper and system.verdict() is answer
    S = lifted(A)
    assert S.shape == (10, 10)


def test_marginal_systems_have_no_cost_and_no_stationary_moment() -> None:
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    system = MarkovJumpSystem([turn, turn], [[0.5, 0.5], [0.5, 0.5]])
    with pytest.raises(AnalysisError, match=r"undecided at this precision: the second-moment radius lies between 1 - "):
        solve_coupled_lyapunov(system, np.eye(2))
    with pytest.raises(AnalysisError, match="undecided at this precision"):
        expected_cost(system, np.eye(2), np.eye(2), [0.5, 0.5])
    damped = MarkovJumpSystem(0.99 * system.modes, system.transition)
    assert expected_cost(damped, np.eye(2), np.eye(2), [0.5, 0.5]) == pytest.approx(2.0 / (1.0 - 0.99**2))
