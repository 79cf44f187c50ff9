"""What no car measures, once or for good: flagged, survived and forgotten; and refusals that leave nothing half done."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators import EstimatorError, Flag, GainSchedule
from estimators.filters import KalmanFilter, UnscentedKalmanFilter
from estimators.forces import VerticalLoads, reconcile
from estimators.pipeline import (
    CornerObservers,
    EstimationPipeline,
    FourWheelSideslip,
    StiffnessSideslip,
    VehicleSignals,
)
from estimators.sideslip import FourWheel, FourWheelObserver, SingleTrack
from estimators.vehicle import GRAVITY
from estimators.velocity import KinematicKalman, SwitchedVelocityObserver
from tests.support.pipeline_truth import CAR, TIME, finite, noisy, run, sample, straight
from tests.support.schedule_content import schedule_content

ALONG, ACROSS = (GainSchedule.from_content(schedule_content(n), n) for n in ("longitudinal", "lateral"))
BODY = (2270.0, 4650.0, 1.42, 1.43)
SIDESLIP = {
    "four wheels": lambda batch: FourWheelSideslip(FourWheel(*BODY, 1.59, 9e4, 9e4, 0.5, 0.5), TIME, batch),
    "sliding mode": lambda batch: StiffnessSideslip(SingleTrack(*BODY, 1.8e5, 1.8e5), TIME, batch, sliding=True),
    "stiffness": lambda batch: StiffnessSideslip(SingleTrack(*BODY, 1.8e5, 1.8e5), TIME, batch),
}


@pytest.mark.parametrize("up", [0.0, -0.5, -GRAVITY])
def test_forces_stay_finite_without_any_load(up: float) -> None:
    """In flight, or with a vertical accelerometer the wrong way round, while a torque is missing and a wheel stands."""
    pipeline = EstimationPipeline(CAR, TIME)
    for k in range(20):
        torque, wheels = np.array([50.0, np.nan, 50.0, 50.0]), np.array([60.0, 60.0, 60.0, 60.0 if k < 10 else 0.0])
        step = pipeline.step(VehicleSignals(wheels, 0.5, torque=torque, az=up))
        assert finite(step)
    shares = reconcile(np.zeros(4), np.full(4, 80.0), 4000.0, 300.0, np.zeros(4), np.ones(4, dtype=np.bool_))
    np.testing.assert_allclose(shares.force, 1000.0)


ABSURD = range(50, 53)
"""The samples that are absurd."""


def complete() -> EstimationPipeline:
    corners = CornerObservers(CAR, ALONG, ACROSS)
    return EstimationPipeline(CAR, TIME, corner_observers=corners, sideslip=SIDESLIP["stiffness"](()))


@pytest.fixture(scope="module")
def undisturbed() -> tuple[dict[str, Any], list[tuple[VehicleSignals, Any]]]:
    """The memory before the absurd samples; from there on what is measured, and the answer to it."""
    truth, pipeline = noisy(straight(np.full(260, 1.0), 15.0), 3), complete()
    given = [sample(truth, k)._replace(az=GRAVITY) for k in range(260)]
    for signals in given[: ABSURD[0]]:
        pipeline.step(signals)
    return pipeline.save(), [(signals, pipeline.step(signals)) for signals in given[ABSURD[0] :]]


@pytest.mark.parametrize("value", [500.0, 1e30, np.inf, -1e6])
@pytest.mark.parametrize("name", ["ax", "ay", "az", "yaw_rate", "torque", "wheel_speed", "steer"])
def test_an_absurd_sample_is_flagged_and_soon_forgotten(name: str, value: float, undisturbed: Any) -> None:
    """Of every signal in turn, for three samples; the same drive without them is the answer a second later."""
    memory, healthy = undisturbed
    size = 1e4 * value if name in ("torque", "wheel_speed") else value
    pipeline = complete()
    pipeline.restore(memory)
    for k, (given, right) in enumerate(healthy, ABSURD[0]):
        wrong = given
        if k in ABSURD:
            old = np.array(getattr(given, name), dtype=np.float64)
            old[(0,) if old.ndim else ()] = size
            wrong = given._replace(**{name: old})
        step = pipeline.step(wrong)
        assert finite(step)
        if k in ABSURD:
            assert step.flags | step.wheel_flags.max()
            assert step.force_z.max() < 1e5
            assert np.abs(step.corners.vx - right.vx) < 5.0
    for field, near in (("vx", 0.1), ("vy", 0.1), ("force_x", 50.0), ("axle_force_y", 50.0), ("force_z", 50.0)):
        np.testing.assert_allclose(getattr(step, field), getattr(right, field), atol=near, err_msg=field)
    assert abs(step.corners.vx - right.corners.vx) < 0.1
    assert abs(step.sideslip_step.sideslip - right.sideslip_step.sideslip) < 0.01


def test_loads_alone_hold_an_absurd_acceleration() -> None:
    loads = VerticalLoads(CAR, TIME)
    for _ in range(50):
        usual = loads.step(1.0, 0.5, GRAVITY)
    odd = loads.step(1.0, 0.5, 500.0)
    assert int(odd.flags) & Flag.MISSING_MEASUREMENT
    np.testing.assert_allclose(odd.load, usual.load, rtol=1e-3)


@pytest.mark.parametrize("kind", list(SIDESLIP))
def test_sideslip_parts_take_a_batch_of_one(kind: str) -> None:
    truth = noisy(straight(np.full(40, 1.0), 15.0), 0)
    wide = truth._replace(**{name: getattr(truth, name)[None] for name in truth._fields})
    alone = run(EstimationPipeline(CAR, TIME, sideslip=SIDESLIP[kind](())), truth)[-1]
    one = run(EstimationPipeline(CAR, TIME, (1,), sideslip=SIDESLIP[kind]((1,))), wide)[-1]
    np.testing.assert_allclose(one.sideslip_step.sideslip, [alone.sideslip_step.sideslip], atol=1e-12)


def content(part: Any) -> list[bytes]:
    return [key.encode() + value.tobytes() for key, value in sorted(part.save().items())]


def test_a_refused_restore_changes_nothing() -> None:
    """The refusal comes from a part that is asked late: a schedule of another name, a factor in the second thousand."""
    other = GainSchedule.from_content({**schedule_content("longitudinal", sample_time=TIME), "name": "other"}, "other")
    truth = noisy(straight(np.full(30, 1.0), 15.0), 1)
    first, second = (EstimationPipeline(CAR, TIME, corner_observers=CornerObservers(CAR, s)) for s in (ALONG, other))
    run(first, truth, 0, 30)
    run(second, truth, 0, 10)
    before = content(second)
    with pytest.raises(EstimatorError, match="another schedule"):
        second.restore(first.save())
    assert content(second) == before
    wheels = FourWheelObserver(FourWheel(*BODY, 1.59, 9e4, 9e4, 0.5, 0.5), batch_shape=(1500,))
    wheels.step(0.01, 4000.0, [0.0, 20.0, 0.0, 0.0])
    saved, before = wheels.save(), content(wheels)
    saved["filters.0.state"] = saved["filters.0.state"] + 1.0
    saved["filters.1.factor"][400] = 1e200
    with pytest.raises(EstimatorError, match="not finite"):
        wheels.restore(saved)
    assert content(wheels) == before


@pytest.mark.parametrize("name", ["az", "roll_rate", "pitch_rate", "grade", "bank", "elapsed", "torque"])
def test_a_signal_of_another_shape_is_refused_before_anything_moves(name: str) -> None:
    pipeline = EstimationPipeline(CAR, TIME)
    run(pipeline, straight(np.full(10, 1.0), 15.0))
    before = content(pipeline)
    with pytest.raises(EstimatorError, match=name):
        pipeline.step(VehicleSignals(60.0, 0.1)._replace(**{name: np.zeros(3)}))
    assert content(pipeline) == before


def test_filters_refuse_what_is_no_covariance_and_no_input() -> None:
    kalman, A = KalmanFilter(np.zeros((3, 2)), np.eye(2)), np.eye(2)
    with pytest.raises(EstimatorError, match="B and u belong together"):
        kalman.predict(A, A, B=np.ones((2, 1)))
    with pytest.raises(EstimatorError, match=r"B \(2, 2\) and u \(1,\) do not fit 2 states"):
        kalman.predict(A, A, np.eye(2), np.ones(1))
    with pytest.raises(EstimatorError, match="Q has a variance below zero"):
        kalman.predict(A, -5.0 * A)
    with pytest.raises(EstimatorError, match="R has a variance below zero"):
        kalman.correct(np.zeros(2), A, -10.0 * A)
    with pytest.raises(EstimatorError, match="offset has shape"):
        kalman.correct(np.zeros(2), A, A, offset=np.zeros((5, 2)))
    np.testing.assert_array_equal(kalman.covariance, np.tile(A, (3, 1, 1)))
    kalman.predict(A, 0.0 * A, np.array([[1.0], [2.0]]), [3.0])
    np.testing.assert_array_equal(kalman.state, np.tile([3.0, 6.0], (3, 1)))
    unscented = UnscentedKalmanFilter(np.zeros((3, 2)), np.eye(2))
    with pytest.raises(EstimatorError, match=r"measurement has shape \(5, 3, 1\), expected 2 on the last axis"):
        unscented.correct(np.zeros(2), lambda x: x[..., :1], np.eye(2))


def test_all_velocity_estimators_flag_a_reset_once() -> None:
    kinematic, switched = KinematicKalman(TIME, (2,)), SwitchedVelocityObserver(ALONG, batch_shape=(2,))
    steps: list[Any] = [
        lambda: kinematic.step(0.0, 0.0, 0.0, np.zeros((2, 2))),
        lambda: switched.step(np.zeros(2), np.zeros(2), np.full(2, 40.0), np.zeros(2)),
    ]
    for part, step in zip((kinematic, switched), steps, strict=True):
        step()
        part.reset(np.array([True, False]))
        assert step().flags.tolist() == [Flag.RESET, 0]
        assert not step().flags.any()
