"""Frozen loops: where one breaks a claim, exact and between grid points; rates, drops and gains in closed form."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import product
from math import exp, log

import numpy as np
import pytest
from flint import fmpq, fmpq_mat

from synthesis.certificate.claims import Claim, ClaimChannel
from synthesis.certificate.frozen import critical_probability, frozen_gain, slowest_decay
from synthesis.certificate.inside_sample import inside_sample
from synthesis.certificate.refute import refuting_place, undetectable_place, unstable_place
from synthesis.certificate.verify import Names, Verifier
from synthesis.loop.observer import ObserverLoop, Update
from synthesis.loop.plant import Axis, Plant
from synthesis.polynomials.enclosure import PolynomialMatrix, constant


def rational(x: Fraction) -> fmpq:
    return fmpq(x.numerator, x.denominator)


def plant(A: PolynomialMatrix, C: PolynomialMatrix) -> Plant:
    """x' = A(u) x + d, y = C x, with u = p in [-1, 1] per parameter."""
    n, v = A.shape[0], A.variables
    none = {key: constant(fmpq_mat(*shape, [0] * (shape[0] * shape[1])), v) for key, shape in (
        ("B", (n, 1)), ("D", (1, 1)), ("F", (1, 1)),
    )}  # fmt: skip
    axes = tuple(Axis(f"p{i}", "1", fmpq(-1), fmpq(1), fmpq(-1), fmpq(1)) for i in range(v))
    drive = constant(fmpq_mat(n, 1, [1] * n), v)
    return Plant(axes, {"A": A, "C": C, "E": drive, **none}, constant(fmpq_mat([[1]]), v))


def hill(places: tuple[Fraction, ...], height: Fraction) -> PolynomialMatrix:
    """height - sum of (u_i - place_i)^2, one state."""
    v = len(places)
    terms = {(0,) * v: fmpq_mat([[rational(height - sum(place**2 for place in places))]])}
    for i, place in enumerate(places):
        terms[tuple(int(k == i) for k in range(v))] = fmpq_mat([[rational(2 * place)]])
        terms[tuple(2 * int(k == i) for k in range(v))] = fmpq_mat([[fmpq(-1)]])
    return PolynomialMatrix(terms, (1, 1), v)


def loop_of(A: PolynomialMatrix, gain: float = 0.0, update: Update = "held", rounded: bool = False) -> ObserverLoop:
    """The same gain at every breakpoint."""
    v = A.variables
    table = {index: fmpq_mat([[rational(Fraction(gain))]]) for index in product((0, 1), repeat=v)}
    one = constant(fmpq_mat([[1]]), v)
    return ObserverLoop(plant(A, one), ((fmpq(-1), fmpq(1)),) * v, table, update, fmpq(1, 10), rounded)


@pytest.mark.parametrize("places", [(Fraction(1, 3),), (Fraction(-7, 11),), (Fraction(1, 3), Fraction(-7, 11))])
def test_an_unstable_hill_between_grid_points_is_climbed(places: tuple[Fraction, ...]) -> None:
    height = Fraction(1, 10**5)  # unstable within 0.003 of the top, a fortieth of the step of the grid
    found = unstable_place(loop_of(hill(places, height)), fmpq(0))
    assert found is not None
    assert sum((Fraction(int(u.p), int(u.q)) - place) ** 2 for u, place in zip(found, places, strict=True)) <= height
    assert unstable_place(loop_of(hill(places, -height)), fmpq(0)) is None
    # the same hill against a decay rate just above and just below what its top has
    assert unstable_place(loop_of(hill(places, -height)), rational(2 * height)) is not None
    assert unstable_place(loop_of(hill(places, -height)), rational(height / 2)) is None


def test_a_place_that_is_given_is_tried_first() -> None:
    top = Fraction(123456789, 10**9)
    needle = loop_of(hill((top,), Fraction(1, 10**20)))  # too narrow for any climb
    assert unstable_place(needle, fmpq(0)) is None
    assert unstable_place(needle, fmpq(0), [(rational(top),)]) == (rational(top),)


def test_what_rounding_leaves_open_refutes_nothing() -> None:
    """Unstable by 1e-18 on a point of the grid: certain of the exact loop, and not of one that is evaluated in float64."""
    hardly = hill((Fraction(1, 4),), Fraction(1, 10**18))
    assert unstable_place(loop_of(hardly), fmpq(0)) == (fmpq(1, 4),)
    assert unstable_place(loop_of(hardly, rounded=True), fmpq(0)) is None
    clearly = hill((Fraction(1, 4),), Fraction(1, 10**12))
    assert unstable_place(loop_of(clearly, rounded=True), fmpq(0)) == (fmpq(1, 4),)


LEVELS = {"decay rate": 0.0, "gain": 100.0, "sampled gain": 100.0, "internal update": 0.0, "drop probability": 0.5}


