"""Independent computations of what the study of P1 says of Lyapunov matrices, gains and boxes, from the printed decimals."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import minimize

from studies.claim import ClaimVerdict
from studies.papers.corner_estimation.inputs import CORNERS
from studies.papers.corner_estimation.quadratic_stability import diagonal_proof
from tests.support.p1_findings import PRINT, RADIUS, finding

PRINTED_29 = (("1.2176", "115.35", "80379.0"), ("-0.0011", "-0.2227", "-67.969"))
PRINTED_41 = (("4.7718", "154.87", "75627.0"), ("-0.0070", "0.0038", "-0.0013"))
MATRICES = {"longitudinal": PRINTED_29, "lateral": PRINTED_41}
OMEGA = sp.Symbol("w", positive=True)
Direction = Any


def exact(direction: Direction, gains: tuple[str, str] | None = None) -> sp.Matrix:
    """A - L C from the printed decimals, polynomial in w."""
    s0, s1, s2, kappa, L1, L2 = (sp.Rational(entry) for entry in PRINT[direction])
    if gains is not None:
        L1, L2 = (sp.Rational(entry) for entry in gains)
    a = kappa * sp.Rational(RADIUS) * OMEGA
    return sp.Matrix([[-a - L1 * (s0 - s1 * a), 1 - L1 * (s1 + s2)], [-L2 * (s0 - s1 * a), -L2 * (s1 + s2)]])


def symmetric(entries: tuple[str, ...]) -> sp.Matrix:
    a, b, d = (sp.Rational(entry) for entry in entries)
    return sp.Matrix([[a, b], [b, d]])


@pytest.mark.parametrize("direction", PRINT)
def test_dual_reading_by_exact_roots(direction: Direction) -> None:
    """Sylvester's minors as rational polynomials, their real roots by sympy: the ends of the interval, and signs between."""
    constant, slope = (symmetric(entries) for entries in MATRICES[direction])
    Q, A = constant + OMEGA * slope, exact(direction)
    minors = [Q[0, 0], Q.det()]
    for rate in (-800, 800):
        total = -(A * Q + Q * A.T - rate * slope)
        minors += [total[0, 0], total.det()]
    roots = sorted(
        root for minor in minors for root in sp.real_roots(sp.Poly(sp.expand(minor), OMEGA)) if 0 < root < 180
    )
    end = float(roots[0]) if roots else 180.0
    assert all(minor.subs(OMEGA, sp.Rational(1, 1000)) > 0 for minor in minors)
    ((low, high),) = finding(f"P1-{29 if direction == 'longitudinal' else 41}-dual").computed["holds_on_rad_s"]
    assert low == 0.0 and high == pytest.approx(end, abs=1e-6)
    assert (end == 180.0) is (direction == "longitudinal")


@pytest.mark.parametrize(("direction", "end"), [("longitudinal", 180.0), ("lateral", 162.2)])
def test_dual_reading_is_a_primal_one_of_the_inverse(direction: Direction, end: float) -> None:
    """P = Q^-1 with P' = -Q^-1 Q' Q^-1, by numpy on a dense grid: no congruence, other eigenvalues, the same signs."""
    s0, s1, s2, kappa, L1, L2 = (float(entry) for entry in PRINT[direction])
    constant, slope = (np.array(symmetric(entries), float) for entries in MATRICES[direction])
    inside = np.linspace(0.0, end, 801)
    beyond = np.linspace(end + 0.1, 180.0, 50) if end < 180.0 else np.empty(0)
    for omega, good in ((inside, True), (beyond, False)):
        for w in omega:
            a = kappa * float(RADIUS) * w
            A = np.array([[-a - L1 * (s0 - s1 * a), 1 - L1 * (s1 + s2)], [-L2 * (s0 - s1 * a), -L2 * (s1 + s2)]])
            P = np.linalg.inv(constant + w * slope)
            unit = np.diag([1.0, np.sqrt(P[0, 0] / P[1, 1])])
            worst = max(
                np.linalg.eigvalsh(unit @ (A.T @ P + P @ A - rate * P @ slope @ P) @ unit).max() for rate in (-800, 800)
            )
            assert bool(worst < 0.0) is good


