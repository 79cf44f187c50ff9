"""Real parametric uncertainty: margins and worst-case gains against closed forms, dense grids and published values."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat

from analysis.errors import AnalysisError
from analysis.lpv.question import ask
from analysis.norms.hinf import hinf_norm
from analysis.uncertainty.margin import robust_stability_margin
from analysis.uncertainty.polynomials import Family
from analysis.uncertainty.worst_gain import _decide, worst_case_gain
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.box_decision import all_positive
from synthesis.polynomials.enclosure import PolynomialMatrix
from tests.support.lmi_cases import parameter, small_model

p, q, s = sp.symbols("p q s")


def companion(denominator: sp.Expr, *ranges: tuple[str, float, float]) -> LpvModel:
    """x of det(s I - A) = the polynomial in s, constant parameters in these ranges."""
    lead, *rest = sp.Poly(sp.expand(denominator), s).all_coeffs()
    n = len(rest)
    A = sp.zeros(n, n)
    A[: n - 1, 1:] = sp.eye(n - 1)
    A[n - 1, :] = sp.Matrix([[-c / lead for c in reversed(rest)]])
    C = sp.zeros(1, n)
    C[0] = 1
    return small_model(A, C, [parameter(name, low, high, 0.0) for name, low, high in ranges])


def test_de_gaston_and_safonov() -> None:
    """IEEE TAC 33 (1988) 156: 800 (1 + 0.1 d1)(s + 2)/(s (s + 4 + 0.2 d2)(s + 6 + 0.3 d3)(s + 10)) in unit feedback.

    The literature gives 3.417 (a corner); independently: the first k for which the corner d = k (1, -1, -1) is not stable.
    """
    d1, d2, d3 = sp.symbols("d1 d2 d3")
    loop = s * (s + 4 + d2 / 5) * (s + 6 + 3 * d3 / 10) * (s + 10) + 800 * (1 + d1 / 10) * (s + 2)
    found = robust_stability_margin(companion(loop, ("d1", -1, 1), ("d2", -1, 1), ("d3", -1, 1)))
    assert found.lower < 3.41740 and found.upper == pytest.approx(3.417, abs=5e-4)
    assert 1.0 < found.upper / found.lower < 1.002
    assert found.witness is not None and np.sign(list(found.witness.values())).tolist() == [1.0, -1.0, -1.0]
    assert found.verdict is Verdict.CERTIFIED
    roots = np.roots([float(c) for c in sp.Poly(loop.subs(found.witness), s).all_coeffs()])
    assert abs(roots.real.max()) < 1e-6
    low, high = found.structured_singular_value
    assert low == pytest.approx(1 / 3.417, rel=1e-3) and low < high < low * 1.002


def test_two_carts_and_a_spring() -> None:
    """Wie and Bernstein's plant with 100 ((s + 1)/(0.001 s + 1))^3 as in the Robust Control Toolbox guide: 2.8826 ..

    2.8864, k = 1.5773.
    """
    m1, m2, k = sp.symbols("m1 m2 k")
    loop = s**2 * (m1 * m2 * s**2 + k * (m1 + m2)) * (s + 1000) ** 3 + 100 * k * (s + 1) ** 3 * 1000**3
    model = companion(loop, ("m1", 0.8, 1.2), ("m2", 0.8, 1.2), ("k", 0.8, 1.2))
    found = robust_stability_margin(model)
    assert found.upper == pytest.approx(2.8864, abs=5e-5)
    assert found.lower > 2.8826
    assert found.witness is not None and found.witness["k"] == pytest.approx(1.5773, abs=5e-5)


@pytest.mark.parametrize("radius", ["0.1", "0.01"])
def test_a_small_hole_in_the_stable_set_is_found(radius: str) -> None:
    """Ackermann's polynomial: stable but for a disc about q1 = q2 = 1, which rays and corners miss; then the proof must not.

    s^3 + (a + 1) s^2 + (a + 3) s + 1 + r^2 + 6 a + 2 q1 q2 with a = q1 + q2: H_2 = (q1 - 1)^2 + (q2 - 1)^2 - r^2, so
    k* = (0.4 - r)/1.1. At r = 0.1 the Robust Control Toolbox is reported to give 0.2722 .. 1.2389.
    """
    q1, q2 = sp.symbols("q1 q2")
    a, r = q1 + q2, sp.Rational(radius)
    loop = s**3 + (a + 1) * s**2 + (a + 3) * s + 1 + r**2 + 6 * a + 2 * q1 * q2
    model = companion(loop, ("q1", 0.3, 2.5), ("q2", 0.0, 1.7))
    found, exact = robust_stability_margin(model), (0.4 - float(r)) / 1.1
    assert found.lower <= exact <= found.upper * (1 + 1e-9)
    assert found.upper / found.lower < 1.002
    assert found.verdict is Verdict.REFUTED
    polynomials = Family(ask(model)).stability()
    for scale, positive in ((0.999 * exact, True), (1.001 * exact, False), (1.0, False)):
        box = [fmpq(0)] * 2, [fmpq(*scale.as_integer_ratio())] * 2
        assert all_positive(polynomials, *box).positive is positive


@pytest.mark.parametrize(("discrete", "expected"), [(False, 1.5), (True, np.sqrt(0.4))])
def test_closed_forms(discrete: bool, expected: float) -> None:
    """Trace -3 + 2 p and determinant 2 + (p - 1.5)^2; and [[0.5, p], [p, 0.2]], which has the eigenvalue 1 at p^2 = 0.4."""
    if discrete:
        model = small_model([[sp.Rational(1, 2), p], [p, sp.Rational(1, 5)]], [[1, 0]], [parameter(rate=0.0)])
    else:
        half = p - sp.Rational(3, 2)
        model = small_model([[half, -2], [1, half]], [[1, 0]], [parameter(rate=0.0)])
    found = robust_stability_margin(model, discrete=discrete)
    assert found.lower <= expected * (1 + 1e-9) and found.upper >= expected * (1 - 1e-9)
    assert found.upper / found.lower < 1.002
    assert robust_stability_margin(model, tolerance=1e-5, discrete=discrete).lower > expected * (1 - 2e-5)


def test_a_family_that_is_always_stable_has_no_witness() -> None:
    found = robust_stability_margin(small_model([[-1 - p**2]], [[1]], [parameter(rate=0.0)]))
    assert found.upper == np.inf and found.witness is None and found.lower == pytest.approx(100.0)


def test_the_stability_polynomials_are_those_of_poles() -> None:
    """Against eigenvalues at random places: all positive where the poles are stable, not so elsewhere (a rational family)."""
    A = [[0, 1, 0], [0, 0, 1], [-(2 + p) / (3 + q), -2, -1 + p * q / 2]]
    question = ask(small_model(A, [[1, 0, 0]], [parameter("p", -3, 3), parameter("q", -2, 2)]))
    polynomials = Family(question).stability()
    places = np.random.default_rng(3).uniform(-1.0, 1.0, (60, 2))
    stable = np.linalg.eigvals(question.frozen(places)[0]).real.max(axis=1) < 0.0
    assert 5 < stable.sum() < 55
    for place, wanted in zip(places, stable, strict=True):
        values = [f.at([fmpq(*float(x).as_integer_ratio()) for x in place])[0, 0] for f in polynomials]
        assert all(v > 0 for v in values) == wanted


@pytest.mark.parametrize("case", range(3))
def test_worst_case_gains_are_those_of_dense_grids(case: int) -> None:
    """One and several inputs and outputs, D, and a denominator.

    41^p places are no worse, and 1 % below the claim is refused.
    """
    model = (
        small_model([[0, 1], [-p, sp.Rational(-1, 5)]], [[1, 0]], [parameter("p", 0.5, 2.0)], E=[[0], [1]]),
        small_model(
            [[0, 1], [-2 - p, -1 + q / 2]], [[1, 0], [0, 1]], [parameter("p", 0, 2), parameter("q")],
            E=[[0, 1], [1, p]], F=[[0, 0.1], [0.3, 0]],
        ),
        small_model([[0, 1], [-2 / (2 + p), -0.3 / (2 + p)]], [[1, 0]], [parameter()], E=[[0], [1 / (2 + p)]]),
    )[case]  # fmt: skip
    found = worst_case_gain(model)
    question = ask(model)
    line = np.linspace(-1.0, 1.0, 41)
    grid = np.stack(np.meshgrid(*[line] * len(question.axes)), axis=-1).reshape(-1, len(question.axes))
    worst = float(hinf_norm(*question.frozen(grid)).norm.max())
    assert worst * (1 - 1e-6) <= found.lower <= found.upper < found.lower * 1.0015
    assert found.below(1.01 * worst) is Verdict.CERTIFIED and found.below(0.99 * worst) is Verdict.REFUTED


@pytest.mark.parametrize("denominator", [sp.Integer(1), 3 + p])
def test_the_gain_polynomial_is_that_of_frequency_responses(denominator: sp.Expr) -> None:
    """|chi(jw)|^2 det(g^2 I - G*G) d^k with two inputs and D, at random places, frequencies and levels."""
    A, B = sp.Matrix([[0, 1], [-2 - p, -1 + q / 2]]), sp.Matrix([[0, 1], [1, p]])
    model = small_model(
        A / denominator, [[1, 0], [0, q]], [parameter("p"), parameter("q")], E=B / denominator, F=[[0, 0.1], [0.3, p]]
    )
    question = ask(model)
    family = Family(question)
    coefficients, rng = family.gain(), np.random.default_rng(7)
    for _ in range(8):
        u, w, g = rng.uniform(-1.0, 1.0, 2), float(rng.uniform(0.1, 3.0)), float(rng.uniform(0.2, 3.0))
        a, b, c, d = (m[0] for m in question.frozen(u[None]))
        G = c @ np.linalg.solve(1j * w * np.eye(2) - a, b) + d
        below = float(denominator.subs(p, u[0]) / denominator.subs(p, 0))
        wanted = (
            abs(np.linalg.det(1j * w * np.eye(2) - a)) ** 2 * np.linalg.det(g**2 * np.eye(2) - np.conj(G.T) @ G).real
        )
        point, square = [fmpq(*float(x).as_integer_ratio()) for x in u], fmpq(*g.as_integer_ratio()) ** 2
        values = [family.in_parameters(x, square).at(point)[0, 0] for x in coefficients]
        found = sum(int(x.p) / int(x.q) * w ** (2 * k) for k, x in enumerate(values))
        assert found == pytest.approx(wanted * below ** (2 + 2 * 2 + 2 * 2), rel=1e-9)


def test_two_singular_values_above_a_level_are_not_below_it() -> None:
    """G near 2 I: det(1 - G*G) is positive everywhere, though every gain is above 1."""
    model = small_model([[-1 + p / 2, 0], [0, -1]], sp.eye(2) / 10, [parameter()], E=sp.eye(2), F=2 * sp.eye(2))
    question = ask(model)
    family = Family(question)
    assert not _decide(question, family, family.gain(), 1.0, 0.0).positive
    assert _decide(question, family, family.gain(), 2.3, 0.0).positive


def test_rolmip_worst_case_gain() -> None:
    """ROLMIP manual, tables 2 and 3: 1.0108, found there by brute force and with a P of degree 2."""
    t1, t2, t3 = sp.symbols("t1 t2 t3")
    model = small_model(
        [[0, 0, 1, 0], [0, 0, 0, 1], [-2 * t1, t1, -t1 * t3, 0], [t2, -t2, 0, -t2 * t3]],
        [[0, 1, 0, 0]],
        [parameter("t1", 2 / 3, 2.0, 0.0), parameter("t2", 0.8, 4 / 3, 0.0), parameter("t3", 1.0, 3.0, 0.0)],
        E=[[0], [0], [t1], [0]],
    )
    found = worst_case_gain(model, tolerance=1e-4)
    assert found.lower == pytest.approx(1.010787, rel=1e-5) and found.upper < 1.010787 * 1.0002
    assert list(found.witness.values()) == pytest.approx([2 / 3, 0.8, 1.0])


def test_a_member_that_is_not_stable_makes_the_gain_infinite() -> None:
    found = worst_case_gain(small_model([[p - sp.Rational(9, 10)]], [[1]], [parameter()], E=[[1]]))
    assert found.lower == np.inf and found.witness["p"] > 0.9


def polynomial(terms: dict[tuple[int, int], float]) -> PolynomialMatrix:
    entries = {k: fmpq_mat([[fmpq(*float(v).as_integer_ratio())]]) for k, v in terms.items()}
    return PolynomialMatrix(entries, (1, 1), 2)


@pytest.mark.parametrize(("least", "positive"), [(1e-3, True), (1e-9, True), (0.0, False), (-1e-9, False)])
def test_signs_near_zero(least: float, positive: bool) -> None:
    """(x - 0.3)^2 + (y + 0.7)^2 + least: never proved where it is zero, and a point that fails does fail."""
    terms = {(0, 0): least, (2, 0): 1.0, (0, 2): 1.0}
    shifted = polynomial(terms).affine([fmpq(-3, 10), fmpq(7, 10)], [fmpq(1)] * 2)
    found = all_positive([shifted], [fmpq(0)] * 2, [fmpq(1)] * 2)
    assert found.positive is positive
    if found.fails_at is not None:
        assert shifted.at(found.fails_at)[0, 0] <= 0


def test_bad_questions_are_refused() -> None:
    with pytest.raises(AnalysisError, match="not stable in the middle"):
        robust_stability_margin(small_model([[p + 1]], [[1]], [parameter()]))
    with pytest.raises(AnalysisError, match="tolerance"):
        worst_case_gain(small_model([[p - 2]], [[1]], [parameter()], E=[[1]]), tolerance=-1.0)
    with pytest.raises(AnalysisError, match="no input reaches"):
        worst_case_gain(replace(small_model([[p - 2]], [[1]], [parameter()], E=[[1]]), E=sp.Matrix([[0]])))