@pytest.mark.parametrize(("kind", "level"), LEVELS.items())
def test_a_pole_on_the_level_refutes_only_where_it_is_certain(kind: str, level: float) -> None:
    """-(u - 1/4)^2 has the pole zero at one point of the grid; rounded it may be on either side, a little higher it is not."""

    def place(height: Fraction, rounded: bool) -> object:
        channel = ClaimChannel({"d": 1.0}, ("x",)) if "gain" in kind else None
        claim = Claim(kind, level, constant(fmpq_mat([[1]]), 1), channel)  # type: ignore[arg-type]
        loop = loop_of(hill((Fraction(1, 4),), height), rounded=rounded)
        return refuting_place(Verifier(loop, Names(("x",), ("d",))), claim)

    assert place(Fraction(0), rounded=True) is None
    assert place(Fraction(1, 10**6), rounded=True) == (fmpq(1, 4),)
    if kind in ("decay rate", "gain"):
        assert place(Fraction(0), rounded=False) == (fmpq(1, 4),)


def test_the_fastest_pole_on_the_level_refutes_only_where_it_is_certain() -> None:
    claim = Claim("fastest pole", 1.0, constant(fmpq_mat([[1]]), 1), None)
    for rounded, found in ((False, True), (True, False)):
        loop = loop_of(constant(fmpq_mat([[-1]]), 1), rounded=rounded)
        assert (refuting_place(Verifier(loop, Names(("x",), ("d",))), claim) is not None) is found


@pytest.mark.parametrize("rates", [(-5, 1), (-1, 5)])
def test_the_faster_of_both_rates_bounds_what_moves_inside_a_sample(rates: tuple[int, int]) -> None:
    """x' = p/3 x, |p| <= 3: q T^2/2 e^T (1/3) e^T, q = 5 the largest rate."""
    A = PolynomialMatrix({(1,): fmpq_mat([[1]])}, (1, 1), 1)
    still = loop_of(A)
    axis = replace(still.plant.axes[0], low=fmpq(-3), high=fmpq(3), rate_low=fmpq(rates[0]), rate_high=fmpq(rates[1]))
    found = inside_sample(
        replace(still, plant=replace(still.plant, axes=(axis,)), breakpoints=((fmpq(-3), fmpq(3)),), _systems={})
    )
    assert found is not None
    assert found.of_states[0][0] == pytest.approx(5.0 / 3.0 * 0.1**2 / 2.0 * exp(0.2), rel=1e-6)


def test_hidden_modes_count_only_if_they_do_not_decay() -> None:
    """x2 shows by u - place alone: hidden at u = place, where its rate is the sign."""
    for place in (fmpq(1, 3), fmpq(2, 7)):
        C = PolynomialMatrix({(0,): fmpq_mat([[1, -place]]), (1,): fmpq_mat([[0, 1]])}, (1, 2), 1)
        for rate, found in ((fmpq(1), (place,)), (fmpq(0), (place,)), (fmpq(-1), None)):
            assert undetectable_place(plant(constant(fmpq_mat([[-1, 0], [0, rate]]), 1), C)) == found


@pytest.mark.parametrize("gain", [0.9, 1.4])  # a positive pole and a negative one
def test_rates_drops_and_gains_of_a_scalar_update(gain: float) -> None:
    """x' = a x + d over T = 0.1: e+ = (e^(a T) - K) e + (e^(a T) - 1)/a d; without a measurement e+ = e^(a T) e + .."""
    a, T, one = 2.0, 0.1, np.ones((1, 1))
    loop = loop_of(constant(fmpq_mat([[2]]), 1), gain, "sampled")
    pole, lost = exp(a * T) - gain, exp(a * T)
    assert slowest_decay(loop) == pytest.approx(-log(abs(pole)) / T, rel=1e-9)
    assert critical_probability(loop) == pytest.approx((1.0 - pole**2) / (lost**2 - pole**2), rel=1e-9)
    largest = (lost - 1.0) / a / (1.0 - abs(pole))  # at the frequency 0, or pi
    assert frozen_gain(loop, 3.0 * one, 5.0 * one) == pytest.approx(15.0 * largest, rel=1e-9)


def test_the_worst_of_the_frozen_loops_counts() -> None:
    """x' = (2 + u) x: both ends of the range lie on the grid, and the upper one is worse."""
    A = PolynomialMatrix({(0,): fmpq_mat([[2]]), (1,): fmpq_mat([[1]])}, (1, 1), 1)
    loop, lost = loop_of(A, 0.9, "sampled"), exp(0.3)
    pole = lost - 0.9
    assert slowest_decay(loop) == pytest.approx(-log(pole) / 0.1, rel=1e-9)
    assert critical_probability(loop) == pytest.approx((1.0 - pole**2) / (lost**2 - pole**2), rel=1e-9)
    unstable = loop_of(A, 0.2, "sampled")
    assert critical_probability(unstable) == 0.0 and slowest_decay(unstable) < 0.0
    steady = loop_of(constant(fmpq_mat([[-1]]), 1), 0.5, "sampled")  # needs no measurement
    assert critical_probability(steady) == pytest.approx(1.0, abs=1e-9)
