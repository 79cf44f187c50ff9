"""The cells that tables cut a plant's range in, and its matrices on each: exact numbers alone, for models and for proofs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import prod
from typing import Any

from flint import fmpq

from estimators.schedule.check_tables import MOST_CELLS
from synthesis.errors import ModelError
from synthesis.polynomials.multilinear import Point, boxes, composed, multilinear
from synthesis.polynomials.rational import decimal

MOST_PRODUCTS = 400_000  # of tables and parameters, on all cells together


def cell_lines(
    tables: Iterable[Mapping[str, Any]], ranges: Sequence[tuple[str, float, float]], where: str
) -> tuple[tuple[float, ...], ...]:
    """The grid of the plant's cells: of every parameter (name, min, max) the ends and all breakpoints of tables between them.

    Raises ModelError for more than MOST_CELLS cells.
    """
    inside: dict[str, set[float]] = {name: set() for name, _, _ in ranges}
    for table in tables:
        for name, line in zip(table["over"], table["breakpoints"], strict=True):
            inside[name] |= {float(x) for x in line}
    lines = tuple((low, *sorted(x for x in inside[name] if low < x < high), high) for name, low, high in ranges)
    count = prod(len(line) - 1 for line in lines)
    if count > MOST_CELLS:
        raise ModelError(
            f"{where}: the tables cut the range in {count} cells, at most {MOST_CELLS} are proved; thin them"
        )
    return lines


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

    Tables are given as `LookupTable.plain`; `names` are those of the parameters. Raises ModelError for too much work.
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
