"""Which tire is soft: a wheel whose learned radius is smaller than those of the other three (indirect pressure monitoring).

    e_i = rho_i - (sum of the other rho)/3,     Var e_i = c_i' P c_i,     rho relative radius errors of the fusion

The common radius error, which only the inertial unit sees, cancels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.velocity.fusion import VelocityFusion
from estimators.velocity.longitudinal_fusion import RADIUS

_CONTRAST = (4.0 * np.eye(4) - 1.0) / 3.0


class SoftTires(NamedTuple):
    """Leading axes are those of the fusion's batch."""

    change: FloatArray  # (..., 4) radius of a wheel over the mean of the others, less 1; negative: softer
    deviation: FloatArray  # (..., 4) standard deviation of that
    soft: BoolArray  # (..., 4) the change is below -3 `radius_single`, by three deviations


def soft_tires(fusion: VelocityFusion) -> SoftTires:
    """What the free rolling up to now says; before any, nothing is soft and the deviation is that of the prior."""
    speed, shape = fusion.longitudinal_filter, (*fusion.batch_shape, 4)
    # the filter takes the error from the surface: R w (1 + rho) is the speed, so the radius is R (1 + rho)
    change = speed.state[:, RADIUS:] @ _CONTRAST.T
    variance = np.einsum("ki,bij,kj->bk", _CONTRAST, speed.covariance[:, RADIUS:, RADIUS:], _CONTRAST)
    deviation = np.sqrt(variance)
    soft = change + 3.0 * deviation < -3.0 * fusion.settings.radius_single
    return SoftTires(change.reshape(shape), deviation.reshape(shape), np.asarray(soft.reshape(shape)))
