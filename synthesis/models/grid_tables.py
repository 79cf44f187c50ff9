"""Matrices at the points of a grid as tables: the plant is multilinear between the points, and nothing is left over."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from synthesis.models.fitted import Fitted
from synthesis.models.table import LookupTable


def as_tables(
    build: Fitted, source: str, lines: Sequence[FloatArray], values: Mapping[str, FloatArray]
) -> tuple[dict[str, sp.Matrix], dict[str, LookupTable]]:
    """Matrices (g_1, .., g_p, rows, columns) by their letters, as formulas of tables `A_1_2`, and those tables.

    An entry is a table over the parameters that move it, and a number where none does.
    """
    count, made, tables = len(lines), {}, {}
    for key, array in values.items():
        matrix = sp.zeros(*array.shape[-2:])
        for i, j in np.ndindex(*array.shape[-2:]):
            entry = array[..., i, j]
            moving = [axis for axis in range(count) if (entry != np.take(entry, [0], axis=axis)).any()]
            if not moving:
                matrix[i, j] = build.entry(key, i, j, entry[(slice(1),) * count])
                continue
            name = f"{key}_{i + 1}_{j + 1}"
            own = entry[tuple(slice(None) if axis in moving else 0 for axis in range(count))]
            over = tuple(build.parameters[axis].name for axis in moving)
            points = tuple(tuple(lines[axis].tolist()) for axis in moving)
            tables[name] = LookupTable(build.unit(key, i, j), source, over, points, own)
            matrix[i, j] = sp.Symbol(name)
        made[key] = matrix
    return made, tables
