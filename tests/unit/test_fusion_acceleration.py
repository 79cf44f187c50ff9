"""An accelerometer that is silent, frozen or wrong while the car changes its pace: forces and wheels carry on."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.faults import Flag
from estimators.forces import vertical_loads
from estimators.vehicle import GRAVITY
from estimators.velocity import FusionSettings, FusionStep, VelocityFusion
from estimators.velocity.longitudinal_fusion import GRADE, SPEED, LongitudinalFusion
from tests.support.fusion_course import CAR, COMPLIANCE, STEP, Course, Signals, course, driven, phases, sensed

FROM = 200  # sample at which the fault begins, 1 s
SETTLED = 100  # samples behind the fault, 0.5 s
NO_SEED = 3


class Fault(NamedTuple):
    """A drive and what becomes of a_x on it."""

    drive: Course
    change: Callable[[FloatArray], FloatArray]
    samples: int


def changing(acceleration: float, change: Callable[[FloatArray], FloatArray], seconds: float) -> Fault:
    """A second at constant speed, then `acceleration` as the fault begins; what is left of 5 s without a fault."""
    return Fault(course(phases((1.0, 0.0), (4.0, acceleration)), start=26.0), change, round(seconds / STEP))


def steady(acceleration: float, change: Callable[[FloatArray], FloatArray], seconds: float = 1.5) -> Fault:
    """The same acceleration for 5 s."""
    start = 10.0 if acceleration >= 0.0 else 10.0 - 5.0 * acceleration
    return Fault(course(phases((5.0, acceleration)), start=start), change, round(seconds / STEP))


def missing(ax: FloatArray) -> FloatArray:
    return np.full_like(ax, np.nan)


def frozen(ax: FloatArray) -> FloatArray:
    return np.full_like(ax, ax[0])


def wrong_sign(ax: FloatArray) -> FloatArray:
    return -ax


def off_by(step: float) -> Callable[[FloatArray], FloatArray]:
    return lambda ax: ax + step


LOST = [
    changing(a, change, seconds) for a in (-5.0, -3.0, 3.0) for change in (missing, frozen) for seconds in (1.0, 3.0)
]
BY = 5 * [-6.6, -4.0, -2.0, 2.0, 4.0, 6.6]  # m/s^2
WRONG = [steady(a, off_by(step)) for a, step in zip(np.repeat([0.0, 1.0, -1.5, 2.0, -4.0], 6), BY, strict=True)]
WRONG += [steady(a, wrong_sign) for a in (3.0, -4.0)]


def told(fault: Fault, force: bool, seed: int = NO_SEED) -> Signals:
    signals = sensed(fault.drive, seed, bias=0.1)
    fault_at = slice(FROM, FROM + fault.samples)
    signals.ax[fault_at] = fault.change(signals.ax[fault_at])
    return signals if force else signals._replace(force=np.full_like(signals.force, np.nan))


def followed(cases: list[tuple[Fault, bool]]) -> tuple[list[FusionStep], FloatArray, FloatArray]:
    """Steps of all in one batch, errors of V_x (n, cases), and how far the mean wheel speed is off, likewise."""
    signals = Signals(*(np.stack(parts, axis=1) for parts in zip(*(told(*case) for case in cases), strict=True)))
    steps, vx = driven(signals, VelocityFusion(CAR, STEP, (len(cases),)))
    true = np.stack([fault.drive.speed for fault, _ in cases], axis=1)
    wheels = np.stack([(CAR.radius * fault.drive.wheel_speed).mean(axis=1) for fault, _ in cases], axis=1)
    return steps, vx - true, wheels - true


def test_an_accelerometer_that_is_lost_while_the_car_brakes_or_pulls() -> None:
    """Whether the forces are known or not."""
    steps, error, wheels = followed([(fault, force) for fault in LOST for force in (True, False)])
    deviation = np.array([step.vx_deviation for step in steps])
    for k in range(error.shape[1]):
        fault = LOST[k // 2]
        during = slice(FROM, FROM + fault.samples)
        assert np.abs(error[during, k]).max() < 0.35 + np.abs(wheels[during, k]).max()
        assert np.abs(error[FROM + fault.samples + SETTLED :, k]).max() < 0.3
        assert (np.abs(error[FROM:, k]) < 0.1 + 3.0 * deviation[FROM:, k]).all()


def test_one_car_alone() -> None:
    for fault in (LOST[0], LOST[2], steady(2.0, off_by(-6.6))):
        steps, vx = driven(told(fault, force=True))
        assert np.abs(vx - fault.drive.speed)[FROM:].max() < 0.6
        assert abs(vx[-1] - fault.drive.speed[-1]) < 0.15
        assert steps[-1].used.all()


def test_an_accelerometer_that_is_wrong_for_a_while() -> None:
    """The forces contradict it and the wheels side with them; half a second later nothing is left of it."""
    steps, error, wheels = followed([(fault, True) for fault in WRONG])
    for k, fault in enumerate(WRONG):
        during = slice(FROM, FROM + fault.samples)
        assert np.abs(error[during, k]).max() < 0.6 + np.abs(wheels[during, k]).max()
        assert np.abs(error[FROM + fault.samples + SETTLED :, k]).max() < 0.25
    assert steps[-1].used.all()
    gated = np.array([step.flags & Flag.GATED for step in steps]) != 0
    assert not gated[:FROM].any()
    assert not gated[FROM + 300 + SETTLED :].any()
    assert (gated[FROM + 60 : FROM + 300, : len(WRONG) - 2].mean(axis=0) > 0.8)[[abs(step) > 3.0 for step in BY]].all()


def spinning(acceleration: float) -> tuple[Course, Signals]:
    """From 1 s on all four run 6 m/s ahead of the car, on ice: 5 m/s^2 above what it gains, and its force stays."""
    drive = course(phases((1.0, 0.0), (3.0, acceleration)), start=5.0)
    signals = sensed(drive, NO_SEED)
    ahead = 6.0 * np.clip((np.arange(drive.speed.size) - FROM) / 240, 0.0, 1.0)
    signals.wheel_speed[:] += ahead[:, None] / CAR.radius
    return drive, signals


@pytest.mark.parametrize("acceleration", [0.6, 1.5])
def test_four_wheels_that_spin_alike_are_not_believed(acceleration: float) -> None:
    """Nor while a_x is missing: then the force tells what the car gains."""
    drive, signals = spinning(acceleration)
    steps, vx = driven(signals)
    assert np.abs(vx - drive.speed).max() < 0.4
    assert not any(step.used.any() for step in steps[FROM + 60 :])
    signals.ax[FROM - 20 : FROM + 300] = np.nan
    _, vx = driven(signals)
    assert np.abs(vx - drive.speed)[: FROM + 300].max() < 0.9  # of 6 m/s that the wheels are off


@pytest.mark.parametrize("factor", [0.0, 0.5, 2.0, -1.0])
def test_wrong_forces_do_not_overrule_accelerometer_and_wheels(factor: float) -> None:
    drive = course(phases((1.0, 0.0), (2.0, 3.0), (1.0, 0.0), (2.0, -4.0)), start=10.0)
    signals = sensed(drive, NO_SEED)
    signals.force[:] *= factor
    _, vx = driven(signals)
    slip = COMPLIANCE * np.abs((1.0 - factor) * drive.ax) / GRAVITY  # which wrong forces do not explain
    assert np.abs(vx - drive.speed).max() < 0.35 + (slip * drive.speed).max()


@pytest.mark.parametrize("ax", [-8.0, 3.0])
def test_the_acceleration_of_the_forces(ax: float) -> None:
    """Front and rear use different shares of loads that the acceleration itself shifts."""
    load = vertical_loads(CAR, np.array([ax]), 0.0)[0]
    share = np.array([0.35, 0.35, 0.15, 0.15])
    mu = CAR.mass * ax * share / load
    fusion = VelocityFusion(CAR, STEP)
    for k in range(200):
        surface = 30.0 + ax * STEP * k
        fusion.step(surface / CAR.radius, 0.0, ax + 1e-3 * (k % 3), 0.0, 0.0, mu)
    assert fusion.signal_monitor.pull.gap + fusion.longitudinal_filter.state[0, 1] == pytest.approx(
        0.0, abs=0.08 * GRAVITY
    )
    assert fusion.signal_monitor.pull.since == 0.0


def test_nothing_is_doubted_on_a_plain_drive() -> None:
    fusion = VelocityFusion(CAR, STEP)
    for sample in zip(*sensed(course(phases((1.0, 0.0), (2.0, 4.0), (2.0, -6.0))), bias=0.15), strict=True):
        fusion.step(*sample)
        assert fusion.signal_monitor.pull.since == 0.0


@pytest.mark.parametrize("grade", [0.1, 0.3])
def test_a_grade_that_was_taken_off_the_accelerometer_is_no_contradiction(grade: float) -> None:
    """An attitude part takes gravity off a_x; the forces still have to carry the car up. The wheels side with a_x."""
    drive = course(phases((1.0, 0.0), (2.0, 2.0)), start=15.0)
    signals = sensed(drive, NO_SEED)
    signals.force[:] += grade
    signals.wheel_speed[:] += (COMPLIANCE * grade * drive.speed)[:, None] / CAR.radius
    steps, vx = driven(signals)
    assert not any(step.flags & Flag.GATED for step in steps)
    assert np.abs(vx - drive.speed).max() < 0.25


def test_a_parked_car_whose_accelerometer_repeats_itself_still_stands() -> None:
    fusion = VelocityFusion(CAR, STEP)
    for _ in range(400):
        step = fusion.step(0.0, 0.0, 0.02, 0.0, 0.0)
    assert step.standing
    assert abs(step.vx) < 0.02


@pytest.mark.parametrize("fault", [LOST[0], WRONG[0]], ids=["missing", "wrong"])
def test_saved_while_in_doubt(fault: Fault) -> None:
    signals = told(fault, force=True)
    one, two = VelocityFusion(CAR, STEP), VelocityFusion(CAR, STEP)
    driven(Signals(*(value[: FROM + 30] for value in signals)), one)
    assert one.signal_monitor.pull.since > 0.0
    two.restore(one.save())
    rest = Signals(*(value[FROM + 30 : FROM + 100] for value in signals))
    np.testing.assert_array_equal(driven(rest, one)[1], driven(rest, two)[1])
    one.reset()
    assert one.signal_monitor.pull.since == one.signal_monitor.pull.gap == one.signal_monitor.pull.apart == 0.0


def test_an_accelerometer_that_repeated_at_rest_is_believed_from_the_start_of_a_launch() -> None:
    """Without noise a_x is one and the same number for a second; the wheels' low-passed slope comes late, and is no evidence."""
    launch = course(np.concatenate([np.zeros(240), np.linspace(0.0, 3.5, 100), np.full(60, 3.5)]))
    still = np.zeros(launch.speed.size)
    signals = Signals(
        launch.wheel_speed, np.zeros((still.size, 4)), launch.ax, still, still, np.full_like(launch.force, np.nan)
    )
    steps, speed = driven(signals)
    used = np.array([bool(step.inertial_used[0]) for step in steps])
    assert used[242:].all()
    assert np.abs(speed - launch.speed)[240:].max() < 0.1


@pytest.mark.parametrize(("levelled", "rate"), [(True, 10.0 / 200.0 + 1.0 / 40.0), (False, 10.0 / 200.0)])
def test_what_attitude_leaves_is_forgotten_in_time_and_a_grade_along_the_road(levelled: bool, rate: float) -> None:
    """g = g_0 exp(-(V/L + 1/T) t) while nothing measures; the same car without attitude is the negative control."""
    half = LongitudinalFusion([0.3] * 4, FusionSettings(road_length=200.0, levelling_memory=40.0), 1, 1)
    half.filter.renew(True, 10.0, 0.01)
    half.filter.mean[GRADE] = 0.2
    for _ in range(100):
        half.filter.mean[SPEED] = 10.0
        half.predict(0.02, 0.0, 0.1, 0.0, (0.0, 0.0), False, levelled)
    assert half.filter.mean[GRADE] == pytest.approx(0.2 * np.exp(-2.0 * rate), rel=1e-3)
