"""Inequalities between parameters in numbers: corners, boxes that touch a border, and proofs on the part of a box inside."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import sympy as sp
from flint import fmpq, fmpq_mat

from synthesis.certificate.claims import Claim
from synthesis.certificate.verify import Names, Verifier
from synthesis.loop.from_model import plant_of
from synthesis.loop.given import GivenLoop
from synthesis.loop.observer import ObserverLoop
from synthesis.models.constraint import ParameterConstraint
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.box_sign import positive
from synthesis.polynomials.boxes import Boxes, orders
from synthesis.polynomials.cut_boxes import positive_on_part
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.half_spaces import Faces, HalfSpace, corners_of
from synthesis.polynomials.matrix import MatrixPolynomial
from synthesis.polynomials.multiplier import borders, lessened
from synthesis.polynomials.positivity import prove_positive
from tests.support.lmi_cases import parameter, small_model

HALF = sp.Rational(1, 2)


def rotor(most: float) -> LpvModel:
    """Poles p + q - 1/2 +- j over [-1, 1]^2 where p + q <= most."""
    p, q = sp.symbols("p q")
    model = small_model([[p + q - HALF, 1], [-1, p + q - HALF]], [[1, 0]], [parameter("p"), parameter("q")])
    return replace(model, constraints=(ParameterConstraint({"p": 1.0, "q": 1.0}, most),))


def test_corners_are_those_of_geometry() -> None:
    """The square without a triangle has five corners; a cube cut by x + y + z <= 1 keeps ten."""
    zeros, ones = (fmpq(0),) * 2, (fmpq(1),) * 2
    found = corners_of(zeros, ones, (HalfSpace((fmpq(1), fmpq(1)), fmpq(1)),))
    assert sorted((int(a), int(b)) for a, b in found) == [(-1, -1), (-1, 1), (0, 1), (1, -1), (1, 0)]
    cube = corners_of((fmpq(0),) * 3, (fmpq(1),) * 3, (HalfSpace((fmpq(1),) * 3, fmpq(2)),))
    assert len(cube) == 10  # seven are left, the eighth becomes three
    border = HalfSpace((fmpq(1), fmpq(1)), fmpq(0), fmpq(1, 100))
    for middle, missed in (
        (fmpq(1, 2), False),
        (fmpq(101, 200), False),
        (fmpq(103, 200), True),
    ):  # touching, within slack
        assert border.misses((middle,) * 2, (fmpq(1, 2),) * 2) is missed


def test_a_strip_along_the_border_that_breaks_a_claim_is_never_skipped() -> None:
    """P = 1 and a decay of 1e-6 1/s hold where p + q < 1/2 - 1e-6: with balls alone, and with the quick cells of a table."""
    P = PolynomialMatrix({(0, 0): fmpq_mat(2, 2, [1, 0, 0, 1])}, (2, 2), 2)
    claim = Claim("decay rate", 1e-6, P)
    for most, proved in ((0.499, True), (0.51, False)):
        plant = plant_of(rotor(most))
        for loop in (GivenLoop(plant), ObserverLoop.constant_gain(plant, fmpq_mat(2, 1, [0, 0]))):
            outcome = Verifier(loop, Names(("x1", "x2"), ())).prove(claim)
            assert outcome.proved is proved
            assert proved or plant.admits(outcome.place)


def test_positive_on_the_part_inside_is_proved_and_nothing_else() -> None:
    """c - u1 - u2 on u1 + u2 <= 0 is at least c, and 2 less on the box; random matrices against dense samples of the set."""
    spaces = (HalfSpace((fmpq(1), fmpq(1)), fmpq(0)),)
    faces, rng = Faces.of(spaces), np.random.default_rng(2)
    for c, proved in ((0.02, True), (-0.02, False)):
        tensor = np.array([[c, -1.0], [-1.0, 0.0]])[..., None, None, None]
        assert prove_positive(MatrixPolynomial(tensor), faces=faces).proved is proved
        assert not prove_positive(MatrixPolynomial(tensor)).proved
        corners = np.array([[c + 2.0, c], [c, c - 2.0]])[None, ..., None, None]
        assert positive_on_part(corners, np.zeros((1, 2)), np.ones((1, 2)), faces, 1e-12).tolist() == [proved]
    samples = faces.drawn_in(rng.uniform(-1.0, 1.0, (4000, 2)))
    table, offset, factor = orders(2, 2), (fmpq(0),) * 2, (fmpq(1),) * 2
    cut, start, slopes = borders(spaces, [offset], [factor])
    assert cut.all()
    found, wrong = {True: 0, False: 0}, 0
    for _ in range(60):
        part = 0.25 * rng.normal(size=(3, 3, 2, 2))
        tensor = 0.5 * (part + np.swapaxes(part, 2, 3))
        tensor[2, 1:] = tensor[1, 2:] = 0.0
        tensor[0, 0] += 0.7 * np.eye(2)
        tensor[1, 0] -= 0.7 * np.eye(2)
        tensor[0, 1] -= 0.7 * np.eye(2)
        matrix = MatrixPolynomial(tensor[..., None])
        true = np.linalg.eigvalsh(matrix.at(samples)[..., 0])[:, 0].min() > 0.0
        boxes = Boxes(np.array([[tensor[k] for k in table.powers]]), np.zeros((1, 2, 2)), 2, 2)
        quick = bool(positive(lessened(boxes, start, slopes))[0])
        inside = prove_positive(matrix, faces=faces).proved
        assert true or not (quick or inside)
        assert inside or not true or np.linalg.eigvalsh(matrix.at(samples)[..., 0])[:, 0].min() < 1e-3
        found[quick and not bool(positive(boxes)[0])] += 1
        wrong += not true
    assert found[True] >= 5  # the multiplier proves what the box does not
    assert wrong >= 5


def test_what_a_multiplier_takes_for_the_set_holds_all_of_it() -> None:
    """g in floats is never below the exact one, slack included, in any corner of a box: no place of the set is left out."""
    rng = np.random.default_rng(5)
    for _ in range(200):
        draw = [fmpq(int(x), int(y)) for x, y in zip(rng.integers(-999, 999, 8), rng.integers(1, 997, 8), strict=True)]
        space = HalfSpace((draw[0], draw[1]), draw[2], abs(draw[3]) / 10**12)
        offset, factor = (draw[4] / 1000, draw[5] / 1000), (abs(draw[6]) / 1000, abs(draw[7]) / 1000)
        _, (start,), (slopes,) = borders((space,), [offset], [factor])
        size = sum(abs(float(x.p) / float(x.q)) for x in draw)
        for signs in product((-1, 1), repeat=2):
            place = [o + f * s for o, f, s in zip(offset, factor, signs, strict=True)]
            exact = space.bound + space.slack - sum((a * u for a, u in zip(space.normal, place, strict=True)), fmpq(0))
            taken = fmpq(*float(start).as_integer_ratio())
            taken -= sum((fmpq(*float(m).as_integer_ratio()) * s for m, s in zip(slopes, signs, strict=True)), fmpq(0))
            assert exact <= taken <= exact + fmpq(*(1e-9 * (size + 1.0) ** 2).as_integer_ratio())
