"""Which tire is soft: a wheel that turns faster than the other three explain (indirect pressure monitoring).

Of four differences (`soft_tire_monitor`) the mean is lost. The three others are taken for healthy, rho ~ N(common,
`radius_single`), while the wheel in question may be off by anything: the posterior mean of its rho minus that of the others is
as sure as its neighbour, which slips alike, and the other axle allow.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.velocity.fusion import VelocityFusion
from estimators.velocity.soft_tire_monitor import LARGEST

_CONTRAST = (4.0 * np.eye(4) - 1.0) / 3.0


class SoftTires(NamedTuple):
    """Leading axes are those of the fusion's batch."""

    change: FloatArray  # (..., 4) radius of a wheel over the mean of the others, less 1; negative: softer
    deviation: FloatArray  # (..., 4) standard deviation of that
    soft: BoolArray  # (..., 4) the change is below -3 `radius_single`, by three deviations


def soft_tires(fusion: VelocityFusion) -> SoftTires:
    """What the last minute of driving says; before any, nothing is soft and the deviation is that of `LARGEST`.

    A tire that is softer by less than 3 `radius_single` is not named: as much are healthy ones apart.
    """
    s, shape = fusion.settings, (*fusion.batch_shape, 4)
    y, N = fusion.soft_tire_monitor.averages(fusion.vehicle.corner_y)
    healthy = np.full(y.shape, s.radius_single)
    change, deviation, soft = _posterior(y, N, healthy, s.radius_single)
    # beside one that is soft, the others are not off: it may differ from them, too
    worst = np.arange(4) == np.argmin(change + 3.0 * deviation, axis=1)[:, None]
    change, deviation, soft = _posterior(y, N, np.where(worst & soft, LARGEST, healthy), s.radius_single)
    return SoftTires(change.reshape(shape), deviation.reshape(shape), soft.reshape(shape))


def _posterior(
    y: FloatArray, N: FloatArray, spread: FloatArray, healthy: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Change, deviation and verdict (b, 4) by y (b, 4) with the noise N (b, 4, 4); `spread` (b, 4) of what rho may be."""
    change, variance = np.empty_like(y), np.empty_like(y)
    for wheel, contrast in enumerate(_CONTRAST):
        prior = spread**2
        prior[:, wheel] = LARGEST**2
        shared = prior * contrast  # Cov(rho, contrast)
        gain = np.linalg.solve(N + prior[:, None] * np.eye(4), shared[..., None])[..., 0]
        change[:, wheel] = (gain * y).sum(axis=1)
        variance[:, wheel] = shared @ contrast - (gain * shared).sum(axis=1)
    deviation = np.sqrt(np.maximum(variance, 0.0))
    soft: BoolArray = change + 3.0 * deviation < -3.0 * healthy
    return change, deviation, soft
