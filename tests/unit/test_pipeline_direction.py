"""Wheel speeds without a sign: the gear tells the way, or the accelerometer does, and until then the deviation covers both."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.pipeline import EstimationPipeline, VehicleSignals
from tests.support.pipeline_truth import CAR, TIME, Truth, noisy, straight


def driven(
    truth: Truth, direction: float | np.ndarray | None = None, torque: bool = False, unsigned: bool = True
) -> tuple[np.ndarray, ...]:
    """V_x error and deviation of a car whose sensors count teeth."""
    pipeline = EstimationPipeline(CAR, TIME, unsigned_wheels=unsigned)
    gear = None if direction is None else np.broadcast_to(direction, truth.ax.shape)
    steps = [
        pipeline.step(VehicleSignals(
            np.abs(truth.wheel_speed[k]), truth.ax[k], truth.ay[k], truth.yaw_rate[k], truth.steer[k],
            truth.torque[k] if torque else np.nan, direction=None if gear is None else gear[k],
        ))
        for k in range(truth.ax.size)
    ]  # fmt: skip
    vx, deviation = (np.array([getattr(step, name) for step in steps]) for name in ("vx", "vx_deviation"))
    return vx - truth.vx, deviation


def from_rest(pull: float, seed: int = 1) -> Truth:
    n = 400
    acceleration = np.concatenate([np.zeros(n), np.full(n, pull), np.zeros(n)])
    truth = noisy(straight(acceleration, 0.0), seed, (0.1, 0.0, 0.0))
    return truth._replace(wheel_speed=np.where(truth.vx[:, None] == 0.0, 0.0, truth.wheel_speed))


@pytest.mark.parametrize("pull", [-2.0, -0.7, 0.7, 2.0])
def test_the_way_is_found_at_a_start(pull: float) -> None:
    error, deviation = driven(from_rest(pull))
    assert np.abs(error).max() < 0.8
    assert np.abs(error)[700:].max() < 0.2
    assert (np.abs(error) < 3.0 * deviation + 0.1).all()
    assert deviation[-1] < 0.4


@pytest.mark.parametrize("direction", [-1.0, 1.0])
def test_the_gear_tells_the_way(direction: float) -> None:
    truth = noisy(straight(np.zeros(300), 4.0 * direction), 2)
    error, deviation = driven(truth, direction)
    assert np.abs(error)[20:].max() < 0.2
    assert deviation[-1] < 0.5


def test_backward_at_constant_speed_from_the_first_sample_on_is_open() -> None:
    """-4 m/s read as +3.98 with a deviation of 0.06: nothing tells, so both are within three deviations."""
    error, deviation = driven(noisy(straight(np.zeros(300), -4.0), 3))
    assert (np.abs(error) < 3.0 * deviation).all()


def test_braking_tells_the_way_and_turns_the_estimate_around() -> None:
    pull = np.concatenate([np.zeros(200), np.full(240, 2.0), np.zeros(100)])
    error, deviation = driven(noisy(straight(pull, -6.0), 4))
    assert np.abs(error[:200]).min() > 10.0
    assert np.abs(error)[400:].max() < 0.3
    assert (np.abs(error) < 3.0 * deviation + 0.1).all()


def test_signed_wheels_are_left_alone_and_a_fast_car_drives_forward() -> None:
    truth = noisy(straight(np.zeros(200), 25.0), 5)
    error, deviation = driven(truth)
    signed, usual = driven(truth, unsigned=False)
    np.testing.assert_array_equal(error, signed)
    np.testing.assert_array_equal(deviation[2:], usual[2:])


def test_a_car_that_rolls_back_in_a_forward_gear_is_not_sure_of_its_way() -> None:
    """A start on a hill: back to -1.6 m/s, then off; taken at its word, the gear makes that +1.6 with a deviation of 0.03."""
    pull = np.concatenate([np.zeros(200), np.full(320, -1.0), np.full(480, 2.0)])
    truth = noisy(straight(pull, 0.0), 6, (0.1, 0.0, 0.0))
    error, deviation = driven(truth, 1.0)
    assert (np.abs(error) < 3.0 * deviation + 0.1).all()
    assert np.abs(error)[460:540].max() < 0.2  # by then the accelerometer is sure
    assert np.abs(error)[850:].max() < 0.2
    straight_off, certain = driven(from_rest(1.0), 1.0)
    assert np.abs(straight_off)[420:].max() < 0.3
    assert certain[700:].max() < 0.3  # where gear and accelerometer agree, nothing is open


@pytest.mark.parametrize("moved", [250, 500])  # at 1.25 m/s, and at the stop, where the wheels give no pulses for 0.6 s
def test_a_lever_moved_while_the_car_still_rolls_is_for_the_way_after_the_stop(moved: int) -> None:
    pull = np.concatenate([np.zeros(200), np.full(500, -1.0), np.zeros(100)])
    truth = noisy(straight(pull, 1.5), 7)
    error, deviation = driven(truth, np.where(np.arange(800) < moved, 1.0, -1.0))
    assert np.abs(error)[20:].max() < 0.5
    assert np.abs(error[truth.vx > 0.4][20:]).max() < 0.2
    assert np.abs(error[truth.vx < -0.4]).max() < 0.2
    assert deviation[truth.vx < -0.4].max() < 0.3
