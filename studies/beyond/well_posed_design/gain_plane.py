"""Constant gains in the plane of L1 and L2: what each pair does over the whole range of wheel speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.beyond.well_posed_design.achieved import Achieved, achieved
from studies.beyond.well_posed_design.cases import Case
from synthesis.polynomials.matrix import FloatArray

WHEEL_SPEEDS = 8


@dataclass(frozen=True)
class GainPlane:
    """L1 (m,) in m/s, L2 (n,) in m/s^2, and what the pairs do, fields of shape (m, n)."""

    first: FloatArray
    second: FloatArray
    fields: Achieved


def gain_plane(case: Case, points: int = 61) -> GainPlane:
    """Around the printed gains and ranges, L2 over two decades."""
    (_, high), (low, top) = case.printed_range
    first = np.linspace(0.02, 1.35 * max(high, case.printed[0]), points)
    second = np.geomspace(0.2 * low, 4.0 * max(top, case.printed[1]), points)
    grid = np.linspace(*_range(case), WHEEL_SPEEDS)
    pairs = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1)
    gains = np.broadcast_to(pairs[:, :, None, :], (points, points, WHEEL_SPEEDS, 2))
    return GainPlane(first, second, achieved(case, gains, grid))


def _range(case: Case) -> tuple[float, float]:
    (parameter,) = case.model.parameters
    return parameter.minimum, parameter.maximum
