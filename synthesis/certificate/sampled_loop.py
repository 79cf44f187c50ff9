"""A loop at many places of its parameters at once, in floats and scaled states: what a search evaluates its inequalities on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
from flint import fmpq

from estimators.arrays import FloatArray
from synthesis.certificate.unknowns import in_scaled_states
from synthesis.lmi.samples import Samples
from synthesis.loop.loop import Loop
from synthesis.loop.on_boxes import MOST_BOXES
from synthesis.loop.system import Region, System, Time
from synthesis.polynomials.boxes import Boxes, orders
from synthesis.polynomials.half_spaces import Faces
from synthesis.polynomials.rational import as_float

MOST_PLACES = 4000  # of the parameters; larger tables are looked at in the corners of their cells only
AT_ONCE = 2000  # cells of a table with more than MOST_BOXES of them, or places
FEW = 50  # places that are worked out one by one
MOST_STANDING = 600  # places of a rational plant that are looked at one by one
INSIDE = 1e-7  # of a cell of a plant that jumps, from its border
MATRICES = ("A", "C", "coasting", "denominator")
GROUPS = ("B", "D")


@dataclass(frozen=True)
class SampledLoop:
    """The closed loop in the states diag(scale) x; `grid` (g, p) holds the scaled parameters where it is looked at."""

    loop: Loop
    scale: FloatArray
    time: Time
    points: int | None = None  # of every cell and parameter
    on_boxes: dict[str, System | None] = field(default_factory=dict, repr=False, compare=False)
    _rows: dict[tuple[float, ...], dict[Any, FloatArray]] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def grid(self) -> FloatArray | None:
        """Corners of the cells and places between them that are in the set, and where its border crosses the lines between.

        None where a cell cannot be enclosed.
        """
        count, cells = len(self.loop.plant.axes), list(self.loop.cells())
        parts = self.points - 1 if self.points is not None else 4 if count == 1 else 2
        line = np.linspace(-1.0, 1.0, (parts if len(cells) * (parts + 1) ** count <= MOST_PLACES else 1) + 1)
        if not self.loop.plant.is_continuous:  # the corner of a cell is another place than that of the next one
            line = line * (1.0 - INSIDE)
        local = np.array(list(product(line, repeat=count))).reshape(len(line) ** count, count)
        if not self.loop.plant.is_polynomial and self.time == "discrete" and len(cells) * len(local) <= MOST_STANDING:
            if not self._fill_standing(cells, local):
                return None
        elif not self._fill_at_once(cells, local):
            for region in cells:
                if not self._fill(region, local):
                    return None
        found = np.array(list(self._rows)).reshape(len(self._rows), count)
        if not self.loop.plant.half_spaces:
            return found
        faces = Faces.of(self.loop.plant.half_spaces)
        lines = [np.unique(column) for column in found.T]
        return np.unique(np.concatenate([found[faces.inside(found)], faces.on_lines(lines)]), axis=0)

    def at(self, places: FloatArray) -> System:
        """The system at scaled parameters (g, p), every matrix `Samples`."""
        keys = _keys(places)
        missing = [self._standing(key) for key in dict.fromkeys(keys) if key not in self._rows]
        here = np.zeros((1, places.shape[1]))
        if len(missing) < FEW or not self._fill_parts(missing, here):
            for region in missing:
                self._fill(region, here)
        rows = [self._rows[key] for key in keys]

        def stacked(name: Any) -> Samples:
            return Samples.known(np.stack([row[name] for row in rows]))

        first = rows[0]
        groups = {letter: [name for name in first if name[0] == letter and len(name) == 2] for letter in GROUPS}
        return System(
            self.time,
            stacked("A"),
            {group: stacked((letter, group)) for letter, group in groups["B"]},
            stacked("C"),
            {group: stacked((letter, group)) for letter, group in groups["D"]},
            stacked("coasting") if "coasting" in first else None,
            stacked("denominator") if "denominator" in first else None,
            self.shared,
        )

    @cached_property
    def shared(self) -> bool:
        """Whether outputs are over the denominator, too."""
        system = self.loop.system(next(iter(self.loop.cells())), self.time)
        return system is not None and system.shared

    def _standing(self, key: tuple[float, ...]) -> Region:
        zeros = (fmpq(0),) * len(key)
        return Region((*(fmpq(*value.as_integer_ratio()) for value in key), *zeros), (*zeros, *zeros))

    def _fill_standing(self, cells: list[Region], local: FloatArray) -> bool:
        """Place by place: where cells are few and wide, the middle of an enclosed quotient is no good guess of it."""
        for offset, factor in zip(*_places(cells, local.shape[1]), strict=True):
            for key in _keys(offset + factor * local):
                if key not in self._rows and not self._fill(self._standing(key), np.zeros((1, len(key)))):
                    return False
        return True

    def _fill_at_once(self, cells: list[Region], local: FloatArray) -> bool:
        """All cells from the middles of their enclosures, where the loop has them; those of a large table part by part."""
        if len(cells) > MOST_BOXES:
            return self._fill_parts(cells, local)
        if self.time not in self.on_boxes:
            quick = getattr(self.loop, "on_boxes", None)
            self.on_boxes[self.time] = None if quick is None else quick(self.time, cells)
        return self._fill_boxes(self.on_boxes[self.time], cells, local)

    def _fill_parts(self, cells: list[Region], local: FloatArray) -> bool:
        quick = getattr(self.loop, "on_boxes", None)
        parts = (cells[start : start + AT_ONCE] for start in range(0, len(cells), AT_ONCE))
        return quick is not None and all(self._fill_boxes(quick(self.time, part), part, local) for part in parts)

    def _fill_boxes(self, system: System | None, cells: list[Region], local: FloatArray) -> bool:
        count = local.shape[1]
        if system is None:
            return False
        powers = np.array(orders(count, system.A.highest).powers)
        monomials = (local[:, None] ** powers).prod(axis=-1)
        left, right = self.scale[:, None], 1.0 / self.scale
        found: dict[Any, FloatArray] = {}

        def keep(name: Any, boxes: Boxes, factor: FloatArray) -> None:
            flat = monomials @ boxes.middle.reshape(len(boxes.middle), len(powers), boxes.shape[0] * boxes.shape[1])
            values = flat.reshape(len(boxes.middle), len(local), *boxes.shape) * factor
            found[name] = np.broadcast_to(values, (len(cells), *values.shape[1:])).reshape(
                len(cells) * len(local), *boxes.shape
            )

        keep("A", system.A, left * right)
        keep("C", system.C, right)
        if system.coasting is not None:
            keep("coasting", system.coasting, left * right)
        if system.denominator is not None:
            keep("denominator", system.denominator, np.ones(1))
        for group in system.B:
            keep(("B", group), system.B[group], left)
            keep(("D", group), system.D[group], np.ones(1))
        offset, factor = _places(cells, count)
        places = np.round((offset + factor * local).reshape(-1, count), 12)
        _, first = np.unique(places, axis=0, return_index=True)
        first = np.sort(first)
        for index, key in zip(first, _keys(places[first]), strict=True):
            self._rows[key] = {name: values[index] for name, values in found.items()}
        return all(np.isfinite(values).all() for values in found.values())

    def _fill(self, region: Region, local: FloatArray) -> bool:
        """Remember the system at local coordinates (g, p) of a region."""
        exact = self.loop.system(region, self.time)
        if exact is None:
            return False
        system, count = in_scaled_states(exact, self.scale), region.parameters
        offset, factor = (np.array([as_float(x) for x in side[:count]]) for side in (region.offset, region.factor))
        points = np.hstack([local, np.zeros_like(local)])
        found: dict[Any, FloatArray] = {}
        for name in MATRICES:
            if getattr(system, name) is not None:
                found[name] = getattr(system, name).at(points)[..., 0]
        for letter in GROUPS:
            matrices: Mapping[str, Any] = getattr(system, letter)
            found |= {(letter, group): matrix.at(points)[..., 0] for group, matrix in matrices.items()}
        for index, key in enumerate(_keys(offset + factor * local)):
            self._rows.setdefault(key, {name: values[index] for name, values in found.items()})
        return True


def _places(cells: list[Region], count: int) -> tuple[FloatArray, FloatArray]:
    """Middles and half widths (g, 1, count) of the cells."""
    offset, factor = (
        np.array([[as_float(x) for x in side[:count]] for side in sides])[:, None]
        for sides in ([cell.offset for cell in cells], [cell.factor for cell in cells])
    )
    return offset, factor


def _keys(places: FloatArray) -> list[tuple[float, ...]]:
    """Corners that neighbouring cells share are one place, although they were rounded separately."""
    return [tuple(place) for place in np.round(places, 12).tolist()]
