"""From a box to finitely many inequalities: what is sampled, what is refused, and what each relaxation is worth."""

from __future__ import annotations

import numpy as np
import pytest

from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.relaxation import cheaper, relax
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.polynomials.matrix import MatrixPolynomial, variable
from tests.support.lmi_cases import lyapunov_problem, parameter, within

GRID, VERTEX, EXACT = (LmiSettings(relaxation=kind) for kind in ("grid", "vertex", "exact"))


def highest(coefficients: list[float], settings: LmiSettings) -> LmiResult:
    """Least t with t - p(u) > 0 on [-1, 1]: the maximum of the polynomial, if the relaxation loses nothing."""
    problem = LmiProblem((parameter(),))
    t = problem.scalar("t")
    problem.minimise("t")
    p = MatrixPolynomial(np.array(coefficients)[:, None, None, None, None])
    problem.require("above", t - p)
    return solve(problem, settings)


@pytest.mark.parametrize(
    ("coefficients", "maximum"),
    [
        ([1.0, 2.0], 3.0),  # degree 1, at the end
        ([0.0, 1.0, -1.0], 0.25),  # u - u^2 at 1/2
        ([0.0, -3.0, 0.0, 4.0], 1.0),  # the Chebyshev polynomial T3: twice
        ([0.0, 0.0, 1.0, 0.0, -1.0], 0.25),  # u^2 - u^4 at +-1/sqrt(2)
        ([0.0, 5.0, 0.0, -20.0, 0.0, 16.0], 1.0),  # T5
        ([-1.0, 0.0, 18.0, 0.0, -48.0, 0.0, 32.0], 1.0),  # T6
        ([7.0], 7.0),
    ],
)
def test_sums_of_squares_find_the_maximum_of_any_polynomial_of_one_variable(
    coefficients: list[float], maximum: float
) -> None:
    result = highest(coefficients, EXACT)
    assert result.verdict is Verdict.CERTIFIED
    assert within(result.objective, maximum)
    assert result.lower_bound is not None
    assert maximum - 1e-4 <= result.lower_bound <= maximum + 1e-9


def test_a_grid_sees_only_its_points_and_is_told_so() -> None:
    """u - u^2 on 3 points {-1, 0, 1}: the grid believes 0, the maximum is 1/4; re-evaluation refuses the answer."""
    coefficients = [0.0, 1.0, -1.0]
    assert highest(coefficients, LmiSettings(relaxation="grid", points=3)).objective == pytest.approx(0.0, abs=1e-6)
    problem = LmiProblem((parameter(),))
    t = problem.scalar("t")
    problem.minimise("t")
    problem.require("above", t - MatrixPolynomial(np.array(coefficients)[:, None, None, None, None]))
    result = solve(problem, LmiSettings(relaxation="grid", points=3))
    assert result.verdict is Verdict.INCONCLUSIVE
    assert result.tightest.value < -0.1
    assert "p = 0.5 1" in result.message


def test_vertices_with_multi_convexity_bound_from_above() -> None:
    """u - u^2: t - p is convex in u, so multi-convexity forbids any t; u + u^2 has its maximum at a vertex: exact."""
    assert within(highest([0.0, 1.0, 1.0], VERTEX).objective, 2.0)
    problem = LmiProblem((parameter(),))
    t = problem.scalar("t")
    problem.minimise("t")
    problem.require("above", t - MatrixPolynomial(np.array([0.0, 1.0, -1.0])[:, None, None, None, None]))
    result = solve(problem, VERTEX)
    assert result.verdict is Verdict.INCONCLUSIVE  # sufficient only: its infeasibility refutes nothing
    assert "the vertex relaxation has no solution" in result.message


