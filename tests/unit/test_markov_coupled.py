"""Coupled Lyapunov and Riccati equations, the LMI beside them, and the continuous-time version."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, solve_discrete_are, solve_discrete_lyapunov

from analysis.constant_lmi import constant_problem, matrix_of
from analysis.errors import AnalysisError
from analysis.markov.continuous import MarkovJumpProcess
from analysis.markov.coupled_lmi import mean_square_lmi, weighted_sum
from analysis.markov.coupled_lyapunov import expected_cost, solve_coupled_lyapunov, stationary_second_moment
from analysis.markov.coupled_riccati import jump_regulator
from analysis.markov.second_moment import svec
from analysis.markov.system import MarkovJumpSystem
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import Verdict
from synthesis.lmi.solve import solve

DRAW = np.random.default_rng(3)
THREE = DRAW.normal(0, 0.45, (3, 2, 2))
CYCLIC = np.array([[0.1, 0.8, 0.1], [0.1, 0.1, 0.8], [0.8, 0.1, 0.1]])
THREE = THREE * np.sqrt(0.8 / float(MarkovJumpSystem(THREE, CYCLIC).second_moment_radius()))
SYSTEM = MarkovJumpSystem(THREE, CYCLIC)
WEIGHTS = np.stack([np.eye(2), np.diag([1.0, 3.0]), np.array([[2.0, 0.5], [0.5, 1.0]])])


def scaled_to(radius: float) -> MarkovJumpSystem:
    return MarkovJumpSystem(THREE * np.sqrt(radius / float(SYSTEM.second_moment_radius())), CYCLIC)


def test_solution_satisfies_the_equation_and_equals_the_sum_over_time() -> None:
    P = solve_coupled_lyapunov(SYSTEM, WEIGHTS)
    for i in range(3):
        np.testing.assert_allclose(
            P[i], WEIGHTS[i] + THREE[i].T @ np.einsum("j,jkl", CYCLIC[i], P) @ THREE[i], rtol=1e-12
        )
    x, pi = np.array([1.0, 2.0]), [0.2, 0.5, 0.3]
    moments = SYSTEM.propagate_second_moment(np.outer(x, x), pi, 2000)
    total = np.einsum("kjab,jba->", moments, WEIGHTS)
    assert expected_cost(SYSTEM, WEIGHTS, np.outer(x, x), pi) == pytest.approx(total, rel=1e-10)


def test_one_mode_is_the_ordinary_lyapunov_equation() -> None:
    system = MarkovJumpSystem(THREE[:1], [[1.0]])
    np.testing.assert_allclose(
        solve_coupled_lyapunov(system, np.eye(2))[0], solve_discrete_lyapunov(THREE[0].T, np.eye(2)), rtol=1e-12
    )
    np.testing.assert_allclose(
        stationary_second_moment(system, np.eye(2))[0], solve_discrete_lyapunov(THREE[0], np.eye(2)), rtol=1e-12
    )


def test_lmi_finds_the_same_matrices_as_the_linear_equations() -> None:
    """Minimise the trace of P with P_i - A_i' E_i(P) A_i >= W_i: the least such P solves the equations."""
    problem = LmiProblem(constant_problem().parameters)
    P = [problem.symmetric(f"P{i}", 2) for i in range(3)]
    bound = problem.scalar("trace")
    for i in range(3):
        step = problem.constant(THREE[i])
        slack = P[i] - step.T @ weighted_sum(P, CYCLIC[i]) @ step - problem.constant(WEIGHTS[i])
        problem.require(f"cost in mode {i}", slack, strict=False)
    corner = [problem.constant(row[None]) for row in np.eye(2)]
    total = weighted_sum([e @ P[i] @ e.T for i in range(3) for e in corner], np.ones(6))
    problem.require("trace", bound - total)
    problem.minimise("trace")
    found = solve(problem).values
    expected = solve_coupled_lyapunov(SYSTEM, WEIGHTS)
    for i in range(3):
        np.testing.assert_allclose(matrix_of(found[f"P{i}"]), expected[i], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("radius", [0.5, 0.99, 0.9999])
def test_lmi_and_radius_agree_below_one(radius: float) -> None:
    system = scaled_to(radius)
    found = mean_square_lmi(system)
    assert found.verdict is Verdict.CERTIFIED, found.message
    A = system.modes
    for i in range(3):
        slack = found.lyapunov[i] - A[i].T @ np.einsum("j,jkl", CYCLIC[i], found.lyapunov) @ A[i]
        assert np.linalg.eigvalsh(slack)[0] > 0 and np.linalg.eigvalsh(found.lyapunov[i])[0] > 0


@pytest.mark.parametrize("radius", [1.0001, 1.1, 3.0])
def test_lmi_refuses_what_the_radius_refuses(radius: float) -> None:
    assert mean_square_lmi(scaled_to(radius)).verdict is Verdict.REFUTED


def test_lmi_copes_with_states_of_very_different_size() -> None:
    S = np.diag([1.0, 1e5])
    system = MarkovJumpSystem(S @ scaled_to(0.9).modes @ np.linalg.inv(S), CYCLIC)
    assert mean_square_lmi(system).verdict is Verdict.CERTIFIED


def test_unstable_systems_have_an_infinite_cost_and_no_solution() -> None:
    system = scaled_to(1.2)
    with pytest.raises(AnalysisError, match=r"radius 1\.2, so the cost is infinite"):
        solve_coupled_lyapunov(system, np.eye(2))
    with pytest.raises(AnalysisError, match="grows without bound"):
        stationary_second_moment(system, np.eye(2))
    assert expected_cost(system, np.eye(2), np.eye(2), [1, 0, 0]) == np.inf
    unseen = MarkovJumpSystem([np.diag([0.5, 2.0])], [[1.0]])
    with pytest.raises(AnalysisError, match="leave those states out"):
        expected_cost(unseen, np.diag([1.0, 0.0]), np.eye(2), [1.0])


def test_weights_that_do_not_fit_are_refused() -> None:
    for weights, words in (
        (np.eye(3), "must end in"),
        (np.zeros((2, 2, 2)), "one matrix a mode"),
        (-np.eye(2), "eigenvalue"),
    ):
        with pytest.raises(AnalysisError, match=words):
            solve_coupled_lyapunov(SYSTEM, weights)
    with pytest.raises(AnalysisError, match="one system at a time"):
        mean_square_lmi(MarkovJumpSystem(np.zeros((4, 2, 1, 1)), np.eye(2)))


def test_stationary_second_moment_is_reached_from_zero() -> None:
    noise = np.stack([np.eye(2), np.zeros((2, 2)), np.diag([4.0, 0.0])])
    X, pi = np.zeros((3, 2, 2)), SYSTEM.stationary_distribution()
    for _ in range(1500):
        moved = THREE @ X @ np.swapaxes(THREE, 1, 2) + pi[:, None, None] * noise
        X = np.einsum("ij,ikl->jkl", CYCLIC, moved)
    np.testing.assert_allclose(stationary_second_moment(SYSTEM, noise), X, rtol=1e-10, atol=1e-13)


def test_one_mode_regulator_is_the_ordinary_riccati_equation() -> None:
    A, B = np.array([[1.2, 0.4], [-0.3, 1.1]]), np.array([[0.0], [1.0]])
    found = jump_regulator(MarkovJumpSystem(A[None], [[1.0]]), B, np.eye(2), [[2.0]])
    X = solve_discrete_are(A, B, np.eye(2), [[2.0]])
    np.testing.assert_allclose(found.cost[0], X, rtol=1e-10)
    np.testing.assert_allclose(found.gains[0], -np.linalg.solve(2.0 + B.T @ X @ B, B.T @ X @ A), rtol=1e-9)


def test_regulator_is_optimal_among_its_neighbours() -> None:
    system = scaled_to(2.0)
    found = jump_regulator(system, np.eye(2)[:, :1], np.eye(2), [[1.0]])
    assert found.radius < 1.0
    pi, X0 = [0.3, 0.3, 0.4], np.eye(2)
    best = np.einsum("i,ikk->", pi, found.cost)
    B = np.eye(2)[:, :1]
    for _ in range(10):
        F = found.gains + DRAW.normal(0, 0.02, found.gains.shape)
        loop = MarkovJumpSystem(system.modes + B @ F, CYCLIC)
        assert expected_cost(loop, np.eye(2) + np.swapaxes(F, 1, 2) @ F, X0, pi) > best


def test_regulator_refuses_what_cannot_be_stabilised() -> None:
    system = MarkovJumpSystem([np.diag([2.0, 0.5])] * 2, [[0.5, 0.5], [0.5, 0.5]])
    with pytest.raises(AnalysisError, match="no mode-dependent feedback"):
        jump_regulator(system, [[0.0], [1.0]], np.eye(2), [[1.0]])
    with pytest.raises(AnalysisError, match="singular or indefinite"):
        jump_regulator(system, [[1.0], [1.0]], np.eye(2), [[0.0]])
    with pytest.raises(AnalysisError, match="inputs has the shape"):
        jump_regulator(system, [[1.0, 1.0, 1.0]], np.eye(2), [[1.0]])


# Scalar modes a_i with equal rates q: abscissa of [[2 a0 - q, q], [q, 2 a1 - q]] in closed form.
@pytest.mark.parametrize(("a0", "a1", "q"), [(0.5, -2.0, 3.0), (1.0, -2.0, 0.5), (-1.0, -1.0, 2.0)])
def test_continuous_scalar_modes_in_closed_form(a0: float, a1: float, q: float) -> None:
    process = MarkovJumpProcess([[[a0]], [[a1]]], [[-q, q], [q, -q]])
    expected = a0 + a1 - q + np.hypot(a0 - a1, q)
    assert process.second_moment_abscissa() == pytest.approx(expected, abs=1e-12)
    assert bool(process.is_mean_square_stable()) == (expected < 0)
    assert process.margin == pytest.approx(-expected, abs=1e-12)


def test_continuous_time_is_the_limit_of_short_steps_with_three_modes() -> None:
    modes, Q = DRAW.normal(size=(3, 2, 2)) - np.eye(2), np.array([[-3.0, 2.5, 0.5], [0.1, -1.0, 0.9], [4.0, 0.5, -4.5]])
    process = MarkovJumpProcess(modes, Q)
    short = [
        (h, MarkovJumpSystem(expm(modes * h), expm(Q * h))) for h in (1e-3, 1e-4)
    ]  # jumps only at the ends of steps
    steps = [np.log(float(system.second_moment_radius())) / h for h, system in short]
    errors = np.abs(np.array(steps) - float(process.second_moment_abscissa()))
    assert errors[1] < 1e-5 or errors[1] < 0.2 * errors[0]
    turned = np.array([[-3.0, 0.5, 2.5], [0.9, -1.0, 0.1], [0.5, 4.0, -4.5]])
    assert abs(MarkovJumpProcess(modes, turned).second_moment_abscissa() - process.second_moment_abscissa()) > 1e-3
    pi = process.stationary_distribution()
    np.testing.assert_allclose(pi @ Q, 0.0, atol=1e-13)
    start = np.concatenate([p * svec(np.eye(2)) for p in pi])
    found = process.propagate_second_moment(start, [0.0, 0.7])
    np.testing.assert_allclose(found[1], expm(0.7 * process.second_moment_operator) @ start, rtol=1e-12)


@pytest.mark.parametrize(
    ("generator", "words"),
    [([[-1.0, 0.5], [1, -1]], "sums to -0.5"), ([[1.0, -1.0], [1, -1]], "negative"), (np.zeros((3, 3)), "2 modes")],
)
def test_bad_generators_are_refused(generator: object, words: str) -> None:
    with pytest.raises(AnalysisError, match=words):
        MarkovJumpProcess(np.zeros((2, 1, 1)), generator)  # type: ignore[arg-type]


def test_absorbing_process() -> None:
    """Leaving mode 0 at rate q for ever: abscissa max(2 a0 - q, 2 a1)."""
    process = MarkovJumpProcess([[[0.4]], [[-0.3]]], [[-1.0, 1.0], [0.0, 0.0]])
    assert process.second_moment_abscissa() == pytest.approx(max(0.8 - 1.0, -0.6))
    np.testing.assert_array_equal(process.stationary_distribution(), [0.0, 1.0])
