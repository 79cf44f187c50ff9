"""A model on the cells of its tables: on each of them its matrices are polynomials of the parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp
from flint import fmpq

from estimators.arrays import FloatArray, IndexArray
from synthesis.errors import ModelError
from synthesis.models.cells import cell_lines, on_cells
from synthesis.models.extract import MATRICES, ExactModel, PolynomialModel, extract, in_floats
from synthesis.models.numeric import owners
from synthesis.models.param import Constant, SchedulingParameter
from synthesis.models.table import LookupTable
from synthesis.polynomials.multilinear import Point
from synthesis.polynomials.rational import as_float


@dataclass(frozen=True)
class ModelPiece:
    """The model on a box u = offset + factor t, t in [-1, 1]^p, of its scaled parameters; polynomials in u."""

    offset: Point
    factor: Point
    exact: ExactModel

    @cached_property
    def polynomial(self) -> PolynomialModel:
        """`exact` as float64 coefficient arrays."""
        return in_floats(self.exact)

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """`offset` and `factor` in floats."""
        return np.array([as_float(x) for x in self.offset]), np.array([as_float(x) for x in self.factor])


@dataclass(frozen=True)
class Pieces:
    """All pieces, the last parameter's running fastest, and the borders between them: of every parameter, its ends among them."""

    lines: tuple[tuple[float, ...], ...]
    all: tuple[ModelPiece, ...]

    @property
    def borders(self) -> list[FloatArray]:
        """The inner borders of every parameter, scaled."""
        found = []
        for line in self.lines:
            low, high = line[0], line[-1]
            found.append((np.array(line[1:-1]) - 0.5 * (low + high)) / (0.5 * (high - low)))
        return found

    def owner(self, u: FloatArray) -> IndexArray:
        """The number of the piece that holds each of the scaled parameters (g, p)."""
        return owners(self.borders, u)

    @property
    def middle(self) -> ModelPiece:
        """The piece that holds the middle of the ranges."""
        return next(q for q in self.all if all(abs(o) <= f for o, f in zip(q.offset, q.factor, strict=True)))


def whole(parameters: Sequence[SchedulingParameter], exact: ExactModel) -> Pieces:
    """A model of one polynomial, or quotient, for the whole range."""
    piece = ModelPiece((fmpq(0),) * len(parameters), (fmpq(1),) * len(parameters), exact)
    return Pieces(tuple((p.minimum, p.maximum) for p in parameters), (piece,))


def pieces_of(
    where: str,
    symbolic: Mapping[str, sp.Matrix],
    parameters: Sequence[SchedulingParameter],
    constants: Mapping[str, Constant],
    tables: Mapping[str, LookupTable],
) -> Pieces:
    """The model on the cells of its tables. Raises ModelError for entries that divide by parameters or tables."""
    names = [sp.Symbol(name) for name in (*(p.name for p in parameters), *tables)]
    for key in MATRICES:
        for (i, j), entry in zip(np.ndindex(*symbolic[key].shape), symbolic[key], strict=True):
            if not entry.is_polynomial(*names):
                raise ModelError(
                    f"{where}: {key}[{i},{j}] = {entry} divides by a parameter or a table; a model with tables is a polynomial "
                    "of both: tabulate the quotient"
                )
    free = tuple(
        SchedulingParameter(name, table.unit, -1.0, 1.0, -math.inf, math.inf) for name, table in tables.items()
    )
    mixed = extract(where, symbolic, (*parameters, *free), constants)
    plain = [table.plain for table in tables.values()]
    lines = cell_lines(plain, [(p.name, p.minimum, p.maximum) for p in parameters], where)
    cells = on_cells(plain, [p.name for p in parameters], lines, mixed.matrices, where)
    one = mixed.denominator
    below = type(one)({(0,) * len(parameters): m for m in one.terms.values()}, (1, 1), len(parameters))
    return Pieces(lines, tuple(ModelPiece(offset, factor, ExactModel(m, below)) for offset, factor, m in cells))
