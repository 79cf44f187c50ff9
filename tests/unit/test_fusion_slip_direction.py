"""Wheels that slip against their force do not slip: the estimate is wrong. No torque is needed to know."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.faults import Flag
from estimators.velocity import VelocityFusion
from tests.support.fusion_course import CAR, STEP, Course, Signals, course, driven, phases, sensed

FAULT = slice(200, 500)
FORGOTTEN = FAULT.stop + 300  # 1.5 s behind the fault
STEPS = [
    (a, step) for a in (0.0, 2.0, -4.0) for step in (-6.6, -4.0, 4.0, 6.6) if (a + step) * step > 1.0
]  # a_x points to the side to which it leads the estimate


def told(drive: Course, reading: FloatArray, seed: int = 3) -> Signals:
    """No torques: forces are shares of a_x."""
    signals = sensed(drive, seed, bias=0.1)
    signals.ax[FAULT] += (reading - drive.ax)[FAULT]
    return signals._replace(force=np.full_like(signals.force, np.nan))


def test_a_wrong_accelerometer_without_torques() -> None:
    """Left alone, an estimate is off by 1.5 s times the step, and stays there as long as the car pulls or brakes."""
    drives = [course(phases((5.0, a)), start=10.0 if a >= 0.0 else 32.0) for a, _ in STEPS]
    runs = [told(drive, drive.ax + step) for drive, (_, step) in zip(drives, STEPS, strict=True)]
    both = Signals(*(np.stack(parts, axis=1) for parts in zip(*runs, strict=True)))
    _, vx = driven(both, VelocityFusion(CAR, STEP, (len(runs),)))
    for k, drive in enumerate(drives):
        error = np.abs(vx[:, k] - drive.speed)
        detectable = 0.5 + 0.03 * drive.speed[FAULT.start]  # m/s, of radii and dead speed; and what grows meanwhile
        assert error[FAULT].max() < 0.75 + 2.0 * detectable  # of 6 or 9.9
        assert error[FORGOTTEN:].max() < 0.2


@pytest.mark.parametrize("acceleration", [3.0, -5.0])
def test_one_car_whose_accelerometer_has_the_wrong_sign(acceleration: float) -> None:
    drive = course(phases((1.0, 0.0), (4.0, acceleration)), start=30.0)
    steps, vx = driven(told(drive, -drive.ax))
    error = np.abs(vx - drive.speed)
    gated = np.array([bool(step.flags & Flag.GATED) for step in steps])
    assert gated[FAULT].mean() > 0.5
    assert not gated[: FAULT.start].any()
    assert not gated[FORGOTTEN:].any()
    assert error[FAULT].max() < 0.5 * 1.5 * 2.0 * abs(acceleration)
    assert error[FORGOTTEN:].max() < 0.2


def test_four_wheels_that_slip_with_their_force_are_no_evidence() -> None:
    """All alike, braked or driven, their force known or not: what is possible is not doubted."""
    drives, runs = [], []
    there = np.clip(np.minimum(np.arange(300), np.arange(300)[::-1]) / 40, 0.0, 1.0)[:, None]
    for friction in (0.1, 0.4, 0.9):
        for slip in (-0.6, -0.2, 0.2, 1.0):
            drive = course(phases((1.0, 0.0), (1.5, friction * 9.81 * np.sign(slip)), (0.5, 0.0)), start=25.0)
            signals = sensed(drive, bias=0.1)
            signals.wheel_speed[FAULT] *= 1.0 + slip * there
            runs += [signals, signals._replace(force=np.full_like(signals.force, np.nan))]
            drives += [drive, drive]
    fusion = VelocityFusion(CAR, STEP, (len(runs),))
    together = Signals(*(np.stack(parts, axis=1) for parts in zip(*runs, strict=True)))
    true = np.stack([drive.speed for drive in drives], axis=1)
    for k, sample in enumerate(zip(*together, strict=True)):
        step = fusion.step(*sample)
        assert (fusion.signal_monitor.pull.remaining == 0.0).all()
        assert np.abs(step.vx - true[k]).max() < 0.6


def test_saved_and_forgotten() -> None:
    drive = course(phases((4.0, 0.0)), start=20.0)
    signals = told(drive, drive.ax - 6.0)
    one, two = VelocityFusion(CAR, STEP), VelocityFusion(CAR, STEP)
    k = 0
    while one.signal_monitor.pull.remaining == 0.0:
        one.step(*(value[k] for value in signals))
        k += 1
    assert FAULT.start < k < FAULT.start + 100
    two.restore(one.save())
    rest = Signals(*(value[k : k + 60] for value in signals))
    np.testing.assert_array_equal(driven(rest, one)[1], driven(rest, two)[1])
    one.reset()
    assert one.signal_monitor.pull.remaining == 0.0


def test_three_wheels_are_enough_and_two_are_not() -> None:
    drive = course(phases((4.0, 0.0)), start=20.0)
    found = []
    for lost in (1, 2):
        signals = told(drive, drive.ax - 6.0)
        signals.wheel_speed[150:, :lost] = np.nan
        fusion = VelocityFusion(CAR, STEP)
        driven(Signals(*(value[:270] for value in signals)), fusion)
        found.append(fusion.signal_monitor.pull.remaining > 0.0)
    assert found == [True, False]


def test_wheel_speeds_that_freeze_while_the_car_brakes_disprove_nothing() -> None:
    """They seem to be faster than the road; but they are dead."""
    drive = course(phases((1.0, 0.0), (3.0, -4.0)), start=25.0)
    signals = told(drive, drive.ax)
    signals.wheel_speed[200:] = signals.wheel_speed[200]
    _, vx = driven(signals)
    assert np.abs(vx - drive.speed).max() < 0.5
