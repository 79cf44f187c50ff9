"""Numbers inside the designs that no verdict shows: discretised plants as polynomials, places in words, limits of settings."""

from __future__ import annotations

import re
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat
from scipy.linalg import expm

from synthesis.certificate.unknowns import in_scaled_states
from synthesis.design.fitted_update import fitted_update, power_below
from synthesis.design.hinf_observer import Channel, ObserverDesign
from synthesis.design.stability import affine_quadratic_stability
from synthesis.errors import ProblemError
from synthesis.lmi.result import Verdict
from synthesis.loop.system import System
from synthesis.polynomials.enclosure import PolynomialMatrix
from tests.support.lmi_cases import parameter, small_model

p, q = sp.symbols("p q")
ONE = (parameter("p", 1.0, 4.0),)
TWO = (*ONE, parameter("q", -2.0, 3.0))


@pytest.mark.parametrize("parameters", [ONE, TWO])
def test_discretised_plants_are_polynomials_close_to_exponentials(parameters: tuple) -> None:  # type: ignore[type-arg]
    """Neither even in the parameters nor alike in both: Phi and Gamma in scaled states at random places."""
    other = q if len(parameters) == 2 else sp.Integer(1)
    plant = small_model([[-p, 3 + other], [p * other / 2, -1 - p]], [[1, p]], parameters, E=[[1], [2]], F=[[1]])
    scale, period = np.array([2.0, 0.1]), 0.05
    (Phi, _, Gamma), draw = fitted_update(plant, plant.pieces[0], scale, period), np.random.default_rng(0)
    for _ in range(5):
        u = draw.uniform(-1.0, 1.0, len(parameters))
        A = plant.A.subs({a.name: a.middle + a.half_width * t for t, a in zip(u, parameters, strict=True)})
        scaled, forced = np.array(A, float) * scale[:, None] / scale, np.array([[1.0], [2.0]]) * scale[:, None]
        block = expm(period * np.block([[scaled, forced], [np.zeros((1, 3))]]))
        for value, wanted in ((Phi, block[:2, :2]), (Gamma, block[:2, 2:])):
            there = value
            for t in u:
                there = np.tensordot(t ** np.arange(len(there)), there, 1)
            np.testing.assert_allclose(there, wanted, atol=1e-8)


def test_discretised_rational_plants_are_over_a_power_of_their_denominator() -> None:
    """A wide range of 1/p, and what 24 degrees do not reach without that power."""
    plant = small_model([[-1 / p, 3 - p], [q / p, -1]], [[1, 0]], (parameter("p", 0.2, 5.0), TWO[1]), E=[[1 / p], [2]])
    scale, period = np.array([2.0, 0.1]), 0.05
    Phi, _, Gamma = fitted_update(plant, plant.pieces[0], scale, period)
    assert Phi.shape[:2] <= (13, 9)
    for u, v in np.random.default_rng(1).uniform(-1.0, 1.0, (5, 2)):
        at = plant.on(np.array([[2.6 + 2.4 * u, 0.5 + 2.5 * v]]))
        A, E = at.A[0] * scale[:, None] / scale, at.E[0] * scale[:, None]
        block = expm(period * np.block([[A, E], [np.zeros((1, 3))]]))
        below = (1.0 + 2.4 / 2.6 * u) ** power_below(plant.pieces[0])
        for value, wanted in ((Phi, block[:2, :2]), (Gamma, block[:2, 2:])):
            there = np.tensordot(v ** np.arange(value.shape[1]), np.tensordot(u ** np.arange(len(value)), value, 1), 1)
            np.testing.assert_allclose(there, wanted * below, atol=1e-5)


