"""Two back ends, one answer: our conic data and cvxpy, floating-point verdicts and exact rational proofs."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.arrays import FloatArray
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings, Relaxation
from synthesis.lmi.solve import solve
from tests.support.lmi_cases import SLACK, confirmed, gain_problem, held, lyapunov_problem, parameter, within

SMALL = settings(deadline=None, max_examples=12)
SEEDS = st.integers(0, 2**32 - 1)
KINDS: tuple[Relaxation, ...] = ("grid", "exact")


def random_plant(seed: int, shift: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A(p) = A0 + p A1 with the largest frozen real part over the range at -shift; B and C constant."""
    rng = np.random.default_rng(seed)
    A = np.stack([rng.standard_normal((3, 3)), 0.3 * rng.standard_normal((3, 3))])
    frozen = A[0] + np.linspace(-1.0, 1.0, 41)[:, None, None] * A[1]
    A[0] -= (np.linalg.eigvals(frozen).real.max() + shift) * np.eye(3)
    return A, rng.standard_normal((1, 3, 2)), rng.standard_normal((1, 1, 3))


def frozen_gain(A: FloatArray, B: FloatArray, C: FloatArray) -> float:
    """Largest gain over constant parameters and frequencies: a bound from below for every L2 gain."""
    points = np.linspace(-1.0, 1.0, 41)[:, None, None, None]
    frequencies = np.concatenate([[0.0], np.geomspace(1e-2, 1e2, 200)])[:, None, None]
    resolvent = 1j * frequencies * np.eye(3) - (A[0] + points * A[1])
    return float(
        np.linalg.norm(C[0] @ np.linalg.solve(resolvent, B[0] + 0j * resolvent[..., :2]), 2, axis=(-2, -1)).max()
    )


@settings(SMALL, max_examples=8)  # nine solves each
@given(SEEDS, st.sampled_from([0.0, 0.3]))
def test_certified_gains_lie_above_frozen_ones_and_fall_with_the_degree(seed: int, rate: float) -> None:
    """What a solver calls the optimum is near it; a bound proved 1 % above it is one, and dual bounds lie below it."""
    A, B, C = random_plant(seed, 0.5)
    floor = frozen_gain(A, B, C)
    previous = np.inf
    for degree in (0, 1, 2):

        def problem(degree: int = degree) -> LmiProblem:
            return gain_problem((parameter(rate=rate),), A, B, C, degree)

        results = {kind: solve(problem(), LmiSettings(relaxation=kind, points=41)) for kind in KINDS}
        exact, grid = results["exact"], results["grid"]
        if exact.report.status != "Solved":
            return  # degree 0 need not have a solution: nothing to compare
        assert exact.objective is not None and exact.lower_bound is not None
        assert grid.objective is not None and grid.lower_bound is not None
        proved = solve(held(problem(), "gamma", 1.01 * exact.objective), LmiSettings(relaxation="exact"))
        assert proved.verdict is Verdict.CERTIFIED
        assert proved.objective == pytest.approx(1.01 * exact.objective, rel=1e-3)
        for certified in (result for result in (exact, proved) if result.verdict is Verdict.CERTIFIED):
            assert certified.objective is not None
            assert certified.objective >= floor
            assert certified.objective >= exact.lower_bound
            assert certified.objective >= grid.lower_bound  # fewer inequalities: a bound from below all the more
        assert exact.objective == pytest.approx(exact.lower_bound, rel=5e-3)
        assert exact.objective <= previous * (1.0 + 1e-4)  # a higher degree is never worse
        assert grid.objective == pytest.approx(exact.objective, rel=2e-3)
        previous = exact.objective


