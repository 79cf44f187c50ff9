"""Roads and rates of the field: a banked road, pitch without torques, wheel speeds at 50 Hz."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from estimators.forces import AttitudeObserver
from estimators.pipeline import Check, EstimationPipeline, PipelineStep, VehicleSignals
from estimators.pipeline.last_sample import LastSample
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


def cruising(speed: float) -> float:
    """N m of each wheel that hold a speed, m/s, against the air, c_d A = 0.8 m^2, and rolling resistance, 0.01."""
    return 0.25 * CAR.radius * (0.5 * 1.2 * 0.8 * speed**2 + 0.01 * CAR.mass * GRAVITY)


def piped(seconds: float, torque: bool, held: int, attitude: bool, spin: float = 0.0) -> list[PipelineStep]:
    """Straight on at 20 m/s; wheel speeds come every `held` samples, the pitch gyro has the bias `spin`."""
    truth = noisy(straight(np.zeros(round(seconds / TIME)), 20.0), 1)
    pipeline = EstimationPipeline(CAR, TIME, attitude=AttitudeObserver(TIME) if attitude else None)
    return [
        pipeline.step(
            VehicleSignals(
                truth.wheel_speed[k // held * held], truth.ax[k], truth.ay[k], truth.yaw_rate[k],
                torque=truth.torque[k] + cruising(20.0) if torque else np.nan, roll_rate=0.0, pitch_rate=spin,
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


def led(rolling: bool) -> tuple[float, float]:
    """Three seconds of 2 m/s^2 to the left without a turn, steady gyros: deg of roll and its deviation."""
    pipeline = EstimationPipeline(CAR, TIME, attitude=AttitudeObserver(TIME))
    pipeline.reset(vx=20.0)
    rng = np.random.default_rng(0)
    for _ in range(600):
        wheels = 20.0 / CAR.radius + 0.05 * rng.normal(size=4) if rolling else np.zeros(4)
        ax, ay, turn = 0.05 * rng.normal(), 2.0 + 0.05 * rng.normal(), 0.002 * rng.normal()
        step = pipeline.step(VehicleSignals(wheels, ax, ay, turn, roll_rate=0.0, pitch_rate=0.0))
    assert step.attitude is not None
    return float(np.degrees(step.attitude.total_roll)), float(np.degrees(step.attitude.roll_deviation))


def test_a_slide_is_no_roll() -> None:
    """Four locked wheels: a_y is what V_y gains. The negative control: rolling wheels hold V_y, and the car leans."""
    slid, deviation = led(rolling=False)
    assert abs(slid) < 1.0
    assert abs(slid) < deviation
    leant, _ = led(rolling=True)
    assert leant > 3.0


def led_back(live: bool, seconds: float, used: bool = False) -> float:
    """Pitch, rad, of a car on a level road that began with 0.1, whose a_x the fusion does not use; `live`: a_x has noise."""
    attitude, last, rng = AttitudeObserver(TIME), LastSample(CAR, TIME, ()), np.random.default_rng(0)
    attitude.reset(pitch=0.1)
    moved = SimpleNamespace(
        vx=np.zeros(()), vy=np.zeros(()), yaw_rate=np.zeros(()), sensor_bias=np.zeros(3), inertial=np.zeros(3),
        inertial_used=np.array([used, True, True]), gravity=np.zeros(2), flags=np.zeros((), int), standing=np.array(False),
    )  # fmt: skip
    signals = VehicleSignals(np.full(4, 60.0), 0.0, 0.0, 0.0, roll_rate=0.0, pitch_rate=0.0)
    for _ in range(round(seconds / TIME)):
        last.learn(moved, 0.0, False)
        found = last.tilted(attitude, signals, 0.05 * rng.normal() if live else 0.0, 0.05 * rng.normal(), 0.0)
    assert found is not None
    return float(found.step.total_pitch)


def test_a_wrong_pitch_does_not_keep_a_x_out_for_ever() -> None:
    """Pitch ran to -0.4 rad, and every a_x contradicted it: V_x was off by 29 m/s on a gravel road."""
    assert abs(led_back(True, 25.0)) < 0.01
    assert abs(led_back(True, 25.0, used=True)) < 0.01
    assert led_back(True, 9.0) == pytest.approx(0.1, abs=1e-3)  # a fault of seconds is no gravity


def test_an_a_x_that_is_stuck_does_not_lead_pitch() -> None:
    """The negative control."""
    assert led_back(False, 25.0) == pytest.approx(0.1, abs=1e-3)


def test_wheels_that_carry_no_force_bring_v_x_back_from_a_wrong_pitch() -> None:
    """17 degrees: gravity that is none took V_x along for ever, -48 m/s after 25 s, and all wheels counted as slipping."""
    attitude = AttitudeObserver(TIME)
    attitude.reset(pitch=0.3)
    truth = noisy(straight(np.zeros(4000), 20.0), 1)
    pipeline = EstimationPipeline(CAR, TIME, attitude=attitude)
    for k in range(truth.ax.size):
        signals = truth.wheel_speed[k], truth.ax[k], truth.ay[k], truth.yaw_rate[k]
        step = pipeline.step(VehicleSignals(*signals, torque=truth.torque[k], roll_rate=0.0, pitch_rate=0.0))
        assert abs(step.vx - 20.0) < 5.0
    assert step.vx == pytest.approx(20.0, abs=0.2)


@pytest.mark.parametrize("speed", [10.0, 40.0])
def test_air_and_rolling_resistance_are_no_pitch(speed: float) -> None:
    """Wheels pull against them, and the car gains nothing: 2.5 degrees of a slope that is none at 40 m/s."""
    truth = noisy(straight(np.zeros(4000), speed), 1)
    pipeline = EstimationPipeline(CAR, TIME, attitude=AttitudeObserver(TIME))
    pitch = []
    for k in range(truth.ax.size):
        signals = truth.wheel_speed[k], truth.ax[k], truth.ay[k], truth.yaw_rate[k]
        torque = truth.torque[k] + cruising(speed)
        step = pipeline.step(VehicleSignals(*signals, torque=torque, roll_rate=0.0, pitch_rate=0.0))
        pitch.append(step.pitch)
    assert abs(np.degrees(np.mean(pitch[3000:]))) < 0.45
