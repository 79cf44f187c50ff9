"""Arrays as the plain numbers that a JSON file holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def floats(values: ArrayLike) -> list[float]:
    """Plain numbers for a JSON file."""
    return [float(v) for v in np.asarray(values, float).ravel()]


def by_speed(speeds: ArrayLike, values: ArrayLike) -> dict[str, float]:
    """{"40": value}: values (g,) named by the wheel speed in rad/s."""
    return {f"{w:g}": v for w, v in zip(floats(speeds), floats(values), strict=True)}
