"""What the sideslip observers must know of the car; every value is checked when it is given."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from estimators.errors import EstimatorError
from estimators.vehicle import GRAVITY

_UNITS = {
    "mass": "kg",
    "yaw_inertia": "kg m^2",
    "front_axle_distance": "m",
    "rear_axle_distance": "m",
    "track": "m",
    "front_stiffness": "N/rad",
    "rear_stiffness": "N/rad",
    "front_relaxation": "m",
    "rear_relaxation": "m",
    "friction": "1",
}


@dataclass(frozen=True)
class SingleTrack:
    """Mass in kg, yaw inertia in kg m^2, distances from the centre of gravity to the axles in m, and the cornering
    stiffness of each axle (both wheels) in N/rad.

    Raises:
        EstimatorError: a value that is not finite and positive; names it with its unit.
    """

    mass: float
    yaw_inertia: float
    front_axle_distance: float
    rear_axle_distance: float
    front_stiffness: float
    rear_stiffness: float

    def __post_init__(self) -> None:
        _positive(self)


@dataclass(frozen=True)
class FourWheel:
    """As `SingleTrack`, but stiffness of one tire, with track in m, relaxation lengths in m and the road's friction.

    Raises:
        EstimatorError: a value that is not finite and positive; names it with its unit.
    """

    mass: float
    yaw_inertia: float
    front_axle_distance: float
    rear_axle_distance: float
    track: float
    front_stiffness: float
    rear_stiffness: float
    front_relaxation: float
    rear_relaxation: float
    friction: float = 1.0

    def __post_init__(self) -> None:
        _positive(self)

    @property
    def static_loads(self) -> tuple[float, float, float, float]:
        """Loads at rest on level ground in N: front left, front right, rear left, rear right."""
        weight = self.mass * GRAVITY / (2 * (self.front_axle_distance + self.rear_axle_distance))
        front, rear = weight * self.rear_axle_distance, weight * self.front_axle_distance
        return front, front, rear, rear


def positive(value: float, name: str, unit: str) -> float:
    """The value.

    Raises:
        EstimatorError: not a finite positive number.
    """
    if not isinstance(value, (int, float)) or not (0 < value < math.inf):
        raise EstimatorError(f"{name} = {value!r} {unit} must be finite and positive")
    return float(value)


def _positive(vehicle: SingleTrack | FourWheel) -> None:
    for field in fields(vehicle):
        positive(getattr(vehicle, field.name), field.name, _UNITS[field.name])