def test_the_place_of_an_unstable_pole_is_in_the_words() -> None:
    """x' = (0.01 - (p - 2)^2 - (q - 1/2)^2) x without correction: the pole of the message is that of its place."""
    hill = small_model([[sp.Rational(1, 100) - (p - 2) ** 2 - (q - sp.Rational(1, 2)) ** 2]], [[1]], TWO)
    found = affine_quadratic_stability(hill, np.array([[0.0]]), 0)
    assert found.verdict is Verdict.REFUTED
    pole, at_p, at_q = (float(x) for x in re.findall(r"(?:pole at|p =|q =) ([+-]?[\d.e-]+)", found.message))
    assert pole >= 0.0 and pole == pytest.approx(0.01 - (at_p - 2.0) ** 2 - (at_q - 0.5) ** 2, abs=2e-4)
    steady = affine_quadratic_stability(hill, np.array([[1.0]]), 0)
    assert steady.verdict is Verdict.CERTIFIED and "scale the states" not in steady.message


def test_limits_of_a_design() -> None:
    channels = (Channel(("d1",), ("x1",)),)
    for given in (
        {"decay_rate": 0.5}, {"decay_rate": 0.0}, {"decay_rate": 0.5, "fastest_pole": 0.6}, {"degree": 8}, {"degree": 0},
    ):  # fmt: skip
        ObserverDesign(channels, **given)  # type: ignore[arg-type]
    for wrong in (
        {"decay_rate": -1e-9}, {"decay_rate": np.inf}, {"decay_rate": np.nan}, {"degree": 9}, {"degree": -1},
        {"decay_rate": 0.5, "fastest_pole": 0.5}, {"fastest_pole": np.inf}, {"backoff": 1.0}, {"reserve": -0.1},
    ):  # fmt: skip
        with pytest.raises(ProblemError):
            ObserverDesign(channels, **wrong)  # type: ignore[arg-type]


def test_scaled_states_leave_inputs_and_outputs_alone() -> None:
    """x' = (A x + B w)/(1 + u^2/2), z = C x + D w: the same gains from w to z in the states diag(s) x, at every u."""
    draw, scale = np.random.default_rng(1), np.array([1e-3, 1.0, 20.0])

    def polynomial(rows: int, columns: int) -> PolynomialMatrix:
        entries = [[fmpq(int(k), 8) for k in draw.integers(-20, 20, rows * columns)] for _ in range(2)]
        return PolynomialMatrix({(k,): fmpq_mat(rows, columns, e) for k, e in enumerate(entries)}, (rows, columns), 1)

    below = PolynomialMatrix({(0,): fmpq_mat([[1]]), (2,): fmpq_mat([[fmpq(1, 2)]])}, (1, 1), 1)
    given = System(
        "continuous", polynomial(3, 3), {"w": polynomial(3, 2)}, polynomial(2, 3), {"w": polynomial(2, 2)},
        polynomial(3, 3), below,
    )  # fmt: skip
    scaled, s = in_scaled_states(given, scale), 0.3 + 2.0j

    def gain(A: np.ndarray, B: np.ndarray, C: np.ndarray, D: np.ndarray, d: float) -> np.ndarray:
        return np.asarray(C @ np.linalg.solve(s * np.eye(3) - A / d, B / d) + D)

    for u in (-1.0, 0.25, 0.5):
        before = [np.array([[float(Fraction(int(x.p), int(x.q))) for x in row] for row in m.at([fmpq(int(4 * u), 4)]).tolist()])
                  for m in (given.A, given.B["w"], given.C, given.D["w"], given.coasting)]  # fmt: skip
        after = [
            m.at(np.array([[u]]))[0, ..., 0]
            for m in (scaled.A, scaled.B["w"], scaled.C, scaled.D["w"], scaled.coasting)
        ]
        d = float(scaled.denominator.at(np.array([[u]]))[0, 0, 0, 0])
        assert d == 1.0 + u * u / 2.0
        np.testing.assert_allclose(gain(*after[:4], d), gain(*before[:4], d), rtol=1e-10)
        np.testing.assert_allclose(after[4], before[4] * scale[:, None] / scale, rtol=1e-12)
        np.testing.assert_allclose(after[0], before[0] * scale[:, None] / scale, rtol=1e-12)
