"""What P4 and P5 take from a trial at 100 Hz: speed, steering angle, the samples that count, and the numbers of the tire."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from studies.trials.estimation import assumed_car
from studies.truth import Measured, TruthVehicle
from studies.truth.fleet import tires_of
from studies.truth.lugre import LuGreTire
from synthesis.errors import SpecError

SAMPLE_TIME = 0.01  # s, P4 and P5: 100 Hz
START = 1.0  # s left out of every error: observers that start from nothing
LEAST_SPEED = 3.0  # m/s, below which sideslip has no error
ANGLES: FloatArray = np.concatenate([[1e-4], np.linspace(2e-3, 0.4, 200)])  # rad, the first for the slope at rest
USE = 0.4  # share of the load at which the secant is read: ordinary cornering
PRINTED_TEST = "Printed values are those of the paper's road test with another driver, road and car."


def rear_speed(drawn: Measured) -> FloatArray:
    """V_g (S, B, n), m/s: mean of the rear wheel speeds times the radius, P4 notes 4."""
    return np.asarray((assumed_car(drawn).radius * drawn.signals["wheel_speed"])[..., 2:].mean(axis=-1))


def front_steer(drawn: Measured) -> FloatArray:
    """Steering angle of the front wheels (S, B, n), rad: mean of both."""
    return np.asarray(drawn.signals["steer"][..., :2].mean(axis=-1))


def counted(drawn: Measured, run: int) -> BoolArray:
    """Samples (n,) of a run that count in errors: from `START` on, and not below `LEAST_SPEED`."""
    truth = drawn.truth
    return np.asarray(truth.valid[run] & (truth.time >= START) & (np.absolute(truth["vx"][run]) >= LEAST_SPEED))


def conditions(drawn: Measured) -> str:
    """The beginning of a caption: tires, time, sensor draws, and what counts."""
    truth = drawn.truth
    return (
        f"Truth vehicle on {truth.tires[0]} tires, {truth.time[-1]:.0f} s at 100 Hz: means over {len(drawn.seeds)} draws of "
        f"the sensor errors with 95 % confidence intervals, judged from {START:g} s on above {LEAST_SPEED:g} m/s."
    )


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