def test_multi_convexity_in_fractions() -> None:
    """m11/2 +- sqrt(m11^2/4 + m12^2) with m from A1 = kappa R [[L1 s1 - 1, 0], [L2 s1, 0]], by hand."""
    computed = finding("P1-mc").computed
    for direction, (_, slope) in MATRICES.items():
        _, s1, _, kappa, L1, L2 = (Fraction(entry) for entry in PRINT[direction])
        p11, p12, p22 = (Fraction(entry) for entry in slope)
        rate = kappa * Fraction(RADIUS)
        m11 = 2 * rate * ((L1 * s1 - 1) * p11 + L2 * s1 * p12)
        m12 = rate * ((L1 * s1 - 1) * p12 + L2 * s1 * p22)
        assert m12 != 0
        root = np.sqrt(float(m11 * m11 / 4 + m12 * m12))
        np.testing.assert_allclose(
            computed[direction]["eigenvalues"]["primal"], [float(m11) / 2 - root, float(m11) / 2 + root], rtol=1e-9
        )
        assert computed[direction]["determinant_as_printed"] == pytest.approx(-float(m12 * m12), rel=1e-12)
    assert finding("P1-mc").verdict is ClaimVerdict.NOT_REPRODUCED
    assert computed["longitudinal"]["eigenvalues"]["adjugate"] == pytest.approx([-1.5e-3, 350.5], rel=0.03)


# ---- (28): gains and boxes ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direction", PRINT)
def test_the_box_by_random_gains_and_moving_wheels(direction: Direction) -> None:
    """20,000 gains and wheel speeds: e'P A_e e < 0 in every direction; and beside the interval of w it fails at a vertex."""
    entry = finding("P1-aqs-box").computed[direction]
    assert entry["proved_exactly"] and entry["vertices"] == 8
    random = np.random.default_rng(3)
    s0, s1, s2, kappa, *_ = (float(value) for value in PRINT[direction])
    L1, L2 = (random.uniform(*entry[key], 20_000) for key in ("L1", "L2"))
    a = kappa * float(RADIUS) * random.uniform(0.0, 180.0, 20_000)
    w = float(entry["weight"])
    m11 = 2 * w * (-a - L1 * (s0 - s1 * a))
    m12 = w * (1 - L1 * (s1 + s2)) - L2 * (s0 - s1 * a)
    m22 = -2 * L2 * (s1 + s2)
    assert (m11 < 0.0).all() and (m11 * m22 - m12**2 > 0.0).all()
    low, high = entry["weights_of_diag_w_1"]
    box = (tuple(entry["L1"]), tuple(entry["L2"]))
    for weight, good in ((low * 1.001, True), (high * 0.999, True), (low * 0.999, False), (high * 1.001, False)):
        assert diagonal_proof(CORNERS[direction], box, weight=round(weight))["proved_exactly"] is good


@pytest.mark.parametrize("direction", PRINT)
def test_interval_of_weights_by_exact_minors(direction: Direction) -> None:
    """The quadratic in w of every vertex solved by sympy; the intersection is the interval of the finding."""
    w, entry = sp.Symbol("w_weight", positive=True), finding("P1-aqs-box").computed[direction]
    low, high = sp.Integer(0), sp.oo
    for L1, L2, speed in product(map(str, entry["L1"]), map(str, entry["L2"]), (0, 180)):
        A = exact(direction, (L1, L2)).subs(OMEGA, speed)
        P = sp.diag(w, 1)
        first, second = sp.real_roots(sp.Poly(sp.expand((A.T * P + P * A).det()), w))
        low, high = max(low, first), min(high, second)
    np.testing.assert_allclose(entry["weights_of_diag_w_1"], [float(low), float(high)], rtol=1e-9)


def test_margins_of_the_conditioning_by_a_direct_search() -> None:
    """Largest t with A_e'P + P A_e < -t I for I <= P <= 1e4 I: maximised over rotation and both eigenvalues of P, no LMI."""
    s0, s1, s2, kappa, L1, L2 = (float(value) for value in PRINT["longitudinal"])
    matrices = []
    for speed in (0.0, 180.0):
        a = kappa * float(RADIUS) * speed
        matrices.append(
            np.array([[-a - L1 * (s0 - s1 * a), 1 - L1 * (s1 + s2)], [-L2 * (s0 - s1 * a), -L2 * (s1 + s2)]])
        )

    def worst(x: Any) -> float:
        c, s = np.cos(x[0]), np.sin(x[0])
        turn = np.array([[c, -s], [s, c]])
        P = turn @ np.diag(np.clip(np.exp(x[1:]), 1.0, 1e4)) @ turn.T
        return float(max(np.linalg.eigvalsh(A.T @ P + P @ A).max() for A in matrices))

    starts = [(angle, np.log(1e4), 0.0) for angle in (-0.05, -0.01, 0.0)]
    best = min(minimize(worst, start, method="Nelder-Mead", options={"maxiter": 4000, "xatol": 1e-10, "fatol": 1e-8}).fun
               for start in starts)  # fmt: skip
    assert -best == pytest.approx(
        finding("P1-aqs-scale").computed["P1 longitudinal"]["margin_unscaled"]["10000"], rel=1e-3
    )
