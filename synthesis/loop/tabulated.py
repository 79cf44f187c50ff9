"""What every law with a table of gains shares: its cells, the multilinear gain on them, and what float64 rounds of both."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from itertools import pairwise, product
from typing import Any

import numpy as np
from flint import arb, fmpq, fmpq_mat

from estimators.arrays import IndexArray
from synthesis.loop.on_boxes import HIGHEST, MOST_BOXES, gains, local, rounding_of
from synthesis.loop.plant import Plant
from synthesis.loop.system import Region
from synthesis.polynomials import box_quotient, quotient
from synthesis.polynomials.boxes import Boxes
from synthesis.polynomials.enclosure import PolynomialMatrix, Powers
from synthesis.polynomials.half_spaces import Point

ROUNDING = fmpq(1, 2**50)  # of float64, with room: every rounding below costs at most 2^-53 of what is rounded


class Tabulated:
    """Cells and gains of a loop that has a plant, breakpoints and a table (a mapping from grid indices to matrices)."""

    plant: Plant
    breakpoints: tuple[tuple[fmpq, ...], ...]
    table: Mapping[tuple[int, ...], fmpq_mat]
    rounded: bool

    def cells(self) -> Iterator[Region]:
        """The boxes between neighbouring breakpoints (of table and plant), without those wholly outside the set."""
        borders = self.plant.lines or ((),) * len(self.breakpoints)
        edges = [
            [(axis.scaled(low), axis.scaled(high)) for low, high in pairwise(sorted({*points, *more}))]
            for axis, points, more in zip(self.plant.axes, self.breakpoints, borders, strict=True)
        ]
        for cell in product(*edges):
            region = Region.between(tuple(low for low, _ in cell), tuple(high for _, high in cell))
            if not self.plant.misses(region.offset, region.factor):
                yield region

    def gain(self, region: Region) -> PolynomialMatrix:
        """The multilinear gain on a region that lies in one cell."""
        axes, count = self.plant.axes, region.parameters
        cell, weights = [], []
        for i, (axis, points) in enumerate(zip(axes, self.breakpoints, strict=True)):
            middle = region.offset[i] * axis.half + axis.middle
            k = next(j for j in range(len(points) - 1) if middle <= points[j + 1])
            cell.append(k)
            low, high = axis.scaled(points[k]), axis.scaled(points[k + 1])
            ends = (region.offset[i] - low) / (high - low), region.factor[i] / (high - low)
            weights.append(((1 - ends[0], -ends[1]), ends))
        terms: dict[Powers, fmpq_mat] = {}
        for corner in product((0, 1), repeat=count):
            value = self.table[tuple(k + c for k, c in zip(cell, corner, strict=True))]
            for powers in product((0, 1), repeat=count):
                factor = fmpq(1)
                for i in range(count):
                    factor *= weights[i][corner[i]][powers[i]]
                if factor != 0:
                    place = (*powers, *(0,) * count)
                    terms[place] = terms[place] + value * factor if place in terms else value * factor
        found = PolynomialMatrix(terms, self._gain_shape, 2 * count).balls()
        return found.inflated(lambda i, j: self._gain_rounding[i, j].abs_upper()) if self.rounded else found

    def plant_on(self, region: Region, letters: str, divided: bool) -> dict[str, PolynomialMatrix] | None:
        """Plant matrices on a region: numerators, or `divided` by the denominator; None if that is not positive there."""
        here = self._plants[self.plant.number(region.offset)]
        plant = {key: region.local(here[key]) for key in letters}
        return quotient.quotients(plant, region.local(self._below)) if divided and self._below is not None else plant

    def _at_once(self, cells: Sequence[Region], letters: str, divided: bool) -> tuple[dict[str, Boxes], Boxes] | None:
        """`plant_on` and the gain on many regions; None where they are too many or too large for that."""
        axes = self.plant.axes
        if not 1 <= len(axes) <= max(HIGHEST) or len(cells) > MOST_BOXES:
            return None
        shape = self._gain_shape
        rounding = rounding_of(self._gain_rounding, shape) if self.rounded else np.zeros(shape)
        owners = np.array([self.plant.number(cell.offset) for cell in cells])
        plant: dict[str, Boxes] | None = {key: self._plants_local(key, cells, owners) for key in letters}
        if plant is not None and divided and self._below is not None:
            plant = box_quotient.quotients(plant, local(self._below, cells))
        return None if plant is None else (plant, gains(self.table, self.breakpoints, axes, cells, rounding))

    @cached_property
    def _gain_shape(self) -> tuple[int, int]:
        first = next(iter(self.table.values()))
        return first.nrows(), first.ncols()

    @cached_property
    def _gain_rounding(self) -> Any:
        """What interpolation in float64 may be off: of the values, and of slopes times rounded distances."""
        rows, columns = self._gain_shape
        steepest = fmpq(1)
        for axis, points in zip(self.plant.axes, self.breakpoints, strict=True):
            narrow = min(b - a for a, b in pairwise(points))
            steepest += max(abs(axis.low), abs(axis.high)) / narrow
        largest = [[max(abs(gain[i, j]) for gain in self.table.values()) for j in range(columns)] for i in range(rows)]
        return {(i, j): arb(largest[i][j] * steepest * ROUNDING * 4) for i in range(rows) for j in range(columns)}

    def _plants_local(self, key: str, cells: Sequence[Region], owners: IndexArray) -> Boxes:
        """One of the matrices on many regions, each in one cell of the plant."""
        places = [np.flatnonzero(owners == number) for number in np.unique(owners)]
        parts = [local(self._plants[owners[own[0]]][key], [cells[int(i)] for i in own]) for own in places]
        if len(parts) == 1:
            return parts[0]
        order = np.argsort(np.concatenate(places))
        middle, radius = (np.concatenate([getattr(part, k) for part in parts])[order] for k in ("middle", "radius"))
        return Boxes(middle, radius, parts[0].variables, parts[0].highest)

    @cached_property
    def _plants(self) -> list[dict[str, PolynomialMatrix]]:
        """Matrices (numerators) in u of every cell of the plant, as balls; uncertain by what float64 may be off."""
        return [
            {key: self._evaluated(matrix, box) for key, matrix in piece.matrices.items()}
            for *box, piece in self.plant.cells
        ]

    @cached_property
    def _below(self) -> PolynomialMatrix | None:
        """The denominator likewise; None where it is one."""
        return None if self.plant.is_polynomial else self._evaluated(self.plant.denominator)

    def _evaluated(self, matrix: PolynomialMatrix, box: Sequence[Point] = ()) -> PolynomialMatrix:
        if not self.rounded:
            return matrix.balls()
        # u = (p - middle) / half of a float64 p: the rounding of `middle` is felt in units of `half`, those of its cell.
        axes, summed = self.plant.axes, matrix
        halves = [axis.half for axis in axes]
        if self.plant.pieces:
            summed, halves = matrix.affine(*box), [h * f for h, f in zip(halves, box[1], strict=True)]
        argument = [
            ROUNDING * (1 + max(abs(axis.low), abs(axis.high)) / half) for axis, half in zip(axes, halves, strict=True)
        ]
        return matrix.balls().inflated(_evaluation_error(summed, argument, 0 if self.plant.is_polynomial else 1))


def _evaluation_error(matrix: PolynomialMatrix, argument: Sequence[fmpq], more: int) -> Any:
    """Bound, entry by entry, of coefficients, powers and argument in float64 for |u| <= 1; and of `more` roundings."""
    count = (sum(matrix.degrees) + 1) ** 2 + more

    def radius(i: int, j: int) -> Any:
        total = fmpq(0)
        for powers, entries in matrix.terms.items():
            size = abs(entries[i, j])
            total += size * (ROUNDING * count + sum((k * a for k, a in zip(powers, argument, strict=True)), fmpq(0)))
        return arb(total).abs_upper()

    return radius
