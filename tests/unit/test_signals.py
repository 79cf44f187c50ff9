"""Raw signals: what is new, what is old, what is missing; derivatives and ticks with the errors they state."""

from __future__ import annotations

import math

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.faults import Flag
from estimators.signals import FilteredDerivative, Freshness, Held, TickSpeed
from studies.drives.corner_inputs import derivative

TIME = 0.005


def test_a_slow_device_read_fast_is_new_only_when_it_changes() -> None:
    device = np.repeat(np.random.default_rng(1).normal(size=50), 4)  # 50 Hz read at 200 Hz
    judge = Freshness((), hold=4)
    fresh = np.array([judge.step(value).fresh for value in device])
    np.testing.assert_array_equal(fresh, np.arange(200) % 4 == 0)


@pytest.mark.parametrize("hold", [1, 4, 7])
def test_a_constant_signal_counts_once_in_a_device_interval(hold: int) -> None:
    judge = Freshness((), hold=hold)
    fresh = np.array([judge.step(3.0).fresh for _ in range(28 * 5)])
    assert fresh.sum() == 28 * 5 / hold
    assert (np.diff(np.flatnonzero(fresh)) == hold).all()


def test_jitter_never_counts_a_repetition() -> None:
    rng = np.random.default_rng(2)
    lengths = rng.integers(3, 6, size=60)  # 15 to 25 ms, late or early by a sample
    device = np.repeat(rng.normal(size=60), lengths)
    judge = Freshness((), hold=5)
    fresh = np.array([judge.step(value).fresh for value in device])
    np.testing.assert_array_equal(np.flatnonzero(fresh), np.concatenate(([0], np.cumsum(lengths)[:-1])))


def test_stale_and_missing_samples_are_flagged_and_not_new() -> None:
    judge = Freshness((2,), hold=2, stale_after=6)
    for k in range(12):
        step = judge.step([1.0, np.nan if k == 5 else k])
        if k == 5:
            assert Flag(int(step.flags[1])) == Flag.MISSING_MEASUREMENT
            assert not step.fresh[1]
    assert Flag(int(step.flags[0])) == Flag.STALE_MEASUREMENT
    assert not step.fresh[0]
    assert step.fresh[1]
    assert step.age[0] > 4
    judge.reset([True, False])
    assert judge.step([1.0, 12.0]).fresh.all()


def test_held_signals_hold_each_entry() -> None:
    held = Held((3,), "torque", [1.0, 2.0, 3.0])
    value, missing = held([np.nan, 5.0, np.inf])
    np.testing.assert_array_equal(value, [1.0, 5.0, 3.0])
    assert missing is not None
    np.testing.assert_array_equal(missing, [True, False, True])
    value, missing = held(7.0)
    np.testing.assert_array_equal(value, 7.0)
    assert missing is None
    with pytest.raises(EstimatorError, match=r"torque has shape \(2,\), expected \(3,\)"):
        held([1.0, 2.0])


@pytest.mark.parametrize("lag", [0.0, 0.004, 0.03])
def test_the_derivative_is_the_offline_one(lag: float) -> None:
    x = np.cumsum(np.random.default_rng(3).normal(size=300))
    runner = FilteredDerivative(TIME, lag, ())
    found = np.array([runner.step(value).derivative for value in x])
    np.testing.assert_allclose(found[1:], derivative(x, TIME, lag)[1:], rtol=1e-12)


@pytest.mark.parametrize("lag", [0.0, 0.01])
def test_a_parabola_shows_the_stated_delay(lag: float) -> None:
    t = TIME * np.arange(400)
    runner = FilteredDerivative(TIME, lag, ())
    for value in 0.5 * 3.0 * t**2:
        step = runner.step(value)
    # exact for an x that is linear between samples: dx/dt is a staircase, so the delay of its filter is not quite the lag
    keep = math.exp(-TIME / lag) if lag else 0.0
    delay = TIME / 2 + TIME * keep / (1.0 - keep)
    assert step.derivative == pytest.approx(3.0 * (t[-1] - delay), rel=1e-9)
    assert delay == pytest.approx(lag + TIME / 2, abs=TIME / 2 + 1e-12)


def test_the_noise_of_the_derivative_is_the_stated_one() -> None:
    lag, runs = 0.01, 4000
    rng = np.random.default_rng(4)
    runner = FilteredDerivative(TIME, lag, (runs,))
    for _ in range(60):
        found = runner.step(0.05 * rng.normal(size=runs)).derivative
    a = math.exp(-TIME / lag)
    stated = 0.05 * math.sqrt(2.0 * (1.0 - a) ** 2 / (1.0 + a)) / TIME
    assert np.std(found) == pytest.approx(stated, rel=5.0 / math.sqrt(2 * runs))


def test_quantisation_costs_no_more_than_its_step_over_the_lag() -> None:
    step, lag = 0.1, 0.02
    t = TIME * np.arange(2000)
    speed = 40.0 + 10.0 * np.sin(3.0 * t) + 2.0 * np.sin(17.0 * t)
    exact, coarse = FilteredDerivative(TIME, lag, ()), FilteredDerivative(TIME, lag, ())
    error = [coarse.step(step * np.round(x / step)).derivative - exact.step(x).derivative for x in speed]
    assert 0.0 < np.abs(error).max() <= step * (1.0 - math.exp(-TIME / lag)) / TIME < step / lag


