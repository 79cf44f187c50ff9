"""Signs on a box: never positive where a value is not, always positive where there is room, undecided where a ball is open."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from flint import arb, arb_mat, fmpq, fmpq_mat
from numpy.polynomial import polynomial

from synthesis.polynomials.definite import Sign, bernstein, is_positive_definite, sign_on_box, to_bernstein
from synthesis.polynomials.enclosure import PolynomialMatrix, constant


def rational(x: float | Fraction) -> fmpq:
    return fmpq(*(x if isinstance(x, Fraction) else Fraction(x)).as_integer_ratio())


def gram(rng: np.random.Generator, size: int, variables: int, degree: int) -> PolynomialMatrix:
    """V'V, which is never negative."""
    terms = {}
    for powers in np.ndindex(*(degree + 1,) * variables):
        entries = [rational(Fraction(int(rng.integers(-20, 21)), 10)) for _ in range(size * size)]
        terms[tuple(int(k) for k in powers)] = fmpq_mat(size, size, entries)
    V = PolynomialMatrix(terms, (size, size), variables)
    return V.T @ V


def touching(rng: np.random.Generator, size: int, variables: int) -> tuple[PolynomialMatrix, tuple[fmpq, ...]]:
    """W'W with a vanishing value: every entry of W has a factor (t_i - place) for some i."""
    place = tuple(rational(Fraction(int(rng.integers(-9, 10)), 10)) for _ in range(variables))
    total = None
    for i in range(variables):
        inner = {}
        for powers in product((0, 1), repeat=variables):
            inner[powers] = fmpq_mat(
                size, size, [rational(Fraction(int(rng.integers(-20, 21)), 10)) for _ in range(size**2)]
            )
        V = PolynomialMatrix(inner, (size, size), variables)
        root = {
            tuple(int(k == i) for k in range(variables)): fmpq_mat([[1]]),
            (0,) * variables: fmpq_mat([[-place[i]]]),
        }
        W = V.scaled_by(PolynomialMatrix(root, (1, 1), variables))
        total = W.T @ W if total is None else total + W.T @ W
    assert total is not None
    return total, place


def unit(size: int, variables: int, factor: Fraction) -> PolynomialMatrix:
    entries = [rational(factor) if i == j else fmpq(0) for i in range(size) for j in range(size)]
    return constant(fmpq_mat(size, size, entries), variables)


def proved(matrix: PolynomialMatrix, depth: int = 12) -> bool | None:
    """By halving, as the verifier does: True, False at a corner, None where it gives up."""
    waiting = [(matrix, 0)]
    while waiting:
        here, level = waiting.pop()
        sign = sign_on_box(here.balls())
        if sign.fails_at is not None:
            return False
        if sign.positive:
            continue
        if level == depth * matrix.variables:
            return None
        axis = level % matrix.variables
        for half in (fmpq(-1, 2), fmpq(1, 2)):
            offset = [half if i == axis else fmpq(0) for i in range(matrix.variables)]
            factor = [fmpq(1, 2) if i == axis else fmpq(1) for i in range(matrix.variables)]
            waiting.append((here.affine(offset, factor), level + 1))
    return True


@pytest.mark.parametrize("variables", [1, 2])
@pytest.mark.parametrize("size", [1, 2, 3])
def test_a_little_above_a_square_is_proved(size: int, variables: int) -> None:
    for seed in range(4):
        rng = np.random.default_rng([seed, size, variables])
        matrix = gram(rng, size, variables, 2 if variables == 1 else 1) + unit(size, variables, Fraction(1, 10))
        assert proved(matrix) is True


@pytest.mark.parametrize("epsilon", [Fraction(1, 10), Fraction(1, 1000), Fraction(1, 10**9), Fraction(1, 10**15)])
@pytest.mark.parametrize("variables", [1, 2])
@pytest.mark.parametrize("size", [1, 2, 3])
def test_what_has_a_negative_value_is_never_positive(size: int, variables: int, epsilon: Fraction) -> None:
    """W'W - epsilon I with W = 0 at one place: negative there by epsilon, however small, and on no box proved positive."""
    for seed in range(6):
        rng = np.random.default_rng([seed, size, variables, epsilon.denominator])
        matrix, place = touching(rng, size, variables)
        matrix = matrix - unit(size, variables, epsilon)
        assert all(matrix.at(place)[i, i] == -rational(epsilon) for i in range(size))
        assert not sign_on_box(matrix.balls()).positive
        assert proved(matrix, 6) is not True
        near = [fmpq(1, 10**4)] * variables
        assert not sign_on_box(matrix.affine(place, near).balls()).positive


def test_a_corner_that_fails_is_named() -> None:
    """diag(1 + t, 2 - s) fails at t = -1 only, where it is singular."""
    terms = {
        (0, 0): fmpq_mat([[1, 0], [0, 2]]),
        (1, 0): fmpq_mat([[1, 0], [0, 0]]),
        (0, 1): fmpq_mat([[0, 0], [0, -1]]),
    }
    sign = sign_on_box(PolynomialMatrix(terms, (2, 2), 2))
    assert not sign.positive and sign.fails_at is not None and sign.fails_at[0] == -1
    terms[(0, 0)] = fmpq_mat([[fmpq(1001, 1000), 0], [0, 2]])
    assert sign_on_box(PolynomialMatrix(terms, (2, 2), 2)) == Sign(True)


