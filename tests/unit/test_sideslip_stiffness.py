"""Adaptive and fixed cornering stiffness: Jacobians, zones, accuracy with wrong stiffness, standstill, faults."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from estimators import EstimatorError, Flag
from estimators.sideslip import AdaptiveStiffnessObserver, CorneringModel, FixedStiffnessObserver
from tests.support.sideslip_truth import AXLES, PERIOD, single_track


def slalom(amplitude: float = 0.04) -> dict[str, np.ndarray]:
    return single_track(lambda t: amplitude * np.sin(2 * t), 20.0, 8.0)


def scaled(factor: float) -> Any:
    return replace(AXLES, front_stiffness=factor * AXLES.front_stiffness, rear_stiffness=factor * AXLES.rear_stiffness)


def follow(observer: Any, truth: dict[str, np.ndarray]) -> tuple[np.ndarray, list[Any]]:
    steps = [
        observer.step(d, r, v, 0.0, [f[0], f[1], ay])
        for d, r, v, f, ay in zip(
            truth["steering"], truth["yaw_rate"], truth["speed"], truth["forces"], truth["ay"], strict=True
        )
    ]
    return np.array([step.sideslip for step in steps]), steps


@pytest.mark.parametrize("n", [1, 3])
def test_jacobians_are_derivatives(n: int) -> None:
    draw = np.random.default_rng(0)
    scale = np.array([0.1, 2e4, 2e4])[:n]
    x = draw.normal(size=(50, n)) * scale
    inputs = (0.1 * draw.normal(size=50), 0.3 * draw.normal(size=50), 5 + 20 * draw.random(50))
    model = CorneringModel(AXLES, PERIOD, *inputs, 1000 * draw.normal(size=50), draw.random(50) < 0.2)
    for function, jacobian, rows in [
        (model.transition, model.transition_jacobian, scale),
        (model.measurement, model.measurement_jacobian, np.array([1e4, 1e4, 1.0])),
    ]:
        columns = [(function(x + e) - function(x - e)) / (2 * e.sum()) for e in np.diag(1e-5 * scale)]
        error = (jacobian(x) - np.stack(columns, axis=-1)) * scale / rows[:, None]
        assert np.absolute(error).max() < 1e-6


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.5])
def test_adaptive_sideslip_hardly_depends_on_the_stiffness_setting(factor: float) -> None:
    truth = slalom()
    found, steps = follow(AdaptiveStiffnessObserver(scaled(factor)), truth)
    error = np.absolute(found - truth["sideslip"])[400:] / np.absolute(truth["sideslip"]).max()
    assert error.mean() < 0.03
    np.testing.assert_allclose(steps[-1].stiffness, [65_000, 50_000], rtol=0.03)


def test_fixed_stiffness_is_good_only_where_it_is_right_and_errs_in_opposite_directions() -> None:
    truth = slalom(0.02)
    peaks = {}
    for factor in (0.5, 1.0, 1.5):
        found, _ = follow(FixedStiffnessObserver(scaled(factor)), truth)
        peaks[factor] = np.absolute(found[400:]).max() / np.absolute(truth["sideslip"][400:]).max()
    assert peaks[1.0] == pytest.approx(1.0, abs=0.02)
    assert peaks[0.5] > 1.3
    assert peaks[1.5] < 0.9


def test_zones() -> None:
    """Axle by axle: opposite signs or small force freeze the stiffness of that axle alone."""
    options: Any = {"threshold": (1000.0, 800.0), "initial_covariance": (1e-12, 1e6, 1e6)}
    observer = AdaptiveStiffnessObserver(AXLES, (4,), **options)
    both = AdaptiveStiffnessObserver(AXLES, (4,), switching="both", **options)
    forces = np.array([[1500.0, 1200.0, 2.0], [-1500.0, 1200.0, 0.0], [900.0, 900.0, 1.0], [1500.0, 700.0, 1.0]])
    given = (np.full(4, 0.05), np.full(4, 0.3), np.full(4, 20.0), np.zeros(4))  # slips of 0.033 and 0.022 rad
    expected = np.array([[True, True], [False, True], [False, True], [True, False]])
    for each, learns in ((observer, expected), (both, expected.all(axis=1, keepdims=True) & expected)):
        step = each.step(*given, forces)
        assert step.excited.tolist() == expected.tolist()
        gain = np.absolute(step.filter.gain[:, [1, 2], [0, 1]])  # of each axle's force on its stiffness
        assert (gain[learns] > 20).all() and (gain[~learns] < 0.05).all()
        assert (np.absolute(step.stiffness - [65_000, 50_000])[~learns] < 150).all()


@pytest.mark.parametrize("kind", [AdaptiveStiffnessObserver, FixedStiffnessObserver])
def test_standstill_zero_steer_and_silence_are_bounded(kind: Any) -> None:
    observer = kind(AXLES, (3,))
    observer.reset(state=[0.2, 100.0, -100.0][: observer._states])
    steering, yaw, speed = np.array([0.3, 0.0, np.nan]), np.zeros(3), np.array([0.0, 20.0, 20.0])
    y = np.zeros((3, 3))
    y[2] = np.nan
    variances = []
    for _ in range(1500):
        step = observer.step(steering, yaw, speed, np.zeros(3), y)
        variances.append(np.einsum("bii->bi", step.filter.covariance))
    assert step.at_rest.tolist() == [True, False, False]
    assert np.absolute(step.sideslip).max() < 1e-3
    np.testing.assert_allclose(variances[-1], variances[750], rtol=1e-3, atol=1e-9)
    assert Flag(int(step.flags[2])) == Flag.MISSING_MEASUREMENT | Flag.MISSING_INPUT
    assert not step.filter.used[0].any() and step.filter.used[1].all()


def test_stiffness_stays_physical() -> None:
    observer = AdaptiveStiffnessObserver(AXLES)
    for k in range(500):
        step = observer.step(0.02, 0.0, 20.0, 0.0, [4e4 * (-1) ** k, 4e4, 50.0])
        assert (step.stiffness >= 0.05 * np.array([65_000, 50_000]) - 1e-6).all()
        assert (step.stiffness <= 2 * np.array([65_000, 50_000]) + 1e-6).all()
        assert np.isfinite(step.sideslip)


def test_save_restore_batch_and_refusals() -> None:
    draw = np.random.default_rng(1)
    observer, twin = AdaptiveStiffnessObserver(AXLES, (2, 2)), AdaptiveStiffnessObserver(AXLES, (2, 2))
    single = AdaptiveStiffnessObserver(AXLES)
    for _ in range(20):
        values = [0.05 * draw.normal(size=(2, 2)), 0.2 * draw.normal(size=(2, 2)), np.full((2, 2), 20.0)]
        y = draw.normal(size=(2, 2, 3)) * [3000, 2000, 3]
        step = observer.step(*values, np.zeros((2, 2)), y)
        alone = single.step(*[value[1, 0] for value in values], 0.0, y[1, 0])
    np.testing.assert_allclose(step.filter.state[1, 0], alone.filter.state, rtol=1e-9, atol=1e-12)
    twin.restore(observer.save())
    left, right = (each.step(*values, np.zeros((2, 2)), y) for each in (observer, twin))
    np.testing.assert_array_equal(left.filter.state, right.filter.state)
    for options, message in [
        ({"switching": "none"}, "switching"),
        ({"threshold": (0.0, 1.0)}, "threshold"),
        ({"standstill_speed": 0.5}, "too low for Euler"),
    ]:
        with pytest.raises(EstimatorError, match=message):
            AdaptiveStiffnessObserver(AXLES, **options)
    with pytest.raises(EstimatorError, match="measurement has shape"):
        single.step(0.0, 0.0, 20.0, 0.0, np.zeros(4))
