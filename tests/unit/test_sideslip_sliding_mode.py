"""Sliding-mode force observer: convergence, linear zone, and what happens when something is missing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from estimators import EstimatorError, Flag
from estimators.sideslip import SlidingGains, SlidingModeObserver, wheel_axes
from tests.support.sideslip_truth import AXLES, single_track


def outputs(state: np.ndarray) -> np.ndarray:
    return np.array([state[0], (state[1] + state[2]) / AXLES.mass, state[3] / AXLES.mass])


def test_converges_to_constant_forces_from_the_published_offset() -> None:
    balance = 2000 * AXLES.front_axle_distance / AXLES.rear_axle_distance
    truth = np.array([0.3, 2000.0, balance, 800.0])
    observer = SlidingModeObserver(AXLES)
    observer.reset(state=[0.5, 5448, 3663, 6181])
    for _ in range(600):
        step = observer.step(outputs(truth))
    np.testing.assert_allclose(step.state, truth, rtol=1e-6)
    assert step.used.all() and not step.flags.any()


def test_error_in_the_zone_follows_the_matrix() -> None:
    truth = np.array([0.0, 0.0, 0.0, 0.0])
    observer = SlidingModeObserver(AXLES)
    e = np.array([0.01, 20.0, -30.0, 15.0])
    observer.reset(state=-e)
    for _ in range(20):
        e = observer.zone_matrix() @ e
        step = observer.step(outputs(truth))
        np.testing.assert_allclose(step.state, -e, atol=1e-9)
    assert observer.spectral_radius == pytest.approx(0.9628, abs=5e-5)


def test_slalom_of_an_independent_single_track() -> None:
    truth = single_track(lambda t: 0.04 * np.sin(1.6 * t), 20.0, 8.0)
    observer = SlidingModeObserver(AXLES)
    found = [
        observer.step([r, ay, 0.0], d)
        for r, ay, d in zip(truth["yaw_rate"], truth["ay"], truth["steering"], strict=True)
    ]
    front = np.array([step.wheel_forces[1] for step in found])
    rear = np.array([step.wheel_forces[2] for step in found])
    for estimate, true in ((front, truth["forces"][:, 0]), (rear, truth["forces"][:, 1])):
        error = np.absolute(estimate - true)[200:] / np.absolute(true).max()
        assert error.mean() < 0.06  # the paper's claim for mean and deviation
        assert error.std() < 0.06


def test_wheel_axes_turn_the_force() -> None:
    state = np.array([0.1, 3000.0, 1000.0, 400.0])
    longitudinal, lateral, rear = wheel_axes(state, np.array(0.2))
    assert np.hypot(longitudinal, lateral) == pytest.approx(np.hypot(3000, 400))
    assert lateral == pytest.approx(3000 * np.cos(0.2) - 400 * np.sin(0.2))
    assert rear == 1000.0


def test_narrow_zone_is_refused_and_would_chatter() -> None:
    with pytest.raises(EstimatorError, match=r"spectral radius 5\.36"):
        SlidingModeObserver(AXLES, widths=(0.05, 0.1, 0.1))
    assert SlidingModeObserver(AXLES, widths=(0.05, 0.1, 0.1), sample_time=1e-3).spectral_radius < 1


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_missing_channels(bad: float) -> None:
    observer = SlidingModeObserver(AXLES, (2,))
    observer.reset(state=[0.1, 1000, 800, 100])
    for _ in range(100_0):
        step = observer.step([[bad, bad, bad], [0.1, bad, 0.0]], [bad, 0.0])
    np.testing.assert_array_equal(step.state[0], [0.1, 1000, 800, 100])
    assert Flag(int(step.flags[0])) == Flag.MISSING_MEASUREMENT | Flag.MISSING_INPUT
    assert step.used.tolist() == [[False] * 3, [True, False, True]]
    assert np.isnan(step.innovation[0]).all() and not step.switching[0].any() and np.isfinite(step.state).all()


def test_save_restore_reset_and_refusals() -> None:
    observer, twin = SlidingModeObserver(AXLES, (2, 3)), SlidingModeObserver(AXLES, (2, 3))
    draw = np.random.default_rng(0)
    observer.step(draw.normal(size=(2, 3, 3)), 0.1 * draw.normal(size=(2, 3)))
    twin.restore(observer.save())
    y = draw.normal(size=(2, 3, 3))
    np.testing.assert_array_equal(observer.step(y).state, twin.step(y).state)
    where = np.zeros((2, 3), dtype=bool)
    where[1, 2] = True
    observer.reset(where)
    step = observer.step(np.full((2, 3, 3), np.nan))
    assert not step.state[1, 2].any() and step.state[0].all()
    assert ((step.flags & Flag.RESET) > 0).tolist() == where.tolist()
    bad: Any
    for bad, message in [({"yaw": 0.0}, "yaw"), ({"rear": np.nan}, "rear")]:
        with pytest.raises(EstimatorError, match=message):
            SlidingGains(**bad)
    with pytest.raises(EstimatorError, match="lateral width"):
        SlidingModeObserver(AXLES, widths=(0.2, 0.0, 1.0))
    with pytest.raises(EstimatorError, match="not finite"):
        observer.reset(state=np.nan)
