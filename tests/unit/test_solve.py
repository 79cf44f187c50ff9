"""Verdicts: what is certified, refuted or left open, and that no solver's word is taken for it."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from synthesis.errors import ProblemError
from synthesis.lmi import solve as solve_module
from synthesis.lmi.clarabel_backend import RawAnswer
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings, Relaxation
from synthesis.lmi.solve import margins_of, solve
from tests.support.blas_threads import blas_threads
from tests.support.lmi_cases import (
    closed_loop,
    condition_problem,
    confirmed,
    gain_problem,
    lyapunov_problem,
    parameter,
    within,
)

STABLE = np.array([[[-1.0, 0.0], [0.0, -2.0]], [[0.0, 0.5], [-0.5, 0.0]]])
ONE = np.ones((1, 1, 1))


def least(expression: float, settings: LmiSettings | None = None, low: float = 0.0) -> LmiResult:
    """Least t with t > expression and, if `low`, t < expression - low: infeasible then."""
    problem = LmiProblem((parameter(),))
    t = problem.scalar("t")
    problem.minimise("t")
    problem.require("above", t - problem.constant(np.array([[expression]])))
    if low:
        problem.require("below", problem.constant(np.array([[expression - low]])) - t)
    return solve(problem, settings)


def test_an_optimum_comes_with_bounds_from_both_sides() -> None:
    result = least(3.0)
    assert result.verdict is Verdict.CERTIFIED
    assert result.objective is not None
    assert result.lower_bound is not None
    assert result.lower_bound <= 3.0 < result.objective
    assert within(result.objective, 3.0)
    assert 3.0 - result.lower_bound < 1e-4
    assert result.values["t"].at(np.zeros((1, 2)))[0, 0, 0, 0] == result.objective
    assert result.message.startswith('certified: tightest "above" at p = ')


def test_infeasible_points_refute_and_an_infeasible_restriction_does_not() -> None:
    refuted = least(3.0, LmiSettings(relaxation="grid", points=3), low=1.0)
    assert refuted.verdict is Verdict.REFUTED
    assert "the grid relaxation has no solution" in refuted.message
    assert refuted.margins == ()
    open_ = least(3.0, LmiSettings(relaxation="vertex"), low=1.0)
    assert open_.verdict is Verdict.INCONCLUSIVE
    assert "the vertex relaxation has no solution" in open_.message
    assert "raise the degree or try the grid relaxation" in open_.message


def test_infeasibility_by_the_safety_margin_alone_refutes_nothing() -> None:
    """0 < t < 1e-9 has solutions; none of them leaves the margin of 1e-8 that the solver is asked for."""
    problem = LmiProblem((parameter(),))
    t = problem.scalar("t")
    problem.require("above", t)
    problem.require("below", problem.constant(np.array([[1e-9]])) - t)
    for kind in ("grid", "vertex", "exact"):
        result = solve(problem, LmiSettings(relaxation=kind, points=3))
        assert result.verdict is not Verdict.REFUTED


def test_nothing_is_certified_that_was_not_verified() -> None:
    result = least(3.0, LmiSettings(verify=False))
    assert result.verdict is Verdict.INCONCLUSIVE
    assert "nothing was verified" in result.message


def test_an_interrupted_solver_certifies_nothing() -> None:
    A, B = np.array([[[-1.0, 5.0], [0.0, -1.0]]]), np.array([[[0.0], [1.0]]])
    problem = gain_problem((parameter(),), A, B, np.array([[[1.0, 0.0]]]), 2)
    result = solve(problem, LmiSettings(max_iterations=2))
    assert result.report.status == "MaxIterations"
    assert result.verdict is Verdict.INCONCLUSIVE
    assert result.report.iterations == 2


def test_margins_are_relative_and_name_the_inequality_the_place_and_the_rate() -> None:
    """P = 1 + p/2, x' = -x: -dV/dt = 2 P - rate/2; with rates up to 3 it is smallest, -0.5, at p = -1, rate = 3."""
    problem = LmiProblem((parameter(rate=3.0),))
    P = problem.symmetric("P", 1, 1)
    problem.require("P > 0", P)
    problem.require("dV/dt < 0", P * 2.0 - problem.time_derivative(P))
    first, second = margins_of(problem, np.array([1.0, 0.5]), 16)
    assert (first.name, second.name) == ("P > 0", "dV/dt < 0")
    assert first.proved
    assert first.value == pytest.approx(0.5 / 1.5)
    assert not second.proved
    assert second.value == pytest.approx((2 * 0.5 - 1.5) / (2 * 1.5 + 1.5))
    assert second.place == "p = -1 1, rate = 3 (1)/s"


