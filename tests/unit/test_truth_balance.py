"""Newton, Euler and energy: what moves is what the forces say, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.vehicle import GRAVITY
from studies.truth import Truth
from studies.truth.road import Zone
from tests.support.truth_cases import TIRES, course, ramp, run

STEP = 0.001


@pytest.fixture(scope="module", params=TIRES)
def drive(request: pytest.FixtureRequest) -> Truth:
    """Steering, torque, then brakes, over an icy patch on the left, uphill and on a bank."""
    patch = Zone(0.25, (True, False, True, False), from_place=12.0, to_place=24.0)
    one = course(
        tire=request.param,
        speed=14.0,
        duration=1.6,
        zones=(patch,),
        steer=lambda t: 0.05 * np.sin(4.0 * t),
        drive_torque=lambda t: np.where(t < 0.8, 3500.0 * np.minimum(t / 0.2, 1.0), 0.0),
        brake_torque=ramp(0.9, 1.1, 4500.0),
        grade=ramp(0.2, 0.6, 0.05),
        bank=ramp(0.5, 0.9, -0.04),
    )
    return run(one, step=STEP, record_time=STEP)


def body_forces(truth: Truth) -> tuple[FloatArray, FloatArray]:
    """(n, 4) N along and across the car."""
    fx, fy, angle = truth["force_x"][0], truth["force_y"][0], truth["steer"][0]
    return fx * np.cos(angle) - fy * np.sin(angle), fx * np.sin(angle) + fy * np.cos(angle)


def test_mass_times_acceleration_is_the_sum_of_forces(drive: Truth) -> None:
    along, across = body_forces(drive)
    mass = drive.vehicles[0].parameters.mass
    vx, vy, r = (drive[name][0] for name in ("vx", "vy", "yaw_rate"))
    grade, bank = drive["grade"][0][1:], drive["bank"][0][1:]
    mean_x, mean_y, mean_r = (0.5 * (v[1:] + v[:-1]) for v in (vx, vy, r))
    pull = mass * (np.diff(vx) / STEP - mean_r * mean_y + GRAVITY * np.sin(grade))
    push = mass * (np.diff(vy) / STEP + mean_r * mean_x + GRAVITY * np.cos(grade) * np.sin(bank))
    scale = mass * GRAVITY
    assert np.abs(pull - along.sum(axis=1)[1:] + drive["drag"][0][1:]).max() < 1e-4 * scale
    assert np.abs(push - across.sum(axis=1)[1:]).max() < 1e-4 * scale
    assert np.abs(along.sum(axis=1)).max() > 0.3 * scale and np.abs(across.sum(axis=1)).max() > 0.2 * scale


def test_yaw_acceleration_is_the_sum_of_moments(drive: Truth) -> None:
    along, across = body_forces(drive)
    car = drive.vehicles[0].parameters
    moment = (car.corner_x * across - car.corner_y * along).sum(axis=1)
    assert np.diff(drive["yaw_rate"][0]) / STEP * car.yaw_inertia == pytest.approx(moment[1:], abs=1e-6)
    assert np.abs(moment).max() > 2000.0


def test_wheels_turn_as_their_torques_say(drive: Truth) -> None:
    """I_w w' = T - R_e F_x - rolling resistance, P1 (1), to rounding, also in the step in which a wheel locks."""
    car = drive.vehicles[0].parameters
    spin = car.wheel_inertia * np.diff(drive["wheel_speed"][0], axis=0) / STEP
    rest = drive["torque"][0] - drive["rolling_torque"][0] - car.radius * drive["force_x"][0]
    assert spin == pytest.approx(rest[1:], abs=1e-6)
    assert (drive["wheel_speed"][0] == 0.0).any()  # one of them was locked on the ice


def test_roll_pitch_and_loads_balance(drive: Truth) -> None:
    """I_x phi'' and I_y theta'' from second differences against the moments about the centre of gravity."""
    along, across = body_forces(drive)
    vehicle = drive.vehicles[0]
    car, load = vehicle.parameters, drive["force_z"][0]
    roll = (car.corner_y * load + car.cg_height * across).sum(axis=1)
    reaction = drive["torque"][0] - car.radius * along
    pitch = (car.corner_x * load + car.cg_height * along + reaction).sum(axis=1)
    for name, moment, ratio in (
        ("roll", roll, vehicle.chassis.roll_inertia_ratio),
        ("pitch", pitch, vehicle.chassis.pitch_inertia_ratio),
    ):
        second = np.diff(drive[name][0], n=2) / STEP**2 * car.yaw_inertia * ratio
        mean = 0.5 * (moment[1:-1] + moment[2:])
        assert np.abs(second - mean).max() < 0.02 * np.abs(mean).max(), name
        assert np.abs(mean).max() > 200.0


def test_loads_carry_the_car(drive: Truth) -> None:
    car, load = drive.vehicles[0].parameters, drive["force_z"][0]
    assert load.sum(axis=1).mean() == pytest.approx(car.mass * GRAVITY, rel=0.02)
    assert (load >= 0.0).all()
    left_turn = np.argmax(drive["road_ay"][0])
    assert load[left_turn, [1, 3]].sum() > load[left_turn, [0, 2]].sum()  # a left turn loads the right wheels


def test_tires_take_energy_and_never_give_more_than_they_store(drive: Truth) -> None:
    power = drive["force_x"][0] * drive["slip_velocity_x"][0] + drive["force_y"][0] * drive["slip_velocity_y"][0]
    taken = np.cumsum(power, axis=0) * STEP  # (n, 4) J
    given_back = (np.maximum.accumulate(taken, axis=0) - taken).max()
    assert taken[-1].min() > 500.0
    assert given_back < 100.0  # 1/2 F^2/C of a bristle field: (5 kN)^2/(2 x 3.5 MN/m) = 4 J, 60 J at 0.5 MN/m
