"""Roads and rates of the field: a banked road, pitch without torques, wheel speeds at 50 Hz."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators.forces import AttitudeObserver, AttitudeStep
from estimators.pipeline import Check, EstimationPipeline, PipelineStep, VehicleSignals
from estimators.vehicle import GRAVITY
from estimators.velocity import VelocityFusion
from tests.support.pipeline_truth import CAR, TIME, noisy, straight
from tests.support.turning_course import Turn, longest, run, turn


def banked(yaw_rate: float, speed: float, angle: float, seconds: float = 9.0) -> Turn:
    """From 2 s on a turn, within a second, on a road that leans by `angle` rad; without an attitude sensor."""
    rise = np.clip((TIME * np.arange(round(seconds / TIME)) - 2.0) / 1.0, 0.0, 1.0)
    return turn(seconds, yaw_rate * rise, speed, GRAVITY * np.sin(angle * rise))


@pytest.mark.parametrize(("yaw_rate", "speed", "degrees"), [(0.0, 20.0, 12.0), (0.2, 20.0, -12.0)])
def test_a_cross_slope_is_learned_and_v_y_does_not_diverge(yaw_rate: float, speed: float, degrees: float) -> None:
    """17 m/s off after 15 s before."""
    course = banked(yaw_rate, speed, np.radians(degrees))
    fusion = VelocityFusion(CAR, TIME)
    found = run(course, fusion)
    settled = round(6.0 / TIME)
    assert np.abs(found.error_x).max() < 0.4
    assert np.abs(found.error_y)[settled:].max() < 0.8
    assert np.abs(found.error_y).max() < 4.5  # the half second that it takes to tell a road from a slide
    assert np.sign(found.steps[settled].gravity[1]) == np.sign(degrees)
    assert found.used[settled:].all()


def test_a_level_road_teaches_no_bank() -> None:
    """The negative control: the same turn without the slope."""
    found = run(banked(0.2, 20.0, 0.0))
    assert np.abs([step.gravity[1] for step in found.steps]).max() < 0.3
    assert np.abs(found.error_y).max() < 0.3
    assert longest(np.abs(found.error_y) > 3.0 * found.deviation_y) < 1.0


def piped(seconds: float, torque: bool, held: int, attitude: bool, spin: float = 0.0) -> list[PipelineStep]:
    """Straight on at 20 m/s; wheel speeds come every `held` samples, the pitch gyro has the bias `spin`."""
    truth = noisy(straight(np.zeros(round(seconds / TIME)), 20.0), 1)
    pipeline = EstimationPipeline(CAR, TIME, attitude=AttitudeObserver(TIME) if attitude else None)
    return [
        pipeline.step(
            VehicleSignals(
                truth.wheel_speed[k // held * held], truth.ax[k], truth.ay[k], truth.yaw_rate[k],
                torque=truth.torque[k] if torque else np.nan, roll_rate=0.0, pitch_rate=spin,
            )
        )
        for k in range(truth.ax.size)
    ]  # fmt: skip


@pytest.mark.parametrize("torque", [True, False])
def test_pitch_does_not_run_away_without_torques(torque: bool) -> None:
    """-13.6 degrees in a minute from a bias of 0.004 rad/s: what is left is bias over gain, with torques or without."""
    steps = piped(16.0, torque, 1, True, 0.004)
    assert np.degrees(steps[-1].pitch) == pytest.approx(-np.degrees(0.004 / 0.25), abs=0.7)
    assert steps[-1].vx == pytest.approx(20.0, abs=0.1)


def test_wheels_at_50_hz_are_wheels() -> None:
    """No alarm between their samples (75 % of all before), and one where they are lost."""
    steps = piped(2.0, True, 4, False)
    assert not any(step.consistency.failed & Check.NO_WHEEL for step in steps[10:])
    pipeline = EstimationPipeline(CAR, TIME)
    for k in range(40):
        step = pipeline.step(VehicleSignals(np.full(4, 60.0 if k < 20 else np.nan), 0.001 * k))
    assert step.consistency.failed & Check.NO_WHEEL


@pytest.mark.parametrize("rolling", [True, False])
def test_an_attitude_part_hears_of_a_slide(rolling: bool) -> None:
    """Four locked wheels and a side force: no axle tells V_y'. The negative control: the same with wheels that roll."""
    heard: list[bool] = []

    class Listening(AttitudeObserver):
        def step(self, *given: Any, sliding: Any = False, **more: Any) -> AttitudeStep:
            heard.append(bool(sliding))
            return super().step(*given, sliding=sliding, **more)

    pipeline = EstimationPipeline(CAR, TIME, attitude=Listening(TIME))
    pipeline.reset(vx=20.0)
    rng = np.random.default_rng(0)
    for _ in range(40):
        wheels = 20.0 / CAR.radius + 0.05 * rng.normal(size=4) if rolling else np.zeros(4)
        signals = VehicleSignals(
            wheels,
            0.05 * rng.normal(),
            2.0 + 0.05 * rng.normal(),
            0.1,
            roll_rate=0.0,
            pitch_rate=0.0,
            steer=np.array([0.02, 0.02, 0.0, 0.0]),
        )
        pipeline.step(signals)
    assert heard[-1] is not rolling
    assert not heard[0]
