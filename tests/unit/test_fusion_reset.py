"""An estimate that rolling wheels contradict starts again from them; one that slipping wheels contradict does not."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.faults import Flag
from estimators.pipeline import EstimationPipeline
from estimators.velocity import FusionStep, VelocityFusion
from tests.support import pipeline_truth
from tests.support.fusion_course import CAR, STEP, Course, Signals, course, driven, phases, sensed

ROLLING = course(phases((1.0, 0.0), (2.0, 1.0), (1.0, -2.0)), start=20.0)
LATEST = 1.4  # s: one of rolling wheels, and the filter that differentiates them


def renewals(steps: list[FusionStep]) -> list[float]:
    """s at which the estimate started anew."""
    return [k * STEP for k, step in enumerate(steps) if step.flags & Flag.RESET]


def recovered(drive: Course, signals: Signals, silent: int, fusion: VelocityFusion | None = None) -> list[FusionStep]:
    steps, vx = driven(signals, fusion)
    again = [time for time in renewals(steps) if time > 0]
    assert len(again) == 1
    assert again[0] < silent * STEP + LATEST
    late = round(again[0] / STEP) + 1
    assert np.abs(vx - drive.speed)[late:].max() < 0.2
    return steps


@pytest.mark.parametrize("silent", [1, 60, 200])
def test_wheel_speeds_that_are_zero_at_first(silent: int) -> None:
    """Whether the calm car has been taken for standing meanwhile or not."""
    signals = sensed(ROLLING, bias=0.1)
    signals.wheel_speed[:silent] = 0.0
    steps = recovered(ROLLING, signals, silent)
    assert abs(steps[silent + 20].vx) < 1.0  # it was lost
    assert np.abs([step.vy for step in steps[-100:]]).max() < 0.1


def test_one_wheel_stays_silent_and_is_outvoted() -> None:
    signals = sensed(ROLLING)
    signals.wheel_speed[:60] = 0.0
    signals.wheel_speed[:, 2] = 0.0
    steps = recovered(ROLLING, signals, 60)
    assert not steps[-1].used[2]


def test_a_slow_bus_and_a_launch() -> None:
    """50 Hz at 200 Hz; and the force explains the side to which the wheels are off."""
    signals = sensed(ROLLING)
    signals.wheel_speed[:60] = 0.0
    held = np.arange(ROLLING.speed.size) // 4 * 4
    recovered(ROLLING, Signals(*(value[held] for value in signals)), 60)
    launch = course(phases((4.0, 2.0)), start=10.0)
    signals = sensed(launch)
    signals.wheel_speed[:60] = 0.0
    recovered(launch, signals, 60)


@pytest.mark.parametrize("wrong", [5.0, 40.0, -20.0])
def test_a_wrong_speed_that_reset_was_told(wrong: float) -> None:
    fusion = VelocityFusion(CAR, STEP)
    fusion.reset(vx=wrong)
    recovered(ROLLING, sensed(ROLLING), 0, fusion)


def test_a_car_that_stands_beyond_doubt() -> None:
    """The wheels stand and the body is calm: the bias is not bent to explain 20 m/s."""
    drive = course(phases((3.0, 0.0)))
    fusion = VelocityFusion(CAR, STEP)
    fusion.reset(vx=20.0)
    steps, vx = driven(sensed(drive, bias=0.2), fusion)
    assert renewals(steps) == [0.0, pytest.approx(1.0, abs=0.05)]
    assert abs(vx[-1]) < 0.02
    assert steps[-1].sensor_bias[0] + steps[-1].gravity[0] == pytest.approx(0.2, abs=0.03)


def test_only_the_lost_car_of_a_batch_starts_again() -> None:
    fusion = VelocityFusion(CAR, STEP, (2,))
    runs = [sensed(ROLLING, seed) for seed in (0, 1)]
    runs[0].wheel_speed[:60] = 0.0
    both = Signals(*(np.stack(parts, axis=1) for parts in zip(*runs, strict=True)))
    steps, vx = driven(both, fusion)
    flags = np.array([step.flags & Flag.RESET for step in steps]) != 0
    assert flags[:, 0].sum() == 1
    assert not flags[:, 1].any()
    assert np.abs(vx[-1] - ROLLING.speed[-1]).max() < 0.1


def pulsed(n: int, locked: float) -> FloatArray:
    """Share of the car's speed that a wheel keeps under an anti-lock brake: 0.3 s a stroke."""
    phase = (np.arange(n) % 60) / 60
    return np.interp(phase, [0.0, 0.2, 0.2 + locked, 1.0], [1.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("friction", [0.8, 0.3, 0.1])
@pytest.mark.parametrize("known", [True, False], ids=["force known", "force unknown"])
@pytest.mark.parametrize("brake", ["locked", "pulsed", "half slip"])
def test_four_wheels_that_brake_alike_are_no_evidence(friction: float, known: bool, brake: str) -> None:
    """All at once, for as long as it takes to 6 m/s, 4 s at most; afterwards they roll again."""
    seconds = min(4.0, 19.0 / (friction * 9.81))
    drive = course(phases((2.0, 0.0), (seconds, -friction * 9.81), (1.0, 0.0)), start=25.0)
    signals = sensed(drive, bias=0.1)
    braking = slice(420, 400 + round(seconds / STEP))
    n = signals.wheel_speed[braking].shape[0]
    share = {"locked": np.zeros(n), "pulsed": pulsed(n, 0.4), "half slip": np.full(n, 0.5)}[brake]
    signals.wheel_speed[braking] *= share[:, None]
    if not known:
        signals.force[braking] = np.nan
    steps, vx = driven(signals)
    assert not renewals(steps)
    assert not any(step.standing for step in steps)
    assert np.abs(vx - drive.speed).max() < 0.4


@pytest.mark.parametrize("acceleration", [0.6, 2.0])
def test_four_wheels_that_spin_from_rest_alike_are_no_evidence(acceleration: float) -> None:
    """On ice: the surfaces of all four run at 10 m/s, without a difference between them but noise."""
    drive = course(phases((2.0, 0.0), (4.0, acceleration)))
    signals = sensed(drive)
    spin = 10.0 * np.minimum(1.0, np.arange(drive.speed.size - 400) / 100)
    signals.wheel_speed[400:] = spin[:, None] / CAR.radius + 0.05 * np.random.default_rng(1).normal(size=(spin.size, 4))
    steps, vx = driven(signals)
    assert not renewals(steps)
    assert np.abs(vx - drive.speed).max() < 0.3


def test_saved_while_lost() -> None:
    signals = sensed(ROLLING)
    signals.wheel_speed[:60] = 0.0
    one, two = VelocityFusion(CAR, STEP), VelocityFusion(CAR, STEP)
    driven(Signals(*(value[:150] for value in signals)), one)
    two.restore(one.save())
    rest = Signals(*(value[150:] for value in signals))
    (mine, _), (yours, _) = driven(rest, one), driven(rest, two)
    assert renewals(mine) == renewals(yours) != []


def test_the_pipeline_recovers_too() -> None:
    truth = pipeline_truth.noisy(pipeline_truth.straight(np.repeat([0.5, -1.0], 300), 20.0), 1)
    truth.wheel_speed[:40] = 0.0
    steps = pipeline_truth.run(EstimationPipeline(CAR, STEP), truth)
    assert sum(bool(step.flags & Flag.RESET) for step in steps) == 1
    assert np.abs(np.array([step.vx for step in steps]) - truth.vx)[round((0.2 + LATEST) / STEP) :].max() < 0.2


def test_a_car_that_starts_again_without_a_lateral_velocity_may_slide() -> None:
    """Steering is unknown, so that the rear axle alone leads V_y; with V_y given it is believed."""
    samples = [Signals(*one) for one in zip(*sensed(ROLLING), strict=True)]
    deviations = []
    for beside in (np.nan, 0.0):
        fusion = VelocityFusion(CAR, STEP)
        for one in samples[:100]:
            fusion.step(*one)
        fusion.reset(vy=beside)
        deviations.append(float(fusion.step(*samples[100]._replace(steer=np.full(4, np.nan))).vy_deviation))
    assert deviations[0] > 1.2 * deviations[1]
