"""Soundness: questions whose answer is no, or unknown, and must not come out as a certificate."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_poly

from synthesis.design.stability import affine_quadratic_stability
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.matrix import MatrixPolynomial
from synthesis.polynomials.positivity import prove_positive
from synthesis.polynomials.rational import is_positive_definite
from synthesis.published_certificate import check_certificate
from tests.published.test_lpv_benchmarks import DIGITS, PARAMETERS, REFERENCE, rolmip
from tests.support.lmi_cases import (
    closed_loop,
    condition_problem,
    corner,
    gain_problem,
    parameter,
    reference_problem,
    small_model,
    within,
)

p = sp.Symbol("p")


def test_nan_is_refused() -> None:
    problem = LmiProblem((parameter(),))
    x = problem.scalar("x")
    with pytest.raises(ProblemError, match="not finite"):
        problem.require("a", x + problem.constant(np.array([[np.nan]])))
    with pytest.raises(ProblemError, match="not finite"):
        prove_positive(MatrixPolynomial(np.full((2, 1, 1, 1), np.nan)))


def test_judge_touching_zero() -> None:
    model = small_model([[-1]], [[p]], (SchedulingParameter("p", "1", 0.0, 1.0, 0.0, 0.0),))
    found = check_certificate(model, [[0.0]], [[["1"]], [["-6"]], [["9"]]])  # M = (3p - 1)^2 is singular at 1/3
    assert not found.everywhere
    assert len(found.intervals) == 2


def exact_minimum(coefficients: np.ndarray) -> float:
    """Smallest value on [-1, 1] at the ends and at the certified critical points, evaluated in rationals."""
    P = fmpq_poly([fmpq(*float(x).as_integer_ratio()) for x in coefficients])
    roots = [root.real.mid() for root, _ in P.derivative().complex_roots() if root.imag == 0]
    points = [fmpq(*float(x).as_integer_ratio()) for x in roots if abs(float(x)) <= 1]
    return float(min(P(x) for x in [fmpq(-1), fmpq(1), *points]))


def test_rounding_guard_of_prove_positive() -> None:
    rng, false = np.random.default_rng(0), []
    for _ in range(300):
        c = np.polynomial.chebyshev.cheb2poly(rng.standard_normal(9))
        c[0] -= exact_minimum(c)
        for delta in (1e-16, 1e-15, 1e-14):
            d = c.copy()
            d[0] -= delta * np.abs(c).max()
            if exact_minimum(d) <= 0 and prove_positive(MatrixPolynomial(d[:, None, None, None])).proved:
                false.append(delta)
    assert not false, len(false)


@pytest.mark.parametrize(
    ("direction", "scale", "degree"),
    [
        ("longitudinal", 0.1, 0),
        ("longitudinal", 0.01, 0),
        ("longitudinal", 0.01, 1),
        ("lateral", 0.01, 0),
        ("lateral", 0.01, 1),
        ("lateral", 0.01, 2),
    ],
)
def test_false_refutation_of_a_feasible_problem(direction: str, scale: float, degree: int) -> None:
    """1 < P < t, dV/dt < 0 has solutions (t about 3e6 .. 3e8): the balanced P, rescaled."""
    A, _ = closed_loop(direction)
    assert (
        solve(condition_problem(A, np.array([scale, 1.0]), degree), LmiSettings(relaxation="exact")).verdict
        is not Verdict.REFUTED
    )


@pytest.mark.parametrize("M", [[[1.0, 100.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, 1.0]]])
def test_nonsymmetric_require(M: list[list[float]]) -> None:
    problem = LmiProblem((parameter(),))
    x = problem.scalar("x")
    known = problem.constant(np.array(M)) + problem.constant(np.zeros((2, 2))).scaled_by(x)
    if np.allclose(M, np.transpose(M)):
        problem.require("a", known)
        return
    with pytest.raises(ProblemError, match="not symmetric"):
        problem.require("a", known)


def test_gamma_lower_of_vertex_is_no_lower_bound() -> None:
    v = solve(gain_problem(PARAMETERS, *rolmip(), (1, 1, 1)), LmiSettings(relaxation="vertex"))
    # degree (1,1,1) certifies 1.053982 by Bernstein coefficients (test_rolmip_table)
    assert v.lower_bound is None or v.lower_bound <= 1.053982


def test_reference_grid_degree_3_given_30() -> None:
    r = solve(
        reference_problem(corner("corner-estimation", "longitudinal", 140.0)[0], 3, 30.0),
        LmiSettings(relaxation="grid"),
    )
    assert r.verdict is Verdict.CERTIFIED
    assert within(np.sqrt(r.objective), REFERENCE, DIGITS)


def test_place_names_a_rate_only_where_there_is_one() -> None:
    r = affine_quadratic_stability(
        small_model([[0, 1], [-4 - p, -1]], [[1, 0]]),
        np.array([[3.0], [1.0]]),
        0,
        settings=LmiSettings(relaxation="exact"),
    )
    assert all("rate" not in margin.place for margin in r.margins), [x.place for x in r.margins]


def test_no_rate_axis_for_constant_parameters() -> None:
    q = LmiProblem((parameter(rate=0.0),))
    P = q.symmetric("P", 2, 1)
    assert q.time_derivative(P).degrees[1] == 0


def test_exact_definiteness_of_non_symmetric_matrices() -> None:
    assert not is_positive_definite([[fmpq(1), fmpq(9)], [fmpq(0), fmpq(1)]])