@pytest.mark.parametrize(("slope", "good"), [(0.3, True), (0.6, False)])
def test_a_certificate_given_by_hand_is_judged_not_believed(slope: float, good: bool) -> None:
    """x' = -x, P = 1 + slope p, rates +-2: 2 (1 - |slope|) > 2 |slope| decides, so slope < 1/2 is true and 0.6 false."""
    problem = LmiProblem((parameter(rate=2.0),))
    P = problem.symmetric("P", 1, 1)
    problem.require("P > 0", P)
    problem.require("dV/dt < 0", P * 2.0 - problem.time_derivative(P))
    margins = margins_of(problem, np.array([1.0, slope]), 16)
    assert all(margin.proved for margin in margins) is good
    assert min(margin.value for margin in margins) > 0.0 if good else margins[1].value < 0.0


@pytest.mark.parametrize("kind", ["grid", "vertex", "exact"])
def test_an_unstable_system_is_never_certified(kind: Relaxation) -> None:
    """Stable at both ends of the range and in between, but not at p = 0.9..1 (eigenvalue -0.9 + p)."""
    A = np.array([[[-0.9, 0.0], [0.0, -2.0]], [[1.0, 0.0], [0.0, 0.1]]])
    for degree in (0, 1):
        result = solve(lyapunov_problem((parameter(rate=0.1),), A, degree), LmiSettings(relaxation=kind, points=9))
        assert result.verdict is Verdict.INCONCLUSIVE
        assert result.objective == pytest.approx(0.0, abs=1e-6)
        assert "not certified" in result.message


def test_a_slightly_better_system_is_certified() -> None:
    A = np.array([[[-1.1, 0.0], [0.0, -2.0]], [[1.0, 0.0], [0.0, 0.1]]])
    for kind in ("grid", "vertex", "exact"):
        result = solve(lyapunov_problem((parameter(rate=0.1),), A, 0), LmiSettings(relaxation=kind, points=9))
        assert result.verdict is Verdict.CERTIFIED
        assert result.objective == pytest.approx(0.2, abs=1e-6)  # 2 (1.1 - 1) with P = 1


def test_too_low_a_degree_is_inconclusive_and_the_next_one_certifies() -> None:
    """A(p) switches its fast direction: for slow parameters a P of degree 1 exists where no constant P does."""
    A = np.array([[[-0.1, 0.0], [0.0, -0.1]], [[0.0, 1.0], [1.0, 0.0]]]) - np.array(
        [[[0.0, 1.5], [-1.5, 0.0]], [[0, 0]] * 2]
    )
    slow = (parameter(low=-1.2, high=1.2, rate=0.02),)
    constant = solve(lyapunov_problem(slow, A, 0), LmiSettings(relaxation="exact"))
    assert constant.verdict is Verdict.INCONCLUSIVE
    assert "raise the degree" in constant.message
    affine = solve(lyapunov_problem(slow, A, 1), LmiSettings(relaxation="exact"))
    better = solve(lyapunov_problem(slow, A, 2), LmiSettings(relaxation="exact"))
    assert Verdict.CERTIFIED in (affine.verdict, better.verdict)
    fast = (parameter(low=-1.2, high=1.2, rate=50.0),)
    assert solve(lyapunov_problem(fast, A, 2), LmiSettings(relaxation="exact")).verdict is Verdict.INCONCLUSIVE


