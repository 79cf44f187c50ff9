"""The box of parameter ranges that designs lie in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from analysis.checks import as_stack
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display

Ranges: TypeAlias = Mapping[str, Sequence[float]]


@dataclass(frozen=True, eq=False, repr=False)
class Box(Display):
    """Names of d parameters, with `low`, `high` and `nominal` values (d,).

    >>> import numpy as np
    >>> box = Box.of(around({"mass": 10.0, "damping": 2.0}, 0.2))
    >>> box.scaled(np.array([[0.0, 0.5]])).round(9).tolist()  # from shares of the ranges
    [[8.0, 2.0]]
    """

    names: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    nominal: FloatArray

    @classmethod
    def of(cls, ranges: Ranges) -> Box:
        """(minimum, maximum) by name, nominal in the middle. Raises AnalysisError for empty, reversed or infinite ranges."""
        if not ranges:
            raise AnalysisError("no parameter to vary; give at least one name with its range")
        pairs = np.empty((len(ranges), 2))
        for i, (name, pair) in enumerate(ranges.items()):
            array = as_stack(f"range of {name}", pair, ndim=1)
            if array.shape != (2,) or not array[0] < array[1]:
                raise AnalysisError(f"range of {name} is {pair}; give (minimum, maximum) with minimum < maximum")
            pairs[i] = array
        return cls(tuple(ranges), pairs[:, 0], pairs[:, 1], pairs.mean(axis=1))

    def scaled(self, points: FloatArray) -> FloatArray:
        """Points (..., d) of the unit cube in this box."""
        return np.asarray(self.low + points * (self.high - self.low))

    def columns(self, points: FloatArray) -> dict[str, FloatArray]:
        """Points (n, d) as one array (n,) a name: what a measure takes."""
        return {name: points[:, i] for i, name in enumerate(self.names)}


def around(nominal: Mapping[str, float], relative: float = 0.2) -> dict[str, tuple[float, float]]:
    """Ranges nominal (1 - relative) .. nominal (1 + relative), in ascending order. A nominal of 0 has none.

    >>> around({"mass": 10.0}, 0.2)
    {'mass': (8.0, 12.0)}
    """
    out = {}
    for name, value in nominal.items():
        edges = sorted((value * (1.0 - relative), value * (1.0 + relative)))
        if not (np.isfinite(edges).all() and edges[0] < edges[1]):
            raise AnalysisError(f"{name} = {value} has no relative range of {relative:g}; give its range yourself")
        out[name] = (edges[0], edges[1])
    return out
