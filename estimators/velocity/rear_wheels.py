"""Speed of the car from its rear wheels alone, as P4 (9) and P5 measure it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from estimators.arrays import FloatArray
from estimators.signals import limits
from estimators.vehicle import VehicleParameters


def rear_wheel_speed(
    vehicle: VehicleParameters, wheel_speed: npt.ArrayLike, yaw_rate: npt.ArrayLike = 0.0
) -> FloatArray:
    """V_g = mean of R_e w over the rear wheels, m/s (...), P4 (9), from `wheel_speed` (..., 4) in rad/s.

    Of one wheel alone where the other is missing: R_e w + r y_c, with the lever arm to the centre; NaN where both are. Both
    together need no `yaw_rate` (...), rad/s; a missing one counts as zero. Biased by slip: the rear wheels must roll freely.
    """
    w = np.asarray(wheel_speed, dtype=np.float64)[..., 2:]
    known = np.absolute(w) <= limits.WHEEL_SPEED
    turn = np.nan_to_num(np.asarray(yaw_rate, dtype=np.float64))[..., None]
    speed = np.where(known, vehicle.radius[2:] * np.where(known, w, 0.0) + turn * vehicle.corner_y[2:], 0.0)
    count = known.sum(axis=-1)
    return np.where(count > 0, speed.sum(axis=-1) / np.maximum(count, 1), np.nan)
