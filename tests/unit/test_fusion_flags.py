"""What the fusion decides is visible in the flags: of the wheels and of the car, and through the pipeline."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.faults import DRIVING, Flag
from estimators.pipeline import EstimationPipeline
from estimators.velocity import FusionStep, VelocityFusion
from tests.support import pipeline_truth
from tests.support.fusion_course import CAR, STEP, course, driven, phases, sensed

CRUISE = course(phases((3.0, 0.0)), start=20.0)


def wheels(steps: list[FusionStep], flag: Flag) -> np.ndarray:
    """(n, 4) where the flag was up."""
    return (np.array([step.wheel_flags for step in steps]) & flag) != 0


def cars(steps: list[FusionStep], flag: Flag) -> np.ndarray:
    return (np.array([step.flags for step in steps]) & flag) != 0


def test_every_flag_has_a_bit_of_its_own() -> None:
    bits = [int(flag) for flag in Flag if flag]
    assert bits == [1 << k for k in range(len(bits))]


def test_a_quiet_cruise_raises_nothing_but_what_the_car_does() -> None:
    steps, _ = driven(sensed(CRUISE))
    assert not np.array([step.wheel_flags for step in steps]).any()
    assert not cars(steps, ~DRIVING).any()
    assert not cars(steps, Flag.STANDING).any()


def test_a_wheel_that_is_stopped_while_the_car_moves() -> None:
    signals = sensed(CRUISE)
    signals.wheel_speed[200:400, 1] = 0.0
    steps, _ = driven(signals)
    stopped = wheels(steps, Flag.WHEEL_STOPPED)
    assert stopped[205:400, 1].all()
    assert not stopped[:, [0, 2, 3]].any()
    assert not stopped[:200].any()
    assert not stopped[405:].any()


def test_wheels_that_stand_with_the_car_are_not_stopped() -> None:
    steps, _ = driven(sensed(course(phases((1.0, 0.0)))))
    assert not wheels(steps, Flag.WHEEL_STOPPED).any()


def test_high_slip_and_gates_are_those_of_the_step() -> None:
    signals = sensed(CRUISE)
    signals.wheel_speed[200:240, 3] *= np.linspace(1.0, 1.6, 40)  # it runs away,
    signals.wheel_speed[240:400, 3] *= 1.6  # and stays away
    steps, _ = driven(signals)
    high, gated = wheels(steps, Flag.HIGH_SLIP), wheels(steps, Flag.GATED)
    np.testing.assert_array_equal(high, [step.high_slip for step in steps])
    np.testing.assert_array_equal(gated, [step.gated for step in steps])
    assert high[215:235, 3].all()
    assert gated[300:400, 3].all()
    assert not high[300:400].any()
    assert not (high | gated)[:, :3].any()
    assert not (high | gated)[500:].any()


def test_standing() -> None:
    drive = course(phases((1.0, 0.0), (1.0, 3.0)))
    steps, _ = driven(sensed(drive))
    standing = cars(steps, Flag.STANDING)
    np.testing.assert_array_equal(standing, [bool(step.standing) for step in steps])
    assert standing[60:200].all()
    assert not standing[220:].any()


@pytest.mark.parametrize("speed", [20.0, 5.0])
def test_not_excited_without_side_force(speed: float) -> None:
    """A stiffness shows where the slip angle that it explains stands out of the error of the angle: in a sharp turn."""
    seen = {}
    for lateral in (0.0, 5.0):
        fusion, turn = VelocityFusion(CAR, STEP), lateral / speed
        rng = np.random.default_rng(0)
        alpha = 0.09 * (lateral / 9.80665) + 0.09 * (lateral / 9.80665) ** 3
        vy = turn * CAR.rear_axle_distance - speed * alpha
        steer = (vy + turn * CAR.front_axle_distance) / speed + alpha
        fusion.reset(vx=speed, vy=vy)
        flags = []
        for _ in range(200):
            noise = rng.normal(size=7) * [0.05, 0.05, 0.002, *[0.05] * 4]
            ax, ay, r = -turn * vy + noise[0], lateral + noise[1], turn + noise[2]
            surface = (speed - turn * CAR.corner_y) / CAR.radius
            flags.append(fusion.step(surface + noise[3:], [steer, steer, 0.0, 0.0], ax, ay, r).flags)
        seen[lateral] = np.mean([bool(flag & Flag.NOT_EXCITED) for flag in flags[50:]])
    assert seen[0.0] > 0.99
    assert seen[5.0] < 0.01


def test_the_pipeline_hands_them_on() -> None:
    truth = pipeline_truth.noisy(pipeline_truth.straight(np.zeros(300), 20.0), 2)
    truth.wheel_speed[100:200, 0] = 0.0
    steps = pipeline_truth.run(EstimationPipeline(CAR, STEP), truth)
    bits = Flag.WHEEL_STOPPED | Flag.GATED
    assert all(step.wheel_flags[0] & bits == bits for step in steps[120:200])
    assert all(step.flags & Flag.NOT_EXCITED for step in steps)
    assert not any(step.flags & Flag.STANDING for step in steps)
