"""From symbolic matrices to exact polynomials over one common denominator, in parameters scaled to [-1, 1].

With p = middle + half_width u every coefficient belongs to a term that is at most one on the range. In powers of p itself the
coefficients of a range far from zero cancel: (p - 635.15)^5 on [634.65, 635.65] has terms of 1e14 that add up to one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp
from flint import fmpq, fmpq_mat

from estimators.arrays import FloatArray
from synthesis.errors import ModelError
from synthesis.models.param import Constant, SchedulingParameter
from synthesis.polynomials.definite import sign_on_box
from synthesis.polynomials.enclosure import PolynomialMatrix, Powers
from synthesis.polynomials.matrix import MatrixPolynomial
from synthesis.polynomials.positivity import prove_positive
from synthesis.polynomials.rational import as_float, decimal

MATRICES = ("A", "B", "C", "D", "E", "F")


@dataclass(frozen=True)
class ExactModel:
    """The matrices (by their letters) as numerators over one denominator, exact rationals in the scaled parameters u."""

    matrices: Mapping[str, PolynomialMatrix]
    denominator: PolynomialMatrix


@dataclass(frozen=True)
class PolynomialModel:
    """Matrices as numerator(u) / denominator(u), float64, with p = middle + half_width u and u in [-1, 1]^p.

    Every array has the shape (d_1+1, ..., d_p+1, rows, columns), powers of u; `denominator` has 1 x 1 entries and is
    positive on the whole range. A polynomial model has denominator 1.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    E: FloatArray
    F: FloatArray
    denominator: FloatArray

    @property
    def parameters(self) -> int:
        """Number of scheduling parameters."""
        return self.A.ndim - 2

    @property
    def is_polynomial(self) -> bool:
        """Whether the common denominator is one."""
        return self.denominator.size == 1

    def with_states_scaled(self, scale: FloatArray) -> PolynomialModel:
        """The model in the states diag(scale) x."""
        return replace(
            self,
            A=self.A * scale[:, None] / scale,
            B=self.B * scale[:, None],
            C=self.C / scale,
            E=self.E * scale[:, None],
        )


def extract(
    where: str,
    symbolic: Mapping[str, sp.Matrix],
    parameters: Sequence[SchedulingParameter],
    constants: Mapping[str, Constant],
) -> ExactModel:
    """Substitute constants, clear denominators and collect coefficients; `where` names the model in messages.

    Numbers are the decimals that are written (0.1 is one tenth); irrational ones are taken at 17 digits.
    """
    # Symbols are known by their names: assumptions a user put on them (real, positive) are of no interest here.
    symbolic = {
        key: matrix.subs({symbol: sp.Symbol(symbol.name) for symbol in matrix.free_symbols})
        for key, matrix in symbolic.items()
    }
    generators = [sp.Symbol(p.name) for p in parameters]
    values = {sp.Symbol(name): sp.Rational(str(c.value)) for name, c in constants.items()}
    matrices = {key: symbolic[key].subs(values) for key in MATRICES}
    zeros = {symbol for symbol, value in values.items() if value == 0}
    for key, matrix in matrices.items():
        for (i, j), entry in zip(np.ndindex(*matrix.shape), matrix, strict=True):
            if entry.has(sp.zoo, sp.nan) and zeros & symbolic[key][i, j].free_symbols:
                names = ", ".join(sorted(str(s) for s in zeros & symbolic[key][i, j].free_symbols))
                raise ModelError(
                    f"{where}: {key}[{i},{j}] = {symbolic[key][i, j]} divides by zero: {names} = 0; give another value"
                )
    fractions = {
        key: [[_fraction(entry, generators, f"{where}: {key}[{i},{j}]") for j, entry in enumerate(row)]
              for i, row in enumerate(matrix.tolist())]
        for key, matrix in matrices.items()
    }  # fmt: skip
    denominator = sp.Integer(1)
    for rows in fractions.values():
        for row in rows:
            for _, below in row:
                denominator = sp.lcm(denominator, below)
    middle = {g: sp.Rational(*decimal_pair(p)) for g, p in zip(generators, parameters, strict=True)}
    size = sp.expand(denominator).subs(middle)
    if size == 0:
        raise ModelError(f"{where}: a denominator vanishes at the middle of the range; shrink the range")
    denominator = sp.expand(denominator / size)  # one where the range has its middle: positive if it has no root
    exact = {}
    for key, rows in fractions.items():
        numerators = [
            [
                above if denominator == below == 1 else sp.expand(sp.cancel(above * denominator / below))
                for above, below in row
            ]
            for row in rows
        ]
        exact[key] = _polynomial(numerators, matrices[key].shape, generators, parameters)
    below = _polynomial([[denominator]], (1, 1), generators, parameters)
    _check_denominator(where, parameters, below)
    return ExactModel(exact, below)


