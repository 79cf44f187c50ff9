"""The estimators with a covariance on their own models: NEES and NIS inside their bands over 1,000 runs.

Innovation covariances that a step does not return are recomputed from the model and the covariance before. Negative
controls: a measurement covariance that is wrong, and a process covariance that is wrong, must fail.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest

from estimators.filters import Consistency, nees, nis
from estimators.forces import LateralForceEstimator, WheelForceFilter
from estimators.forces.planar import planar_model
from estimators.vehicle import VehicleParameters
from estimators.velocity import BristleTire, KinematicKalman, LtvKalmanObserver
from estimators.velocity.ltv_model import sampled
from tests.support.monte_carlo import RUNS, consistency_of, normal

TIME = 0.005
CAR = VehicleParameters.published_suv()
Both = tuple[Consistency, Consistency]


def refuses_wrong_noise(run: Any) -> None:
    """Consistent as it is; NEES or NIS must notice either noise covariance wrong by a factor of two."""
    for found in run(1.0, 1.0):
        assert found.consistent, str(found)
    for wrong in ((1.0, 2.0), (1.0, 0.5), (2.0, 1.0), (0.5, 1.0)):
        assert not all(found.consistent for found in run(*wrong)), wrong


@pytest.mark.parametrize("states", [2, 3])
def test_time_varying_kalman(states: Literal[2, 3]) -> None:
    """V_r alone: the covariance of all states becomes singular at constant speed."""
    tire, q, r, steps = BristleTire(), 1e-4, 1e-3, 60
    w = np.full(RUNS, 40.0)
    A, B = sampled(tire, w, 0 * w, TIME, states)
    C, drive = tire.output(w, states), np.array([0.0, 1.0, 1.0])[:states]

    def run(process: float, sensor: float) -> Both:
        draw = np.random.default_rng(4)
        observer = LtvKalmanObserver(tire, TIME, (RUNS,), states=states, normal=(q * process, r * sensor))
        x = (np.linalg.cholesky(observer.filter.covariance) @ draw.normal(size=(RUNS, states, 1)))[..., 0]
        errors, innovations = [], []
        for _ in range(steps):
            mu = (C @ x[..., None])[:, 0, 0] + math.sqrt(r) * draw.normal(size=RUNS)
            step = observer.step(np.full(RUNS, 2.0), mu, w)
            innovations.append(step.innovation**2 / step.innovation_variance)
            x = (A @ x[..., None])[..., 0] + 2.0 * B + math.sqrt(q) * draw.normal(size=(RUNS, 1)) * drive
            errors.append(nees((x - step.estimate)[:, 1:2], observer.filter.covariance[:, 1:2, 1:2]))
        return consistency_of(errors, innovations, 1, 1)

    refuses_wrong_noise(run)


def test_kinematic_kalman() -> None:
    turn, deviation, steps = np.full(RUNS, 0.3), 0.1, 150
    truth = KinematicKalman(TIME, (RUNS,), acceleration_noise=2.0, bias_memory=10.0)
    A, B, Q = (part[0] for part in truth._model(turn, np.zeros(RUNS, dtype=np.bool_)))

    def run(process: float, sensor: float) -> Both:
        draw = np.random.default_rng(1)
        claimed = 2.0 * math.sqrt(process)
        kalman = KinematicKalman(TIME, (RUNS,), acceleration_noise=claimed, bias_memory=10.0)
        own = kalman._model(turn, np.zeros(RUNS, dtype=np.bool_))[2][0]
        R = deviation**2 * sensor
        x = normal(draw, np.diag(kalman.filter.covariance[0]))
        errors, innovations = [], []
        for _ in range(steps):
            ahead = A @ kalman.filter.covariance @ A.T + own
            x = x @ A.T + B @ [1.0, 2.0] + normal(draw, np.diag(Q))
            measured = x[:, :2] + deviation * draw.normal(size=(RUNS, 2))
            step = kalman.step(1.0, 2.0, 0.3, measured, math.sqrt(R))
            errors.append(nees(x - np.concatenate([step.velocity, step.bias], axis=1), step.covariance))
            innovations.append(nis(step.innovation, ahead[:, :2, :2] + R * np.eye(2))[0])
        return consistency_of(errors, innovations, 4, 2)

    refuses_wrong_noise(run)


@pytest.mark.parametrize("method", ["unscented", "linear"])
def test_wheel_force_filter(method: Any) -> None:
    """Driven by noise of the speed measurement as the filter reads it: z_k with the speed before taken as exact.

    Wheels ten times as heavy as a car's, so that random forces neither stop them nor spin them up beyond all wheels.
    """
    car = replace(CAR, wheel_inertia=10.0 * CAR.wheel_inertia)
    pull = TIME / car.wheel_inertia * car.radius
    walk, deviation, steps = 4000.0**2 * TIME, 0.05, 80

    def run(process: float, sensor: float) -> Both:
        draw = np.random.default_rng(4)
        runner = WheelForceFilter(
            car,
            TIME,
            (RUNS // 4, 4),
            force_rate=4000.0 * math.sqrt(process),
            speed_deviation=deviation * math.sqrt(sensor),
            method=method,
        )
        force = draw.normal(size=(RUNS // 4, 4)) * car.static_loads
        speed = np.full((RUNS // 4, 4), 500.0)
        runner.step(speed, 0.0)
        runner.filter.reset()
        errors, innovations = [], []
        for _ in range(steps):
            ahead = runner.filter.covariance[..., 0, 0] + runner.process_variance
            force = force + math.sqrt(walk) * draw.normal(size=force.shape)
            speed = speed - pull * force + math.sqrt(2.0) * deviation * draw.normal(size=force.shape)
            found = runner.step(speed, 0.0)
            error = nees((found.force - force)[..., None], runner.filter.covariance)
            errors.append(error.reshape(-1))
            total = pull**2 * ahead + runner.measurement_variance
            innovations.append((found.innovation**2 / total).reshape(-1))
        return consistency_of(errors, innovations, 1, 1)

    refuses_wrong_noise(run)


@pytest.mark.parametrize("method", ["unscented", "linear"])
def test_lateral_force_estimator(method: Any) -> None:
    """In kN, with a split by load that says nothing: the wheels turn from side to side."""
    sensors, walk, steps = np.array([0.3, 0.1, 0.3]), 130.0, 60

    def run(process: float, sensor: float) -> Both:
        draw = np.random.default_rng(3)
        claimed = tuple(sensors * math.sqrt(sensor))
        runner = LateralForceEstimator(
            CAR,
            TIME,
            (RUNS,),
            method,
            walk * math.sqrt(process),
            claimed,
            split_deviation=1e6,  # type: ignore[arg-type]
        )
        states = normal(draw, np.diag(runner.filter.covariance[0])) * 1000.0
        errors, innovations = [], []
        for k in range(steps):
            steer = np.full(RUNS, 0.25 * math.sin(0.2 * k))
            ahead = runner.filter.covariance * 1e6 + (walk**2 * process) * np.eye(3)
            states = states + walk * draw.normal(size=states.shape)
            C = planar_model(CAR, steer, np.zeros((RUNS, 4))).C
            y = (C @ states[..., None])[..., 0] + draw.normal(size=states.shape) * sensors
            step = runner.step(y[:, 0], y[:, 1], y[:, 2], steer, np.zeros((RUNS, 4)))
            errors.append(nees(runner.filter.state - states / 1000.0, runner.filter.covariance))
            innovations.append(nis(step.innovation, C @ ahead @ C.swapaxes(1, 2) + np.diag(np.square(claimed)))[0])
        return consistency_of(errors, innovations, 3, 3)

    refuses_wrong_noise(run)
