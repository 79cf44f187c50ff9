"""Plant, gains and any exact polynomial of the parameters on all cells of a table at once (`synthesis.polynomials.boxes`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from flint import arb, fmpq_mat

from estimators.arrays import FloatArray
from synthesis.loop.plant import Axis
from synthesis.loop.system import Region
from synthesis.polynomials.boxes import EPS, Boxes, constants, orders
from synthesis.polynomials.enclosure import PolynomialMatrix

HIGHEST = {1: 8, 2: 6, 3: 4}  # total degree that is kept, by the number of parameters
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


def gains(table: Mapping[tuple[int, ...], fmpq_mat], counts: Sequence[int], rounding: FloatArray) -> Boxes:
    """The multilinear gain on every cell: sum over its corners of the gain there times prod (1 +- t_i)/2."""
    shape = next(iter(table.values())).nrows(), next(iter(table.values())).ncols()
    values = np.empty((*counts, *shape))
    for index in np.ndindex(*counts):
        values[index] = np.array([_float(x) for x in table[index].entries()]).reshape(shape)
    count = len(counts)
    corners = [
        values[tuple(slice(c, n - 1 + c) for c, n in zip(corner, counts, strict=True))].reshape(-1, *shape)
        for corner in product((0, 1), repeat=count)
    ]
    moved = np.stack(corners, axis=1).reshape(-1, *(2,) * count, *shape)
    size = np.abs(moved).sum(axis=tuple(range(1, count + 1)))
    for axis in range(1, count + 1):
        low, high = np.take(moved, 0, axis=axis), np.take(moved, 1, axis=axis)
        moved = np.stack([0.5 * (low + high), 0.5 * (high - low)], axis=axis)
    return _boxes(moved, EPS * (count + 4) * size + rounding, count)


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
    return float(x) if isinstance(x, arb) else int(x.p) / int(x.q)


def _above(x: Any) -> float:
    return float(arb(x).abs_upper()) * (1.0 + 1e-9)
