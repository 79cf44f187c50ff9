"""Steady lateral force of a truth tire against its slip angle, and the numbers by which estimators know it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from studies.truth import TruthVehicle
from studies.truth.fleet import tires_of
from studies.truth.lugre import LuGreTire
from synthesis.errors import SpecError

ANGLES: FloatArray = np.concatenate([[1e-4], np.linspace(2e-3, 0.4, 200)])  # rad, the first for the slope at rest
USE = 0.4  # share of the load at which the secant is read: ordinary cornering


class TireFacts(NamedTuple):
    """Of one tire of the front and of the rear axle at their static loads; pairs, front first."""

    slope: tuple[float, float]  # N/rad, at no slip
    secant: tuple[float, float]  # N/rad, from no slip to the angle at which the force is `USE` times the load
    peak: tuple[float, float]  # greatest force over load up to 0.4 rad
    relaxation: tuple[float, float]  # m, at little slip


def lateral_curve(vehicle: TruthVehicle, kind: str, speed: float, friction: float) -> FloatArray:
    """F_y/F_z (2, n) of a front and a rear tire that rolls freely at `speed`, m/s, at the slip angles `ANGLES`.

    Positive for a positive angle, at static load: the deflection (or lagged slip) at rest is its source over its decay.
    """
    tire = tires_of(kind, [vehicle] * ANGLES.size)
    shape, across = (4, ANGLES.size), speed * np.tan(ANGLES)
    slide: FloatArray = np.stack([np.zeros(shape), np.broadcast_to(across, shape)])
    surface, transport = np.full(shape, speed), np.broadcast_to(np.maximum(speed, across), shape)
    load = np.broadcast_to(vehicle.parameters.static_loads[:, None], shape)
    grip, nothing = np.full(shape, friction), np.zeros((2, *shape))
    decay, push = tire.rates(nothing, slide, surface, transport, grip)
    return np.asarray((tire.forces(push / decay, nothing, slide, transport, load, grip)[1] / load)[0::2])


def tire_facts(vehicle: TruthVehicle, kind: str, speed: float, friction: float) -> TireFacts:
    """Read off `lateral_curve`. Raises SpecError on a road too slippery for the secant."""
    curve = lateral_curve(vehicle, kind, speed, friction)
    if curve.max(axis=1).min() <= USE:
        remedy = "use a road with more grip"
        raise SpecError(f"friction = {friction:g}: the tires never reach {USE:g} of their load; {remedy}")
    load, rising = vehicle.parameters.static_loads[0::2], curve.argmax(axis=1) + 1
    angle = np.array([np.interp(USE, row[:top], ANGLES[:top]) for row, top in zip(curve, rising, strict=True)])
    length = 1.0 / vehicle.lugre.kappa[1] if kind == LuGreTire.name else vehicle.magic_formula.relaxation[1]
    found = (curve[:, 0] * load / ANGLES[0], USE * load / angle, curve.max(axis=1), (length, length))
    return TireFacts(*((float(front), float(rear)) for front, rear in found))
