"""Corner kinematics and slips, against the derivative of a known motion and simple geometry."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.vehicle import VehicleParameters
from estimators.velocity import (
    corner_acceleration,
    corner_velocity,
    side_slip_angle,
    slip_ratio,
    tire_frame,
    vehicle_frame,
)

CAR = VehicleParameters.published_suv()
TIME = np.linspace(0.0, 4.0, 4001)


def motion(t: np.ndarray) -> dict[str, np.ndarray]:
    """A smooth drive with everything in it, and its exact derivatives."""
    vx, dvx = 12.0 + 3.0 * np.sin(0.7 * t), 2.1 * np.cos(0.7 * t)
    vy, dvy = 0.8 * np.cos(1.3 * t), -1.04 * np.sin(1.3 * t)
    r, dr = 0.4 * np.sin(1.1 * t), 0.44 * np.cos(1.1 * t)
    delta, ddelta = 0.2 * np.sin(1.5 * t), 0.3 * np.cos(1.5 * t)
    steer = np.stack([delta, 0.9 * delta, 0 * delta, 0 * delta], axis=-1)
    rate = np.stack([ddelta, 0.9 * ddelta, 0 * delta, 0 * delta], axis=-1)
    return {"vx": vx, "vy": vy, "r": r, "dr": dr, "ax": dvx - r * vy, "ay": dvy + r * vx, "steer": steer, "rate": rate}


def accelerated(m: dict[str, np.ndarray], rate: np.ndarray) -> np.ndarray:
    found = corner_acceleration(CAR, m["ax"], m["ay"], m["r"], m["dr"], m["vx"], m["vy"], m["steer"], rate)
    return np.stack([found.x, found.y], axis=-1)


def test_corner_acceleration_is_the_derivative_of_the_corner_velocity() -> None:
    m = motion(TIME)
    tire = tire_frame(corner_velocity(CAR, m["vx"], m["vy"], m["r"]), m["steer"])
    numeric = np.gradient(np.stack([tire.x, tire.y], axis=-1), TIME[1] - TIME[0], axis=0, edge_order=2)
    np.testing.assert_allclose(accelerated(m, m["rate"])[1:-1], numeric[1:-1], atol=2e-5)


def test_the_steering_rate_that_the_paper_leaves_out_is_not_small() -> None:
    """0.3 rad/s at 12 m/s are 3.6 m/s^2 (P1 notes 6)."""
    m = {key: np.array(0.0) for key in ("vy", "r", "dr", "ax", "ay")} | {"vx": np.array(12.0)}
    m["steer"], rate = np.zeros(4), np.array([0.3, 0.3, 0.0, 0.0])
    np.testing.assert_allclose((accelerated(m, rate) - accelerated(m, 0 * rate))[:, 1], [-3.6, -3.6, 0, 0], atol=1e-12)


def test_pure_rotation_moves_the_corners_sideways_and_along() -> None:
    found = corner_velocity(CAR, 0.0, 0.0, 1.0)
    np.testing.assert_allclose(found.x, -CAR.corner_y)
    np.testing.assert_allclose(found.y, CAR.corner_x)


def test_frames_are_inverse_and_keep_lengths() -> None:
    rng = np.random.default_rng(0)
    body = corner_velocity(CAR, *rng.normal(size=(3, 5)))
    steer = rng.normal(size=(5, 4))
    there = tire_frame(body, steer)
    np.testing.assert_allclose(np.hypot(*there), np.hypot(*body))
    np.testing.assert_allclose(vehicle_frame(there, steer), body)


@pytest.mark.parametrize(
    ("surface", "velocity", "expected"),
    [(10.0, 10.0, 0.0), (20.0, 10.0, 0.5), (10.0, 20.0, -0.5), (0.0, 10.0, -1.0), (5.0, 0.0, 1.0), (0.0, 0.0, 0.0)],
)
def test_slip_ratio(surface: float, velocity: float, expected: float) -> None:
    assert slip_ratio(surface, velocity) == pytest.approx(expected)
    assert slip_ratio(-surface, -velocity) == pytest.approx(-expected)  # backwards: the sign of the slip velocity


def test_slips_at_standstill_are_those_of_a_small_error() -> None:
    assert abs(float(slip_ratio(0.01, 0.0))) < 0.03
    assert abs(float(side_slip_angle(0.0, 0.01))) < 0.03
    assert np.isnan(slip_ratio(np.nan, 1.0))


def test_slip_angle_has_the_sign_of_the_lateral_velocity() -> None:
    assert side_slip_angle(10.0, 1.0) == pytest.approx(np.arctan(0.1))
    assert side_slip_angle(-10.0, 1.0) == pytest.approx(np.arctan(0.1))
