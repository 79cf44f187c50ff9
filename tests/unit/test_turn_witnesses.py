"""Who may bear witness of a turn: wheels that roll, and a steering angle that moves."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.velocity import VelocityFusion
from estimators.velocity.parity import FRONT, REAR
from tests.support.fusion_course import CAR, STEP

ROLLING = 20.0 / 0.33  # rad/s


def known(fusion: VelocityFusion, wheels: np.ndarray) -> list[bool]:
    """Whether the front and the rear wheels are witnesses after a sample on a straight road."""
    fusion.step(wheels, np.zeros(4), 0.0, 0.0, 0.0, np.zeros(4))
    readings = fusion.signal_monitor.turn.witnesses.readings
    return [bool(readings.known[axle]) for axle in (FRONT, REAR)]


@pytest.mark.parametrize("axle", [0, 1])
def test_wheels_that_only_pass_the_speed_of_the_car_are_no_witnesses(axle: int) -> None:
    """From spinning at twice the speed to locked within 0.1 s, as on ice: one of these samples looks like rolling."""
    rng, fusion = np.random.default_rng(0), VelocityFusion(CAR, STEP)
    for _ in range(200):
        found = known(fusion, ROLLING + 0.05 * rng.normal(size=4))
    assert found == [True, True]
    seen = []
    for factor in (*np.linspace(1.0, 2.0, 20), *np.linspace(2.0, 0.1, 20)):
        wheels = ROLLING + 0.05 * rng.normal(size=4)
        wheels[2 * axle : 2 * axle + 2] *= factor
        found = known(fusion, wheels)
        seen.append(found[axle])
        assert found[1 - axle]
    assert not any(seen[10:])


def test_a_front_angle_that_repeats_itself_is_seen_whatever_the_rear_one_does() -> None:
    rng = np.random.default_rng(0)
    for front, repeats in ((0.0, True), (1e-3, False)):
        fusion = VelocityFusion(CAR, STEP)
        for _ in range(40):
            steer = np.array([front, front, 1e-3, 1e-3]) * rng.normal(size=4)
            fusion.step(np.full(4, ROLLING), steer, 0.0, 0.0, 0.0)
        assert (float(fusion.inputs.locked) > fusion.settings.slowest_unit) is repeats


@pytest.mark.parametrize(("jitter", "rear", "believed"), [(0.0, 2.0, False), (1e-3, 2.0, True), (0.0, 1.0, True)])
def test_an_angle_that_repeats_itself_is_believed_while_the_rear_axle_can_contradict_it(
    jitter: float, rear: float, believed: bool
) -> None:
    """Rear wheels that spin at twice the speed cannot; the negative controls: an angle that moves, and wheels that roll."""
    rng, fusion = np.random.default_rng(0), VelocityFusion(CAR, STEP)
    for k in range(120):
        wheels = ROLLING + 0.05 * rng.normal(size=4)
        wheels[2:] *= rear if k > 60 else 1.0
        steer = np.array([1.0, 1.0, 0.0, 0.0]) * jitter * rng.normal()
        step = fusion.step(wheels, steer, 0.05 * rng.normal(), 0.05 * rng.normal(), 0.002 * rng.normal(), np.zeros(4))
    assert bool(step.axle_used[0]) is believed
