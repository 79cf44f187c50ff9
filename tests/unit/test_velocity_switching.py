"""Switching between two gain schedules by slip."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.linalg import expm

from estimators import EstimatorError, Flag, GainSchedule, LpvVelocityObserver
from estimators.velocity import SlipSwitch, SwitchedVelocityObserver, with_constant_gain
from estimators.velocity.switching import HIGH_SLIP_GAIN
from tests.support.schedule_content import schedule_content

SCHEDULE = GainSchedule.from_content(schedule_content("resilient-longitudinal"))
SIZE = (20,)


def signals(seed: int, steps: int = 50) -> np.ndarray:
    rng = np.random.default_rng(seed)
    speed = 40.0 + np.cumsum(rng.normal(size=(steps, *SIZE)), axis=0)
    return np.stack([3 * rng.normal(size=(steps, *SIZE)), 0.3 * rng.normal(size=(steps, *SIZE)), speed], axis=1)


@pytest.mark.parametrize(("slip", "other"), [(0.1, SCHEDULE), (-0.2, with_constant_gain(SCHEDULE))])
def test_in_one_mode_it_is_the_plain_observer(slip: float, other: GainSchedule) -> None:
    switched, plain = SwitchedVelocityObserver(SCHEDULE, batch_shape=SIZE), LpvVelocityObserver(other, SIZE)
    for u, y, p in signals(0):
        a, b = switched.step(u, y, p, slip), plain.step(u, y, p)
        np.testing.assert_allclose(a.estimate, b.estimate, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(a.innovation, b.innovation, rtol=1e-9, atol=1e-12)
        assert (a.high_slip == (abs(slip) >= 0.15)).all()


def test_switching_keeps_one_state() -> None:
    """Entry by entry against the matrix exponential of the closed loop with the gain of the mode."""
    rng = np.random.default_rng(1)
    observer = SwitchedVelocityObserver(SCHEDULE, batch_shape=SIZE)
    x = np.zeros((*SIZE, 2))
    for u, y, p in signals(2, 25):
        slip = 0.3 * rng.random(SIZE)
        step = observer.step(u, y, p, slip)
        plant = SCHEDULE.plant_at(p)
        for i in range(SIZE[0]):
            L = np.array(HIGH_SLIP_GAIN if slip[i] >= 0.15 else (1.18, 387.0))[:, None]
            block = np.zeros((3, 3))
            block[:2, :2] = plant.A[i] - L @ plant.C[i]
            block[:2, 2] = plant.B[i][:, 0] * u[i] + L[:, 0] * y[i]
            x[i] = (expm(0.005 * block) @ [*x[i], 1.0])[:2]
        np.testing.assert_allclose(step.estimate, x, rtol=1e-9, atol=1e-12)


def test_hysteresis_keeps_the_mode() -> None:
    plain, sticky = SlipSwitch((1,)), SlipSwitch((1,), hysteresis=0.4)
    course = [0.1, 0.15, 0.12, 0.08, np.nan, 0.2, np.nan, 0.0]
    assert [bool(plain(np.array([s]))[0]) for s in course] == [False, True, False, False, False, True, True, False]
    assert [bool(sticky(np.array([s]))[0]) for s in course] == [False, True, True, False, False, True, True, False]


def test_faults_are_flagged() -> None:
    observer = SwitchedVelocityObserver(SCHEDULE, batch_shape=(4,))
    observer.step(0.0, 0.1, 40.0, 0.0)
    step = observer.step(
        np.array([np.nan, 0, 0, 0]), np.array([0.1, np.nan, 0.1, 0.1]), np.array([40, 40, np.nan, 40.0]), np.nan
    )
    np.testing.assert_array_equal(
        step.flags, [Flag.MISSING_INPUT, Flag.MISSING_MEASUREMENT, Flag.MISSING_PARAMETER, Flag.NONE]
    )
    np.testing.assert_array_equal(step.used, [True, False, True, True])
    assert np.isnan(step.innovation[1])
    assert np.isfinite(step.estimate).all()


def test_saved_restored_and_reset() -> None:
    one, two = (SwitchedVelocityObserver(SCHEDULE, batch_shape=SIZE) for _ in range(2))
    course = signals(3)
    for k, (u, y, p) in enumerate(course):
        if k == 30:
            two.restore(one.save())
        slip = np.where(np.arange(SIZE[0]) % 3 == k % 3, 0.3, 0.0)
        a = one.step(u, y, p, slip)
        if k >= 30:
            np.testing.assert_array_equal(a.estimate, two.step(u, y, p, slip).estimate)
    one.reset(state=[0.0, 1.0])
    np.testing.assert_array_equal(one.state[..., 1], 1.0)
    assert not one.switch.high.any()


def test_a_constant_gain_carries_no_certificate() -> None:
    """Its digest, by which claims would be found, is gone; and its gain is that of the update it was published for."""
    bare = with_constant_gain(SCHEDULE)
    assert bare.sha256 == ""
    assert with_constant_gain(dataclasses.replace(SCHEDULE, update="sampled")).update == "held"
    np.testing.assert_array_equal(bare.gain(70.0)[:, 0], HIGH_SLIP_GAIN)


def test_bad_settings_are_refused() -> None:
    with pytest.raises(EstimatorError, match="two finite numbers"):
        with_constant_gain(SCHEDULE, (1.0, float("nan")))
    with pytest.raises(EstimatorError, match="limit"):
        SwitchedVelocityObserver(SCHEDULE, limit=0.0)
    with pytest.raises(EstimatorError, match="slip"):
        SwitchedVelocityObserver(SCHEDULE, batch_shape=(4,)).step(0.0, 0.0, 0.0, np.zeros(3))
