"""Where a sensor unit sits in the car and how it is turned: from what it reads to what the car does at its centre of gravity.

With R from the axes of the unit to those of the car (ISO: x forward, y left, z up; right-handed rotations, about z by yaw, then
about the new y by pitch, then about the new x by roll), w the angular rate and l from the centre of gravity to the unit,

    a_cg = R a - w' x l - w x (w x l),      V_cg = R V - w x l,      w = R w_unit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.errors import EstimatorError

FARTHEST = 20.0  # m
LEAST_SHARE = 0.1
"""Share of a reading in an axis of the car above which the axis is missing where the reading is; below, its last value does."""
_TURNED = 0.5  # least determinant of what is solved where axes are not measured: 60 degrees about one axis


@dataclass(frozen=True)
class Mounting:
    """Lever arm from the centre of gravity to the unit, m, in axes of the car, and angles of the unit against the car, rad.

    x ahead, y to the left, z above; roll with the left side of the unit up, pitch with its nose down, yaw turned to the left
    (ISO 8855).

    Raises:
        EstimatorError: a value that is not finite, beyond 20 m, or beyond pi (pitch: pi/2).

    >>> Mounting(x=0.3, roll=0.01).x  # m ahead of the centre of gravity
    0.3
    """

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0

    def __post_init__(self) -> None:
        most = {"x": FARTHEST, "y": FARTHEST, "z": FARTHEST, "roll": math.pi, "pitch": math.pi / 2, "yaw": math.pi}
        for entry in fields(self):
            value, unit = float(getattr(self, entry.name)), "m" if entry.name in "xyz" else "rad"
            if not abs(value) <= most[entry.name]:  # False for NaN
                raise EstimatorError(
                    f"mounting: {entry.name} = {value:g} {unit} must be within {most[entry.name]:.4g} {unit}; lengths in "
                    "metres from the centre of gravity, angles in radians"
                )
            object.__setattr__(self, entry.name, value)

    @cached_property
    def lever(self) -> FloatArray:
        """l (3,), m."""
        return np.array([self.x, self.y, self.z])

    @cached_property
    def rotation(self) -> FloatArray:
        """R (3, 3) = R_z(yaw) R_y(pitch) R_x(roll)."""
        angles = (self.roll, self.pitch, self.yaw)
        (a, b, c), (p, q, s) = ([function(angle) for angle in angles] for function in (math.cos, math.sin))
        about_x = np.array([[1.0, 0.0, 0.0], [0.0, a, -p], [0.0, p, a]])
        about_y = np.array([[b, 0.0, q], [0.0, 1.0, 0.0], [-q, 0.0, b]])
        about_z = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        turn: FloatArray = about_z @ about_y @ about_x
        return turn

    @property
    def turned(self) -> bool:
        """Whether the unit has other axes than the car."""
        return any((self.roll, self.pitch, self.yaw))

    @property
    def away(self) -> bool:
        """Whether the unit is off the centre of gravity."""
        return any((self.x, self.y, self.z))


class UnitAxes:
    """Readings of a unit in the axes of the car, where only some of its three axes are measured.

    What is not measured is known of the car itself, not of the unit: a level car has g above it and rolls and pitches
    little. So the measured readings y_m = (R')_mm x_m + (R')_mn x_n are solved for x_m with x_n at `usual`.

    Args:
        mounting: R.
        measured: which of x, y, z are.
        usual: what the car does along the others.

    Raises:
        EstimatorError: angles so large that the measured axes say too little.
    """

    def __init__(
        self, mounting: Mounting, measured: tuple[bool, ...], usual: tuple[float, ...] = (0.0, 0.0, 0.0)
    ) -> None:
        self.usual = np.array(usual)
        known = np.array(measured, dtype=np.bool_)
        back = mounting.rotation.T
        inner = back[np.ix_(known, known)]
        if known.any() and abs(np.linalg.det(inner)) < _TURNED:
            lost = ", ".join(axis for axis, there in zip("xyz", measured, strict=True) if not there)
            raise EstimatorError(
                f"mounting: roll {mounting.roll:g}, pitch {mounting.pitch:g}, yaw {mounting.yaw:g} rad turn the measured axes "
                f"too far for axis {lost} not to be measured; measure it, or correct the angles"
            )
        self._turn = np.zeros((3, 3))
        self._turn[np.ix_(known, known)] = np.linalg.inv(inner)
        self._shift = np.where(known, 0.0, self.usual)
        self._shift -= self._turn @ (back @ self._shift)

    def __call__(self, reading: FloatArray, last: FloatArray) -> FloatArray:
        """(..., 3) in axes of the car, NaN where a reading of a larger share is missing; `last` stands for small ones."""
        there = np.isfinite(reading)
        if there.all():
            out: FloatArray = reading @ self._turn.T + self._shift
            return out
        whole = np.where(there, reading, last) @ self._turn.T + self._shift
        return np.where(self.touched(~there, LEAST_SHARE), np.nan, whole)

    def touched(self, readings: BoolArray, share: float) -> BoolArray:
        """Which axes of the car (..., 3) have a larger `share` of any of the `readings` (..., 3)."""
        needs: BoolArray = np.absolute(self._turn) > share
        return np.asarray((readings[..., None, :] & needs).any(axis=-1))


def lever_acceleration(lever: FloatArray, rate: FloatArray, slope: FloatArray) -> FloatArray:
    """w' x l + w x (w x l) (..., 3), m/s^2: what a point at `lever` (3,) feels beyond the centre of gravity.

    `rate` w in rad/s and `slope` w' in rad/s^2, (..., 3) in axes of the car.
    """
    along = (rate * lever).sum(axis=-1, keepdims=True)
    size = (rate * rate).sum(axis=-1, keepdims=True)
    out: FloatArray = np.cross(slope, lever) + rate * along - lever * size
    return out


def lever_velocity(lever: FloatArray, rate: FloatArray) -> FloatArray:
    """w x l (..., 3), m/s: by how much a point at `lever` (3,) moves beyond the centre of gravity."""
    return np.cross(rate, lever)
