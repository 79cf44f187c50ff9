"""Standstill, and what only looks like it: slopes, slides sideways, creeping, and wheels of which two spin and two stand."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.faults import Flag
from estimators.velocity import VelocityFusion
from tests.support.fusion_course import CAR, STEP, Signals, course, driven, phases, sensed
from tests.support.turning_course import resets

AT_REST = course(phases((3.0, 0.0)))
N = AT_REST.speed.size


def unloaded(signals: Signals) -> Signals:
    """Without torques."""
    return signals._replace(force=np.full_like(signals.force, np.nan))


@pytest.mark.parametrize("name", ["ax", "ay"])
@pytest.mark.parametrize("gravity", [1.92, -1.92])
def test_parked_on_a_slope_of_20_percent(name: str, gravity: float) -> None:
    """Found at once: the wheels have never turned, and nothing changes. It took 1.7 s."""
    signals = unloaded(sensed(AT_REST))
    getattr(signals, name)[:] += gravity
    steps, vx = driven(signals)
    standing = np.array([step.standing for step in steps])
    assert np.flatnonzero(standing)[0] * STEP < 0.55
    assert standing[120:].all()
    assert np.abs(vx[120:]).max() < 0.05
    assert abs(steps[-1].vy) < 0.05


def test_a_car_that_was_moving_is_not_parked() -> None:
    """The negative control: the same readings behind a drive are locked wheels that slide."""
    drive = course(phases((1.0, 0.0), (2.0, -1.92)), start=12.0)
    signals = unloaded(sensed(drive))
    signals.wheel_speed[210:] = 0.0
    steps, vx = driven(signals)
    assert not any(step.standing for step in steps)
    assert np.abs(vx - drive.speed).max() < 0.6


def test_sliding_sideways_is_not_standing() -> None:
    """Wheels at rest, a_x and yaw rate calm, 12 m/s sideways on ice: V_y 0.35 with a deviation of 0.01 before."""
    true = np.maximum(12.0 - 2.0 * np.arange(1600) * STEP, 0.0)
    signals = unloaded(sensed(course(phases((8.0, 0.0)))))
    signals.ay[:] -= np.where(true > 0.0, 2.0, 0.0)
    fusion = VelocityFusion(CAR, STEP)
    fusion.reset(vx=0.0, vy=12.0)
    steps, _ = driven(signals, fusion)
    error, deviation = np.array([step.vy for step in steps]) - true, np.array([step.vy_deviation for step in steps])
    moving = true > 1.0
    assert not any(step.standing for step, moves in zip(steps, moving, strict=True) if moves)
    assert np.abs(error)[moving].max() < 0.2
    assert (np.abs(error) < 3.0 * deviation + 0.3)[moving].all()
    assert abs(steps[-1].vy) < 0.1 or steps[-1].vy_deviation > 0.3


def test_creeping_below_the_dead_band_of_the_sensors() -> None:
    """0.6 m/s read as 0: whatever is estimated, the truth is within three deviations (0.009 before)."""
    drive = course(phases((1.0, 0.0), (2.4, -1.0), (3.0, 0.0)), start=3.0)
    signals = unloaded(sensed(drive))
    signals.wheel_speed[CAR.radius * signals.wheel_speed < 0.62] = 0.0
    steps, vx = driven(signals)
    deviation = np.array([step.vx_deviation for step in steps])
    assert (np.abs(vx - drive.speed) < 3.0 * deviation + 0.05).all()
    parked, _ = driven(unloaded(sensed(AT_REST)))
    assert parked[-1].standing
    assert parked[-1].vx_deviation > 0.19


@pytest.mark.parametrize("since", [0, 200])
def test_two_wheels_that_spin_and_two_that_stand(since: int) -> None:
    """Stuck on ice, without torques: 5.8 m/s, a speed of no wheel, and seven resets before. It is told as open."""
    signals = unloaded(sensed(AT_REST))
    noise = 0.05 * np.random.default_rng(1).normal(size=(N - since, 2))
    signals.wheel_speed[since:, 2:] = 10.8 / CAR.radius[2:] + noise
    steps, vx = driven(signals)
    assert np.abs(vx).max() < 0.1
    assert resets(steps[1:]) == 0
    assert steps[-1].used.tolist() == [True, True, False, False]
    assert 3.0 * steps[-1].vx_deviation > 10.0


def test_three_wheels_that_spin_do_not_outvote_the_one_that_held_the_car() -> None:
    """Stuck, known to stand: 10.8 m/s with a deviation of 0.16 m/s before. It is told as open, too."""
    signals = unloaded(sensed(AT_REST))
    signals.wheel_speed[300:, 1:] = 10.8 / CAR.radius[1:] + 0.05 * np.random.default_rng(1).normal(size=(N - 300, 3))
    steps, vx = driven(signals)
    assert np.abs(vx).max() < 0.1
    assert resets(steps[1:]) == 0
    assert 3.0 * steps[-1].vx_deviation > 10.0


def test_three_wheels_that_roll_outvote_one() -> None:
    """The negative control: one dead sensor does not keep the car at rest."""
    drive = course(phases((3.0, 0.0)), start=10.8)
    signals = unloaded(sensed(drive))
    signals.wheel_speed[:, 1] = 0.0
    steps, vx = driven(signals)
    assert np.abs(vx - drive.speed)[10:].max() < 0.2
    assert bool(steps[-1].wheel_flags[1] & Flag.GATED)
    assert steps[-1].vx_deviation < 0.3


def test_a_car_that_crept_below_the_dead_band_teaches_no_radii() -> None:
    """It moves off at 0.5 m/s^2 while wheels read zero below 0.3 m/s, and rolls on at 0.8 m/s: radii came out 6 % low."""
    rng, fusion = np.random.default_rng(0), VelocityFusion(CAR, STEP)
    for k in range(1600):
        speed = min(0.5 * STEP * max(k - 600, 0), 0.8)
        turning = speed / 0.33 + 0.05 * rng.normal(size=4) if speed > 0.3 else np.zeros(4)
        pull = 0.5 if 600 < k < 920 else 0.0
        step = fusion.step(turning, 0.0, pull + 0.05 * rng.normal(), 0.05 * rng.normal(), 0.002 * rng.normal())
    assert step.vx == pytest.approx(0.8, abs=0.03)
    assert abs(step.vx - 0.8) < 3.0 * step.vx_deviation
    assert np.abs(step.radius / 0.33 - 1.0).max() < 0.02
