"""The eight-state unscented filter: a batch of 1,000 runs beside a loop over filterpy's, and one step of one car."""

from __future__ import annotations

import math
import statistics
import time
from typing import Any

import numpy as np
import pytest

from estimators.filters import KalmanFilter, UnscentedKalmanFilter
from estimators.sideslip import FourWheelModel, FourWheelObserver
from tests.support.sideslip_truth import CAR, PERIOD

RUNS = 1000
START = np.array([0.05, 20.0, 0.0, 100.0, 100.0, 80.0, 80.0, 150.0])
SPREAD = np.diag([1e-4, 1e-2, 1e-5, 1e4, 1e4, 1e4, 1e4, 1e4])
PROCESS = np.array([1e-3, 1e-2, 1e-5, 1e5, 1e5, 1e5, 1e5, 1e5])
SENSOR = np.array([4e-6, 4e-2, 2.5e-3, 2.5e-3])
MEASURED = np.array([0.1, 20.0, 0.1, 1.5])
STEERING = 0.03


LEVERS = np.array([CAR.front_axle_distance, CAR.front_axle_distance, -CAR.rear_axle_distance, -CAR.rear_axle_distance])
SIDES = np.array([-1.0, 1.0, -1.0, 1.0]) * CAR.track / 2
STIFFNESS = np.array([CAR.front_stiffness] * 2 + [CAR.rear_stiffness] * 2)
RELAXATION = np.array([CAR.front_relaxation] * 2 + [CAR.rear_relaxation] * 2)
KNEES = CAR.friction * np.asarray(CAR.static_loads) / (2 * STIFFNESS)
ANGLES = np.array([STEERING, STEERING, 0.0, 0.0])


def usual_transition(x: Any, dt: float) -> Any:
    """The model of one car as one writes it for a loop: numpy over the wheels, P4 (1)-(11) as printed."""
    r, v, b, drive = x[0], x[1], x[2], x[7]
    forces = x[3:7]
    tangents = np.tan(ANGLES - np.arctan2(v * b + LEVERS * r, v + SIDES * r))
    ratio = np.minimum(KNEES / np.maximum(np.abs(tangents), 1e-9), 1.0)
    front, rear = forces[0] + forces[1], forces[2] + forces[3]
    lateral = front * np.cos(STEERING) + drive * np.sin(STEERING)
    difference = (forces[0] - forces[1]) * np.sin(STEERING)
    angle = b - STEERING
    along = drive * np.cos(angle) + front * np.sin(angle) + rear * np.sin(b)
    across = -drive * np.sin(angle) + front * np.cos(angle) + rear * np.cos(b)
    rate = np.zeros(8)
    rate[0] = (
        CAR.front_axle_distance * lateral - CAR.rear_axle_distance * rear + CAR.track / 2 * difference
    ) / CAR.yaw_inertia
    rate[1] = along / CAR.mass
    rate[2] = across / (CAR.mass * v) - r
    rate[3:7] = v / RELAXATION * (STIFFNESS * tangents * (2 - ratio) * ratio - forces)
    return x + dt * rate


def usual_measurement(x: Any) -> Any:
    front, drive = x[3] + x[4], x[7]
    along = drive * np.cos(STEERING) - front * np.sin(STEERING)
    across = front * np.cos(STEERING) + x[5] + x[6] + drive * np.sin(STEERING)
    return np.array([x[0], x[1], along / CAR.mass, across / CAR.mass])


def plain_transition(x: Any, dt: float) -> Any:
    """The model in plain numbers, the fastest that a loop can be given."""
    r, v, b, f11, f12, f21, f22, fx = x.tolist()
    sd, cd, sb, cb = math.sin(STEERING), math.cos(STEERING), math.sin(b - STEERING), math.cos(b - STEERING)
    front, rear = v * b + CAR.front_axle_distance * r, v * b - CAR.rear_axle_distance * r
    left, right = v - CAR.track * r / 2, v + CAR.track * r / 2
    tangents = (
        math.tan(STEERING - math.atan(front / left)),
        math.tan(STEERING - math.atan(front / right)),
        -rear / left,
        -rear / right,
    )
    stiffness = (CAR.front_stiffness,) * 2 + (CAR.rear_stiffness,) * 2
    shares = (dt * v / CAR.front_relaxation,) * 2 + (dt * v / CAR.rear_relaxation,) * 2
    forces = []
    for k, force in enumerate((f11, f12, f21, f22)):
        size = abs(tangents[k])
        knee = CAR.friction * CAR.static_loads[k] / (2 * stiffness[k])
        factor = (2 - knee / size) * knee / size if size > knee else 1.0
        forces.append(force + shares[k] * (stiffness[k] * tangents[k] * factor - force))
    lateral = (f11 + f12) * cd + fx * sd
    moment = CAR.front_axle_distance * lateral - CAR.rear_axle_distance * (f21 + f22) + CAR.track / 2 * (f11 - f12) * sd
    return np.array(
        [
            r + dt * moment / CAR.yaw_inertia,
            v + dt * (fx * cb + (f11 + f12) * sb + (f21 + f22) * math.sin(b)) / CAR.mass,
            b + dt * ((-fx * sb + (f11 + f12) * cb + (f21 + f22) * math.cos(b)) / (CAR.mass * v) - r),
            *forces,
            fx,
        ]
    )


