"""Observer inputs against closed forms: statics, kinematics of a rigid body, a filter's ramp response."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.forces import normalised, vertical_loads
from estimators.vehicle import GRAVITY, VehicleParameters
from estimators.velocity import corner_acceleration_by_speed
from studies.drives import corner_inputs as ci
from studies.drives.corner_inputs import held, integrated_acceleration, mean_over
from studies.drives.evaluation import moving_slip

CAR = VehicleParameters(
    mass=2000.0, yaw_inertia=3500.0, wheel_inertia=1.0, front_axle_distance=1.2, rear_axle_distance=1.6, cg_height=0.6,
    front_track=1.5, rear_track=1.6, effective_radius=0.33,
)  # fmt: skip
RNG = np.random.default_rng(7)


def test_loads_carry_the_car_and_balance_its_moments() -> None:
    ax, ay = RNG.uniform(-8, 8, 50), RNG.uniform(-8, 8, 50)
    load = vertical_loads(CAR, ax, ay)
    m, h = CAR.mass, CAR.cg_height
    np.testing.assert_allclose(load.sum(axis=1), m * GRAVITY)
    pitch = load[:, :2].sum(axis=1) * 1.2 - load[:, 2:].sum(axis=1) * 1.6
    np.testing.assert_allclose(pitch, -m * ax * h, atol=1e-6)
    roll = (load[:, 1] - load[:, 0]) * 0.75 + (load[:, 3] - load[:, 2]) * 0.8
    np.testing.assert_allclose(roll, m * ay * h, atol=1e-6)


def test_signs_of_load_transfer() -> None:
    """Braking loads the front, a left turn (a_y > 0) the right wheels."""
    zero = np.zeros(1)
    rest = vertical_loads(CAR, zero, zero)[0]
    braking = vertical_loads(CAR, zero - 5, zero)[0]
    left = vertical_loads(CAR, zero, zero + 5)[0]
    assert (braking > rest).tolist() == [True, True, False, False]
    assert (left > rest).tolist() == [False, True, False, True]


def test_wheel_force_undoes_the_wheel_equation() -> None:
    """I dw/dt = T - R (F_x + c F_z sign w), solved for the force that was put in."""
    force, load, dw = (RNG.uniform(-1, 1, (30, 4)) * size for size in (4e3, 1e3, 200.0))
    load += 5e3
    radius = np.array([0.33, 0.33, 0.35, 0.35])
    for spin in (20.0, -20.0):
        w = np.full((30, 4), spin)
        torque = 1.5 * dw + radius * (force + 0.012 * load * np.sign(spin))
        np.testing.assert_allclose(ci.wheel_forces(torque, w, dw, load, 1.5, radius, 0.012, 1.0), force)


def test_a_stopped_wheel_says_nothing_about_its_force() -> None:
    w = np.array([[-0.07, 0.0, 0.99, 1.01]])
    one = np.ones((1, 4))
    force = ci.wheel_forces(-2000 * one, w, 0 * one, 5e3 * one, 1.5, one[0] / 3, 0.0, 1.0)
    assert np.isnan(force[0]).tolist() == [True, True, True, False]
    rolling = np.array([[9.0], [0.0], [9.0], [9.0]]) * one
    force = ci.wheel_forces(0 * rolling, rolling, 0 * rolling, 5e3 + 0 * rolling, 1.5, one[0] / 3, 0.0, 1.0)
    assert np.isnan(force[:, 0]).tolist() == [False, True, True, False]  # dw/dt behind the stop began inside it


def test_shared_forces_add_up() -> None:
    ax, load = RNG.uniform(-8, 8, 20), RNG.uniform(1e3, 8e3, (20, 4))
    nothing = np.full((20, 4), np.nan)
    forces = ci.shared_forces(ax, load, 2000.0, nothing, np.zeros(4, dtype=np.bool_))
    np.testing.assert_allclose(forces.sum(axis=1), 2000 * ax)
    assert np.ptp(forces / load, axis=1).max() < 1e-12
    rear = np.array([False, False, True, True])
    dynamics = np.where(rear, 1000.0, np.nan) * np.ones((20, 1))
    forces = ci.shared_forces(ax, load, 2000.0, dynamics, rear)
    np.testing.assert_allclose(forces.sum(axis=1), 2000 * ax)
    assert (forces[:, 2:] == 1000.0).all()


def test_lifted_wheels_have_no_normalised_force() -> None:
    load = np.array([[5e3, 1e2, 0.0, -50.0]])
    mu = normalised(np.full((1, 4), 1e3), load, 5e3)
    np.testing.assert_array_equal(mu, [[0.2, np.nan, np.nan, np.nan]])


@pytest.mark.parametrize("lag", [0.0, 0.003, 0.05])
def test_derivative_of_a_ramp_is_its_slope(lag: float) -> None:
    t = np.arange(100) * 0.005
    found = ci.derivative(4.0 - 3.0 * t, 0.005, lag)
    assert np.isnan(found[0])
    np.testing.assert_allclose(found[1:], -3.0, rtol=1e-9)


def test_derivative_of_a_bend_is_the_exponential_of_its_lag() -> None:
    """x' steps from 0 to 1: y(t) = 1 - exp(-t/lag), exactly, at the samples."""
    t = (np.arange(200) - 100) * 0.005
    found = ci.derivative(np.maximum(t, 0.0), 0.005, 0.02)
    np.testing.assert_allclose(found[100:], 1 - np.exp(-t[100:] / 0.02), atol=1e-12)


