"""Multilinear tables on a box between their breakpoints, as exact polynomials; and polynomials of them as polynomials of u."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise, product
from typing import Any

from flint import fmpq, fmpq_mat

from synthesis.polynomials.enclosure import PolynomialMatrix, Powers, constant, variable

Point = tuple[fmpq, ...]


def boxes(lines: Sequence[Sequence[fmpq]]) -> list[tuple[Point, Point]]:
    """Middles and half widths of the cells of a grid, the last variable's running fastest."""
    edges = [[((a + b) / 2, (b - a) / 2) for a, b in pairwise(line)] for line in lines]
    return [(tuple(m for m, _ in cell), tuple(h for _, h in cell)) for cell in product(*edges)]


def multilinear(
    lines: Sequence[Sequence[fmpq]],
    value: Callable[[tuple[int, ...]], fmpq],
    places: Sequence[int],
    middle: Sequence[fmpq],
) -> PolynomialMatrix:
    """A table over the variables number `places` (breakpoints `lines`, values by indices) on its cell around `middle`.

    A breakpoint that stands twice has no cell of its own: on either side one of its values counts.
    """
    count, one = len(middle), constant(fmpq_mat([[1]]), len(middle))
    low = [
        next(k for k, (a, b) in enumerate(pairwise(line)) if a < middle[i] < b)
        for i, line in zip(places, lines, strict=True)
    ]
    shares = []  # of the lower and the upper end, along every variable
    for i, line, k in zip(places, lines, low, strict=True):
        upper = (variable(i, count) - one * line[k]) * (1 / (line[k + 1] - line[k]))
        shares.append((one - upper, upper))
    total = PolynomialMatrix({}, (1, 1), count)
    for corner in product((0, 1), repeat=len(lines)):
        term = one * value(tuple(k + c for k, c in zip(low, corner, strict=True)))
        for share, c in zip(shares, corner, strict=True):
            term = term.scaled_by(share[c])
        total = total + term
    return total


def composed(matrix: PolynomialMatrix, tables: Sequence[PolynomialMatrix], parameters: int) -> PolynomialMatrix:
    """A polynomial in (u_1..u_p, t_1..t_m), with a polynomial in u for each t."""
    parts: dict[Powers, dict[Powers, Any]] = {}
    for powers, entries in matrix.terms.items():
        parts.setdefault(tuple(powers[parameters:]), {})[tuple(powers[:parameters])] = entries
    total = PolynomialMatrix({}, matrix.shape, parameters)
    for powers, terms in parts.items():
        term = PolynomialMatrix(terms, matrix.shape, parameters)
        for table, power in zip(tables, powers, strict=True):
            for _ in range(power):
                term = term.scaled_by(table)
        total = total + term
    kept = {powers: m for powers, m in total.terms.items() if any(x != 0 for x in m.entries())}
    return PolynomialMatrix(kept, matrix.shape, parameters)
