"""Courses made by hand for the tests of the truth vehicles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from estimators.arrays import FloatArray
from studies.truth import Truth, TruthVehicle, load_vehicle, simulate
from studies.truth.course import Course, Courses
from studies.truth.driver import Driver
from studies.truth.fleet import Fleet, tires_of
from studies.truth.plant import Controls, Plant, SteerAngles
from studies.truth.profile import GRID
from studies.truth.road import Zone

Profile = Callable[[FloatArray], FloatArray]
TIRES = ("lugre", "magic-formula")


def ramp(start: float, end: float, height: float) -> Profile:
    return lambda t: height * np.clip((t - start) / (end - start), 0.0, 1.0)


def course(
    tire: str = "lugre",
    speed: float = 0.0,
    duration: float = 1.0,
    friction: float = 1.0,
    zones: tuple[Zone, ...] = (),
    name: str = "case",
    **profiles: Profile,
) -> Course:
    """`profiles`: steer, drive_torque, brake_torque, drive_share, brake_share, grade, bank as functions of time."""
    t = GRID * np.arange(int(np.ceil(duration / GRID)) + 2)
    names = ("steer", "drive_torque", "drive_share", "brake_torque", "brake_share", "grade", "bank")
    tables = {n: np.asarray(profiles[n](t)) if n in profiles else np.zeros_like(t) for n in names}
    return Course(name, duration, speed, tire, friction=friction, zones=zones, **tables)


@cache
def published() -> TruthVehicle:
    return load_vehicle("resilient-velocity")


def suv(**changes: object) -> TruthVehicle:
    return published().changed(**changes)


def run(one: Course, vehicle: TruthVehicle | None = None, step: float = 0.001, record_time: float = 0.001) -> Truth:
    return simulate([one], [vehicle or suv()], step=step, record_time=record_time)


def plant_of(one: Course, vehicle: TruthVehicle) -> tuple[Plant, Callable[[FloatArray, float], Controls]]:
    """The equations of one car, and its controls as a function of state and time (no path, no assists)."""
    fleet = Fleet([vehicle])
    plant, driver = Plant(fleet, tires_of(one.tire, [vehicle])), Driver(Courses([one]), fleet)
    nothing = np.zeros((4, 1))

    def controls(state: FloatArray, time: float) -> Controls:
        return driver.act(state, plant.slide(state, SteerAngles(nothing, nothing + 1.0)), time, 0.0)

    return plant, controls


def shortened(one: Course, duration: float) -> Course:
    return replace(one, duration=min(duration, one.duration))
