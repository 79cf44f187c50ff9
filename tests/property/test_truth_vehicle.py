"""The truth vehicle at random states: its power balance, its symmetry, its batches."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.arrays import FloatArray
from estimators.vehicle import GRAVITY
from studies.truth import simulate, varied
from studies.truth.layout import COMPLIANCE, COMPLIANCE_RATE, DEFLECTION, JACK, STATES, B, W
from studies.truth.plant import Controls, Forces, Plant, SteerAngles
from studies.truth.road import Zone
from tests.support.truth_cases import TIRES, course, plant_of, suv

SCALES = {"vx": 12.0, "vy": 3.0, "heave": 0.02, "roll": 0.02, "pitch": 0.02}
SCALES |= {"heave_rate": 0.1, "roll_speed": 0.1, "pitch_speed": 0.1}
numbers = st.lists(st.floats(-1.0, 1.0, allow_nan=False), min_size=STATES + 14, max_size=STATES + 14)


@cache
def plant(tire: str) -> Plant:
    return plant_of(course(tire=tire), suv())[0]


def state_of(draw: FloatArray) -> FloatArray:
    size = np.ones(STATES)
    for name, value in SCALES.items():
        size[B[name]] = value
    size[W["wheel_speed"]], size[DEFLECTION], size[COMPLIANCE], size[COMPLIANCE_RATE] = 40.0, 1e-3, 2e-3, 0.05
    state = (size * draw[:STATES])[:, None]
    w = state[W["wheel_speed"]]
    state[W["wheel_speed"]] = np.where(np.abs(w) < 0.1, 0.5, w)  # dry friction needs a direction
    return state


def controls_of(draw: FloatArray) -> Controls:
    rest = draw[STATES:, None]
    brake, friction = 800.0 * np.abs(rest[8:12]), np.full((4, 1), 0.8)
    return Controls(0.3 * rest[0:4], 1000.0 * rest[4:8], brake, friction, 0.1 * rest[12], 0.1 * rest[13])


def energy(one: Plant, s: FloatArray) -> float:
    """J of the moving body, wheels, springs, bars and compliant links; gravity cancels the static spring forces."""
    car = one.fleet
    lift = s[B["heave"]] + car.y * s[B["roll"]] + car.x * s[B["pitch"]]
    kinetic = car.mass * (s[B["vx"]] ** 2 + s[B["vy"]] ** 2 + s[B["heave_rate"]] ** 2)
    kinetic += car.yaw_inertia * s[B["yaw_rate"]] ** 2 + car.roll_inertia * s[B["roll_speed"]] ** 2
    kinetic += car.pitch_inertia * s[B["pitch_speed"]] ** 2
    spin = (car.wheel_inertia * s[W["wheel_speed"]] ** 2).sum(axis=0)
    springs = (car.spring * lift**2).sum(axis=0) + (car.bar * car.track).sum(axis=0) * s[B["roll"]] ** 2
    links = (car.compliance_stiffness * s[COMPLIANCE] ** 2 + car.unsprung * s[COMPLIANCE_RATE] ** 2).sum(axis=0)
    return float(0.5 * (kinetic + spin + springs + links)[0])


def power(one: Plant, s: FloatArray, controls: Controls, forces: Forces) -> float:
    """W: drive and brakes, less tires, rolling resistance, drag, dampers and gravity along the road."""
    car, w = one.fleet, s[W["wheel_speed"]]
    rolling = np.sign(w) * car.radius * car.rolling_resistance * forces.load
    torque = controls.drive - np.sign(w) * controls.brake
    out = (torque * (w + s[B["pitch_speed"]]) - rolling * w).sum()
    out -= (forces.tire * one.slide(s, SteerAngles(np.sin(controls.steer), np.cos(controls.steer))).slip).sum()
    rate = s[B["heave_rate"]] + car.y * s[B["roll_speed"]] + car.x * s[B["pitch_speed"]]
    out -= (car.damper * rate**2).sum() + (car.compliance_damping * s[COMPLIANCE_RATE] ** 2).sum()
    vx, vy, up = s[B["vx"]][0], s[B["vy"]][0], s[B["heave_rate"]][0]
    grade, bank, weight = controls.grade[0], controls.bank[0], car.mass[0] * GRAVITY
    out -= car.drag[0] * abs(vx) ** 3
    out -= weight * (np.sin(grade) * vx + np.cos(grade) * (np.sin(bank) * vy + np.cos(bank) * up) - up)
    side = forces.body[1, 0::2] + forces.body[1, 1::2]
    behind = car.roll_center * side - s[JACK] * car.track  # N m that the links have not passed on yet
    return float(out + behind.sum() * s[B["roll_speed"]][0])


@settings(max_examples=60, deadline=None)
@given(numbers, st.sampled_from(TIRES))
def test_power_balance_at_any_instant(draw: list[float], tire: str) -> None:
    """dE/dt from the equations of motion equals the power of everything that acts: no coupling makes or loses any."""
    one, state, controls = plant(tire), state_of(np.array(draw)), controls_of(np.array(draw))
    slope, forces = one.derivative(state, controls)
    if forces.load.min() <= 0.0:  # a wheel in the air: its spring is longer than its energy says
        return
    h = 1e-6  # the energy is quadratic in the state: the central difference is exact but for rounding
    found = (energy(one, state + h * slope) - energy(one, state - h * slope)) / (2.0 * h)
    expected = power(one, state, controls, forces)
    scale = np.abs(forces.body).sum() * 12.0 + np.abs(controls.drive).sum() * 40.0 + 1e3
    assert found == pytest.approx(expected, abs=1e-6 * scale)


SIGNS = {"yaw", "y", "vy", "yaw_rate", "roll", "roll_speed", "jack_front", "jack_rear"}


def mirrored(state: FloatArray) -> FloatArray:
    """The same state seen in a mirror along the car: left is right."""
    out = state.copy()
    for name in SIGNS:
        out[B[name]] = -out[B[name]]
    for name, rows in W.items():
        out[rows] = out[rows][[1, 0, 3, 2]] * (-1.0 if "_y" in name else 1.0)
    return out


@settings(max_examples=40, deadline=None)
@given(numbers, st.sampled_from(TIRES))
def test_left_and_right_are_alike(draw: list[float], tire: str) -> None:
    """Mirroring state and controls mirrors every rate of change."""
    one, state, c = plant(tire), state_of(np.array(draw)), controls_of(np.array(draw))
    swap = [1, 0, 3, 2]
    seen = Controls(-c.steer[swap], c.drive[swap], c.brake[swap], c.friction[swap], c.grade, -c.bank)
    slope, other = one.derivative(state, c)[0], one.derivative(mirrored(state), seen)[0]
    assert mirrored(slope) == pytest.approx(other, rel=1e-9, abs=1e-9)


def test_a_run_is_the_same_alone_and_in_any_batch() -> None:
    wet = Zone(0.4, from_place=1.0, to_place=2.5)
    courses = [
        course(tire=tire, speed=v, duration=0.2, zones=zones, steer=lambda t, v=v: 0.01 * v * t, name=f"{tire} {v:g}")
        for tire in TIRES
        for v, zones in ((4.0, ()), (11.0, (wet,)), (20.0, ()))
    ]
    cars = varied(suv(), {"mass": 0.2, "cg_height": 0.1, "wheel_inertia": 0.3}, range(len(courses)))
    together = simulate(courses, cars)
    backwards = simulate(courses[::-1], cars[::-1])
    for b, (one, car) in enumerate(zip(courses, cars, strict=True)):
        alone = simulate([one], [car])
        for name, value in alone.signals.items():
            assert together[name][b] == pytest.approx(value[0], rel=1e-9, abs=1e-9), name
            assert backwards[name][-1 - b] == pytest.approx(value[0], rel=1e-9, abs=1e-9), name


def test_a_shorter_run_in_a_batch_is_masked() -> None:
    short = course(speed=10.0, duration=0.2, name="short")
    truth = simulate([short, replace(short, duration=0.5, name="long")], [suv(), suv()])
    assert truth.valid.sum(axis=1).tolist() == [41, 101]
    assert truth.only("short").time[-1] == pytest.approx(0.2)
