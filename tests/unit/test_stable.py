"""Hurwitz and Schur by signs: known roots, multiple roots on either side of the border and on it, balls that leave it open."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb, arb_mat, fmpq, fmpq_mat

from synthesis.polynomials.stable import is_hurwitz, is_schur

Rows = list[list[fmpq]]


def similar(rows: Rows, rng: np.random.Generator) -> fmpq_mat:
    """The same matrix in other coordinates: exactly, with a matrix of determinant one."""
    n = len(rows)
    turn = fmpq_mat(n, n, [fmpq(int(i == j)) for i in range(n) for j in range(n)])
    for _ in range(2 * n):
        i, j = (int(k) for k in rng.integers(n, size=2))
        if i != j:
            step = fmpq_mat(n, n, [fmpq(int(a == b)) for a in range(n) for b in range(n)])
            step[i, j] = fmpq(int(rng.integers(-2, 3)))
            turn = turn * step
    return turn.inv() * fmpq_mat(rows) * turn


def blocks(roots: list[tuple[fmpq, fmpq]], coupled: bool = False) -> Rows:
    """Real roots (a, 0), pairs a +- ib; `coupled` puts ones above the diagonal, which makes Jordan blocks of equal roots."""
    size = sum(1 if b == 0 else 2 for _, b in roots)
    rows, at = [[fmpq(0)] * size for _ in range(size)], 0
    for a, b in roots:
        width = 1 if b == 0 else 2
        for k in range(width):
            rows[at + k][at + k] = a
            if coupled and at + k + width < size:
                rows[at + k][at + k + width] = fmpq(1)
        if b != 0:
            rows[at][at + 1], rows[at + 1][at] = -b, b
        at += width
    return rows


@pytest.mark.parametrize("seed", range(60))
def test_known_roots(seed: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 4))
    roots = [
        (
            fmpq(int(rng.integers(-300, 120)), 100),
            fmpq(int(rng.integers(1, 200)), 100) if rng.random() < 0.5 else fmpq(0),
        )
        for _ in range(count)
    ]
    matrix = similar(blocks(roots), rng)
    left = all(a < 0 for a, _ in roots)
    inside = all(a * a + b * b < 1 for a, b in roots)
    assert is_hurwitz(matrix) is left
    assert is_schur(matrix) is inside
    assert is_hurwitz(arb_mat(matrix)) in ((True,) if left else (False, None))
    assert is_schur(arb_mat(matrix)) in ((True,) if inside else (False, None))
    small = matrix * fmpq(1, 4)  # a second look at the disc, where more of them are inside
    assert is_schur(small) is all(a * a + b * b < 16 for a, b in roots)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(
    ("pole", "stable"), [(fmpq(-1, 1000), True), (fmpq(0), False), (fmpq(1, 1000), False), (fmpq(-1, 10**9), True)]
)
def test_fourfold_poles_of_one_jordan_block(seed: int, pole: fmpq, stable: bool) -> None:
    """Floating point spreads a fourfold pole over a ring of radius 1e-4 and more; signs do not."""
    rng = np.random.default_rng(seed)
    matrix = similar(blocks([(pole, fmpq(0))] * 4, coupled=True), rng)
    assert is_hurwitz(matrix) is stable
    disc = matrix + fmpq_mat(4, 4, [fmpq(int(i == j)) for i in range(4) for j in range(4)])
    assert is_schur(disc) is stable


def test_floats_would_have_said_otherwise() -> None:
    """Why signs: the largest real part of the eigenvalues in float64 is positive for a fourfold pole at -1e-5."""
    worst = -np.inf
    for seed in range(20):
        matrix = similar(blocks([(fmpq(-1, 10**5), fmpq(0))] * 4, coupled=True), np.random.default_rng(seed))
        assert is_hurwitz(matrix) is True
        numbers = np.array([float(int(x.p)) / int(x.q) for x in matrix.entries()]).reshape(4, 4)
        worst = max(worst, float(np.linalg.eigvals(numbers).real.max()))
    assert worst > 0.0


@pytest.mark.parametrize("seed", range(8))
def test_double_pairs_on_the_border_are_not_stable(seed: int) -> None:
    """+-i twice in one Jordan block, and 3/5 +- 4/5 i on the circle; a thousandth inside both are stable."""
    rng = np.random.default_rng(seed)
    axis = [(fmpq(0), fmpq(1))] * 2
    circle = [(fmpq(3, 5), fmpq(4, 5))] * 2
    assert is_hurwitz(similar(blocks(axis, coupled=True), rng)) is False
    assert is_schur(similar(blocks(circle, coupled=True), rng)) is False
    assert is_hurwitz(similar(blocks([(fmpq(-1, 1000), b) for _, b in axis], coupled=True), rng)) is True
    inside = [(a * fmpq(999, 1000), b * fmpq(999, 1000)) for a, b in circle]
    assert is_schur(similar(blocks(inside, coupled=True), rng)) is True


@pytest.mark.parametrize("root", [fmpq(1), fmpq(-1)])
def test_real_roots_on_the_circle_are_not_stable(root: fmpq) -> None:
    """z = -1 goes to infinity under the map of the disc: the leading coefficient vanishes."""
    for others in ([], [(fmpq(1, 2), fmpq(0))], [(fmpq(1, 4), fmpq(1, 4)), (fmpq(0), fmpq(0))]):
        assert is_schur(fmpq_mat(blocks([(root, fmpq(0)), *others]))) is False
        assert is_schur(fmpq_mat(blocks([(root * fmpq(999, 1000), fmpq(0)), *others]))) is True
        assert is_schur(fmpq_mat(blocks([(root * fmpq(1001, 1000), fmpq(0)), *others]))) is False


def test_unit_roots_of_every_order() -> None:
    """Companion matrices of z^n - c: roots on a circle of radius c^(1/n)."""
    for n in range(1, 7):
        for c, inside in (
            (fmpq(1), False),
            (fmpq(-1), False),
            (fmpq(999, 1000), True),
            (fmpq(-999, 1000), True),
            (fmpq(1001, 1000), False),
        ):
            rows = [[fmpq(int(j == i + 1)) for j in range(n)] for i in range(n)]
            rows[-1][0] = c
            assert is_schur(fmpq_mat(rows)) is inside


def test_open_balls_decide_nothing() -> None:
    """A pole somewhere in [-0.2, 0.1] may be on either side; in [-0.3, -0.1] it is left, in [0.1, 0.3] right."""
    assert is_hurwitz(arb_mat([[arb(-0.05, 0.15)]])) is None
    assert is_hurwitz(arb_mat([[arb(-0.2, 0.1)]])) is True
    assert is_hurwitz(arb_mat([[arb(0.2, 0.1)]])) is False
    assert is_schur(arb_mat([[arb(0.95, 0.1)]])) is None
    assert is_schur(arb_mat([[arb(-0.95, 0.1)]])) is None
    assert is_schur(arb_mat([[arb(0.8, 0.1)]])) is True
    assert is_schur(arb_mat([[arb(1.2, 0.1)]])) is False
    assert is_schur(arb_mat([[arb(-1.2, 0.1)]])) is False
    assert is_hurwitz(arb_mat([[arb("nan")]])) is None
    assert is_hurwitz(arb_mat([[arb(-1), arb(0, 5)], [arb(0, 5), arb(-1)]])) is None


def test_balls_never_say_what_no_matrix_in_them_is() -> None:
    """A certain answer of a ball holds for the matrices in it."""
    certain = 0
    for seed in range(80):
        rng = np.random.default_rng(seed)
        n, radius = int(rng.integers(1, 4)), 10.0 ** rng.uniform(-4, -0.5)
        middle = rng.normal(size=(n, n)) - np.eye(n) * rng.uniform(-0.5, 1.5)
        ball = arb_mat([[arb(float(x), radius) for x in row] for row in middle])
        hurwitz, schur = is_hurwitz(ball), is_schur(ball)
        for _ in range(6):
            inside = middle + rng.uniform(-radius, radius, (n, n))
            exact = fmpq_mat([[fmpq(*float(x).as_integer_ratio()) for x in row] for row in inside])
            assert hurwitz in (None, is_hurwitz(exact)) and schur in (None, is_schur(exact))
        certain += (hurwitz is not None) + (schur is not None)
    assert certain > 60
