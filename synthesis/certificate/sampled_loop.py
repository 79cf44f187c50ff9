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
from synthesis.loop.observer import ObserverLoop
from synthesis.loop.system import Region, System, Time

PARTS = {1: 4}  # of every cell, along every parameter; 2 for more parameters
MATRICES = ("A", "C", "coasting", "denominator")
GROUPS = ("B", "D")


@dataclass(frozen=True)
class SampledLoop:
    """The closed loop in the states diag(scale) x; `grid` (g, p) holds the scaled parameters where it is looked at."""

    loop: ObserverLoop
    scale: FloatArray
    time: Time
    _rows: dict[tuple[float, ...], dict[Any, FloatArray]] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def grid(self) -> FloatArray | None:
        """Corners of the cells and places between them; None where a cell cannot be enclosed."""
        count = len(self.loop.plant.axes)
        line = np.linspace(-1.0, 1.0, PARTS.get(count, 2) + 1)
        local = np.array(list(product(line, repeat=count))).reshape(len(line) ** count, count)
        for region in self.loop.cells():
            if not self._fill(region, local):
                return None
        return np.array(list(self._rows)).reshape(len(self._rows), count)

    def at(self, places: FloatArray) -> System:
        """The system at scaled parameters (g, p), every matrix `Samples`."""
        keys = [_key(place) for place in places]
        for key in keys:
            if key not in self._rows:
                self._fill(self._standing(key), np.zeros((1, len(key))))
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
        )

    def _standing(self, key: tuple[float, ...]) -> Region:
        zeros = (fmpq(0),) * len(key)
        return Region((*(fmpq(*value.as_integer_ratio()) for value in key), *zeros), (*zeros, *zeros))

    def _fill(self, region: Region, local: FloatArray) -> bool:
        """Remember the system at local coordinates (g, p) of a region."""
        exact = self.loop.system(region, self.time)
        if exact is None:
            return False
        system, count = in_scaled_states(exact, self.scale), region.parameters
        offset, factor = (
            np.array([int(x.p) / int(x.q) for x in side[:count]]) for side in (region.offset, region.factor)
        )
        points = np.hstack([local, np.zeros_like(local)])
        found: dict[Any, FloatArray] = {}
        for name in MATRICES:
            if getattr(system, name) is not None:
                found[name] = getattr(system, name).at(points)[..., 0]
        for letter in GROUPS:
            matrices: Mapping[str, Any] = getattr(system, letter)
            found |= {(letter, group): matrix.at(points)[..., 0] for group, matrix in matrices.items()}
        for index, place in enumerate(offset + factor * local):
            self._rows.setdefault(_key(place), {name: values[index] for name, values in found.items()})
        return True


def _key(place: FloatArray) -> tuple[float, ...]:
    """Corners that neighbouring cells share are one place, although they were rounded separately."""
    return tuple(float(x) for x in np.round(place, 12))