def plain_measurement(x: Any) -> Any:
    r, v, _, f11, f12, f21, f22, fx = x.tolist()
    sd, cd = math.sin(STEERING), math.cos(STEERING)
    front = f11 + f12
    return np.array([r, v, (fx * cd - front * sd) / CAR.mass, (front * cd + f21 + f22 + fx * sd) / CAR.mass])


MODELS = ("usual numpy model", "model in plain numbers", "same model object")


def reference(kind: str = MODELS[0]) -> Any:
    """filterpy's filter with a model of one car: usual numpy, plain numbers, or the very object that the batch uses."""
    kalman = pytest.importorskip("filterpy.kalman", reason="filterpy is not installed: the `bench` extra brings it")
    points = kalman.MerweScaledSigmaPoints(8, math.sqrt(3 / 8), 2.0, 0.0)
    model = FourWheelModel.at(CAR, PERIOD, np.array(STEERING), np.array(CAR.static_loads), 1.0)
    functions = {
        MODELS[0]: (usual_measurement, usual_transition),
        MODELS[1]: (plain_measurement, plain_transition),
        MODELS[2]: (model.measurement, lambda x, dt: model.transition(x)),
    }
    found = kalman.UnscentedKalmanFilter(8, 4, PERIOD, *functions[kind], points)
    found.x, found.P = START.copy(), SPREAD.copy()
    found.Q, found.R = np.diag(PROCESS * PERIOD), np.diag(SENSOR)
    return found


def batch() -> FourWheelObserver:
    observer = FourWheelObserver(CAR, "unscented", (RUNS,), PERIOD, PROCESS, SENSOR, np.diag(SPREAD))
    observer.reset(state=START)
    return observer


def inputs() -> tuple[Any, Any, Any]:
    return np.full(RUNS, STEERING), np.tile(CAR.static_loads, (RUNS, 1)), np.tile(MEASURED, (RUNS, 1))


@pytest.mark.parametrize(
    ("transition", "measurement"),
    [(usual_transition, usual_measurement), (plain_transition, plain_measurement)],
    ids=MODELS[:2],
)
def test_models_are_the_same(transition: Any, measurement: Any) -> None:
    model = FourWheelModel.at(CAR, PERIOD, np.array(STEERING), np.array(CAR.static_loads), 1.0)
    for x in START + np.random.default_rng(0).normal(size=(20, 8)) * np.sqrt(np.diag(SPREAD)):
        np.testing.assert_allclose(transition(x, PERIOD), model.transition(x), rtol=1e-11)
        np.testing.assert_allclose(measurement(x), model.measurement(x), rtol=1e-11, atol=1e-12)


def test_prediction_equals_filterpy() -> None:
    """An implementation by others; its measurement update may reuse the propagated points, so only P- is compared."""
    theirs = reference()
    ours = UnscentedKalmanFilter(START, SPREAD)
    model = FourWheelModel.at(CAR, PERIOD, np.array(STEERING), np.array(CAR.static_loads), 1.0)
    theirs.predict()
    ours.predict(model.transition, np.diag(PROCESS * PERIOD))
    np.testing.assert_allclose(ours.state, theirs.x, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(ours.covariance, theirs.P, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("kind", MODELS)
def test_batch_against_a_loop_over_filterpy(benchmark: Any, kind: str) -> None:
    """Both in one process, in turns, in processor time; the middle of the rounds' ratios is what is reported.

    A round is a twentieth of a second: what slows the machine slows both. The best times stand beside.
    """
    theirs, observer, given = reference(kind), batch(), inputs()
    observer.step(*given)
    slow, fast = [], []
    for _ in range(21):
        start = time.process_time()
        for _ in range(40):
            theirs.predict()
            theirs.update(MEASURED)
        slow.append((time.process_time() - start) / 40)
        start = time.process_time()
        for _ in range(6):
            observer.step(*given)
        fast.append((time.process_time() - start) / (6 * RUNS))
    benchmark.extra_info["filterpy us per step"] = round(min(slow) * 1e6, 1)
    benchmark.extra_info["batch us per run and step"] = round(min(fast) * 1e6, 2)
    benchmark.extra_info["throughput ratio"] = round(statistics.median(s / f for s, f in zip(slow, fast, strict=True)))
    step = benchmark(observer.step, *given)
    assert np.isfinite(step.state).all()


@pytest.mark.parametrize("kind", ["unscented", "extended"])
def test_one_car(benchmark: Any, kind: Any) -> None:
    observer = FourWheelObserver(CAR, kind)
    observer.reset(state=START)
    step = benchmark(observer.step, STEERING, CAR.static_loads, MEASURED)
    assert np.isfinite(step.state).all()


@pytest.mark.parametrize("size", [2, 3])
def test_kalman_four_corners(benchmark: Any, size: int) -> None:
    kalman = KalmanFilter(np.zeros((4, size)), np.eye(size))
    A, Q, C, R = np.eye(size), 0.1 * np.eye(size), np.eye(1, size), np.eye(1)

    def step() -> Any:
        kalman.predict(A, Q)
        return kalman.correct(np.zeros((4, 1)), C, R)

    assert benchmark(step).used.all()
