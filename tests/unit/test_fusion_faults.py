"""The fusion with broken signals: flagged, finite, and no more certain than it may be."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.faults import DRIVING, Flag
from estimators.velocity import VelocityFusion
from tests.support.fusion_course import CAR, STEP, Signals, course, driven, phases, sensed

LAUNCH = phases((1.0, 0.0), (4.0, 3.0), (3.0, 0.0))
CORNERING = (np.full(4, 60.0), np.array([0.05, 0.05, 0, 0]))


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("name", ["wheel_speed", "steer", "ax", "ay", "yaw_rate", "force"])
def test_scattered_bad_samples(name: str, value: float) -> None:
    drive = course(LAUNCH[:600])
    signals = sensed(drive)
    bad = np.random.default_rng(0).random(drive.speed.size) < 0.1
    bad[0] = False
    getattr(signals, name)[bad] = value
    steps, vx = driven(signals)
    assert rms(vx - drive.speed) < 0.15
    for step, broken in zip(steps, bad, strict=True):
        assert np.isfinite(step.vx)
        assert np.isfinite(step.vy)
        if name == "wheel_speed":
            assert bool((step.wheel_flags & Flag.MISSING_MEASUREMENT).all()) == broken
        elif name != "force":
            wanted = Flag.MISSING_INPUT | Flag.PARAMETER_OUT_OF_RANGE
            assert bool(step.flags & wanted) == broken


def test_a_lost_wheel_speed() -> None:
    drive = course(LAUNCH)
    signals = sensed(drive)
    signals.wheel_speed[300:, 1] = np.nan
    steps, vx = driven(signals)
    assert rms(vx - drive.speed) < 0.1
    np.testing.assert_array_equal(steps[-1].used, [True, False, True, True])


def test_a_wheel_that_reads_zero_for_ever() -> None:
    drive = course(LAUNCH)
    signals = sensed(drive)
    signals.wheel_speed[300:, 1] = 0.0
    steps, vx = driven(signals)
    assert rms(vx - drive.speed) < 0.1
    assert steps[-1].gated[1]


def test_a_frozen_wheel_speed_is_found_out() -> None:
    drive = course(LAUNCH)
    signals = sensed(drive)
    signals.wheel_speed[500:, 1] = signals.wheel_speed[500, 1]
    steps, vx = driven(signals)
    assert rms(vx - drive.speed) < 0.15
    assert bool(steps[520].wheel_flags[1] & Flag.STALE_MEASUREMENT)
    assert not any(step.used[1] for step in steps[700:])


def test_repeated_samples_do_not_make_it_overconfident() -> None:
    """A 50 Hz bus read at 200 Hz: not more certain than fresh samples at 200 Hz, and not wrong by more than it says."""
    drive = course(phases((6.0, 0.0)), start=20.0)
    runs = [sensed(drive, seed, bias=0.1 * (-1) ** seed) for seed in range(12)]
    signals = Signals(*(np.stack(parts, axis=1) for parts in zip(*runs, strict=True)))
    held = np.arange(drive.speed.size) // 4 * 4
    steps, vx = driven(Signals(*(value[held] for value in signals)), VelocityFusion(CAR, STEP, (12,)))
    whole, _ = driven(signals, VelocityFusion(CAR, STEP, (12,)))
    assert (steps[-2].wheel_flags == Flag.STALE_MEASUREMENT).all()
    assert not steps[-2].used.any()
    assert rms(vx[-1] - drive.speed[-1]) < 2 * steps[-1].vx_deviation.mean()
    assert steps[-1].vx_deviation.mean() > whole[-1].vx_deviation.mean()


def test_the_inertial_unit_is_lost_in_a_turn() -> None:
    fusion = VelocityFusion(CAR, STEP)
    turn = 0.3
    for _ in range(400):
        fusion.step(*CORNERING, 0.0, turn * 19.8, turn)
    for k in range(2000):
        speed = 60.0 - 0.015 * k
        step = fusion.step(np.full(4, speed) + 1e-3 * (k % 7), CORNERING[1], np.nan, np.nan, np.nan)
        assert np.isfinite([step.vx, step.vy]).all()
    assert bool(step.flags & Flag.MISSING_INPUT)
    assert step.vx == pytest.approx(speed * 0.33, abs=0.3)
    assert abs(step.vy) < 0.5
    assert step.vx_deviation < 2.0


@pytest.mark.parametrize("lost", ["ay", "yaw_rate"])
def test_one_lateral_signal_is_lost_in_a_turn(lost: str) -> None:
    fusion = VelocityFusion(CAR, STEP)
    wheels = CORNERING[0] - 0.3 * CAR.corner_y / CAR.radius
    for k in range(2000):
        noise = 1e-3 * (k % 5)
        signals = {"ax": noise, "ay": 0.3 * 19.8 + noise, "yaw_rate": 0.3 + noise}
        if k > 400:
            signals[lost] = np.nan
        step = fusion.step(wheels + noise, CORNERING[1], **signals)
    assert abs(step.vy) < 0.6  # the other signals say what it should read: the axles still hold V_y
    assert step.inertial_used.tolist() == [True, lost != "ay", lost != "yaw_rate"]


def test_everything_is_lost_for_long() -> None:
    fusion = VelocityFusion(CAR, STEP, (2,))
    nothing = np.full(2, np.nan)
    fusion.step(np.full((2, 4), 30.0), np.zeros((2, 4)), np.zeros(2), np.zeros(2), np.zeros(2))
    for _ in range(1200):
        step = fusion.step(np.full((2, 4), np.nan), np.full((2, 4), np.nan), nothing, nothing, nothing)
    for estimate in (step.vx, step.vy, step.vx_deviation, step.vy_deviation, step.slip, step.slip_angle, step.radius):
        assert np.isfinite(estimate).all()
    assert (step.vx_deviation <= 50.0).all()
    step = fusion.step(np.full((2, 4), 30.0), np.zeros((2, 4)), np.zeros(2), np.zeros(2), np.zeros(2))
    for _ in range(400):
        step = fusion.step(np.full((2, 4), 30.0), np.zeros((2, 4)), np.zeros(2), np.zeros(2), np.zeros(2))
    np.testing.assert_allclose(step.vx, 9.9, atol=0.1)


def test_no_wheel_at_the_start() -> None:
    fusion = VelocityFusion(CAR, STEP)
    for _ in range(10):
        step = fusion.step(np.full(4, np.nan), np.zeros(4), 0.0, 0.0, 0.0)
    assert step.vx_deviation > 10.0
    step = fusion.step(np.full(4, 60.0), np.zeros(4), 0.0, 0.0, 0.0)
    assert step.vx == pytest.approx(19.8, abs=0.01)


def test_impossible_times_are_replaced_and_flagged() -> None:
    fusion = VelocityFusion(CAR, STEP, (4,))
    wheels = np.full((4, 4), 30.0)
    step = fusion.step(wheels, np.zeros((4, 4)), 0.0, 0.0, 0.0, elapsed=np.array([0.005, 0.0, -1.0, np.nan]))
    np.testing.assert_array_equal(step.flags & ~DRIVING, [0, *[Flag.MISSING_INPUT] * 3])


def test_a_covariance_without_excitation_has_a_bound() -> None:
    """Parked for a quarter of an hour, and rolling at constant speed for as long."""
    fusion = VelocityFusion(CAR, 0.5, (2,))
    rng = np.random.default_rng(0)
    speed = np.array([[0.0], [40.0]])
    for _ in range(1800):
        wheels = np.where(speed > 0, speed + 0.05 * rng.normal(size=(2, 4)), 0.0)
        step = fusion.step(wheels, np.zeros((2, 4)), *(0.05 * rng.normal(size=(2, 2))), 0.002 * rng.normal(size=2))
    assert (step.vx_deviation < 0.5).all()
    assert (step.vy_deviation < 0.3).all()
    for part in (fusion.longitudinal_filter, fusion.lateral_filter):
        assert np.linalg.eigvalsh(part.covariance).min() > 0
