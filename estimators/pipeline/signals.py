"""One sample of everything that a car measures, as it comes: anything may be missing, late or wrong."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arguments import apart, entries
from estimators.arithmetic import Number
from estimators.arrays import FloatArray
from estimators.display import displayed

UNITS = {
    "wheel_speed": "rad/s", "ax": "m/s^2", "ay": "m/s^2", "yaw_rate": "rad/s", "steer": "rad", "torque": "N m", "az": "m/s^2",
    "roll_rate": "rad/s", "pitch_rate": "rad/s", "grade": "rad", "bank": "rad", "elapsed": "s",
}  # fmt: skip


CheckedSignals = tuple[FloatArray, FloatArray, FloatArray, Number, Number, Number]
"""wheel_speed, steer, torque (..., 4), and ax, ay, yaw_rate (...): arrays, or plain numbers of one car."""


@displayed(UNITS)
class VehicleSignals(NamedTuple):
    """Arrays of the batch shape `...`, or one number for all; NaN (or infinite) where missing. ISO frame, SI units.

    None says that the car has no such sensor: nothing is flagged then.

    >>> import numpy as np
    >>> signals = VehicleSignals(wheel_speed=np.full(4, 60.0), ax=0.5)  # rad/s and m/s^2; what is not given is not measured
    >>> signals.az is None
    True
    """

    wheel_speed: npt.ArrayLike  # (..., 4) rad/s, signed: backwards is negative
    ax: npt.ArrayLike  # (...) m/s^2, specific force at the centre of gravity
    ay: npt.ArrayLike = 0.0  # (...) m/s^2
    yaw_rate: npt.ArrayLike = 0.0  # (...) rad/s
    steer: npt.ArrayLike = 0.0  # (..., 4) rad, road-wheel angles; hand wheel divided by its ratio
    torque: npt.ArrayLike = np.nan  # (..., 4) N m, drive minus brake
    az: npt.ArrayLike | None = None  # (...) m/s^2, +g at rest
    roll_rate: npt.ArrayLike | None = None  # (...) rad/s, about x
    pitch_rate: npt.ArrayLike | None = None  # (...) rad/s, about y
    grade: npt.ArrayLike = 0.0  # (...) rad, of the road, uphill positive
    bank: npt.ArrayLike = 0.0  # (...) rad, left side up positive
    elapsed: npt.ArrayLike | None = None  # (...) s since the last sample, where it is not the sample time
    direction: npt.ArrayLike | None = None  # (...) gear: 1 forward, -1 backward; 0 or NaN where it does not say

    def arrays(self, shape: tuple[int, ...]) -> CheckedSignals:
        """What every car has, as arrays of the batch shape; the others are checked as well.

        Raises:
            EstimatorError: another shape, or not numbers.
        """
        four = (*shape, 4)
        for name, value in zip(self._fields[6:], self[6:], strict=True):
            if value is not None and not isinstance(value, float):
                entries(value, shape, name)
        return (
            entries(self.wheel_speed, four, "wheel_speed"),
            entries(self.steer, four, "steer"),
            entries(self.torque, four, "torque"),
            entries(self.ax, shape, "ax"),
            entries(self.ay, shape, "ay"),
            entries(self.yaw_rate, shape, "yaw_rate"),
        )

    def of_cars(self, shape: tuple[int, ...]) -> list[VehicleSignals]:
        """Of each car of the batch, what `arrays` does not return."""
        cars = [list(self) for _ in range(math.prod(shape))]
        for place, value in enumerate(self[6:], 6):
            if value is not None and not isinstance(value, float):
                for car, own in zip(cars, apart(value, shape, self._fields[place]), strict=True):
                    car[place] = own
        return [VehicleSignals._make(car) for car in cars]
