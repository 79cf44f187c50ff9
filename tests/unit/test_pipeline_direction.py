"""Wheel speeds without a sign: the gear tells the way, or the accelerometer does, and until then the deviation covers both."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.pipeline import EstimationPipeline, VehicleSignals
from tests.support.pipeline_truth import CAR, TIME, Truth, noisy, straight


def driven(
    truth: Truth, direction: float | None = None, torque: bool = False, unsigned: bool = True
) -> tuple[np.ndarray, ...]:
    """V_x error and deviation of a car whose sensors count teeth."""
    pipeline = EstimationPipeline(CAR, TIME, unsigned_wheels=unsigned)
    steps = [
        pipeline.step(VehicleSignals(
            np.abs(truth.wheel_speed[k]), truth.ax[k], truth.ay[k], truth.yaw_rate[k], truth.steer[k],
            truth.torque[k] if torque else np.nan, direction=direction,
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
