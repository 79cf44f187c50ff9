"""Quotients of polynomials, enclosed: they hold the exact values in both rings, shrink on parts, and refuse zeros."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from flint import arb, fmpq, fmpq_mat

from synthesis.loop.on_boxes import local
from synthesis.loop.system import Region
from synthesis.polynomials import box_quotient
from synthesis.polynomials.boxes import Boxes, orders
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.quotient import least, quotients

RNG = np.random.default_rng(7)


def numerator(count: int) -> PolynomialMatrix:
    terms = {
        k: fmpq_mat(2, 2, [fmpq(int(x), 97) for x in RNG.integers(-99, 99, 4)]) for k in np.ndindex(*((3,) * count))
    }
    return PolynomialMatrix(terms, (2, 2), count)


def speed(count: int, power: int = 2) -> PolynomialMatrix:
    """Powers of 2 + u_1 + u_2/3 + ..: a speed that its range takes through a factor of three."""
    one = {(0,) * count: fmpq_mat([[2]])}
    one |= {tuple(int(i == j) for i in range(count)): fmpq_mat([[fmpq(1, 1 + 2 * j)]]) for j in range(count)}
    base = PolynomialMatrix(one, (1, 1), count)
    found = base
    for _ in range(power - 1):
        found = found @ base
    return found


def regions(count: int) -> list[Region]:
    edges = [(fmpq(-1, 2), fmpq(0)), (fmpq(0), fmpq(1, 3))]
    return [
        Region.between(tuple(a for a, _ in cell), tuple(b for _, b in cell)) for cell in product(edges, repeat=count)
    ]


def radius(matrix: PolynomialMatrix) -> float:
    constant = matrix.terms[(0,) * matrix.variables]
    return max(float(x.rad()) for x in constant.entries())


def off(boxes: Boxes, number: int, point: tuple[fmpq, ...], exact: fmpq_mat) -> float:
    """How much of the radius the exact values need, at most; exactly compared."""
    worst = 0.0
    for i, j in np.ndindex(2, 2):
        value = fmpq(0)
        for place, powers in enumerate(orders(boxes.variables, boxes.highest).powers):
            weight = fmpq(*float(boxes.middle[number, place, i, j]).as_integer_ratio())
            for t, k in zip(point, powers, strict=True):
                weight *= t**k
            value += weight
        share = abs(value - exact[i, j]) / fmpq(*float(boxes.radius[number, i, j]).as_integer_ratio())
        worst = max(worst, int(share.p) / int(share.q))
    return worst


@pytest.mark.parametrize("count", [1, 2, 3])
def test_both_rings_hold_the_exact_quotient(count: int) -> None:
    N, d, cells = numerator(count), speed(count), regions(count)
    at_once = box_quotient.quotients({"A": local(N, cells)}, local(d, cells))
    assert at_once is not None
    needed = 0.0
    for number, region in enumerate(cells):
        alone = quotients({"A": region.local(N)}, region.local(d))
        assert alone is not None and radius(alone["A"]) < (1e-6 if count == 1 else 1e-3)
        for _ in range(4):
            point = tuple(fmpq(int(k), 8) for k in RNG.integers(-8, 9, count))
            u = region.point((*point, *(0,) * count))[:count]
            exact = N.at(u) * (1 / d.at(u)[0, 0])
            values = alone["A"].at((*point, *(fmpq(0),) * count))
            assert all(ball.contains(arb(x)) for ball, x in zip(values.entries(), exact.entries(), strict=True))
            needed = max(needed, off(at_once["A"], number, point, exact))
    assert 0.01 < needed <= 1.0  # the radii are needed: without the remainder the values would lie outside


def test_half_a_region_leaves_a_far_smaller_remainder() -> None:
    N, d = numerator(1), speed(1)
    whole = Region.between((fmpq(-1),), (fmpq(1),))
    sizes = []
    for region in (whole, whole.halves(0)[0]):
        found = quotients({"A": region.local(N)}, region.local(d))
        assert found is not None
        sizes.append(radius(found["A"]))
    assert sizes[1] < sizes[0] / 50


def test_the_least_value_is_a_bound_from_below() -> None:
    assert least(speed(1)).bound == 1  # (2 + u)^2 at u = -1
    runge = PolynomialMatrix({(0,): fmpq_mat([[1]]), (2,): fmpq_mat([[25]])}, (1, 1), 1)
    bound = least(runge).bound  # 1 + 25 u^2: a Bernstein coefficient of the whole range is -24
    assert bound is not None and 0.9 < float(bound) <= 1.0


@pytest.mark.parametrize("zero", [fmpq(-1), fmpq(1, 3), fmpq(1)])
@pytest.mark.parametrize("twice", [False, True])
def test_a_zero_on_the_range_is_refused(zero: fmpq, twice: bool) -> None:
    """At an end, or inside; also where the sign does not change."""
    line = PolynomialMatrix({(0,): fmpq_mat([[-zero]]), (1,): fmpq_mat([[1]])}, (1, 1), 1)
    below = line @ line if twice else line * (-1 if zero == 1 else 1)
    found = least(below)
    assert found.bound is None and (twice or below.at(found.place)[0, 0] <= 0)
    region = Region.between((fmpq(-1),), (fmpq(1),))
    assert quotients({"A": region.local(numerator(1))}, region.local(below)) is None
    assert box_quotient.quotients({"A": local(numerator(1), [region])}, local(below, [region])) is None