def test_sampled_places_are_all_points_times_all_rate_vertices() -> None:
    problem = LmiProblem((parameter("p"), parameter("q")))
    u, w, r, _ = (variable(i, 4) for i in range(4))
    problem.require("with a rate", u.scaled_by(w) + r)
    problem.require("without", u)
    relaxed = relax(problem, LmiSettings(relaxation="grid", points=5))
    first, second = relaxed.sampled
    assert first.places.shape == (2 * 25, 4)
    assert {tuple(place) for place in first.places[:, 2:]} == {(-1.0, 0.0), (1.0, 0.0)}
    assert {tuple(place) for place in first.places[:, :2]} == {
        (a, b) for a in np.linspace(-1, 1, 5) for b in np.linspace(-1, 1, 5)
    }
    assert second.places.shape == (5, 4)  # only the parameter that it depends on
    np.testing.assert_allclose(
        first.values[..., 0][:, 0, 0], first.places[:, 0] * first.places[:, 1] + first.places[:, 2]
    )
    assert relax(problem, VERTEX).sampled[0].places.shape == (8, 4)


def test_boxes_get_their_share_of_the_points() -> None:
    problem = LmiProblem((parameter(low=0.0, high=10.0),))
    u = variable(0, 2)
    problem.require("all", u)
    for name, middle, half in (("half", -0.5, 0.5), ("sliver", -0.999, 0.001)):
        box = np.array([middle, 0.0]), np.array([half, 1.0])
        problem.require_on(name, u.affine(*box), *box)
    counts = [len(entry.places) for entry in relax(problem, LmiSettings(relaxation="grid", points=100)).sampled]
    assert counts == [100, 50, 3]


def test_multi_convexity_is_one_inequality_for_each_quadratic_parameter() -> None:
    problem = LmiProblem((parameter("p"), parameter("q")))
    u, w = variable(0, 4), variable(1, 4)
    problem.require("m", u.scaled_by(w).scaled_by(w) * -3.0)
    relaxed = relax(problem, VERTEX)
    assert [entry.name for entry in relaxed.sampled] == ["m", "m: multi-convexity in q"]
    second = relaxed.sampled[1]
    assert second.margin == 0.0
    np.testing.assert_allclose(second.values[:, 0, 0, 0], 6.0 * second.places[:, 0])  # -d2/dw2 of -3 u w^2


@pytest.mark.parametrize(
    ("build", "settings", "message"),
    [
        (
            lambda u, w, r: u.scaled_by(u).scaled_by(u),
            VERTEX,
            "has degree 3 in p; the vertex relaxation takes at most 2",
        ),
        (lambda u, w, r: r.scaled_by(r), VERTEX, "has degree 2 in rate 0; inequalities must be affine in the rates"),
        (lambda u, w, r: u + w, EXACT, "the exact relaxation is for one parameter, this problem has 2"),
    ],
)
def test_relaxations_refuse_what_they_cannot_take(build: object, settings: LmiSettings, message: str) -> None:
    problem = LmiProblem((parameter("p"), parameter("q")))
    problem.require("m", build(variable(0, 4), variable(1, 4), variable(2, 4)))  # type: ignore[operator]
    with pytest.raises(ProblemError) as error:
        relax(problem, settings)
    assert message in str(error.value)


def test_auto_takes_the_cheaper_sound_one_and_says_which() -> None:
    def problem(degree: int) -> LmiProblem:
        A = np.array([[[-1.0, 0.0], [0.0, -2.0]], [[0.0, 0.5], [-0.5, 0.0]]])
        return lyapunov_problem((parameter(),), A, degree)

    assert cheaper(problem(1), LmiSettings(points=140)) == "exact"
    assert cheaper(problem(1), LmiSettings(points=2)) == "grid"
    assert cheaper(problem(8), LmiSettings(points=140)) == "grid"
    assert solve(problem(1)).report.relaxation == "exact"
    two = lyapunov_problem((parameter("p"), parameter("q")), -np.eye(2)[None, None], 1)
    assert solve(two, LmiSettings(points=3)).report.relaxation == "exchange"


def test_three_relaxations_agree_where_none_of_them_loses() -> None:
    """A(p) = [[-1, p], [-p, -1]]: A + A' = -2 I, so P = 1 - 0 is optimal and the margin is min(P, 2 P) = 1."""
    A = np.array([[[-1.0, 0.0], [0.0, -1.0]], [[0.0, 1.0], [-1.0, 0.0]]])
    for settings in (GRID, VERTEX, EXACT):
        for degree in (0, 1):
            result = solve(lyapunov_problem((parameter(),), A, degree), settings)
            assert result.verdict is Verdict.CERTIFIED
            assert result.objective == pytest.approx(1.0, abs=1e-6)
