"""Radii that are learned in free rolling: white noise does not move them, and a soft tire is named."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.velocity import FusionStep, VelocityFusion, soft_tires
from tests.support.fusion_course import CAR, STEP, course, driven, phases, sensed

SOFT = 0.97  # of its catalogue radius


class Rolled(NamedTuple):
    """What became of one car: its fusion, the steps, and the errors of V_x, m/s."""

    fusion: VelocityFusion
    steps: list[FusionStep]
    error: FloatArray


def rolled(speed: float, seconds: float, seed: int, factor: float = 1.0) -> Rolled:
    """At constant speed; the rear left radius is `factor` of the catalogue."""
    signals = sensed(course(phases((seconds, 0.0)), start=speed), seed)
    signals.wheel_speed[:, 2] /= factor
    fusion = VelocityFusion(CAR, STEP)
    steps, vx = driven(signals, fusion)
    return Rolled(fusion, steps, vx - speed)


@pytest.mark.parametrize("seed", [0, 1])
def test_noise_of_the_wheel_speeds_does_not_move_the_radii(seed: int) -> None:
    """With the measured surface speed in the sensitivity they fall by 0.25 % a minute at 30 m/s, and V_x with them."""
    car = rolled(30.0, 40.0, seed)
    assert np.abs(car.error).max() < 0.03
    assert np.abs(car.steps[-1].radius / CAR.radius - 1.0).max() < 0.0005


def test_a_soft_tire_is_named_within_a_minute_and_a_healthy_car_has_none() -> None:
    healthy, soft = rolled(20.0, 30.0, 0), rolled(20.0, 30.0, 1, SOFT)
    right, found = soft_tires(healthy.fusion), soft_tires(soft.fusion)
    assert [right.soft.tolist(), found.soft.tolist()] == [[False] * 4, [False, False, True, False]]
    assert found.change[2] == pytest.approx(SOFT - 1.0, abs=3.0 * found.deviation[2])
    assert found.deviation[2] < 0.002
    assert np.abs(right.change).max() < 0.002
    for car in (healthy, soft):
        assert np.sqrt(np.mean(car.error**2)) < 0.1
        spread = np.array([step.vx_deviation for step in car.steps])
        assert (np.abs(car.error) < 3.0 * spread).mean() > 0.99


def test_nothing_is_named_before_anything_was_learned() -> None:
    found = soft_tires(VelocityFusion(CAR, STEP))
    assert found.change.shape == (4,)
    assert not found.soft.any()
    assert (found.deviation > 0.004).all()