def in_floats(exact: ExactModel) -> PolynomialModel:
    """The coefficients correctly rounded. Raises ModelError for one beyond the range of numbers."""
    try:
        arrays = {key: _array(matrix) for key, matrix in exact.matrices.items()}
        return PolynomialModel(denominator=_array(exact.denominator), **arrays)
    except OverflowError:
        beyond = "a coefficient is beyond 1e308; choose other units, or smaller ranges and constants"
        raise ModelError(f"the model's matrices over its ranges: {beyond}") from None


def decimal_pair(parameter: SchedulingParameter) -> tuple[int, int]:
    """Numerator and denominator of the exact middle of the range."""
    middle = (decimal(parameter.minimum) + decimal(parameter.maximum)) / 2
    return int(middle.p), int(middle.q)


def _rational(number: sp.Expr) -> sp.Rational:
    """A number as the decimals that it shows."""
    return number if number.is_Rational else sp.Rational(str(sp.N(number, 17)))


def _fraction(entry: sp.Expr, generators: list[sp.Symbol], where: str) -> tuple[sp.Expr, sp.Expr]:
    if entry.has(sp.nan, sp.oo, -sp.oo, sp.zoo, sp.I):
        raise ModelError(f"{where} = {entry} is not a finite real expression")
    written = entry.replace(lambda e: e.is_Float, lambda e: sp.Rational(str(e)))
    if written.is_polynomial(*generators):  # by its form: the way through fractions takes ten times as long
        above, below = sp.expand(written), sp.Integer(1)
    else:
        above, below = sp.fraction(sp.cancel(sp.together(written)))
    for part in (above, below):
        if not part.is_polynomial(*generators):
            raise ModelError(f"{where} = {entry} is neither polynomial nor rational in the parameters")
    if (above.free_symbols | below.free_symbols) - set(generators):
        raise ModelError(f"{where} = {entry} still contains a symbol without value")
    return above, below


def _polynomial(
    rows: list[list[sp.Expr]],
    shape: tuple[int, int],
    generators: list[sp.Symbol],
    parameters: Sequence[SchedulingParameter],
) -> PolynomialMatrix:
    """Exact coefficients in u of a matrix whose entries are polynomials in p."""
    # A model without parameters still needs a variable for sympy to collect in; it never appears.
    variables = generators or [sp.Symbol("constant")]
    cells: dict[Powers, list[fmpq]] = {}
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            for powers, coefficient in sp.Poly(entry, *variables).terms():
                number = _rational(coefficient)
                place = cells.setdefault(tuple(powers[: len(generators)]), [fmpq(0)] * (shape[0] * shape[1]))
                place[i * shape[1] + j] = fmpq(int(number.p), int(number.q))
    terms = {powers: fmpq_mat(*shape, entries) for powers, entries in cells.items() if any(entries)}
    low, high = [decimal(p.minimum) for p in parameters], [decimal(p.maximum) for p in parameters]
    return PolynomialMatrix(terms, shape, len(generators)).affine(
        [(a + b) / 2 for a, b in zip(low, high, strict=True)], [(b - a) / 2 for a, b in zip(low, high, strict=True)]
    )


def _array(matrix: PolynomialMatrix) -> FloatArray:
    out = np.zeros((*(d + 1 for d in matrix.degrees), *matrix.shape))
    for powers, entries in matrix.terms.items():
        out[powers] = [[as_float(x) for x in row] for row in entries.tolist()]
    out.setflags(write=False)
    return out


def _check_denominator(where: str, parameters: Sequence[SchedulingParameter], denominator: PolynomialMatrix) -> None:
    if not any(denominator.degrees) or sign_on_box(denominator.balls()).positive:
        return
    size = MatrixPolynomial(_array(denominator)[..., None])
    found = prove_positive(size)
    if not found.proved:
        bad, good = np.array(found.place), np.zeros(len(parameters))  # one in the middle: it vanishes in between
        for _ in range(60):
            between = (bad + good) / 2
            bad, good = (bad, between) if size.at(between[None])[0, 0, 0, 0] > 0.0 else (between, good)
        place = ", ".join(
            f"{p.name} = {p.middle + p.half_width * u:.4g} {p.unit}" for p, u in zip(parameters, bad, strict=True)
        )
        raise ModelError(f"{where}: a denominator vanishes inside the range, near {place}; shrink the range")
