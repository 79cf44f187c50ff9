"""Plant, gains and any exact polynomial of the parameters on all cells of a table at once (`synthesis.polynomials.boxes`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from flint import arb, fmpq, fmpq_mat

from estimators.arrays import FloatArray
from synthesis.loop.plant import Axis
from synthesis.loop.system import Region
from synthesis.polynomials.boxes import EPS, Boxes, constants, orders
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import as_float

HIGHEST = {1: 8, 2: 7, 3: 6}  # total degree that is kept, by the number of parameters
MOST_BOXES = 20_000


def local(matrix: PolynomialMatrix, cells: Sequence[Region]) -> Boxes:
    """A polynomial in u (balls or rationals) in the local variables t of every cell, u = offset + factor t."""
    count = matrix.variables
    degrees = tuple(int(d) for d in matrix.degrees)
    middle = np.zeros((*(d + 1 for d in degrees), *matrix.shape))
    radius = np.zeros(matrix.shape)
    for powers, entries in matrix.terms.items():
        value, spread = _floats(entries)
        middle[tuple(int(k) for k in powers)] = value
        radius += spread
    size = np.abs(middle).sum(axis=tuple(range(count)))
    offset, factor = (
        np.array([[_float(x) for x in side[:count]] for side in sides]).reshape(len(cells), count)
        for sides in ([cell.offset for cell in cells], [cell.factor for cell in cells])
    )
    moved = np.broadcast_to(middle, (len(cells), *middle.shape))
    for axis, degree in enumerate(degrees):
        change = np.zeros((len(cells), degree + 1, degree + 1))  # column k: coefficients of (offset + factor t)^k
        column = np.zeros((len(cells), degree + 1))
        column[:, 0] = 1.0
        for k in range(degree + 1):
            change[:, :, k] = column
            shifted = np.concatenate([np.zeros((len(cells), 1)), column[:, :-1]], axis=1)
            column = offset[:, axis, None] * column + factor[:, axis, None] * shifted
        flat = np.moveaxis(moved, axis + 1, 1)
        moved = np.moveaxis((change @ flat.reshape(len(cells), degree + 1, -1)).reshape(flat.shape), 1, axis + 1)
    # |offset| + |factor| <= 1: every column sums to one at most, and each of its steps rounds three times.
    radius = radius + EPS * (4 * sum(degrees) + 16) * size
    return _boxes(moved, radius, count)


def gains(
    table: Mapping[tuple[int, ...], fmpq_mat],
    breakpoints: Sequence[Sequence[fmpq]],
    axes: Sequence[Axis],
    cells: Sequence[Region],
    rounding: FloatArray,
) -> Boxes:
    """The multilinear gain on every region (each in one cell of the table), from the exact corners of its cell.

    On a cell it is the sum over its corners of the gain there times prod (1 +- t_i)/2; a part of it is t = offset + factor s.
    """
    count, first = len(breakpoints), next(iter(table.values()))
    shape = first.nrows(), first.ncols()
    numbers: dict[tuple[int, ...], FloatArray] = {}  # of the corners that are met
    scaled = [[axis.scaled(x) for x in line] for axis, line in zip(axes, breakpoints, strict=True)]
    moved = np.empty((len(cells), *(2,) * count, *shape))
    offset, factor = np.empty((len(cells), count)), np.empty((len(cells), count))
    for g, cell in enumerate(cells):
        low = []
        for i, line in enumerate(scaled):
            k = next(j for j in range(len(line) - 1) if cell.offset[i] <= line[j + 1])
            low.append(k)
            middle, half = (line[k] + line[k + 1]) / 2, (line[k + 1] - line[k]) / 2
            offset[g, i], factor[g, i] = _float((cell.offset[i] - middle) / half), _float(cell.factor[i] / half)
        for corner in product((0, 1), repeat=count):
            index = tuple(k + c for k, c in zip(low, corner, strict=True))
            if index not in numbers:
                numbers[index] = np.array([_float(x) for x in table[index].entries()]).reshape(shape)
            moved[(g, *corner)] = numbers[index]
    size = np.abs(moved).sum(axis=tuple(range(1, count + 1)))
    for axis in range(count):
        left, right = np.take(moved, 0, axis=axis + 1), np.take(moved, 1, axis=axis + 1)
        spread = (len(cells), *(1,) * (left.ndim - 1))
        slope = 0.5 * (right - left)
        start = 0.5 * (left + right) + offset[:, axis].reshape(spread) * slope
        moved = np.stack([start, factor[:, axis].reshape(spread) * slope], axis=axis + 1)
    return _boxes(moved, EPS * (8 * count + 8) * size + rounding, count)


def rounding_of(radii: Mapping[tuple[int, int], Any], shape: tuple[int, int]) -> FloatArray:
    """Upper bounds as floats."""
    return np.array([[_above(radii[i, j]) for j in range(shape[1])] for i in range(shape[0])]).reshape(shape)


def unit(size: int, axes: Sequence[Axis]) -> Boxes:
    """The unit matrix."""
    return constants(np.eye(size), len(axes), HIGHEST[len(axes)])


def _boxes(tensor: FloatArray, radius: FloatArray, count: int) -> Boxes:
    """From coefficients (g, d_1+1, .., d_p+1, rows, columns); what lies above the highest degree widens the radius."""
    highest = HIGHEST[count]
    table = orders(count, highest)
    shape = tensor.shape[-2:]
    middle = np.zeros((len(tensor), len(table.powers), *shape))
    radius = np.broadcast_to(radius, (len(tensor), *shape)).copy()
    place = {powers: number for number, powers in enumerate(table.powers)}
    for powers in np.ndindex(*tensor.shape[1 : 1 + count]):
        part = tensor[(slice(None), *powers)]
        if powers in place:
            middle[:, place[powers]] = part
        elif part.any():
            radius += np.abs(part)
    return Boxes(middle, radius * (1.0 + 1e-9), count, highest)


def _floats(entries: Any) -> tuple[FloatArray, FloatArray]:
    shape = entries.nrows(), entries.ncols()
    values = [_float(x.mid() if isinstance(x, arb) else x) for x in entries.entries()]
    radii = [_above(x.rad()) if isinstance(x, arb) else 0.0 for x in entries.entries()]
    middle = np.array(values).reshape(shape)
    return middle, np.array(radii).reshape(shape) + 2 * EPS * np.abs(middle)


def _float(x: Any) -> float:
    return float(x) if isinstance(x, arb) else as_float(x)


def _above(x: Any) -> float:
    return float(arb(x).abs_upper()) * (1.0 + 1e-9)
