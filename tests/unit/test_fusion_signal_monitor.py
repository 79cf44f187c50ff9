"""Yaw rate and lateral acceleration that freeze, clip, vanish or change their sign in a turn: found, replaced, and back again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.faults import Flag
from estimators.velocity import VelocityFusion
from tests.support.fusion_course import CAR, STEP, Signals, driven
from tests.support.turning_course import Turn, longest, run, there_and_back, turn

FAULT = slice(500, 900)  # 2.5 to 4.5 s: in the turn and out of it
BACK = FAULT.stop + 400  # 2 s later
YAW = there_and_back(8.0, 0.2)
Change = Callable[[FloatArray], FloatArray]
CHANGES: dict[str, Change] = {
    "missing": lambda value: np.full_like(value, np.nan),
    "frozen": lambda value: np.full_like(value, value[0]),
    "zero": np.zeros_like,
    "clipped": lambda value: np.clip(value, -0.5 * np.abs(value).max(), 0.5 * np.abs(value).max()),
    "negated": lambda value: -value,
    "doubled": lambda value: 2.0 * value,
}
PLACES = {"ay": 1, "yaw_rate": 2}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("name", PLACES)
def test_a_signal_at_fault_in_a_turn(name: str, change: str) -> None:
    """Before, V_y was off by 9 m/s after 2 s, and did not come back."""
    course = turn(8.0, YAW)
    signal = getattr(course.signals, name)
    true = signal.copy()
    signal[FAULT] = CHANGES[change](signal[FAULT])
    found = run(course)
    assert np.abs(found.error_x).max() < 0.3
    assert np.abs(found.error_y)[FAULT].max() < 0.5
    assert np.abs(found.error_y)[BACK:].max() < 0.1
    assert longest(np.abs(found.error_y) > 3.0 * found.deviation_y) < 1.0
    off = ~(np.abs(signal - true) < (1.2 if name == "ay" else 0.06))  # NaN is off
    matters = np.flatnonzero(np.convolve(off, np.ones(40))[: off.size] >= 40)  # for 0.2 s
    if matters.size:
        assert not found.used[matters[0], PLACES[name]]
    others = [place for place in range(3) if place != PLACES[name]]
    assert found.used[:, others].mean() > 0.97  # while a yaw rate jumps, a_y is in doubt too
    assert found.used[BACK:].all()


def test_two_at_once_are_found_from_the_wheels() -> None:
    course = turn(8.0, YAW)
    for name in PLACES:
        signal = getattr(course.signals, name)
        signal[FAULT] = 0.0
    found = run(course)
    assert np.abs(found.error_y)[FAULT].max() < 0.5
    assert not found.used[FAULT.start + 100 : FAULT.start + 300, 1:].any()
    assert found.used[BACK:].all()


def test_nothing_is_doubted_where_all_is_well() -> None:
    """The negative control: turns and changes of lane, with noise, at three speeds."""
    for speed, size in ((8.0, 0.4), (20.0, 0.25), (35.0, 0.12)):
        wave = size * np.sin(2.0 * np.pi * np.arange(1200) * STEP / 2.5) * np.clip(np.arange(1200) / 400, 0.0, 1.0)
        found = run(turn(6.0, wave, speed))
        assert found.used.all()


def test_a_slide_is_no_fault_of_the_accelerometer() -> None:
    """On ice the car turns further than its side force carries it: a_y and V_x r contradict each other, and both are right.

    For longer than 0.5 s, with a steering that agrees, it would be taken for a bank.
    """
    course = turn(4.0, there_and_back(4.0, 0.25, 1.5, 2.3, 0.4))
    felt, n = 1.5, course.vx.size  # m/s^2, all that the ice gives
    pull = np.clip(course.vx * course.signals.yaw_rate, -felt, felt)
    noise = 0.05 * np.random.default_rng(2).normal(size=n)
    signals = course.signals._replace(ay=pull + noise)
    steps, _ = driven(signals)
    assert all(step.inertial_used.all() for step in steps)


def test_a_car_that_is_caught_from_a_slide_has_a_healthy_accelerometer() -> None:
    """It turns to the other side at once, steered there by far, while its side force is still near zero: neither fault nor bank.

    `sign` -1, the negative control: an a_y of the wrong sign is one that nothing but a fault explains.
    """
    time = STEP * np.arange(round(4.0 / STEP))
    swung = np.clip((time - 2.0) / 0.4, 0.0, 1.0)
    slide = turn(4.0, 0.16 * (1.0 - swung) - 0.38 * swung, speed=12.0)
    steer = slide.signals.steer * np.where(time < 2.2, 1.0, 1.6)[:, None]
    noise = 0.05 * np.random.default_rng(4).normal(size=time.size)
    for sign, healthy in ((1.0, True), (-1.0, False)):
        carried = np.interp(time, (2.0, 2.2, 2.45, 2.7), (1.9, 0.4, 0.2, -2.6 * sign))
        ay = np.where(time < 2.0, slide.signals.ay, carried + noise)
        steps, _ = driven(slide.signals._replace(ay=ay, steer=steer))
        assert all(step.inertial_used.all() for step in steps) == healthy
        assert max(abs(step.gravity[1]) for step in steps) < 0.3


def test_steering_alone_says_nothing_of_a_live_accelerometer() -> None:
    """Wheels lost: a_y and the yaw rate contradict each other, and nothing says which is right; both are kept."""
    course = turn(8.0, YAW)
    course.signals.wheel_speed[450:900] = np.nan
    course.signals.yaw_rate[FAULT] *= 2.0
    found = run(course)
    assert found.used[FAULT.start : FAULT.start + 200].all()


def test_saved_while_a_signal_is_replaced_and_a_batch_is_its_runs() -> None:
    course = turn(8.0, YAW)
    course.signals.ay[FAULT] *= -1.0
    one, two, many = VelocityFusion(CAR, STEP), VelocityFusion(CAR, STEP), VelocityFusion(CAR, STEP, (2,))
    part = Signals(*(value[: FAULT.start + 60] for value in course.signals))
    steps, _ = driven(part, one)
    assert not steps[-1].inertial_used[1]
    two.restore(one.save())
    rest = Signals(*(value[FAULT.start + 60 : 620] for value in course.signals))
    mine, yours = driven(rest, one)[0], driven(rest, two)[0]
    np.testing.assert_array_equal([step.vy for step in mine], [step.vy for step in yours])
    both = Signals(*(np.stack([value[:620]] * 2, axis=1) for value in course.signals))
    together = driven(both, many)[0]
    np.testing.assert_allclose(together[-1].vy, mine[-1].vy, rtol=1e-6, atol=1e-8)


def rolled(course: Turn, known: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Errors of V_y, whether it is GATED, and whether a_y is used, where an attitude says `known` m/s^2 of gravity in a_y."""
    heavy = np.stack([0.0 * known, known, 0.0 * known, known], axis=1)
    steps, _ = driven(course.signals, gravity=heavy)
    gated = np.array([bool(step.flags & Flag.GATED) for step in steps])
    return np.array([step.vy for step in steps]) - course.vy, gated, np.array([step.inertial_used[1] for step in steps])