def test_derivative_starts_afresh_behind_a_gap() -> None:
    x = np.concatenate([np.zeros(5), [np.nan, np.nan], 10 + 0.01 * np.arange(5)])
    found = ci.derivative(x, 0.005, 0.05)
    assert np.isnan(found).tolist() == [True] + 4 * [False] + 3 * [True] + 4 * [False]
    np.testing.assert_allclose(found[8:], 2.0)


def test_corner_acceleration_is_the_derivative_of_the_corner_velocity() -> None:
    """A smooth planar motion with steering: central differences of v_xt against the formula, both ends independent."""
    h = 1e-4
    t = np.arange(0, 2, h)
    vx, vy, r = 15 + 2 * np.sin(t), 0.8 * np.cos(2 * t), 0.4 * np.sin(1.5 * t)
    dvx, dvy, dr = 2 * np.cos(t), -1.6 * np.sin(2 * t), 0.6 * np.cos(1.5 * t)
    steer = 0.2 * np.sin(3 * t)[:, None] * np.array([1.0, 0.9, 0.0, 0.0])
    rate = 0.6 * np.cos(3 * t)[:, None] * np.array([1.0, 0.9, 0.0, 0.0])
    x, y = CAR.corner_x, CAR.corner_y
    along, across = vx[:, None] - r[:, None] * y, vy[:, None] + r[:, None] * x
    v_xt = along * np.cos(steer) + across * np.sin(steer)
    free, per_speed = corner_acceleration_by_speed(CAR, dvx - r * vy, dvy + r * vx, r, dr, vy, steer, rate)
    found = free + per_speed * vx[:, None]
    np.testing.assert_allclose(found[1:-1], (v_xt[2:] - v_xt[:-2]) / (2 * h), atol=1e-6)


def test_integral_of_acceleration_in_a_turn() -> None:
    """a_x = dV_x/dt - r V_y gives V_x back when V_y is known, to the trapezoidal rule."""
    t = np.arange(0, 3, 0.005)
    vx, vy, r = 10 + np.sin(t), 0.5 * np.cos(t), np.full_like(t, 0.3)
    found = integrated_acceleration(np.cos(t) - r * vy, r, vy, 0.005, 10.0)
    np.testing.assert_allclose(found, vx, atol=1e-5)


def test_missing_samples_are_held_and_left_out() -> None:
    nan = np.nan
    np.testing.assert_array_equal(held(np.array([nan, 1, nan, nan, 2])), [0, 1, 1, 1, 2])
    np.testing.assert_array_equal(mean_over(np.array([[1.0, 3.0], [nan, 3.0], [nan, nan]])), [2, 3, nan])


def test_slip_ratio_of_spinning_locked_and_reversing_wheels() -> None:
    nan = np.nan
    surface = np.array([[11.0, 0.0, -9.0, 1.0, nan]])
    ground = np.array([[10.0, 10.0, -10.0, 1.0, 10.0]])
    np.testing.assert_allclose(moving_slip(surface, ground), [[1 / 11, -1.0, 0.1, nan, nan]])
