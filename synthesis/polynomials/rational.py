"""Exact polynomial matrices over the rationals, and the proof that one is positive definite on [0, 1].

Read this together with `synthesis.verify`: the two are all there is to a certificate.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from math import comb
from typing import Any, TypeAlias

from flint import fmpq, fmpq_poly

Matrix: TypeAlias = list[list[Any]]  # entries fmpq_poly (or fmpq); flint has no type stubs


def rational(number: float | int | str) -> fmpq:
    """The rational number that a float is, bit for bit; a string is read as a decimal."""
    if isinstance(number, str):
        decimal = Fraction(number)
        return fmpq(decimal.numerator, decimal.denominator)
    return fmpq(*number.as_integer_ratio())


def decimal(number: float | int) -> fmpq:
    """The decimal that is written for a number: 0.1 is one tenth, not the float64 next to it."""
    exact = Fraction(repr(float(number))) if isinstance(number, float) else Fraction(int(number))
    return fmpq(exact.numerator, exact.denominator)


def as_float(number: fmpq) -> float:
    """The float64 next to a rational number."""
    return int(number.p) / int(number.q)


def polynomial_matrix(monomials: Sequence[Sequence[int]], coefficients: Sequence[Any]) -> Matrix:
    """sum_k p^(monomials[k]) coefficients[k] for one parameter p."""
    rows, columns = len(coefficients[0]), len(coefficients[0][0])
    size = max(power for (power,) in monomials) + 1
    out = [[[fmpq(0)] * size for _ in range(columns)] for _ in range(rows)]
    for (power,), matrix in zip(monomials, coefficients, strict=True):
        for i in range(rows):
            for j in range(columns):
                out[i][j][power] += rational(matrix[i][j])
    return [[fmpq_poly(entry) for entry in row] for row in out]


def derivative(matrix: Matrix) -> Matrix:
    """Entrywise derivative."""
    return [[entry.derivative() for entry in row] for row in matrix]


def transpose(matrix: Matrix) -> Matrix:
    """The transpose."""
    return [list(column) for column in zip(*matrix, strict=True)]


def add(*matrices: Matrix) -> Matrix:
    """The sum."""
    return [[sum(cells[1:], cells[0]) for cells in zip(*rows, strict=True)] for rows in zip(*matrices, strict=True)]


def scale(matrix: Matrix, factor: Any) -> Matrix:
    """Every entry times a rational number or polynomial."""
    return [[entry * factor for entry in row] for row in matrix]


def multiply(left: Matrix, right: Matrix) -> Matrix:
    """The matrix product."""
    columns = transpose(right)
    return [
        [sum((a * b for a, b in zip(row, column, strict=True)), fmpq_poly([0])) for column in columns] for row in left
    ]


def first_failure(matrix: Matrix, depth: int = 14) -> fmpq | None:
    r"""None if the symmetric matrix is positive definite at every t in [0, 1]; else a t at which the proof fails.

    M(t) = sum_k B_k(t) M_k with Bernstein polynomials B_k >= 0 that sum to one: all M_k > 0 proves M > 0 on the interval,
    and M_0, M_d are the values at its ends. An interval that decides nothing is halved. Complete for a strict inequality,
    and every step is exact.
    """
    degree = max(entry.degree() for row in matrix for entry in row)
    waiting = [(fmpq(0), fmpq(1), bernstein(matrix, max(degree, 0)), 0)]
    while waiting:
        low, high, points, level = waiting.pop()
        if not is_positive_definite(points[0]):
            return low
        if not is_positive_definite(points[-1]):
            return high
        if all(is_positive_definite(point) for point in points[1:-1]):
            continue
        middle = (low + high) / 2
        if level == depth:
            return middle
        left, right = halve(points)
        waiting += [(middle, high, right, level + 1), (low, middle, left, level + 1)]
    return None


def bernstein(matrix: Matrix, degree: int) -> list[Matrix]:
    """Bernstein coefficients on [0, 1]: M_i = sum_k C(i,k)/C(d,k) a_k."""
    return [
        [
            [sum((entry[k] * fmpq(comb(i, k), comb(degree, k)) for k in range(i + 1)), fmpq(0)) for entry in row]
            for row in matrix
        ]
        for i in range(degree + 1)
    ]


def halve(points: list[Matrix]) -> tuple[list[Matrix], list[Matrix]]:
    """De Casteljau: the Bernstein coefficients of both halves."""
    half = fmpq(1, 2)
    left, right = [points[0]], [points[-1]]
    while len(points) > 1:
        points = [scale(add(a, b), half) for a, b in pairwise(points)]
        left.append(points[0])
        right.append(points[-1])
    return left, right[::-1]


def is_positive_definite(matrix: Matrix) -> bool:
    """Symmetric with all pivots positive (Sylvester's criterion by elimination). Entries are rational numbers.

    Without symmetry the criterion says nothing: P = -A^-1 makes P A + (P A)' = -2 I for an unstable A as well.
    """
    if any(matrix[i][j] != matrix[j][i] for i in range(len(matrix)) for j in range(i)):
        return False
    rows = [list(row) for row in matrix]
    for k in range(len(rows)):
        if not rows[k][k] > 0:
            return False
        for i in range(k + 1, len(rows)):
            factor = rows[i][k] / rows[k][k]
            rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k], strict=True)]
    return True
