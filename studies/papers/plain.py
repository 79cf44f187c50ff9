"""Arrays as the plain numbers that a JSON file or a table holds."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from studies.study import Table


def floats(values: ArrayLike) -> list[float]:
    """Plain numbers for a JSON file."""
    return [float(v) for v in np.asarray(values, float).ravel()]


def by_speed(speeds: ArrayLike, values: ArrayLike) -> dict[str, float]:
    """{"40": value}: values (g,) named by the wheel speed in rad/s."""
    return {f"{w:g}": v for w, v in zip(floats(speeds), floats(values), strict=True)}


def column_table(name: str, caption: str, columns: Mapping[str, ArrayLike]) -> Table:
    """A table from its columns (n,) by their names, in order."""
    return Table(name, caption, tuple(columns), np.column_stack(list(columns.values())).tolist())
