"""A plant that is another polynomial on each cell of a grid of its parameters, evaluated in float64 as it was proved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from math import prod
from typing import Any, NamedTuple, NoReturn

import numpy as np

from estimators.arrays import FloatArray, IndexArray
from estimators.errors import ScheduleError
from estimators.schedule.plant import chebyshev, scaling


class PlantByCells(NamedTuple):
    """M(p) = sum over (i, j, ..) of pieces[cell, i, j, ..] T_i(t_1) T_j(t_2) .., t = (p - middles[cell]) / halves[cell].

    `borders` (b_i,) are the inner ones of each parameter; a parameter on a border is in the cell above it.
    """

    borders: tuple[FloatArray, ...]
    middles: FloatArray  # (cells, parameters)
    halves: FloatArray
    pieces: FloatArray  # (cells, orders of each parameter, rows, columns)

    def local(self, parameters: FloatArray) -> tuple[IndexArray, FloatArray]:
        """Cells (n,) and coordinates t (n, parameters) in them, of parameters (n, parameters)."""
        number: IndexArray = np.zeros(len(parameters), dtype=np.intp)
        for column, border in zip(parameters.T, self.borders, strict=True):
            number = number * (len(border) + 1) + border.searchsorted(column, "right")
        return number, (parameters - self.middles.take(number, 0)) / self.halves.take(number, 0)

    def at(self, parameter: FloatArray) -> FloatArray:
        """M(p), leading axes as those of a polynomial: of one parameter all, of several without the last."""
        count = len(self.borders)
        values = np.asarray(parameter, dtype=np.float64)
        lead = values.shape if count == 1 else values.shape[:-1]
        number, t = self.local(values.reshape(-1, count))
        shape = self.pieces.shape
        flat = self.pieces.reshape(shape[0], prod(shape[1:-2]), shape[-2] * shape[-1])
        basis = chebyshev(t, shape[1:-2])
        return np.asarray((basis[:, None] @ flat.take(number, 0)).reshape(*lead, *shape[-2:]))

    @property
    def largest(self) -> FloatArray:
        """Bounds (rows, columns) of |M(p)| on the whole range, entry by entry."""
        return np.asarray(np.abs(self.pieces).sum(axis=tuple(range(1, self.pieces.ndim - 2))).max(axis=0))

    @property
    def coefficients(self) -> NoReturn:
        """There is no polynomial for the whole range.

        Raises:
            ScheduleError: always.
        """
        raise ScheduleError(
            "the plant of the schedule is a polynomial by cells (tables), what uses it here takes one polynomial; "
            "take LpvObserver"
        )


def plant_by_cells(plant: Mapping[str, Any], shapes: Mapping[str, tuple[int, int]]) -> dict[str, PlantByCells]:
    """The matrices from their stored form."""
    lines: Sequence[Sequence[float]] = plant["breakpoints"]
    borders = tuple(np.array(line[1:-1], dtype=np.float64) for line in lines)
    boxes = [[scaling(*pair) for pair in pairwise(line)] for line in lines]
    middles, halves = np.moveaxis(np.array(list(product(*boxes))).reshape(-1, len(lines), 2), 2, 0)
    found = {}
    for key, shape in shapes.items():
        stored = [cell[key] for cell in plant["cells"]]
        orders = np.array([order for one in stored for order in one["orders"]] or [[0] * len(lines)]).max(axis=0)
        pieces = np.zeros((len(stored), *(orders + 1), *shape))
        for cell, one in enumerate(stored):
            for order, matrix in zip(one["orders"], one["coefficients"], strict=True):
                pieces[(cell, *order)] = np.array(matrix, dtype=np.float64).reshape(shape)
        pieces.flags.writeable = False
        found[key] = PlantByCells(borders, middles, halves, pieces)
    return found
