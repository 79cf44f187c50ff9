"""The car as the runtime knows it: masses, lengths and radii, checked once and immutable from then on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import ClassVar, NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import EstimatorError

GRAVITY = 9.80665
"""Standard acceleration of free fall, m/s^2: what a level accelerometer reads upwards at rest."""
CORNERS = ("fl", "fr", "rl", "rr")
"""Order of the corners on the last axis of every array, everywhere."""


class _Kind(NamedTuple):
    unit: str
    low: float
    high: float
    remedy: str


_LENGTH = "give it in metres"
_STIFFNESS = "the cornering stiffness, some 25 times the load for each radian"
_KINDS = {
    "mass": _Kind("kg", 50.0, 1e5, "give the total mass of the loaded car in kilograms"),
    "yaw_inertia": _Kind("kg m^2", 1.0, 1e7, "m L_f L_r is a fair first guess"),
    "wheel_inertia": _Kind("kg m^2", 1e-3, 1e3, "about 1 for a passenger car's wheel with brake disc"),
    "front_axle_distance": _Kind("m", 0.1, 20.0, "from the front axle back to the centre of gravity, " + _LENGTH),
    "rear_axle_distance": _Kind("m", 0.1, 20.0, "from the centre of gravity back to the rear axle, " + _LENGTH),
    "cg_height": _Kind("m", 0.05, 5.0, "centre of gravity above the road, " + _LENGTH),
    "roll_center_height": _Kind("m", -1.0, 5.0, "roll axis above the road below the centre of gravity, " + _LENGTH),
    "track": _Kind("m", 0.2, 5.0, _LENGTH),
    "front_track": _Kind("m", 0.2, 5.0, _LENGTH),
    "rear_track": _Kind("m", 0.2, 5.0, _LENGTH),
    "effective_radius": _Kind("m", 0.05, 2.0, "rolling radius of the wheels, " + _LENGTH),
    "front_stiffness": _Kind("N/rad", 1.0, 1e7, _STIFFNESS),
    "rear_stiffness": _Kind("N/rad", 1.0, 1e7, _STIFFNESS),
    "front_relaxation": _Kind("m", 1e-3, 10.0, "the relaxation length of the tires, " + _LENGTH),
    "rear_relaxation": _Kind("m", 1e-3, 10.0, "the relaxation length of the tires, " + _LENGTH),
    "friction": _Kind("(no unit)", 1e-3, 10.0, "of tire and road, about 1 on dry asphalt"),
    "bearing_friction": _Kind("N m s/rad", 0.0, 100.0, "drag torque of a wheel over its speed, 0 to leave it out"),
    "rolling_resistance": _Kind("(no unit)", 0.0, 0.2, "about 0.01 on asphalt, 0 to leave it out"),
}


@dataclass(frozen=True, repr=False)
class RigidBody(Display):
    """The car in the plane, SI units: what every kind of vehicle has.

    Raises:
        EstimatorError: a value that is missing, not finite, or impossible in its unit; all of them are listed.
    """

    shown_units: ClassVar = {name: kind.unit for name, kind in _KINDS.items() if kind.unit != "(no unit)"} | {
        "radii": "m"
    }

    mass: float  # kg, total
    yaw_inertia: float  # kg m^2
    front_axle_distance: float  # L_f, m, centre of gravity to front axle
    rear_axle_distance: float  # L_r, m

    def __post_init__(self) -> None:
        problems, names = [], [entry.name for entry in fields(self) if entry.init]
        for name in names:
            kind, given = _KINDS[name], getattr(self, name)
            values = _numbers(given)
            if name == "effective_radius" and len(values) not in (1, 2, 4):
                problems.append(f"effective_radius has {len(values)} values; give one, (front, rear) or fl, fr, rl, rr")
            elif name != "effective_radius" and len(values) != 1:
                problems.append(f"{name} = {given!r} is not one number; {kind.remedy}")
            elif not all(kind.low <= value <= kind.high for value in values):
                span = f"[{kind.low:g}, {kind.high:g}] {kind.unit}"
                problems.append(f"{name} = {given!r} {kind.unit} is not in {span}: {kind.remedy}")
        problems = problems or self._contradictions()
        if problems:
            raise EstimatorError("vehicle parameters: " + "; ".join(problems))
        for name in names:
            if name != "effective_radius":
                object.__setattr__(self, name, float(getattr(self, name)))

    def _contradictions(self) -> list[str]:
        """What cannot hold together."""
        return []

    @property
    def wheelbase(self) -> float:
        """L = L_f + L_r, m."""
        return self.front_axle_distance + self.rear_axle_distance

    @property
    def static_loads(self) -> FloatArray:
        """F_z of fl, fr, rl, rr of the level car at rest, N, (4,)."""
        front = self.mass * GRAVITY * self.rear_axle_distance / (2.0 * self.wheelbase)
        rear = self.mass * GRAVITY * self.front_axle_distance / (2.0 * self.wheelbase)
        return np.array([front, front, rear, rear])


@dataclass(frozen=True, repr=False)
class SingleTrack(RigidBody):
    """With the cornering stiffness of each axle (both wheels): P5.

    >>> SingleTrack(1400.0, 2400.0, 1.1, 1.6, 80000.0, 90000.0).front_stiffness
    80000.0
    """

    front_stiffness: float  # N/rad
    rear_stiffness: float  # N/rad


@dataclass(frozen=True, repr=False)
class FourWheel(RigidBody):
    """With the stiffness of one tire, the relaxation lengths of the tires and the friction of the road: P4.

    >>> FourWheel(1500.0, 2500.0, 1.2, 1.4, 1.5, 50000.0, 50000.0, 0.4, 0.4, friction=0.8).friction
    0.8
    """

    track: float  # m, both axles
    front_stiffness: float  # N/rad
    rear_stiffness: float  # N/rad
    front_relaxation: float  # m
    rear_relaxation: float  # m
    friction: float = 1.0


@dataclass(frozen=True, repr=False)
class VehicleParameters(RigidBody):
    """What the force, load and velocity estimators need to know of a car.

    Lengths and inertias as in P1 Table I; `published_suv()` is that table. The tracks are those of the wheel centres.

    >>> VehicleParameters.published_suv().mass
    2270.0
    """

    wheel_inertia: float  # kg m^2, one wheel with everything that turns with it
    cg_height: float  # h_CG, m
    front_track: float  # T_f, m
    rear_track: float  # T_r, m
    effective_radius: float | Sequence[float]  # R_e, m: one, front and rear, or fl, fr, rl, rr; kept as four
    roll_center_height: float = 0.0  # h_rc, m
    rolling_resistance: float = 0.0  # c_rr: the wheel loses R_e c_rr F_z to it; the papers have 0
    bearing_friction: float = 0.0  # C_b of P2 (1), N m s/rad; the paper neglects it
    radii: tuple[float, float, float, float] = field(init=False)  # R_e of fl, fr, rl, rr, m

    def __post_init__(self) -> None:
        super().__post_init__()
        radii = _numbers(self.effective_radius)
        radii = radii * 4 if len(radii) == 1 else radii
        radii = [radii[0], radii[0], radii[1], radii[1]] if len(radii) == 2 else radii
        object.__setattr__(self, "effective_radius", radii[0] if len(set(radii)) == 1 else tuple(radii))
        object.__setattr__(self, "radii", tuple(radii))

    def _contradictions(self) -> list[str]:
        if self.roll_center_height <= self.cg_height:
            return []
        return [
            f"roll_center_height = {self.roll_center_height:g} m is above cg_height = {self.cg_height:g} m: "
            "exchange the two, or give the roll axis below the centre of gravity"
        ]

    @property
    def radius(self) -> FloatArray:
        """R_e of fl, fr, rl, rr, m, (4,)."""
        return np.array(self.radii)

    @property
    def corner_x(self) -> FloatArray:
        """x of the wheel centres from the centre of gravity, m, (4,): L_f, L_f, -L_r, -L_r."""
        front, rear = self.front_axle_distance, self.rear_axle_distance
        return np.array([front, front, -rear, -rear])

    @property
    def corner_y(self) -> FloatArray:
        """y of the wheel centres from the centre of gravity, m, (4,): +T_f/2, -T_f/2, +T_r/2, -T_r/2."""
        return np.array([self.front_track, -self.front_track, self.rear_track, -self.rear_track]) / 2.0

    @classmethod
    def published_suv(cls) -> VehicleParameters:
        """The papers' test car: P1 Table I and P2 Table I."""
        return cls(
            mass=2270.0,
            yaw_inertia=4650.0,
            wheel_inertia=1.68,
            front_axle_distance=1.42,
            rear_axle_distance=1.43,
            cg_height=0.65,
            front_track=1.62,
            rear_track=1.56,
            effective_radius=0.33,
            roll_center_height=0.54,
        )


def _numbers(given: object) -> list[float]:
    """The finite numbers given, a NaN for what is none."""
    values = list(given) if isinstance(given, Sequence | np.ndarray) and not isinstance(given, str) else [given]
    numbers = []
    for value in values:
        number = float(value) if isinstance(value, int | float | np.integer | np.floating) else math.nan
        numbers.append(math.nan if isinstance(value, bool) or not math.isfinite(number) else number)
    return numbers