@pytest.mark.parametrize("variables", [1, 2, 3])
def test_zero_is_not_positive_however_it_is_written(variables: int) -> None:
    """Without any term, with terms of zero, as t^2 - t^2: 0 > 0 is false."""
    nothing = PolynomialMatrix({}, (2, 2), variables)
    zero = constant(fmpq_mat([[0, 0], [0, 0]]), variables)
    square = PolynomialMatrix({(2,) * variables: fmpq_mat([[1, 0], [0, 1]])}, (2, 2), variables)
    for matrix in (
        nothing,
        zero,
        square - square,
        nothing.balls(),
        nothing + nothing,
        nothing @ nothing,
        nothing.truncated(1),
    ):
        assert not sign_on_box(matrix).positive
    assert not sign_on_box(square).positive


@pytest.mark.parametrize("variables", [1, 2])
def test_polynomials_without_a_constant_term_are_not_positive(variables: int) -> None:
    """They vanish in the middle: Bernstein coefficients that no term reaches are zero, not absent."""
    for seed in range(20):
        rng = np.random.default_rng([seed, variables])
        terms = {}
        for powers in np.ndindex(*(3,) * variables):
            if any(powers) and rng.random() < 0.6:
                terms[tuple(int(k) for k in powers)] = fmpq_mat([[int(rng.integers(0, 9))]])
        assert not sign_on_box(PolynomialMatrix(terms, (1, 1), variables)).positive


def test_open_balls_decide_nothing() -> None:
    """A ball that reaches below zero proves nothing, one that is below it at a corner refutes, and NaN is no number."""
    for radius, positive in ((0.4, True), (0.6, False)):
        ball = arb_mat([[arb(0.5, radius)]])
        assert is_positive_definite(ball) is (True if positive else None)
        assert sign_on_box(constant(ball, 1)) == Sign(positive)
    assert is_positive_definite(arb_mat([[arb(-0.5, 0.4)]])) is False
    assert is_positive_definite(arb_mat([[arb("nan")]])) is None
    assert is_positive_definite(arb_mat([[arb("inf") - arb("inf")]])) is None
    assert is_positive_definite(arb_mat([[arb(1), arb(0, 2)], [arb(0, 2), arb(1)]])) is None
    assert not sign_on_box(constant(arb_mat([[arb("nan")]]), 1)).positive


def test_definiteness_agrees_with_minors() -> None:
    """Sylvester's criterion, exactly, for random symmetric matrices; singular ones are not definite."""
    counts = {True: 0, False: 0}
    for seed in range(300):
        rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 5))
        half = rng.integers(-3, 4, (n, n))
        rows = (half + half.T + np.diag(rng.integers(0, 12, n))).tolist()
        matrix = fmpq_mat(rows)
        wanted = all(fmpq_mat([row[:k] for row in rows[:k]]).det() > 0 for k in range(1, n + 1))
        assert is_positive_definite(matrix) is wanted
        assert is_positive_definite(arb_mat(matrix)) in ((True,) if wanted else (False, None))
        counts[wanted] += 1
    assert min(counts.values()) > 50
    assert is_positive_definite(fmpq_mat([[1, 1], [1, 1]])) is False
    assert is_positive_definite(fmpq_mat([[0, 0], [0, 1]])) is False


@pytest.mark.parametrize("degree", range(7))
def test_bernstein_coefficients_are_exact(degree: int) -> None:
    """Corners are values, and sum_i C(d, i) ((1+t)/2)^i ((1-t)/2)^(d-i) b_i is the polynomial."""
    rng = np.random.default_rng(degree)
    powers = rng.integers(-9, 10, degree + 1)
    powers[-1] = powers[-1] or 1
    matrix = PolynomialMatrix({(k,): fmpq_mat([[int(c)]]) for k, c in enumerate(powers)}, (1, 1), 1)
    found = bernstein(matrix)
    weights = [found[(i,)][0, 0] if (i,) in found else fmpq(0) for i in range(degree + 1)]
    assert weights[0] == matrix.at((fmpq(-1),))[0, 0] and weights[-1] == matrix.at((fmpq(1),))[0, 0]
    for t in (fmpq(-1, 3), fmpq(0), fmpq(4, 5)):
        basis = [fmpq(1)] * (degree + 1)
        for i in range(degree + 1):
            count = fmpq(1)
            for k in range(i):
                count = count * (degree - k) / (k + 1)
            basis[i] = count * ((1 + t) / 2) ** i * ((1 - t) / 2) ** (degree - i)
        assert sum((w * b for w, b in zip(weights, basis, strict=True)), fmpq(0)) == matrix.at((t,))[0, 0]
    assert all(abs(x) <= 1 for row in to_bernstein(degree) for x in row)


def test_tensor_coefficients_enclose_values() -> None:
    """The values of a scalar polynomial in two variables lie between its least and its largest coefficient."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        array = rng.integers(-5, 6, (3, 4)).astype(float)
        terms = {(i, j): fmpq_mat([[int(array[i, j])]]) for i in range(3) for j in range(4)}
        numbers = [
            float(int(m[0, 0].p)) / int(m[0, 0].q) for m in bernstein(PolynomialMatrix(terms, (1, 1), 2)).values()
        ]
        values = polynomial.polygrid2d(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21), array)
        assert min(numbers) <= values.min() + 1e-12 and values.max() <= max(numbers) + 1e-12


@pytest.mark.parametrize("value", [-1, 1])
def test_what_is_too_large_to_look_at_decides_nothing(value: int) -> None:
    """value + (t s)^d / 2: of either sign, and beyond 20 000 coefficients neither is said."""

    def sign(degree: int) -> Sign:
        terms = {(0, 0): fmpq_mat([[value]]), (degree, degree): fmpq_mat([[fmpq(1, 2)]])}
        return sign_on_box(PolynomialMatrix(terms, (1, 1), 2).balls())

    assert sign(200) == Sign(False)
    assert sign(4).positive is (value > 0) and (sign(4).fails_at is None) is (value > 0)
