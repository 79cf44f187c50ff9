"""Loops of rational plants: one wide cell, and a plant that is secretly polynomial."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp
from flint import fmpq, fmpq_mat
from scipy.linalg import expm

from synthesis.certificate.claims import Claim, ClaimChannel
from synthesis.certificate.search import Search, Wish
from synthesis.certificate.verify import Names, Verifier
from synthesis.design.feedback_channel import feedback_names
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.loop.plant import Plant
from synthesis.loop.system import Region
from synthesis.polynomials.enclosure import PolynomialMatrix
from tests.support.lmi_cases import parameter, small_model
from tests.support.single_track import numbers, single_track

PERIOD = 0.01


def test_one_wide_cell_is_proved_on_its_parts() -> None:
    """1/V from 2 to 50 m/s is no polynomial of order 8: the remainder is wide on the whole range, and small on its parts."""
    model = single_track(2.0, 50.0)
    loop = FeedbackLoop.constant_gain(
        plant_of(model), fmpq_mat([[fmpq(1, 100), fmpq(-1, 20)]]), sample_time=fmpq(1, 100)
    )
    slowest = np.inf
    for V in np.linspace(2.0, 50.0, 200):
        A, B, _, _ = numbers(V)
        whole = expm(PERIOD * np.block([[A, B], [np.zeros((1, 3))]]))
        kept = np.linalg.eigvals(whole[:2, :2] + whole[:2, 2:] @ [[0.01, -0.05]])
        slowest = min(slowest, -np.log(np.abs(kept).max()) / PERIOD)
    search = Search(loop, feedback_names(model), model.parameters, 0)
    assert search.prove(Wish("sampled error", 0.97 * slowest))[0] is not None
    assert search.prove(Wish("sampled error", 1.001 * slowest))[0] is None


@pytest.mark.parametrize("V", [5.0, 8.25, 40.0])
def test_a_law_with_a_state_on_the_measured_outputs(V: float) -> None:
    """[x; xk]+ by matrix exponentials and plain products; C and D are over the speed, too."""
    Ak, Bk, Ck, Dk = np.array([[0.75]]), np.array([[0.5, -0.125]]), np.array([[0.25]]), np.array([[-0.125, 0.0]])
    rows = np.block([[Ak, Bk], [Ck, Dk]])
    gain = fmpq_mat([[fmpq(*float(x).as_integer_ratio()) for x in row] for row in rows])
    ends = ((fmpq(5), fmpq(40)),)
    loop = FeedbackLoop(plant_of(single_track()), ends, {(0,): gain, (1,): gain}, "outputs", 1, fmpq(1, 100))
    u = (fmpq(*V.as_integer_ratio()) - fmpq(45, 2)) / fmpq(35, 2)
    system = loop.system(Region((u, fmpq(0)), (fmpq(0), fmpq(0))), "discrete")
    assert system is not None and system.denominator is None
    A, B, C, D = numbers(V)
    E, F = np.array([[1.0, 0.0, 0.0], [0.0] * 3]), np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 1.0]])
    whole = expm(PERIOD * np.block([[A, B, E], [np.zeros((4, 6))]]))
    free, moved, driven = whole[:2, :2], whole[:2, 2:3], whole[:2, 3:]
    K, seen = np.hstack([Dk @ C, Ck]), np.hstack([C, np.zeros((2, 1))])
    apart = np.block([[free, np.zeros((2, 1))], [np.zeros((1, 2)), Ak]])
    wanted = {
        "A": apart + np.vstack([moved @ K, Bk @ (seen + D @ K)]),
        "B": np.vstack([driven + moved @ Dk @ F, Bk @ (F + D @ Dk @ F)]),
        "C": np.vstack([np.eye(2, 3), seen + D @ K, K]),
        "D": np.vstack([np.zeros((2, 3)), F + D @ Dk @ F, Dk @ F]),
    }  # fmt: skip
    found = {"A": system.A, "B": system.B["disturbances"], "C": system.C, "D": system.D["disturbances"]}
    for key, matrix in wanted.items():
        values = [float(x.mid()) for x in found[key].at((fmpq(0), fmpq(0))).entries()]
        np.testing.assert_allclose(np.reshape(values, matrix.shape), matrix, rtol=1e-12, atol=1e-12)


def _disguised(plant: Plant) -> Plant:
    """N d over d."""
    d = PolynomialMatrix({(0,): fmpq_mat([[1]]), (1,): fmpq_mat([[fmpq(2, 5)]])}, (1, 1), 1)
    return Plant(plant.axes, {key: matrix.scaled_by(d) for key, matrix in plant.matrices.items()}, d)


@pytest.mark.parametrize("update", ["held", "sampled", "feedback"])
def test_a_plant_that_is_secretly_polynomial_has_the_same_claims(update: str) -> None:
    """The least level that one P proves, by bisection: the same with and without a common factor, in both ways."""
    p = sp.Symbol("p")
    model = small_model(
        [[0, 1], [-2 - p, -1]], [[1, 0]], (parameter("p", 0.0, 2.0, 3.0),), B=[[0], [1]], E=[[0, 0], [1, 0]], F=[[0, 1]]
    )
    plant = plant_of(model)
    ends = (fmpq(0), fmpq(1), fmpq(2))
    if update == "feedback":
        gain = fmpq_mat([[fmpq(-1, 2), -1]])
        loops: list[Any] = [FeedbackLoop(one, (ends,), {(k,): gain for k in range(3)}, sample_time=fmpq(1, 20))
                            for one in (plant, _disguised(plant))]  # fmt: skip
    else:
        gain = fmpq_mat([[fmpq(1)], [fmpq(1, 2)]]) * (fmpq(1, 20) if update == "sampled" else 1)
        loops = [ObserverLoop(one, (ends,), {(k,): gain for k in range(3)}, update, fmpq(1, 20))  # type: ignore[arg-type]
                 for one in (plant, _disguised(plant))]  # fmt: skip
    P = PolynomialMatrix({(0,): fmpq_mat([[560, 64], [64, 160]])}, (2, 2), 1)
    region = Region.between((fmpq(-1),), (fmpq(0),))
    first, second = (loop.system(region, "discrete") for loop in loops)
    for a, b in ((first.A, second.A), (first.B["disturbances"], second.B["disturbances"])):
        for t in (fmpq(-1), fmpq(1, 3), fmpq(1)):
            difference = (a - b).at((t, fmpq(0))).entries()
            assert all(x.contains(0) and float(x.abs_upper()) < 1e-12 for x in difference)
    outputs = ("x1", "x2", "y1", "u1") if update == "feedback" else ()
    names = Names(("x1", "x2"), ("d1", "d2"), outputs)

    def proved(loop: Any, level: float, quick: bool) -> bool:
        claim = Claim("sampled gain", level, P, ClaimChannel({"d1": 1.0, "d2": 1.0}, ("x2",)))
        return Verifier(loop, names, boxes={} if quick else {"discrete": None}).prove(claim).proved

    low, high = 0.1, 50.0
    while high / low > 1.0 + 1e-5:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if proved(loops[0], middle, True) else (middle, high)
    assert high < 10.0
    for quick in (True, False):
        assert proved(loops[1], high * (1.0 + 1e-4), quick) and not proved(loops[1], high * (1.0 - 1e-4), quick)
