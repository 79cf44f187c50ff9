"""A model on the cells of its tables: on each of them its matrices are polynomials of the parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

import numpy as np
import sympy as sp
from flint import fmpq

from estimators.arrays import FloatArray
from synthesis.errors import ModelError
from synthesis.models.extract import MATRICES, ExactModel, PolynomialModel, extract, in_floats
from synthesis.models.param import Constant, SchedulingParameter
from synthesis.models.table import Table, cell_lines
from synthesis.polynomials.multilinear import Point, boxes, composed, multilinear
from synthesis.polynomials.rational import as_float, decimal

MOST_PRODUCTS = 400_000  # on all cells together


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


def scaled_lines(lines: Sequence[Sequence[float]], ranges: Sequence[tuple[fmpq, fmpq]]) -> tuple[tuple[fmpq, ...], ...]:
    """Breakpoints in u = (p - middle)/half, from those in p; `ranges` are middles and half widths."""
    return tuple(
        tuple((decimal(x) - middle) / half for x in line) for line, (middle, half) in zip(lines, ranges, strict=True)
    )


def on_cells(
    tables: Sequence[Mapping[str, Any]],
    names: Sequence[str],
    lines: Sequence[Sequence[float]],
    matrices: Mapping[str, Any],
    where: str,
) -> list[tuple[Point, Point, dict[str, Any]]]:
    """Matrices in (u, t), t the tables in order, on every cell of `lines` as polynomials in u: offset, factor, matrices.

    Tables are given as `Table.plain`; `names` are those of the parameters. Raises ModelError for too much work.
    """
    count = len(names)
    ranges = [
        ((decimal(line[0]) + decimal(line[-1])) / 2, (decimal(line[-1]) - decimal(line[0])) / 2) for line in lines
    ]
    read = []
    for table in tables:
        places = [names.index(name) for name in table["over"]]
        own = scaled_lines(table["breakpoints"], [ranges[i] for i in places])

        def value(index: tuple[int, ...], entry: Any = table["values"]) -> fmpq:
            for k in index:
                entry = entry[k]
            return decimal(float(entry))

        read.append((own, value, places))
    products = sum(1 + sum(powers[count:]) for m in matrices.values() for powers in m.terms)
    number = prod(len(line) - 1 for line in lines)
    if number * (products + len(tables)) > MOST_PRODUCTS:
        raise ModelError(
            f"{where}: {number} cells with {products} products of tables are too many to be worked out; thin the breakpoints"
        )
    found = []
    for offset, factor in boxes(scaled_lines(lines, ranges)):
        here = [multilinear(own, value, places, offset) for own, value, places in read]
        found.append((offset, factor, {key: composed(m, here, count) for key, m in matrices.items()}))
    return found


def pieces_of(
    where: str,
    symbolic: Mapping[str, sp.Matrix],
    parameters: Sequence[SchedulingParameter],
    constants: Mapping[str, Constant],
    tables: Mapping[str, Table],
) -> tuple[tuple[tuple[float, ...], ...], tuple[ModelPiece, ...]]:
    """The grid of the cells and the model on each. Raises ModelError for entries that divide by parameters or tables."""
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
    whole = extract(where, symbolic, (*parameters, *free), constants)
    plain = [table.plain for table in tables.values()]
    lines = cell_lines(plain, [(p.name, p.minimum, p.maximum) for p in parameters], where)
    cells = on_cells(plain, [p.name for p in parameters], lines, whole.matrices, where)
    one = whole.denominator
    below = type(one)({(0,) * len(parameters): m for m in one.terms.values()}, (1, 1), len(parameters))
    return lines, tuple(ModelPiece(offset, factor, ExactModel(m, below)) for offset, factor, m in cells)