@pytest.mark.parametrize("known", [3.0, -4.0])
def test_a_roll_angle_at_fault_is_not_taken_off(known: float) -> None:
    """0.3 to 0.4 rad: what the accelerometer reads agrees with the turn, what is levelled does not."""
    wrong = np.zeros(YAW.size)
    wrong[FAULT] = known
    error, gated, used = rolled(turn(8.0, YAW), wrong)
    assert np.abs(error).max() < 0.8  # 8 m/s after these 2 s otherwise
    assert gated[FAULT.start + 40 : FAULT.stop].all()
    assert not gated[BACK:].any()
    assert used.all()


def test_a_roll_angle_that_is_right_is_no_fault() -> None:
    """The negative control: a road that leans as much as the attitude says."""
    bank = there_and_back(8.0, 3.0, 2.5, 4.5, 0.8)
    error, gated, used = rolled(turn(8.0, YAW, gravity=bank), bank)
    assert not gated.any()
    assert used.all()
    assert np.abs(error).max() < 1.0  # tires of this course carry nothing of V_y', which the bank changes


def test_a_steering_angle_that_freezes_is_not_believed() -> None:
    """In the turn, and the car leaves it: V_y followed the front axle by 0.7 m/s."""
    course = turn(8.0, YAW)
    course.signals.steer[FAULT] = course.signals.steer[FAULT.start]
    found = run(course)
    gated = np.array([bool(step.flags & Flag.GATED) for step in found.steps])
    off = np.flatnonzero(np.abs(turn(8.0, YAW).signals.steer[:, 0] - course.signals.steer[:, 0]) > 0.015)
    assert gated[off[0] : off[0] + 60].any()
    assert not gated[: FAULT.start].any()
    assert not gated[BACK:].any()
    assert np.abs(found.error_y)[FAULT].max() < 0.4
