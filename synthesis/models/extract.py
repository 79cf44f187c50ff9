"""From symbolic matrices to coefficient arrays over one common denominator."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from synthesis.errors import ModelError
from synthesis.models.param import Constant, SchedulingParameter
from synthesis.polynomials.matrix import FloatArray, MatrixPolynomial
from synthesis.polynomials.positivity import prove_positive

MATRICES = ("A", "B", "C", "D", "E", "F")


@dataclass(frozen=True)
class PolynomialModel:
    """Matrices as numerator(p) / denominator(p).

    Every array has the shape (d_1+1, ..., d_p+1, rows, columns) in the physical parameters; `denominator` has
    1 x 1 entries and is positive on the whole range. A polynomial model has denominator 1.
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
) -> PolynomialModel:
    """Substitute constants, clear denominators and collect coefficients; `where` names the model in messages."""
    # Symbols are known by their names: assumptions a user put on them (real, positive) are of no interest here.
    symbolic = {
        key: matrix.subs({symbol: sp.Symbol(symbol.name) for symbol in matrix.free_symbols})
        for key, matrix in symbolic.items()
    }
    generators = [sp.Symbol(p.name) for p in parameters]
    values = {sp.Symbol(name): sp.Rational(str(c.value)) for name, c in constants.items()}
    matrices = {key: symbolic[key].subs(values) for key in MATRICES}
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
    middle = {g: sp.Rational(str(p.middle)) for g, p in zip(generators, parameters, strict=True)}
    size = sp.expand(denominator).subs(middle)
    if size == 0:
        raise ModelError(f"{where}: a denominator vanishes at the middle of the range; shrink the range")
    denominator = sp.expand(denominator / size)  # one where the range has its middle: positive if it has no root
    arrays = {}
    for key, rows in fractions.items():
        numerators = [[sp.expand(sp.cancel(above * denominator / below)) for above, below in row] for row in rows]
        arrays[key] = _coefficients(numerators, matrices[key].shape, generators)
    below = _coefficients([[denominator]], (1, 1), generators)
    _check_denominator(where, parameters, below)
    return PolynomialModel(denominator=below, **arrays)


def _fraction(entry: sp.Expr, generators: list[sp.Symbol], where: str) -> tuple[sp.Expr, sp.Expr]:
    if entry.has(sp.nan, sp.oo, -sp.oo, sp.zoo, sp.I):
        raise ModelError(f"{where} = {entry} is not a finite real expression")
    above, below = sp.fraction(sp.cancel(sp.together(entry)))
    for part in (above, below):
        if not part.is_polynomial(*generators):
            raise ModelError(f"{where} = {entry} is neither polynomial nor rational in the parameters")
    if (above.free_symbols | below.free_symbols) - set(generators):
        raise ModelError(f"{where} = {entry} still contains a symbol without value")
    return above, below


def _coefficients(rows: list[list[sp.Expr]], shape: tuple[int, int], generators: list[sp.Symbol]) -> FloatArray:
    # A model without parameters still needs a variable for sympy to collect in; it never appears.
    variables = generators or [sp.Symbol("constant")]
    polynomials = [[sp.Poly(entry, *variables) for entry in row] for row in rows]
    degrees = [0] * len(generators)
    for row in polynomials:
        for polynomial in row:
            degrees = [max(d, n, 0) for d, n in zip(degrees, polynomial.degree_list(), strict=False)]
    out = np.zeros((*(d + 1 for d in degrees), *shape))
    for i, row in enumerate(polynomials):
        for j, polynomial in enumerate(row):
            for powers, coefficient in polynomial.terms():
                out[(*powers[: len(generators)], i, j)] = float(coefficient)
    out.setflags(write=False)
    return out


def _check_denominator(where: str, parameters: Sequence[SchedulingParameter], denominator: FloatArray) -> None:
    if denominator.size == 1:
        return
    offsets = np.array([p.middle for p in parameters])
    factors = np.array([p.half_width for p in parameters])
    found = prove_positive(MatrixPolynomial(denominator[..., None]).affine(offsets, factors))
    if not found.proved:
        place = ", ".join(
            f"{p.name} = {o + f * u:.4g} {p.unit}"
            for p, o, f, u in zip(parameters, offsets, factors, found.place, strict=True)
        )
        raise ModelError(f"{where}: a denominator vanishes inside the range, near {place}; shrink the range")