@SMALL
@given(SEEDS, st.sampled_from([-0.05, 0.02, 0.2, 1.0]), st.sampled_from(["grid", "exact", "vertex"]))
def test_certified_means_certified(seed: int, shift: float, kind: Relaxation) -> None:
    """Whatever the solver says: a CERTIFIED verdict stands in exact arithmetic, and never with an unstable frozen loop."""
    A, _, _ = random_plant(seed, shift)
    problem = lyapunov_problem((parameter(rate=0.4),), A, 1)
    result = solve(problem, LmiSettings(relaxation=kind, points=5))
    if result.verdict is Verdict.CERTIFIED:
        assert shift > 0.0
        assert confirmed(problem, result)
    if shift < 0.0:
        assert result.verdict is not Verdict.CERTIFIED


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kind", ["grid", "vertex", "exact"])
def test_cvxpy_comes_to_the_same_answer(seed: int, kind: Relaxation) -> None:
    """The same optimum, and a gain 1 % above it is proved with both back ends."""
    A, B, C = random_plant(seed, 1.5)
    answers, proofs = [], []
    for solver in ("CLARABEL", "cvxpy:CLARABEL"):
        used = LmiSettings(relaxation=kind, points=7, solver=solver)
        answers.append(solve(gain_problem((parameter(rate=0.2),), A, B, C, 1), used))
        level = 1.01 * (answers[0].objective or np.nan)
        proofs.append(solve(held(gain_problem((parameter(rate=0.2),), A, B, C, 1), "gamma", level), used).verdict)
    first, second = answers
    assert first.objective is not None
    assert first.objective == pytest.approx(second.objective, rel=2.0 * SLACK)
    assert proofs == [Verdict.CERTIFIED] * 2
    assert (first.report.solver, second.report.solver) == ("clarabel", "cvxpy:CLARABEL")
    assert second.lower_bound is None  # cvxpy hands out no common form of the dual objective


def test_cvxpy_takes_multi_convexity_as_the_same_equality() -> None:
    """A1 with a zero column, as in the corner models: the (2,2) entry of the condition is zero for every P."""
    A = np.array([[[-3.0, 1.0], [-1.0, -2.0]], [[-0.5, 0.0], [0.4, 0.0]]])
    answers = [
        solve(lyapunov_problem((parameter(rate=0.5),), A, 1), LmiSettings(relaxation="vertex", solver=solver))
        for solver in ("CLARABEL", "cvxpy:CLARABEL")
    ]
    assert [answer.verdict for answer in answers] == [Verdict.CERTIFIED] * 2
    assert answers[0].objective == pytest.approx(answers[1].objective, abs=1e-6)
    slope = answers[0].values["P"].derivative(0).at(np.zeros((1, 2)))[0, ..., 0]
    convexity = A[1].T @ slope + slope @ A[1]
    assert abs(convexity[0, 1]) < 1e-7
    assert convexity[0, 0] >= -1e-7


@SMALL
@given(SEEDS)
def test_the_answer_does_not_depend_on_the_units_of_the_parameter(seed: int) -> None:
    """p in rad/s or in rpm: the same problem, the same gain."""
    A, B, C = random_plant(seed, 1.0)
    gains = []
    for unit in (1.0, 1e-3, 9.55e3):
        scaled = np.stack([A[0], A[1] / unit])
        problem = gain_problem((parameter("p", -unit, unit, 0.3 * unit),), scaled, B, C, 1)
        gains.append(solve(problem, LmiSettings(relaxation="exact")).objective)
    assert gains[1] == pytest.approx(gains[0], rel=2.0 * SLACK)
    assert gains[2] == pytest.approx(gains[0], rel=2.0 * SLACK)


@pytest.mark.parametrize(("first", "second"), list(product([1.0, 1e-3], [1.0, 1e4])))
def test_parameters_of_very_different_size(first: float, second: float) -> None:
    """x' = -(1 + a + b) x + d with a, b in [0, 1] in odd units: the gain is that of a = b = 0, which is 1."""
    A = np.zeros((2, 2, 1, 1))
    A[0, 0], A[1, 0], A[0, 1] = -1.0, -1.0 / first, -1.0 / second
    ones = np.ones((1, 1, 1, 1))
    parameters = (parameter("a", 0.0, first, first), parameter("b", 0.0, second, np.inf))
    result = solve(gain_problem(parameters, A, ones, ones, (1, 0)), LmiSettings(relaxation="vertex"))
    assert result.verdict is Verdict.CERTIFIED
    assert within(result.objective, 1.0)
