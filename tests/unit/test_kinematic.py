"""The kinematic Kalman filter with bias states."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.velocity import KinematicKalman

STEP = 0.005


@pytest.mark.parametrize("turn", [0.0, 1e-9, 0.3, -2.0])
def test_prediction_equals_the_matrix_exponential(turn: float) -> None:
    filter_ = KinematicKalman(STEP, bias_memory=1e12)
    filter_.reset(velocity=[20.0, -1.0])
    block = np.zeros((4, 4))
    block[0, 1], block[1, 0] = turn, -turn
    block[0, 2] = block[1, 3] = 1.0  # columns of the held accelerations
    expected = expm(STEP * block) @ [20.0, -1.0, 2.0, -3.0]
    step = filter_.step(2.0, -3.0, turn)
    np.testing.assert_allclose(step.velocity, expected[:2], rtol=1e-14)


def test_circular_motion_is_integrated_without_drift() -> None:
    """Constant speed on a circle, seen from the car: a_y = r u_x, nothing changes."""
    filter_ = KinematicKalman(STEP)
    filter_.reset(velocity=[15.0, 0.0])
    for _ in range(4000):
        step = filter_.step(0.0, 0.5 * 15.0, 0.5)
    np.testing.assert_allclose(step.velocity, [15.0, 0.0], atol=1e-9)


def test_biases_are_learned_from_a_measured_speed_and_the_turn() -> None:
    """u_x alone is measured; while the car turns it gives u_y and both biases."""
    filter_ = KinematicKalman(STEP)
    filter_.reset(velocity=[15.0, 0.0])
    bias = np.array([0.1, -0.12])
    t, vx, vy = 0.0, 15.0, 0.0
    for _ in range(6000):
        turn = 0.4 * np.sin(0.8 * t)
        ax, ay = 0.5 * np.cos(0.5 * t), turn * 15.0
        angle = turn * STEP
        rotation = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        drive = expm(STEP * np.array([[0, turn, ax], [-turn, 0, ay], [0, 0, 0]]))[:2, 2]
        vx, vy = rotation @ [vx, vy] + drive
        t += STEP
        step = filter_.step(ax - bias[0], ay - bias[1], turn, [vx, np.nan], [0.05, 1.0])
        np.testing.assert_array_equal(step.used, [True, False])
    np.testing.assert_allclose(step.velocity, [vx, vy], atol=0.05)
    np.testing.assert_allclose(step.bias, bias, atol=0.01)


def test_without_a_turn_the_lateral_velocity_is_not_observable_and_says_so() -> None:
    straight, turning = KinematicKalman(STEP), KinematicKalman(STEP)
    for filter_, turn in ((straight, 0.0), (turning, 0.4)):
        for _ in range(3000):
            step = filter_.step(0.0, 0.0, turn, [0.0, np.nan])
        deviation = np.sqrt(step.covariance[1, 1])
        assert (
            deviation > 2.0 if turn == 0.0 else deviation < 0.5
        )  # a_xb and r u_y look alike in a steady turn: 0.15/0.4


def test_covariance_has_a_bound() -> None:
    filter_ = KinematicKalman(0.1)
    widest = 0.0
    for _ in range(5000):
        step = filter_.step(np.nan, np.nan, 0.0)
        widest = max(widest, float(step.covariance[0, 0]))
    assert widest < 31.0**2
    assert step.covariance[2, 2] <= 0.15**2 * (1 + 1e-9)
    assert step.flags == Flag.MISSING_INPUT | Flag.MISSING_MEASUREMENT
    step = filter_.step(0.0, 0.0, 0.0, [10.0, 0.0])
    np.testing.assert_allclose(step.velocity, [10.0, 0.0], atol=0.01)


def test_missing_accelerations_are_held_and_flagged() -> None:
    filter_ = KinematicKalman(STEP, (2,))
    filter_.step(1.0, 0.0, 0.0)
    step = filter_.step(np.array([1.0, np.nan]), 0.0, 0.0, np.array([[1.0, np.inf], [np.nan, np.nan]]))
    assert step.velocity[0, 0] != 0
    assert bool(step.flags[1] & Flag.MISSING_INPUT)
    assert not step.flags[0] & Flag.MISSING_INPUT
    assert np.isfinite(step.velocity).all()
    np.testing.assert_array_equal(step.used, [[True, False], [False, False]])


def test_saved_and_restored() -> None:
    one, two = KinematicKalman(STEP, (3,)), KinematicKalman(STEP, (3,))
    for _ in range(5):
        one.step(1.0, 0.2, 0.1)
    two.restore(one.save())
    np.testing.assert_array_equal(one.step(0.0, 0.0, 0.1).velocity, two.step(0.0, 0.0, 0.1).velocity)


def test_bad_settings_are_refused() -> None:
    with pytest.raises(EstimatorError, match="bias_memory"):
        KinematicKalman(STEP, bias_memory=0.0)
    with pytest.raises(EstimatorError, match="velocity"):
        KinematicKalman(STEP).step(0.0, 0.0, 0.0, np.zeros(3))
