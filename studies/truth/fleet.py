"""B truth vehicles as arrays: (B,) for a car, (4, B) for its corners fl, fr, rl, rr, (2, B) for axles; SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from estimators.arrays import FloatArray
from estimators.errors import unknown
from estimators.vehicle import GRAVITY
from studies.truth.drivetrain import Drivetrains
from studies.truth.layout import column
from studies.truth.lugre import LuGreTire
from studies.truth.magic_formula import MagicFormulaTire
from studies.truth.vehicle import TruthVehicle
from synthesis.errors import SpecError

AIR_DENSITY = 1.2  # kg/m^3
Tire = LuGreTire | MagicFormulaTire
TIRES = (LuGreTire.name, MagicFormulaTire.name)  # names of the tire models


def tires_of(kind: str, vehicles: Sequence[TruthVehicle]) -> Tire:
    """The tires of a batch. Raises SpecError for an unknown kind."""
    if kind == LuGreTire.name:
        return LuGreTire([v.lugre for v in vehicles])
    if kind == MagicFormulaTire.name:
        return MagicFormulaTire([v.magic_formula for v in vehicles])
    raise SpecError(unknown("tire", kind, TIRES))


class Fleet:
    """Parameters of B vehicles side by side, with what follows from them once."""

    def __init__(self, vehicles: Sequence[TruthVehicle]) -> None:
        if not vehicles:
            raise SpecError("a truth batch needs at least one vehicle")
        cars, bodies = [v.parameters for v in vehicles], [v.chassis for v in vehicles]

        self.size = len(cars)
        self.mass = column(cars, "mass")
        self.yaw_inertia = column(cars, "yaw_inertia")
        self.roll_inertia: FloatArray = self.yaw_inertia * column(bodies, "roll_inertia_ratio")
        self.pitch_inertia: FloatArray = self.yaw_inertia * column(bodies, "pitch_inertia_ratio")
        self.wheel_inertia = column(cars, "wheel_inertia")
        self.radius: FloatArray = column(cars, "radius")
        self.x: FloatArray = column(cars, "corner_x")
        self.y: FloatArray = column(cars, "corner_y")
        self.height = column(cars, "cg_height")
        self.roll_center = column(cars, "roll_center_height")
        self.track: FloatArray = np.array([[c.front_track for c in cars], [c.rear_track for c in cars]])
        self.static_load: FloatArray = column(cars, "static_loads")
        self.drag: FloatArray = 0.5 * AIR_DENSITY * column(bodies, "drag_area")
        self.rolling_resistance = column(bodies, "rolling_resistance")
        self.load_lag = column(bodies, "load_lag")
        under = [v.suspension for v in vehicles]
        self.unsprung = column(under, "unsprung_mass")
        self.compliance_stiffness, self.compliance_damping = (
            np.repeat([column(under, f"{kind}_{axis}") for axis in "xy"], 4, axis=0)
            for kind in ("stiffness", "damping")
        )
        self.drivetrains = Drivetrains([v.drivetrain for v in vehicles])
        ride = np.array([[b.front_ride_frequency for b in bodies], [b.rear_ride_frequency for b in bodies]])
        speed = 2.0 * math.pi * np.repeat(ride, 2, axis=0)
        corner_mass = self.static_load / GRAVITY
        self.spring: FloatArray = corner_mass * speed**2
        self.damper: FloatArray = 2.0 * column(bodies, "ride_damping") * corner_mass * speed
        bars = column(bodies, "anti_roll_ratio") * (self.spring * self.y**2).sum(axis=0)  # N m/rad
        front = column(bodies, "anti_roll_front_share")
        # N per wheel and rad of roll: K phi = 2 F T/2
        self.bar: FloatArray = np.stack([bars * front, bars * (1.0 - front)]) / self.track
