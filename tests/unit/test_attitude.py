"""Roll and pitch: agreeing sensors pass undisturbed, disagreeing ones as the second-order error says."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.linalg import expm

from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.forces import AttitudeObserver, attitude, without_gravity
from estimators.vehicle import GRAVITY

TIME = 0.005


def test_a_still_tilted_car_is_found_with_the_signs_of_the_imu() -> None:
    roll, pitch = 0.06, -0.04
    runner = AttitudeObserver(TIME)
    for _ in range(6000):
        found = runner.step(
            0.0, 0.0, GRAVITY * math.sin(pitch), GRAVITY * math.sin(roll), 0.0, 0.0, bank=0.02, grade=0.01
        )
    np.testing.assert_allclose([found.total_roll, found.total_pitch], [roll, pitch], atol=1e-4)  # e^(-t/4) of 30 s
    np.testing.assert_allclose([found.roll, found.pitch], [roll - 0.02, pitch - 0.01], atol=1e-4)
    assert found.used.all()
    assert not found.flags


def test_agreeing_rates_and_angles_pass_undisturbed() -> None:
    """A car that rolls and pitches while it accelerates: gyros and accelerometers tell the same story."""
    t = TIME * np.arange(2000)
    roll, pitch = 0.05 * np.sin(4.0 * t), 0.03 * np.sin(2.5 * t)
    p, nose_up = 0.2 * np.cos(4.0 * (t - TIME / 2)), 0.075 * np.cos(2.5 * (t - TIME / 2))  # rates between the samples
    motion_x, motion_y = 3.0 * np.sin(t), 4.0 * np.cos(1.3 * t)
    ax, ay = motion_x + GRAVITY * np.sin(pitch), motion_y + GRAVITY * np.sin(roll)
    runner = AttitudeObserver(TIME)
    runner.reset()
    error = []
    for k in range(1, 2000):
        found = runner.step(p[k], -nose_up[k], ax[k - 1], ay[k - 1], motion_x[k - 1], motion_y[k - 1])
        error.append([found.roll - roll[k], found.pitch - pitch[k]])
        free = without_gravity(ax[k], ay[k], found.total_roll, found.total_pitch)
        np.testing.assert_allclose(free, [motion_x[k], motion_y[k]], atol=0.01)
    assert np.abs(error).max() < 4e-4  # what is left is p cos(roll) and the Euler step


def test_a_wrong_start_dies_out_as_the_stated_second_order_error() -> None:
    tau, gain = 1.5, 0.4
    runner = AttitudeObserver(TIME, time_constant=tau, gain=gain)
    runner.reset(roll=0.02)
    move = expm(TIME * np.array([[0.0, gain], [-1.0 / tau, -1.0 / tau]]))  # angle, lagged difference
    state = np.array([0.02, 0.0])
    for _ in range(1500):
        found = runner.step(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        state = move @ state
        assert found.total_roll == pytest.approx(state[0], abs=2e-4)
    assert abs(found.total_roll) < 2e-3


@pytest.mark.parametrize("bias", [0.002, -0.01])
def test_a_gyro_bias_leaves_its_quotient_by_the_gain(bias: float) -> None:
    runner = AttitudeObserver(TIME)
    for _ in range(8000):
        found = runner.step(bias, bias, 0.0, 0.0, 0.0, 0.0)
    np.testing.assert_allclose([found.total_roll, found.total_pitch], [bias / 0.25, -bias / 0.25], rtol=2e-3)


def test_turning_on_a_slope_turns_roll_into_pitch() -> None:
    """A plane road tilted by 0.1: the car on it, turning in place, sees the slope rotate; the gyros know why."""
    slope, r = 0.1, 0.5
    runner = AttitudeObserver(TIME)
    runner.reset(roll=0.0, pitch=slope)
    up = np.array([math.sin(slope), 0.0, math.cos(slope)])  # the vertical, in the frame of the car
    spin = expm(-TIME * r * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    for _ in range(1000):
        up = spin @ up
        found = runner.step(0.0, 0.0, np.nan, np.nan, yaw_rate=r)
    np.testing.assert_allclose(np.sin([found.total_pitch, found.total_roll]), up[:2], atol=2e-3)


def test_lost_sensors_are_flagged_and_the_others_carry_on() -> None:
    runner = AttitudeObserver(TIME, (3,))
    runner.reset(roll=0.05)
    for k in range(400):
        # no motion known; no gyro; everything lost
        motion = np.array([np.nan, 0.0, np.nan])
        rate = np.array([0.01, np.nan, np.inf])
        found = runner.step(rate, 0.0, 0.0, GRAVITY * math.sin(0.05), motion, motion)
        reset = Flag.RESET if k == 0 else Flag.NONE
        expected = [Flag.MISSING_MEASUREMENT, Flag.MISSING_INPUT, Flag.MISSING_MEASUREMENT | Flag.MISSING_INPUT]
        assert [Flag(int(flag)) for flag in found.flags] == [reset | flag for flag in expected]
        assert np.isfinite(found.roll).all()
    np.testing.assert_allclose(found.roll, [0.07, 0.05, 0.05], atol=1e-4)
    assert np.isnan(found.innovation[[0, 2]]).all()
    assert found.used[1].all()
    for _ in range(3000):
        found = runner.step(1e3, -1e90, 1e90, 1e90, 0.0, 0.0)
    assert np.abs(found.roll).max() <= math.radians(60.001)


def test_deviations_are_those_of_cars_drawn_from_them() -> None:
    """NEES of roll and pitch of 400 cars at rest on roads, with biases, drawn from what the deviation is made of."""
    draw, cars = np.random.default_rng(3), 400
    tilt = np.array(attitude.LEVEL)[:, None] * draw.normal(size=(2, cars))
    felt = GRAVITY * tilt + attitude.ACCELERATION_BIAS * draw.normal(size=(2, cars))
    spin = attitude.GYRO_BIAS * draw.normal(size=(2, cars))
    runner, squares = AttitudeObserver(0.02, (cars,)), []
    for k in range(400):
        found = runner.step(spin[0], spin[1], felt[1], felt[0], 0.0, 0.0)
        if k % 25 == 24:
            sigma = np.stack([found.roll_deviation, found.pitch_deviation])
            squares.append(((np.stack([found.total_roll, found.total_pitch]) - tilt) / sigma) ** 2)
    assert 0.7 < np.mean(squares) < 1.3  # half as wide makes it 4, twice as wide 0.25


@pytest.mark.parametrize("turn", [0.0, 0.5])
def test_in_the_end_the_deviation_is_that_of_biases(turn: float) -> None:
    """sigma^2 = (b_a/g)^2 + ((b + misalignment |r|)/L)^2 once the accelerometers have all the share."""
    runner = AttitudeObserver(0.02)
    for _ in range(4000):
        found = runner.step(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, yaw_rate=turn)
    drift = (attitude.GYRO_BIAS + attitude.MISALIGNED * turn) / runner.gain
    expected = np.hypot(attitude.ACCELERATION_BIAS / GRAVITY, drift)
    assert found.roll_deviation == pytest.approx(expected, rel=1e-3)
    assert found.pitch_deviation == pytest.approx(expected, rel=1e-3)


def test_a_gyro_that_is_wrong_shows_in_the_deviation() -> None:
    """0.3 s at 0.3 rad/s of which the gyro says the opposite; accelerometers and motion tell the truth."""
    runner, nose = AttitudeObserver(TIME), 0.0
    before = runner.step(0.0, 0.0, 0.0, 0.0, 0.0, 0.0).pitch_deviation
    for k in range(400):
        rate = 0.3 if k < 60 else 0.0
        nose += TIME * rate
        found = runner.step(0.0, rate, GRAVITY * math.sin(nose), 0.0, 0.0, 0.0)
    assert abs(found.pitch - nose) > 4.0 * before
    assert abs(found.pitch - nose) < 3.0 * found.pitch_deviation


def test_states_are_saved_and_nonsense_is_refused() -> None:
    rng = np.random.default_rng(1)
    first, second = AttitudeObserver(TIME, (2,)), AttitudeObserver(TIME, (2,))
    for _ in range(20):
        first.step(*rng.normal(0, 0.1, (6, 2)))
    second.restore(first.save())
    signals = rng.normal(0, 0.1, (6, 2))
    np.testing.assert_array_equal(first.step(*signals).roll, second.step(*signals).roll)
    with pytest.raises(EstimatorError, match="time_constant = 0 s"):
        AttitudeObserver(TIME, time_constant=0.0)
    with pytest.raises(EstimatorError, match="roll = nan rad"):
        first.reset(roll=math.nan)
