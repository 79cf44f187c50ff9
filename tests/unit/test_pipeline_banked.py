"""Roads that lean by 12 and 30 degrees and roads that climb, at up to 60 m/s: nothing is lost, and the tires carry the slope."""

from __future__ import annotations

import numpy as np
import pytest

from estimators.arrays import FloatArray
from estimators.faults import DRIVING
from estimators.forces import AttitudeObserver
from estimators.pipeline import Check, EstimationPipeline, PipelineStep
from estimators.vehicle import GRAVITY
from estimators.velocity import VelocityFusion
from tests.support.banked_course import CAR, TIME, Banked, banked, run

# speed m/s, bank degrees, turn rad/s, grade degrees, bias of the gyros rad/s
LEVELLED = {
    "across 30": (60.0, 30.0, 0.0, 0.0, 0.0),
    "neutral turn": (60.0, -30.0, 0.094, 0.0, 0.0),
    "banked turn": (60.0, -30.0, 0.15, 0.0, 0.0),
    "across 12": (20.0, 12.0, 0.0, 0.0, 0.0),
    "turn 12": (20.0, -12.0, 0.2, 0.0, 0.0),
    "across 30, biased gyros": (60.0, 30.0, 0.0, 0.0, 0.004),
    "banked turn, biased gyros": (60.0, -30.0, 0.15, 0.0, 0.004),
    "climb": (20.0, 0.0, 0.0, 6.0, 0.0),
}


def errors(
    names: list[str], attitude: bool, gravity: bool = True, seconds: float = 5.0
) -> tuple[Banked, list[PipelineStep], FloatArray, FloatArray]:
    """The course, the steps, and errors of V_x and V_y (n, cars)."""
    shape = (len(names),)
    velocity = VelocityFusion(CAR, TIME, shape)
    velocity.uses_gravity = gravity
    course = banked(np.array([LEVELLED[name] for name in names]), seconds)
    part = AttitudeObserver(TIME, shape) if attitude else None
    steps = run(course, EstimationPipeline(CAR, TIME, shape, attitude=part, velocity=velocity))
    vx, vy = (np.array([getattr(step, name) for step in steps]) for name in ("vx", "vy"))
    return course, steps, np.abs(vx - course.vx), np.abs(vy - course.vy)


def test_with_gyros_a_bank_is_carried_by_the_tires() -> None:
    """V_y across 30 degrees was off by 3.8 m/s: side slip as if the tires carried nothing."""
    course, steps, vx, vy = errors(list(LEVELLED), attitude=True)
    assert vx.max() < 0.3
    limits = dict(zip(LEVELLED, vy.max(axis=0), strict=True))
    assert limits.pop("across 30") < 0.7
    assert limits.pop("across 30, biased gyros") < 1.0
    assert limits.pop("banked turn, biased gyros") < 0.5
    assert max(limits.values()) < 0.15
    assert not any((step.flags & ~DRIVING).any() for step in steps[10:])
    balance = int(Check.FORCE_BALANCE | Check.LATERAL_BALANCE)
    assert not any((step.consistency.failed & balance).any() for step in steps[10:])  # 30 % of a climb before
    force, load = steps[-1].force_x[-1].sum(), steps[-1].force_z[-1]
    assert force == pytest.approx(CAR.mass * GRAVITY * np.sin(course.pitch[-1, -1]), rel=0.08)
    lever = (CAR.rear_axle_distance - CAR.cg_height * np.tan(course.pitch[-1, -1])) / CAR.wheelbase
    assert load[:2].sum() / load.sum() == pytest.approx(lever, abs=0.005)
    assert steps[-1].pitch[-1] == pytest.approx(course.pitch[-1, -1], abs=0.01)


def test_without_gyros_the_bank_is_learned() -> None:
    """V_y ran to 40 m/s at 30 degrees and took 10 m/s of V_x with it."""
    _, _, vx, vy = errors(["banked turn", "across 12", "turn 12"], attitude=False)
    assert vx.max() < 0.3
    assert vy[:, 0].max() < 8.0
    assert vy[:, 1:].max() < 2.5
    assert vy[-1, 1:].max() < 0.8


def test_tires_that_are_taken_to_carry_nothing_are_found_out() -> None:
    """The negative control: gravity taken off before the velocity part, for tires, too."""
    _, _, _, vy = errors(["across 30"], attitude=True, gravity=False, seconds=4.0)
    assert vy.max() > 2.0