def test_repeated_readings_give_the_slope_and_no_spikes() -> None:
    runner, naive = FilteredDerivative(TIME, 0.0, (), hold=4), FilteredDerivative(TIME, 0.0, ())
    steps = [runner.step(100.0 * TIME * (4 * (k // 4))) for k in range(60)]
    spikes = [naive.step(100.0 * TIME * (4 * (k // 4))).derivative for k in range(60)]
    np.testing.assert_allclose([step.derivative for step in steps[8:]], 100.0, rtol=1e-12)
    assert max(spikes) == pytest.approx(400.0)
    assert not any(step.flags for step in steps)


def test_a_gap_is_bridged_by_its_mean_slope_and_a_long_one_is_flagged() -> None:
    runner = FilteredDerivative(TIME, 0.01, (2,), longest_gap=10)
    x = 50.0 * TIME * np.arange(100)
    x_lost = x.copy()
    x_lost[20:25] = np.nan
    x_lost[40:60] = np.inf
    for k in range(100):
        step = runner.step([x[k], x_lost[k]])
        assert np.isfinite(step.derivative).all()
        assert step.derivative[0] == pytest.approx(50.0 if k else 0.0)
        lost = not np.isfinite(x_lost[k])
        assert bool(step.flags[1] & Flag.MISSING_MEASUREMENT) == lost
        long = 50 <= k < 60
        assert bool(step.flags[1] & Flag.STALE_MEASUREMENT) == long
        assert step.derivative[1] == pytest.approx(0.0 if long or not k else 50.0)
        assert step.value[1] == (x_lost[k] if not lost else x[19 if k < 30 else 39])


def test_derivatives_can_be_saved_reset_and_refuse_nonsense() -> None:
    rng = np.random.default_rng(5)
    first, second = (FilteredDerivative(TIME, 0.01, (3,), hold=2) for _ in range(2))
    for _ in range(10):
        first.step(rng.normal(size=3))
    second.restore(first.save())
    x = rng.normal(size=3)
    np.testing.assert_array_equal(first.step(x).derivative, second.step(x).derivative)
    second.reset([True, False, False])
    assert second.step(x).derivative[0] == 0.0
    for arguments in ((0.0, 0.01), (TIME, -1.0), (TIME, math.nan)):
        with pytest.raises(EstimatorError, match=" s must be finite and"):
            FilteredDerivative(*arguments)
    with pytest.raises(EstimatorError, match="hold = 0 samples"):
        Freshness(hold=0)
    with pytest.raises(EstimatorError, match="stale_after = 2 samples"):
        Freshness(hold=4, stale_after=2)
    with pytest.raises(EstimatorError, match="holds no entries"):
        Freshness((0,))
    with pytest.raises(EstimatorError, match="expected a bool mask"):
        first.reset([1, 0, 0])
    with pytest.raises(EstimatorError, match=r"saved 'value' is float64 \(3,\), expected float64 \(2,\)"):
        FilteredDerivative(TIME, 0.01, (2,), hold=2).restore(first.save())
    with pytest.raises(EstimatorError, match="saved state lacks"):
        first.restore({})


@pytest.mark.parametrize("speed", [0.4, -6.0, 20.0, 130.0])
@pytest.mark.parametrize("modulus", [None, 256])
def test_ticks_are_right_to_the_stated_resolution(speed: float, modulus: int | None) -> None:
    teeth = 48
    counter = TickSpeed(teeth, TIME, (), least_ticks=6, longest_window=40, modulus=modulus)
    for k in range(200):
        count = math.floor(speed * TIME * k * teeth / (2 * math.pi) + 0.3)
        step = counter.step(count % modulus if modulus else count)
        if k >= 40:
            assert abs(step.speed - speed) < step.resolution
            assert step.resolution == pytest.approx(2 * math.pi / teeth / (step.window * TIME))
    assert (step.window == 40) == (abs(speed) < 1.0)


def test_ticks_at_rest_missing_and_reset() -> None:
    counter = TickSpeed(48, TIME, (2,), longest_window=5)
    for k in range(10):
        step = counter.step([7.0, np.nan if k in {3, 6} else 2.0 * k])
        assert np.isfinite(step.speed).all()
        assert bool(step.flags[1]) == (k in {3, 6})
    np.testing.assert_allclose(step.speed, [0.0, 2 * 2 * math.pi / 48 / TIME])
    other = TickSpeed(48, TIME, (2,), longest_window=5)
    other.restore(counter.save())
    np.testing.assert_array_equal(counter.step([9.0, 20.0]).speed, other.step([9.0, 20.0]).speed)
    counter.reset()
    np.testing.assert_array_equal(counter.step([9.0, 20.0]).speed, 0.0)
    with pytest.raises(EstimatorError, match="teeth = 0 must be at least 1"):
        TickSpeed(0, TIME)
