"""`affine_quadratic_stability` on random and offset ranges next to the boundary: nothing false certified, nothing false refuted.

Every answer is checked in rational numbers by the theorems of Sturm and Routh (`tests.support.exact_stability`), without code of
the prover. 10,000 cases by hand: `python -m tests.support.stability_cases 10000`.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat, fmpq_poly
from scipy.linalg import solve_continuous_lyapunov

from synthesis.certificate.claims import Claim
from synthesis.certificate.verify import Names, Verifier
from synthesis.design.stability import affine_quadratic_stability
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.enclosure import PolynomialMatrix
from tests.support import exact_stability as oracle
from tests.support.lmi_cases import parameter, small_model
from tests.support.stability_cases import FAMILIES, Case, asked, case_of, complaint, survey

CASES, PARTS = 120, 3
p = sp.Symbol("p")


@pytest.mark.parametrize("part", range(PARTS))
def test_no_verdict_is_false(part: int) -> None:
    each = CASES // PARTS
    counts, complaints = survey(range(part * each, (part + 1) * each))
    assert complaints == []
    verdicts: Counter[str] = Counter()
    for (_, verdict), number in counts.items():
        verdicts[verdict] += number
    assert counts.pop(("all", "lost")) <= 2
    assert {family for family, _ in counts} == set(FAMILIES)
    assert min(verdicts["certified"], verdicts["refuted"]) >= each // 5  # it does decide
    assert counts["multiple pole", "refuted"] == 0


# ---- the cases that were wrong -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize(("low", "high"), [(634.65, 635.65), (-0.5, 0.5), (999999.5, 1000000.5)])
@pytest.mark.parametrize(
    ("a", "verdict"),
    [("1/2", Verdict.REFUTED), ("0.9999", Verdict.REFUTED), ("1", Verdict.REFUTED), ("1.0001", Verdict.CERTIFIED)],
)
def test_a_range_far_from_zero_is_a_range_like_any_other(
    a: str, verdict: Verdict, low: float, high: float, degree: int
) -> None:
    """A = u^5 - a with u = 2 (p - middle): A = 1 - a at the upper end. In powers of p the terms are 1e14 and more."""
    u = 2 * (p - sp.Rational(str((low + high) / 2)))
    for entry in (u**5 - sp.Rational(a), sp.expand(u**5 - sp.Rational(a))):
        model = small_model([[entry]], [[1]], (parameter("p", low, high),))
        assert affine_quadratic_stability(model, np.zeros((1, 1)), degree).verdict is verdict


def test_the_same_written_with_floats() -> None:
    model = small_model([[(2.0 * (p - 635.15)) ** 5 - 0.5]], [[1]], (parameter("p", 634.65, 635.65),))
    result = affine_quadratic_stability(model, np.zeros((1, 1)))
    assert result.verdict is Verdict.REFUTED
    assert "pole at +0.5 1/s" in result.message


TURNS = {  # of determinant one
    2: sp.Matrix([[3, 5], [1, 2]]),
    3: sp.Matrix([[1, 2, 3], [0, 1, 4], [5, 6, 0]]),
    4: sp.Matrix([[1, 2, 0, 1], [0, 1, 3, 0], [1, 2, 1, 1], [2, 5, 3, 3]]),
}


@pytest.mark.parametrize("pole", ["1e-3", "1e-5", "1e-8"])
@pytest.mark.parametrize("size", [2, 3, 4])
@pytest.mark.parametrize("turn", [False, True])
def test_a_multiple_pole_that_is_stable_is_never_refuted(size: int, turn: bool, pole: str) -> None:
    """One Jordan block at -1e-3 or closer: floating point splits it into a ring that reaches across the axis. It is stable."""
    alpha = sp.Rational(pole)
    A = sp.Matrix(size, size, lambda i, j: -alpha if i == j else int(j == i + 1))
    if turn:
        A = TURNS[size] * A * TURNS[size].inv()
    parts = [[model, np.zeros((size, 1)), 0] for model in (constant(A), constant(A + 2 * alpha * sp.eye(size)))]
    for form in ("primal", "dual"):
        assert affine_quadratic_stability(*parts[0], form).verdict is not Verdict.REFUTED  # type: ignore[arg-type]
        assert affine_quadratic_stability(*parts[1], form).verdict is Verdict.REFUTED  # type: ignore[arg-type]


def constant(A: sp.Matrix) -> LpvModel:
    """A model whose parameter is seen in an output alone, which no gain uses."""
    n = A.shape[0]
    return small_model(A, sp.Matrix(1, n, lambda _, j: p if j == 0 else 0))


@pytest.mark.parametrize("middle", ["0.37", "-0.81"])
def test_what_is_unstable_between_the_points_of_a_grid_is_found(middle: str) -> None:
    """-1 - 1e-3 + 1.002 / (1 + 1e4 (p - p0)^2): unstable on a width of 6e-4 that no grid of nine points sees."""
    spike = sp.Rational("1.002") / (1 + 10**4 * (p - sp.Rational(middle)) ** 2)
    model = small_model([[spike - sp.Rational("1.001")]], [[1]])
    assert affine_quadratic_stability(model, np.zeros((1, 1)), 0).verdict is Verdict.REFUTED


@pytest.mark.parametrize("seed", [91, 136, 235, 397, 604, 1009])
def test_an_unstable_spike_is_found_where_no_failed_proof_points_at_it(seed: int) -> None:
    """Beside a stable state the proof fails elsewhere; the unstable place is climbed to from the worst points of the grid."""
    case = case_of(seed)
    assert case.family == "interior spike"
    assert not case.stable
    assert asked(case).verdict is Verdict.REFUTED


@pytest.mark.parametrize("family", ["2 states", "3 states", "rate-bounded", "rational", "one end", "scalar power"])
@pytest.mark.parametrize("dual", [False, True])
def test_a_random_lyapunov_matrix_is_decided_as_sturm_decides_it(family: str, dual: bool) -> None:
    """P affine in p, its best decay rate (of either sign) bisected by the oracle: no proof beyond it, one before it."""
    decided = 0
    for seed in range(7 if family != "rational" else 5):
        draw = np.random.default_rng(seed)
        case = FAMILIES[family](draw)
        P = random_lyapunov(case, draw, dual)
        speeds = [Fraction(repr(rate)) / case.half for rate in case.rates if np.isfinite(rate)]
        if not speeds:
            continue
        low, high = Fraction(-4000), Fraction(1000)
        if not oracle.lyapunov_on_range(case.closed, P, case.below, speeds, low, dual):
            continue
        while high - low > Fraction(1, 10**4) * max(abs(low + high), Fraction(1, 100)):
            middle = (low + high) / 2
            good = oracle.lyapunov_on_range(case.closed, P, case.below, speeds, middle, dual)
            low, high = (middle, high) if good else (low, middle)
        gain = fmpq_mat([[fmpq(*float(g).as_integer_ratio())] for g in case.gain or [0.0] * case.states])
        loop = ObserverLoop.constant_gain(plant_of(case.model), gain)
        verifier = Verifier(loop, Names(tuple(f"x{i + 1}" for i in range(case.states)), ()))
        exact = PolynomialMatrix(
            {(k,): fmpq_mat([[oracle.rational(x) for x in row] for row in m]) for k, m in enumerate(P)},
            (case.states,) * 2,
            1,
        )
        beyond, before = (float(f"{float(level):.12g}") for level in (high + (high - low) / 9, low - (high - low) / 9))
        assert not verifier.prove(Claim("decay rate", beyond, exact), dual).proved
        assert verifier.prove(Claim("decay rate", before, exact), dual).proved
        decided += 1
    assert decided >= 3, decided


def random_lyapunov(case: Case, draw: np.random.Generator, dual: bool) -> list[list[list[Fraction]]]:
    """P0 + v P1 in decimals, from Lyapunov equations in the middle and at the ends with a random right-hand side."""
    n, values = case.states, []
    root = draw.normal(size=(n, n))
    for v in (Fraction(-1), Fraction(0), Fraction(1)):
        below = sum(float(c) * float(v) ** k for k, c in enumerate(case.below))
        A = np.array(oracle.at(case.closed, v), float) / below
        A = A - (max(np.linalg.eigvals(A).real.max(), 0.0) + 0.3) * np.eye(n)
        values.append(solve_continuous_lyapunov(A if dual else A.T, -(root @ root.T + 0.1 * np.eye(n))))
    size = np.abs(values[1]).max()
    parts = values[1] / size, 0.2 * (values[2] - values[0]) / size
    return [[[Fraction(f"{m[min(i, j), max(i, j)]:.9f}") for j in range(n)] for i in range(n)] for m in parts]


def test_a_negative_lyapunov_matrix_proves_nothing() -> None:
    """P = -1 has -(2 P A) > 0 for A = +1: without P > 0 every unstable plant would be stable."""
    loop = ObserverLoop.constant_gain(plant_of(small_model([[1]], [[p]])), fmpq_mat([[0]]))
    claim = Claim("decay rate", 0.1, PolynomialMatrix({(0,): fmpq_mat([[-1]])}, (1, 1), 1))
    assert not Verifier(loop, Names(("x1",), ())).prove(claim).proved


def test_a_model_without_parameters_is_a_model() -> None:
    for shift, verdict in ((Fraction(-1, 10**6), Verdict.CERTIFIED), (Fraction(1, 10**6), Verdict.REFUTED)):
        case = Case("no parameter", [[[shift, Fraction(1)], [Fraction(0), Fraction(-1)]]])
        assert not case.has_parameter
        assert asked(case).verdict is verdict


# ---- the judge ------------------------------------------------------------------------------------------------------------


def test_the_judge_knows_what_numpy_knows() -> None:
    """Sturm and Routh against eigenvalues on a grid, where these are clear."""
    draw, clear = np.random.default_rng(0), Counter()  # type: Counter[bool]
    for _ in range(200):
        n, degree = int(draw.integers(1, 5)), int(draw.integers(0, 4))
        series = [
            [[Fraction(int(x), 10) for x in row] for row in draw.integers(-9, 10, (n, n))] for _ in range(degree + 1)
        ]
        series = oracle.shifted(series, Fraction(-int(draw.integers(0, 3))))
        v = np.linspace(-1.0, 1.0, 501)
        worst = np.linalg.eigvals(
            sum(np.array(m, float) * v[:, None, None] ** k for k, m in enumerate(series))
        ).real.max()
        if abs(worst) > 1e-2:
            assert oracle.stable_on_range(series) == (worst < 0.0)
            clear[bool(worst < 0.0)] += 1
    assert min(clear.values()) > 40


@pytest.mark.parametrize(
    ("coefficients", "free"),
    [
        ([0, 1], False), ([1, 0, 1], True), ([fmpq(1, 4), -1, 1], False), ([-4, 0, 1], True), ([1, 1], False),
        ([-1, 1], False), ([fmpq(10001, 10000), 1], True), ([3], True), ([0], False), ([1, -2, 1], False),
    ],
)  # fmt: skip
def test_roots_in_the_range_are_counted_exactly(coefficients: list[fmpq], free: bool) -> None:
    assert oracle.no_root(fmpq_poly(coefficients)) is free


def test_false_answers_are_seen() -> None:
    """Verdicts turned round, and Lyapunov matrices spoiled: each is a complaint."""
    seen: Counter[str] = Counter()
    for seed in range(45):
        case = case_of(seed)
        result = asked(case)
        if result.verdict is Verdict.REFUTED:
            assert "a frozen pole" in str(complaint(case, replace(result, verdict=Verdict.CERTIFIED)))
            seen["turned"] += 1
        if result.verdict is Verdict.CERTIFIED:
            assert "every frozen pole" in str(complaint(case, replace(result, verdict=Verdict.REFUTED)))
            P = result.result.values["P"]
            spoiled = replace(result.result, values={"P": type(P)(-P.coefficients)})
            assert "does not prove it" in str(complaint(case, replace(result, result=spoiled)))
            seen["spoiled"] += 1
    assert min(seen.values()) > 10


def test_the_lyapunov_matrix_in_physical_parameters_proves_it_too() -> None:
    """Where the range is not far from zero its coefficients lose nothing."""
    case = Case("2 states", [[[Fraction(-1), Fraction(2)], [Fraction(-1), Fraction(-1)]],
                             [[Fraction(0), Fraction(1, 2)], [Fraction(1, 2), Fraction(0)]]], half=Fraction(2))  # fmt: skip
    result = affine_quadratic_stability(case.model, np.zeros((2, 1)), 1, settings=LmiSettings(points=21))
    assert result.verdict is Verdict.CERTIFIED
    P = [[[Fraction(float(x)) * case.half**k for x in row] for row in m] for k, m in enumerate(result.lyapunov)]
    for m in P:
        m[1][0] = m[0][1]
    rates = [Fraction(repr(rate)) / case.half for rate in case.rates]
    assert oracle.lyapunov_on_range(case.closed, P, case.below, rates, Fraction(0), dual=False)
