"""The corner observers as the only source of velocities: a paper's own chain through the pipeline."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators import EstimatorError, Flag, GainSchedule
from estimators.pipeline import (
    Check,
    CornerObservers,
    CornerVelocity,
    EstimationPipeline,
    KalmanCorners,
    SwitchedCorners,
)
from estimators.velocity import BristleTire, KinematicKalman, SlipWeights
from tests.support.pipeline_truth import CAR, TIME, Truth, finite, noisy, run, sample, straight, turning
from tests.support.schedule_content import PUBLISHED, schedule_content

ALONG, ACROSS = (GainSchedule.from_content(schedule_content(n), n) for n in ("longitudinal", "lateral"))
SLIP, SIDE = (PUBLISHED[n]["constants"][3] / PUBLISHED[n]["constants"][0] for n in ("longitudinal", "lateral"))
"""kappa/sigma0: slip of a bristle tire per unit of normalised force, where the force is far from the friction."""
KINDS = ["scheduled", "switched", "Kalman", "Kalman and kinematic"]


def pipeline_of(batch: tuple[int, ...] = (), kind: str = "scheduled") -> EstimationPipeline:
    along: Any = ALONG
    kind, _, filtered = kind.partition(" and ")
    if kind == "switched":
        along = SwitchedCorners(ALONG, (*batch, 4))
    if kind == "Kalman":
        along = KalmanCorners(BristleTire(*PUBLISHED["longitudinal"]["constants"], CAR.radii[0]), TIME, (*batch, 4))
    corners = CornerObservers(CAR, along, ACROSS, batch, SlipWeights() if kind == "scheduled" else None)
    kinematic = KinematicKalman(TIME, batch) if filtered else None
    return EstimationPipeline(CAR, TIME, batch, velocity=CornerVelocity(corners, kinematic))


@pytest.mark.parametrize("kind", KINDS)
def test_straight_drive(kind: str) -> None:
    truth = straight(np.full(600, 2.0), 10.0, SLIP)
    steps = run(pipeline_of(kind=kind), truth)
    late = slice(200, None)
    assert np.abs(np.array([s.vx for s in steps]) - truth.vx)[late].max() < 0.05
    assert np.abs([s.vy for s in steps]).max() < 0.02
    slip = np.array([s.slip for s in steps])[late]
    np.testing.assert_allclose(slip, SLIP * 2.0 / 9.81, atol=2e-3)
    assert not any(s.consistency.failed for s in steps[10:])
    assert not any(s.flags & ~Flag.RESET for s in steps)


@pytest.mark.parametrize("kind", KINDS)
def test_steady_turn(kind: str) -> None:
    """V_y from the lateral observers: the tire that they know is the one that drives."""
    truth = turning(800, slip=SLIP, side=(SIDE, 0.0))
    pipeline = pipeline_of(kind=kind)
    pipeline.reset(vx=truth.vx[0], vy=truth.vy[0])
    last = run(pipeline, noisy(truth, 3))[-1]
    assert last.vx == pytest.approx(truth.vx[-1], abs=0.15)
    assert last.vy == pytest.approx(truth.vy[-1], abs=0.1)
    assert (last.slip_angle < 0).all()
    assert last.yaw_rate == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_a_batch_equals_a_loop_and_a_restored_one_goes_on(kind: str) -> None:
    runs = [noisy(straight(np.repeat([2.0, -3.0], 60), 10.0, SLIP), seed) for seed in range(2)]
    runs[1].torque[40:60] = np.nan
    runs[0].wheel_speed[50:55, 1] = np.nan
    both = Truth(*(np.stack(column) for column in zip(*runs, strict=True)))
    many, other = pipeline_of((2,), kind), pipeline_of((2,), kind)
    together = run(many, both, 0, 70)
    other.restore(many.save())
    for mine, theirs in zip(run(many, both, 70, 100), run(other, both, 70, 100), strict=True):
        np.testing.assert_array_equal(mine.vx, theirs.vx)
        np.testing.assert_array_equal(mine.slip_angle, theirs.slip_angle)
    for place, one in enumerate(runs):
        for k, alone in enumerate(run(pipeline_of((), kind), one, 0, 70)):
            for name in ("vx", "vy", "slip", "slip_angle", "force_x", "sideslip"):
                np.testing.assert_allclose(getattr(together[k], name)[place], getattr(alone, name), 1e-7, 1e-7, name)
            assert together[k].flags[place] == alone.flags


def test_the_kinematic_filter_finds_the_bias_of_an_accelerometer() -> None:
    """0.15 m/s^2 along, which the corners do not have: their V_x comes from wheels that hardly slip."""
    truth = noisy(straight(np.zeros(6000), 20.0, SLIP), 5, (0.15, 0.0, 0.0))
    last = run(pipeline_of(kind="scheduled and kinematic"), truth)[-1]
    assert last.velocity.sensor_bias[0] == pytest.approx(0.15, abs=0.03)
    assert last.vx == pytest.approx(20.0, abs=0.1)
    assert 0.0 < last.vx_deviation < 0.2
    assert last.flags == 0


def test_faults_are_flagged_and_survived() -> None:
    truth = noisy(straight(np.full(200, 1.0), 15.0, SLIP), 0)
    truth.yaw_rate[50:60], truth.wheel_speed[80:90], truth.ax[100:110] = np.nan, np.inf, np.nan
    steps = run(pipeline_of(), truth)
    assert all(step.flags & Flag.MISSING_INPUT for step in (*steps[50:60], *steps[100:110]))
    assert all((step.wheel_flags & Flag.MISSING_MEASUREMENT).all() for step in steps[81:90])
    assert all(
        Check.NO_WHEEL & int(step.consistency.failed) for step in steps[86:90]
    )  # longer than a sensor repeats itself
    for step in steps:
        assert finite(step._replace(vx_deviation=np.zeros(()), vy_deviation=np.zeros(())))
    assert abs(steps[-1].vx - truth.vx[-1]) < 0.2


def test_reset_starts_one_car_at_the_given_speed() -> None:
    both = Truth(*(np.stack([column, column]) for column in noisy(straight(np.zeros(60), 10.0, SLIP), 4)))
    pipeline, other = pipeline_of((2,)), pipeline_of((2,))
    run(pipeline, both, 0, 50)
    run(other, both, 0, 50)
    pipeline.reset(np.array([True, False]), vx=10.0, vy=0.0)
    step, kept = pipeline.step(sample(both, 50)), other.step(sample(both, 50))
    assert step.vx[0] == pytest.approx(10.0, abs=0.2)
    assert step.vx[1] == kept.vx[1]


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(EstimatorError, match="give a lateral schedule"):
        CornerVelocity(CornerObservers(CAR, ALONG))
    with pytest.raises(EstimatorError, match=r"batch_shape \(4,\), expected \(3, 4\)"):
        CornerObservers(CAR, SwitchedCorners(ALONG), None, (3,))
    with pytest.raises(EstimatorError, match=r"kinematic is for sample_time = 0\.01 s"):
        CornerVelocity(CornerObservers(CAR, ALONG, ACROSS), KinematicKalman(0.01))
    late = KalmanCorners(BristleTire(), 0.01)
    with pytest.raises(EstimatorError, match=r"sample times 0\.01 s and 0\.005 s"):
        CornerObservers(CAR, late, ACROSS)