def test_without_balanced_states_verification_decides_and_not_the_status() -> None:
    """The trap of these models: P has a natural condition number of 1e5, and a solver says solved where nothing is proved.

    In which of these cases it does hangs on its last digits: four on one processor, eight on another.
    """
    for direction, scale, degree in product(("longitudinal", "lateral"), (1.0, 0.1), (1, 2, 3)):
        A, _ = closed_loop(direction)
        problem = condition_problem(A, np.array([scale, 1.0]), degree)
        result = solve(problem, LmiSettings(relaxation="exact"))
        if result.verdict is Verdict.CERTIFIED:
            assert confirmed(problem, result)
        elif result.report.status == "Solved" and result.tightest.value < 0.0:
            assert not confirmed(problem, result)


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
def test_a_solver_that_says_solved_and_is_wrong_is_not_believed(
    direction: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same trap on every machine: the last digits of a good answer are spoilt and its status is kept."""
    honest = solve_module.solve_with_clarabel
    A, balance = closed_loop(direction)
    problem = condition_problem(A, balance, 1)
    good = solve(problem, LmiSettings(relaxation="exact"))
    assert good.verdict is Verdict.CERTIFIED and confirmed(problem, good)

    def spoilt(*arguments: Any) -> RawAnswer:
        answer = honest(*arguments)
        return replace(answer, status="Solved", decisions=answer.decisions * (1.0 - 1e-4))

    monkeypatch.setattr(solve_module, "solve_with_clarabel", spoilt)
    result = solve(problem, LmiSettings(relaxation="exact"))
    assert result.report.status == "Solved"
    assert result.verdict is Verdict.INCONCLUSIVE and not confirmed(problem, result)
    assert result.message.startswith('not certified: tightest "P > 1" at wheel_speed = ')


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
@pytest.mark.parametrize("kind", ["grid", "exact"])
def test_balanced_states_avoid_the_trap(direction: str, kind: Relaxation) -> None:
    """The same problem in balanced states: P = 1 does longitudinally, and almost laterally."""
    A, balance = closed_loop(direction)
    for degree in (0, 1, 2):
        result = solve(condition_problem(A, balance, degree), LmiSettings(relaxation=kind, points=20))
        assert result.verdict is Verdict.CERTIFIED
        assert within(result.objective, 1.0)


def test_vertices_alone_are_solved_and_violated_in_between() -> None:
    """Two grid points and no multi-convexity: solved, and wrong by far in the middle of the range."""
    A, _ = closed_loop("longitudinal")
    result = solve(condition_problem(A, np.ones(2), 2), LmiSettings(relaxation="grid", points=2))
    assert result.report.status in ("Solved", "AlmostSolved")
    assert result.verdict is Verdict.INCONCLUSIVE
    assert result.tightest.name == "dV/dt < 0"
    assert result.tightest.value < -0.1
    assert "rate = " in result.tightest.place


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"relaxation": "grids"}, "unknown relaxation 'grids'; did you mean grid?"),
        ({"points": 1}, "setting points = 1 must be at least 2"),
        ({"margin": 0.0}, "setting margin = 0.0 must lie between 0 and 1"),
        ({"margin": float("nan")}, "setting margin = nan"),
        ({"tolerance": 2.0}, "setting tolerance = 2.0"),
        ({"max_iterations": 0}, "setting max_iterations = 0"),
        ({"proof_depth": 0}, "setting proof_depth = 0"),
    ],
)
def test_settings_are_checked(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ProblemError) as error:
        LmiSettings(**changes)  # type: ignore[arg-type]
    assert message in str(error.value)


def test_unknown_solvers_are_refused_with_the_known_ones() -> None:
    with pytest.raises(ProblemError, match="unknown cvxpy solver 'CLARABELL'; did you mean CLARABEL"):
        solve(lyapunov_problem((parameter(),), STABLE, 0), LmiSettings(solver="cvxpy:CLARABELL"))


def test_a_maximised_margin_decides_by_its_sign() -> None:
    """x' = a x, P < 1: the margin is min(P, -2 a P), so its best value is min(1, -2 a) while a < 0, and 0 at P = 0 else."""
    for a, margin in ((-0.25, 0.5), (-3.0, 1.0), (0.25, 0.0)):
        result = solve(lyapunov_problem((parameter(),), a * ONE, 0))
        assert result.objective == pytest.approx(margin, abs=1e-6)
        assert (result.verdict is Verdict.CERTIFIED) is (a < 0.0)


def test_linear_algebra_has_one_thread_meanwhile_and_as_many_as_before_afterwards(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    seen: list[dict[str, int]] = []
    verified = solve_module._verified

    def counted(*args: Any) -> Any:
        seen.append(blas_threads())
        return verified(*args)

    monkeypatch.setattr(solve_module, "_verified", counted)
    with threadpool_limits(2, "blas"):
        before = blas_threads()
        if 2 not in before.values():
            pytest.skip("a BLAS whose threads cannot be set")
        solve(lyapunov_problem((parameter(),), STABLE), LmiSettings())
        after = blas_threads()
    assert seen and all(at[file] == 1 for at in seen for file in before)
    assert {file: after[file] for file in before} == before
