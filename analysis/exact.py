"""Exact rational matrices, for proofs that must not depend on rounding. Floats are read bit for bit."""

from __future__ import annotations

from typing import Any, TypeAlias

from flint import fmpq, fmpq_mat, fmpq_poly

from estimators.arrays import FloatArray
from synthesis.polynomials.rational import as_float, is_positive_definite, rational

Rational: TypeAlias = Any  # flint.fmpq_mat; flint has no type stubs


def rationals(array: FloatArray) -> Rational:
    """A matrix of floats as exact rationals."""
    return fmpq_mat(array.shape[0], array.shape[1], [rational(float(x)) for x in array.ravel()])


def congruence(left: Rational, middle: Rational) -> Rational:
    """left middle left'."""
    return left * middle * left.transpose()


def total(matrices: list[Rational]) -> Rational:
    """The sum of at least one matrix."""
    out = matrices[0]
    for matrix in matrices[1:]:
        out = out + matrix
    return out


def is_positive(matrix: Rational) -> bool:
    """Positive definite by Sylvester's criterion."""
    rows = [[matrix[i, j] for j in range(matrix.ncols())] for i in range(matrix.nrows())]
    return is_positive_definite(rows)


def as_float_up(number: Any) -> float:
    """The least float not below a rational number (so that a bound stays a bound)."""
    from math import inf, nextafter

    value = as_float(number)
    return value if rational(value) >= number else nextafter(value, inf)


def absolute(number: Any) -> Any:
    """|x| of a rational number."""
    return number if number >= fmpq(0) else -number


def eigenvalues(matrix: Rational) -> list[Any]:
    """Eigenvalues, once each, as certified balls (flint's acb); those that are real have the imaginary part 0."""
    return [root for root, _ in fmpq_poly(matrix.charpoly().coeffs()).complex_roots()]


def radius_below_one(matrix: FloatArray) -> bool | None:
    """Whether all eigenvalues of a matrix (d, d), as it is stored, lie inside the unit circle; None for one that touches it."""
    roots = eigenvalues(rationals(matrix))
    if all(root.abs_upper() < 1 for root in roots):
        return True
    return False if any(root.abs_lower() > 1 for root in roots) else None
