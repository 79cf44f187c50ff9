"""Wheel loads: sums, signs, slopes, lifted wheels, and the body that answers with a delay."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.forces import BodyResponse, VerticalLoads, levelled, vertical_loads
from estimators.vehicle import GRAVITY, VehicleParameters

TIME = 0.005
CAR = VehicleParameters.published_suv()


def test_level_loads_are_the_quasi_static_ones() -> None:
    """P1 (15), (17) at zero angles, written out: Fz_i = m (L g -+ h a_x)/L (1/2 -+ h a_y/(g T_i))."""
    rng = np.random.default_rng(1)
    ax, ay = rng.normal(0, 3, (2, 100))
    front = CAR.mass / CAR.wheelbase * (CAR.rear_axle_distance * GRAVITY - CAR.cg_height * ax)
    rear = CAR.mass / CAR.wheelbase * (CAR.front_axle_distance * GRAVITY + CAR.cg_height * ax)
    shifts = (CAR.cg_height * ay / (GRAVITY * track) for track in (CAR.front_track, CAR.rear_track))
    pairs = zip((front, rear), shifts, strict=True)
    expected = np.stack([axle * (0.5 + sign * shift) for axle, shift in pairs for sign in (-1, 1)], axis=-1)
    np.testing.assert_allclose(vertical_loads(CAR, ax, ay), expected)
    np.testing.assert_allclose(vertical_loads(CAR, 0.0, 0.0), CAR.static_loads)


def test_loads_sum_to_the_vertical_specific_force() -> None:
    rng = np.random.default_rng(2)
    ax, ay = rng.normal(0, 3, (2, 100))
    az = GRAVITY + rng.normal(0, 2, 100)
    pitch, roll = rng.normal(0, 0.1, (2, 100))
    up = levelled(ax, ay, az, pitch, roll)[2]
    np.testing.assert_allclose(vertical_loads(CAR, ax, ay, az, pitch, roll).sum(-1), CAR.mass * up)


def test_axles_balance_moments_about_the_ground() -> None:
    """Independent way: moments of inertia force and weight about the axles, and about the wheel contacts of the car."""
    ax, ay = 2.0, 4.0
    fl, fr, rl, rr = vertical_loads(CAR, ax, ay)
    m, h, base = CAR.mass, CAR.cg_height, CAR.wheelbase
    assert (fl + fr) * base == pytest.approx(m * GRAVITY * CAR.rear_axle_distance - m * ax * h)
    assert (rl + rr) * base == pytest.approx(m * GRAVITY * CAR.front_axle_distance + m * ax * h)
    roll_moment = (fr - fl) * CAR.front_track / 2 + (rr - rl) * CAR.rear_track / 2
    assert roll_moment == pytest.approx(m * ay * h)


@pytest.mark.parametrize("angle", [0.05, -0.12])
def test_a_tilted_body_at_rest_on_a_level_road_carries_its_static_loads(angle: float) -> None:
    """P1 (11) and (14) must agree: an IMU tilted by the springs reads gravity, and that is not a load transfer."""
    low = replace(CAR, roll_center_height=0.0)
    sine, cosine = GRAVITY * math.sin(angle), GRAVITY * math.cos(angle)
    np.testing.assert_allclose(vertical_loads(low, sine, 0.0, cosine, pitch=angle), CAR.static_loads, rtol=1e-12)
    np.testing.assert_allclose(vertical_loads(low, 0.0, sine, cosine, roll=angle), CAR.static_loads, rtol=1e-12)
    leaning = vertical_loads(CAR, 0.0, sine, cosine, roll=angle)  # h_rc: the weight has moved to the lower side
    shift = CAR.roll_center_height * math.sin(angle) / CAR.front_track
    np.testing.assert_allclose(leaning[1] / (leaning[0] + leaning[1]), 0.5 + shift)


def test_a_car_parked_uphill_loads_its_rear() -> None:
    grade = 0.15
    loads = vertical_loads(CAR, GRAVITY * math.sin(grade), 0.0, GRAVITY * math.cos(grade))
    base, h = CAR.wheelbase, CAR.cg_height
    weight = CAR.mass * GRAVITY
    rear = weight * (CAR.front_axle_distance * math.cos(grade) + h * math.sin(grade)) / base
    assert loads[2:].sum() == pytest.approx(rear)
    assert loads.sum() == pytest.approx(weight * math.cos(grade))


def test_signs() -> None:
    braking, left = vertical_loads(CAR, -5.0, 0.0), vertical_loads(CAR, 0.0, 5.0)
    assert (braking[:2] > CAR.static_loads[:2]).all()
    assert (left[[1, 3]] > CAR.static_loads[[1, 3]]).all()


def test_lifted_wheels_carry_nothing_and_the_sum_stays() -> None:
    runner = VerticalLoads(CAR, TIME, (4,), dynamic=False)
    ax, ay = np.array([0.0, 40.0, -40.0, 30.0]), np.array([14.0, 0.0, -15.0, -30.0])
    found = runner.step(ax, ay)
    assert (found.load >= 0.0).all()
    np.testing.assert_allclose(found.load.sum(-1), CAR.mass * GRAVITY)
    assert found.lifted[0].tolist() == [True, False, True, False]
    assert found.lifted.any(axis=-1).all()
    flying = VerticalLoads(CAR, TIME).step(0.0, 0.0, az=-1.0)
    np.testing.assert_array_equal(flying.load, 0.0)
    assert flying.lifted.all()


def test_body_response_is_the_second_order_system() -> None:
    """Against scipy's simulation of I theta'' = m h a - M, M = K theta + C theta'."""
    rng = np.random.default_rng(3)
    a = np.repeat(rng.normal(0, 3, 60), 10)
    modes = ((1.4, 0.4), (1.7, 0.3), (2.0, 1.0))  # the last with a double pole
    runner = BodyResponse(TIME, (), modes)
    found = np.array([runner.step([x, x, x]) for x in a])
    t = TIME * np.arange(len(a) + 1)
    for i, (frequency, zeta) in enumerate(modes):
        w = 2 * math.pi * frequency
        system = StateSpace([[0, 1], [-w * w, -2 * zeta * w]], [[0], [1]], [[w * w, 2 * zeta * w]], [[0]])
        _, out, _ = lsim(system, np.append(a, a[-1]), t, X0=[a[0] / w**2, 0.0], interp=False)
        np.testing.assert_allclose(found[:, i], out[:-1], rtol=1e-9, atol=1e-9)


def test_body_response_settles_and_overshoots_as_stated() -> None:
    runner = BodyResponse(TIME)
    runner.step([0.0, 0.0])
    found = np.array([runner.step([1.0, 1.0]) for _ in range(600)])
    np.testing.assert_allclose(found[-1], 1.0, atol=1e-3)
    assert 1.2 < found[:, 0].max() < 1.45
    assert 1.2 < found[:, 1].max() < 1.55
    assert np.abs(found[200:] - 1.0).max() < 0.06


def test_dynamic_loads_start_settled_hold_what_is_missing_and_restore() -> None:
    runner, other = VerticalLoads(CAR, TIME, (2,)), VerticalLoads(CAR, TIME, (2,))
    first = runner.step(-3.0, 2.0)
    np.testing.assert_allclose(first.load, np.broadcast_to(vertical_loads(CAR, -3.0, 2.0), (2, 4)))
    for k in range(50):
        lost = 3 < k < 9
        found = runner.step([-3.0, np.nan if lost else -3.0], 2.0, az=[GRAVITY, np.inf if k == 20 else GRAVITY])
        np.testing.assert_allclose(found.load, first.load, rtol=1e-9)
        expected = Flag.MISSING_MEASUREMENT if lost or k == 20 else 0
        assert found.flags.tolist() == [0, expected]
    runner.step([1.0, 2.0], 0.0)
    other.restore(runner.save())
    np.testing.assert_array_equal(runner.step(0.0, 1.0).load, other.step(0.0, 1.0).load)
    runner.reset([True, False])
    found = runner.step(0.0, 0.0, pitch=0.0, roll=[0.0, np.nan])
    np.testing.assert_allclose(found.load[0], CAR.static_loads)
    assert found.flags.tolist() == [Flag.RESET, Flag.MISSING_INPUT]
    with pytest.raises(EstimatorError, match="frequency = 0 Hz must be finite and above 0"):
        VerticalLoads(CAR, TIME, pitch=(0.0, 0.3))
    with pytest.raises(EstimatorError, match=r"ax has shape \(3,\), expected \(2,\)"):
        runner.step(np.zeros(3), 0.0)


def test_vehicle_parameters_are_checked_all_at_once() -> None:
    with pytest.raises(EstimatorError) as caught:
        replace(CAR, mass=math.nan, cg_height=65.0, effective_radius=(0.3, 0.3, 0.3))
    message = str(caught.value)
    for part in (
        "mass = nan kg is not in",
        "cg_height = 65.0 m is not in [0.05, 5] m",
        "effective_radius has 3 values",
    ):
        assert part in message
    with pytest.raises(EstimatorError, match="exchange the two"):
        replace(CAR, roll_center_height=0.7)
    assert replace(CAR, effective_radius=(0.30, 0.31)).radii == (0.30, 0.30, 0.31, 0.31)
    assert CAR.static_loads.sum() == pytest.approx(CAR.mass * GRAVITY)
