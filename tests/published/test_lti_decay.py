"""Decay rates of constant matrices: the largest alpha with A'P + P A + 2 alpha P < 0 for some P > 0 is that of the slowest pole.

YALMIP, example "Decay-rate computation in LTI systems": A = [[-1, 2], [-3, -4]] has the decay rate 2.5 (so does issue 1334 of
YALMIP say). cvxpy, issue 932: A = [[0, 1], [-578.09782526, -67.43751973]] has 10.0786, its poles are -10.07860459, -57.35891514.
"""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from synthesis.design.stability import Form, affine_quadratic_stability
from synthesis.lmi.result import Verdict
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Signal

CASES = [
    pytest.param([["-1", "2"], ["-3", "-4"]], 2.5, 1e-9, id="YALMIP"),
    pytest.param([["0", "1"], ["-578.09782526", "-67.43751973"]], 10.0786, 5e-5, id="cvxpy 932"),
]


def constant_model(A: list[list[str]]) -> LpvModel:
    """x' = A x without any scheduling parameter."""
    return LpvModel(
        name="constant",
        source="see the module",
        states=(Signal("x1", "1"), Signal("x2", "1")),
        outputs=(Signal("y", "1"),),
        parameters=(),
        A=sp.Matrix([[sp.Rational(x) for x in row] for row in A]),
        C=sp.Matrix([[1, 0]]),
    )


def verdict(A: list[list[str]], rate: float, form: Form = "primal") -> Verdict:
    return affine_quadratic_stability(constant_model(A), np.zeros((2, 1)), 0, form, decay_rate=rate).verdict


@pytest.mark.parametrize(("A", "rate", "digits"), CASES)
@pytest.mark.parametrize("form", ["primal", "dual"])
def test_the_published_rate_is_certified_from_below_and_refuted_from_above(
    A: list[list[str]], rate: float, digits: float, form: Form
) -> None:
    poles = np.linalg.eigvals(np.array(A, float)).real
    assert -poles.max() == pytest.approx(rate, abs=digits)
    assert verdict(A, rate * (1.0 - 1e-3), form) is Verdict.CERTIFIED
    assert verdict(A, rate * (1.0 + 1e-3), form) is Verdict.REFUTED


@pytest.mark.parametrize(("A", "rate", "digits"), CASES)
def test_a_bisection_on_certified_ends_at_the_published_rate(A: list[list[str]], rate: float, digits: float) -> None:
    """The floor rises on CERTIFIED, the ceiling falls on REFUTED, and nothing is left undecided above the last digit."""
    low, high = 0.0, 100.0
    while high - low > 1e-4 * high:
        middle = 0.5 * (low + high)
        found = verdict(A, middle)
        assert found is not Verdict.INCONCLUSIVE, middle
        low, high = (middle, high) if found is Verdict.CERTIFIED else (low, middle)
    assert low - digits <= rate <= high + digits


def test_the_poles_of_issue_932() -> None:
    A = np.array(CASES[1].values[0], float)
    assert np.sort(np.linalg.eigvals(A)) == pytest.approx([-57.35891514, -10.07860459], abs=5e-9)
