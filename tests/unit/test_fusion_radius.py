"""Radii that are learned in free rolling: white noise does not move them, and a soft tire is named."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.velocity import FusionStep, VelocityFusion, soft_tires
from tests.support.fusion_course import CAR, STEP, Signals, course, driven, phases, sensed

SOFT = 0.97  # of its catalogue radius


def rolled(speed: float, seconds: float, factor: float = 1.0) -> tuple[VelocityFusion, list[FusionStep], FloatArray]:
    """Two cars at constant speed; the rear left radius of the second is `factor` of the catalogue."""
    drive = course(phases((seconds, 0.0)), start=speed)
    runs = [sensed(drive, seed) for seed in (0, 1)]
    runs[1].wheel_speed[:, 2] /= factor
    fusion = VelocityFusion(CAR, STEP, (2,))
    steps, vx = driven(Signals(*(np.stack(parts, axis=1) for parts in zip(*runs, strict=True))), fusion)
    return fusion, steps, vx - speed


def test_noise_of_the_wheel_speeds_does_not_move_the_radii() -> None:
    """With the measured surface speed in the sensitivity they fall by 0.25 % a minute at 30 m/s, and V_x with them."""
    _, steps, error = rolled(30.0, 40.0)
    assert np.abs(error).max() < 0.03
    assert np.abs(steps[-1].radius / CAR.radius - 1.0).max() < 0.0005


def test_a_soft_tire_is_named_within_a_minute_and_a_healthy_car_has_none() -> None:
    fusion, steps, error = rolled(20.0, 30.0, SOFT)
    found = soft_tires(fusion)
    assert found.soft.tolist() == [[False] * 4, [False, False, True, False]]
    assert found.change[1, 2] == pytest.approx(SOFT - 1.0, abs=3.0 * found.deviation[1, 2])
    assert found.deviation[1, 2] < 0.002
    assert np.abs(found.change[0]).max() < 0.002
    assert np.sqrt(np.mean(error**2, axis=0)).max() < 0.1
    spread = np.array([step.vx_deviation for step in steps])
    assert (np.abs(error) < 3.0 * spread).mean() > 0.99


def test_nothing_is_named_before_anything_was_learned() -> None:
    found = soft_tires(VelocityFusion(CAR, STEP))
    assert found.change.shape == (4,)
    assert not found.soft.any()
    assert (found.deviation > 0.004).all()
