"""Check a Lyapunov matrix exactly, such as a published one: over which parameter values does it prove what it should?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, get_args

from flint import fmpq, fmpq_poly

from estimators.display import Display
from estimators.errors import unknown
from synthesis.design.stability import Form
from synthesis.errors import ProblemError
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import (
    Matrix,
    add,
    decimal,
    derivative,
    multiply,
    polynomial_matrix,
    rational,
    scale,
    transpose,
)


@dataclass(frozen=True, repr=False)
class CertifiedRange(Display):
    """Open intervals of the parameter on which every inequality holds; `everywhere` on the whole range asked for."""

    intervals: tuple[tuple[float, float], ...]
    everywhere: bool


def check_certificate(
    model: LpvModel,
    gains: Sequence[Sequence[float | str]],
    lyapunov: Sequence[Any],
    form: Form = "primal",
    search: tuple[float, float] | None = None,
) -> CertifiedRange:
    """Where M > 0 and its Lyapunov inequality hold, for both bounds of the rate, in exact arithmetic.

    `lyapunov` holds the coefficients of M(p) as numbers or printed decimals; the inequality is A_e'M + M A_e + q M' < 0
    (primal) or A_e M + M A_e' - q M' < 0 (dual), with q at both rate bounds. The end points of the intervals are roots of
    leading principal minors, isolated by certified enclosures. `search` may extend the model's range.
    Raises ProblemError for a model with several parameters or a rational one.

    >>> import sympy as sp
    >>> model = LpvModel(
    ...     name="lag", source="example", states=(Signal("x", "1"),), outputs=(Signal("y", "1"),),
    ...     parameters=(SchedulingParameter("p", "1/s", 1.0, 2.0, -1.0, 1.0),),
    ...     A=sp.Matrix([[-sp.Symbol("p")]]), C=sp.Matrix([[1]]),
    ... )
    >>> check_certificate(model, gains=[[0.0]], lyapunov=[[[1.0]]]).everywhere
    True
    """
    if len(model.parameters) != 1 or not model.polynomial.is_polynomial:
        raise ProblemError(f"model '{model.name}': only polynomial models of one parameter can be checked exactly")
    (parameter,) = model.parameters
    if form not in get_args(Form):
        raise ProblemError(unknown("form", form, get_args(Form)))
    if parameter.may_jump:
        raise ProblemError(
            f"'{parameter.name}' may jump; a matrix that depends on it proves nothing then; bound its rate"
        )
    _check_numbers("gains", gains, (len(model.states), len(model.outputs)))
    for k, matrix in enumerate(lyapunov):
        _check_numbers(f"coefficient {k} of the matrix", matrix, (len(model.states),) * 2)
        if any(rational(matrix[i][j]) != rational(matrix[j][i]) for i in range(len(matrix)) for j in range(i)):
            raise ProblemError(f"coefficient {k} of the matrix is not symmetric; a Lyapunov matrix must be")
    low, high = search or (parameter.minimum, parameter.maximum)
    powers = [[k] for k in range(len(lyapunov))]
    M = polynomial_matrix(powers, lyapunov)
    middle, half = (decimal(parameter.maximum) + s * decimal(parameter.minimum) for s in (1, -1))
    u = fmpq_poly([-middle / half, 2 / half])
    plant = {
        key: [[in_powers(model.exact.matrices[key], i, j)(u) for j in range(columns)] for i in range(rows)]
        for key, (rows, columns) in (("A", model.A.shape), ("C", model.C.shape))
    }
    L = polynomial_matrix([[0]], [gains])
    A_e = add(plant["A"], scale(multiply(L, plant["C"]), fmpq(-1)))
    product = multiply(M, A_e) if form == "primal" else multiply(A_e, M)
    sign = 1 if form == "primal" else -1
    matrices = [M]
    for rate in (parameter.rate_minimum, parameter.rate_maximum):
        total = add(product, transpose(product), scale(derivative(M), sign * rational(rate)))
        matrices.append(scale(total, fmpq(-1)))
    return _intervals([minor for matrix in matrices for minor in leading_minors(matrix)], rational(low), rational(high))


def in_powers(matrix: PolynomialMatrix, row: int, column: int) -> fmpq_poly:
    """One entry of a matrix polynomial of one variable."""
    powers = [fmpq(0)] * (matrix.degrees[0] + 1)
    for (power,), entries in matrix.terms.items():
        powers[power] = entries[row, column]
    return fmpq_poly(powers)


def _check_numbers(what: str, matrix: Sequence[Sequence[float | str]], shape: tuple[int, int]) -> None:
    if len(matrix) != shape[0] or any(len(row) != shape[1] for row in matrix):
        raise ProblemError(f"{what} must have the shape {shape}")
    for row in matrix:
        for entry in row:
            try:
                rational(entry)
            except (ValueError, OverflowError, TypeError, AttributeError):
                raise ProblemError(f"{what}: {entry!r} is not a finite number or printed decimal") from None


def leading_minors(matrix: Matrix) -> list[fmpq_poly]:
    """Determinants of the leading square blocks; all positive means positive definite (Sylvester)."""
    return [_determinant([row[:size] for row in matrix[:size]]) for size in range(1, len(matrix) + 1)]


def _determinant(matrix: Matrix) -> fmpq_poly:
    """By expansion along the first row: exact, for the small matrices that papers print."""
    if len(matrix) == 1:
        return matrix[0][0]
    total = fmpq_poly([0])
    for j, entry in enumerate(matrix[0]):
        minor = [row[:j] + row[j + 1 :] for row in matrix[1:]]
        total += (-1) ** j * entry * _determinant(minor)
    return total


def _intervals(minors: list[fmpq_poly], low: fmpq, high: fmpq) -> CertifiedRange:
    """Cut [low, high] at every root and keep the pieces on which all minors are positive."""
    cuts = {low, high}
    for minor in minors:
        if minor.degree() < 1:
            continue
        for root, _ in minor.complex_roots():
            if root.imag == 0:
                middle = fmpq(*float(root.real.mid()).as_integer_ratio())
                if low < middle < high:
                    cuts.add(middle)
    edges = sorted(cuts)
    pieces: list[tuple[fmpq, fmpq]] = []
    for left, right in pairwise(edges):
        middle = (left + right) / 2
        if all(minor(middle) > 0 for minor in minors):
            pieces.append((left, right))  # never merged: every inner cut is a root, where strict positivity fails
    everywhere = (
        len(pieces) == 1 and pieces[0] == (low, high) and all(minor(x) > 0 for minor in minors for x in (low, high))
    )
    return CertifiedRange(tuple((float(a), float(b)) for a, b in pieces), everywhere)
