"""Every filter on its own model: errors and innovations are as large as its covariances say, over 1,000 runs.

Negative controls: the same filters with one noise covariance wrong by a factor of two must fail.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators import EstimatorError
from estimators.filters import (
    Consistency,
    ExtendedKalmanFilter,
    KalmanFilter,
    UnscentedKalmanFilter,
    consistency,
    nees,
    nis,
)
from estimators.sideslip import AdaptiveStiffnessObserver, FixedStiffnessObserver, FourWheelModel, FourWheelObserver
from tests.support.monte_carlo import RUNS, consistency_of, normal
from tests.support.sideslip_truth import AXLES, CAR, PERIOD

STEPS = 150


def f(x: np.ndarray) -> np.ndarray:
    """A damped pendulum."""
    return np.stack((x[..., 0] + 0.05 * x[..., 1], x[..., 1] - 0.05 * (np.sin(x[..., 0]) + 0.4 * x[..., 1])), axis=-1)


def f_jacobian(x: np.ndarray) -> np.ndarray:
    F = np.empty((*x.shape, 2))
    F[..., 0, :] = 1.0, 0.05
    F[..., 1, 0], F[..., 1, 1] = -0.05 * np.cos(x[..., 0]), 0.98
    return F


def h(x: np.ndarray) -> np.ndarray:
    return np.sin(x[..., :1])


def h_jacobian(x: np.ndarray) -> np.ndarray:
    return np.stack((np.cos(x[..., :1]), np.zeros_like(x[..., :1])), axis=-1)


A, C = np.array([[1.0, 0.05], [-0.05, 0.98]]), np.array([[1.0, 0.0]])
Q, R, P0 = np.array([1e-5, 4e-5]), np.array([4e-4]), np.array([1e-3, 1e-3])


def general(kind: str, process: float, sensor: float) -> tuple[Consistency, Consistency]:
    draw = np.random.default_rng(7)
    mean = np.array([0.8, 0.0])
    truth = mean + normal(draw, P0)
    filters = {"kalman": KalmanFilter, "extended": ExtendedKalmanFilter, "unscented": UnscentedKalmanFilter}
    which: Any = filters[kind](np.tile(mean, (RUNS, 1)), np.diag(P0))
    q, r = np.diag(Q * process), np.diag(R * sensor)
    errors, innovations = [], []
    for _ in range(STEPS):
        linear = kind == "kalman"
        truth = (truth @ A.T if linear else f(truth)) + normal(draw, Q)
        y = (truth @ C.T if linear else h(truth)) + normal(draw, R)
        if linear:
            which.predict(A, q)
            step = which.correct(y, C, r)
        elif kind == "extended":
            which.predict(f, f_jacobian, q)
            step = which.correct(y, h, h_jacobian, r)
        else:
            which.predict(f, q)
            step = which.correct(y, h, r)
        errors.append(nees(step.state - truth, step.covariance))
        innovations.append(nis(step.innovation, step.innovation_covariance)[0])
    return consistency_of(errors, innovations, 2, 1)


@pytest.mark.parametrize("kind", ["kalman", "extended", "unscented"])
def test_general_filters(kind: str) -> None:
    for found in general(kind, 1.0, 1.0):
        assert found.consistent, str(found)
    for wrong in ((2.0, 1.0), (0.5, 1.0)):
        assert not general(kind, *wrong)[0].consistent
    for wrong in ((1.0, 1.3), (1.0, 0.7)):
        assert not general(kind, *wrong)[1].consistent


PROCESS = np.array([1e-3, 1e-2, 1e-5, 1e5, 1e5, 1e5, 1e5, 1e5])  # per second
SENSOR = np.array([4e-6, 4e-2, 2.5e-3, 2.5e-3])
START = np.array([1e-4, 1e-2, 1e-5, 1e4, 1e4, 1e4, 1e4, 1e4])


def four_wheel(kind: Any, process: float, sensor: float) -> tuple[Consistency, Consistency]:
    draw = np.random.default_rng(8)
    mean = np.array([0.0, 20.0, 0, 0, 0, 0, 0, 100.0])
    observer = FourWheelObserver(CAR, kind, (RUNS,), PERIOD, PROCESS * process, SENSOR * sensor, START)
    observer.reset(state=mean)
    truth = mean + normal(draw, START)
    load = np.tile(CAR.static_loads, (RUNS, 1))
    before, errors, innovations = 0.0, [], []
    for k in range(STEPS):
        model = FourWheelModel.at(CAR, PERIOD, np.full(RUNS, before), load, 1.0)
        truth = model.transition(truth) + normal(draw, PROCESS * PERIOD)
        before = 0.04 * np.sin(2 * k * PERIOD)
        now = FourWheelModel.at(CAR, PERIOD, np.full(RUNS, before), load, 1.0)
        step = observer.step(np.full(RUNS, before), load, now.measurement(truth) + normal(draw, SENSOR))
        errors.append(nees(step.state - truth, step.filter.covariance))
        innovations.append(nis(step.filter.innovation, step.filter.innovation_covariance)[0])
    return consistency_of(errors, innovations, 8, 4)


@pytest.mark.parametrize("kind", ["extended", "unscented"])
def test_four_wheel_observer(kind: str) -> None:
    for found in four_wheel(kind, 1.0, 1.0):
        assert found.consistent, str(found)
    assert not any(found.consistent for found in four_wheel(kind, 1.0, 0.5))
    assert not four_wheel(kind, 0.5, 1.0)[0].consistent


@pytest.mark.parametrize("kind", [AdaptiveStiffnessObserver, FixedStiffnessObserver])
def test_stiffness_observers(kind: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Axles in zones 5 and 6 all along: slip angles and forces that never change sign."""

    def run(sensor: float) -> tuple[Consistency, Consistency]:
        draw = np.random.default_rng(9)
        monkeypatch.setattr("estimators.sideslip.stiffness.GOOD_NOISE", (100.0 * sensor, 100.0 * sensor, 0.01 * sensor))
        observer = kind(AXLES, (RUNS,), initial_covariance=(1e-6, 1e4, 1e4), threshold=(1.0, 1.0))
        given = (np.full(RUNS, 0.06), np.full(RUNS, 0.35), np.full(RUNS, 20.0), np.full(RUNS, 200.0))
        n = observer._states
        observer.step(*given, np.full((RUNS, 3), np.nan))  # takes the inputs up
        mean, spread = np.array([-0.01, 0.0, 0.0])[:n], np.diag(observer.covariance[0])
        observer.filter.reset(state=mean, covariance=np.diag(spread))
        truth = mean + normal(draw, spread)
        model = observer._model([np.asarray(value) for value in given])
        noise = np.array([1e-13, 0.24, 0.24])[:n]
        errors, innovations = [], []
        for _ in range(STEPS):
            truth = model.transition(truth) + normal(draw, noise)
            y = model.measurement(truth) + normal(draw, np.array([100.0, 100.0, 0.01]))
            step = observer.step(*given, y)
            assert step.excited.all()
            errors.append(nees(step.filter.state - truth, step.filter.covariance))
            innovations.append(nis(step.filter.innovation, step.filter.innovation_covariance)[0])
        return consistency_of(errors, innovations, n, 3)

    for found in run(1.0):
        assert found.consistent, str(found)
    assert not run(0.7)[1].consistent
    assert not run(1.4)[1].consistent


def test_report_and_refusals() -> None:
    values = np.random.default_rng(0).chisquare(3, size=(500, 100))
    found = consistency(values, 3)
    assert found.consistent and str(found).startswith("consistent: ")
    assert str(consistency(1.1 * values, 3)).startswith("not consistent: ")
    with pytest.raises(EstimatorError, match="expected \\(runs, steps\\)"):
        consistency(np.ones(3), 1)
    with pytest.raises(EstimatorError, match="not finite"):
        consistency([[np.nan]], 1)
