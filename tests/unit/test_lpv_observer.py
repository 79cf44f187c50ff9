"""The velocity observer: what it does with good input, missing input and input outside the certified box."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from estimators import EstimatorError, Flag, GainSchedule, LpvVelocityObserver, RangeError, ScheduleError
from estimators.arrays import FloatArray
from tests.support.schedule_content import schedule_content, with_matrix

SCHEDULE = GainSchedule.from_content(schedule_content(gains=[(0.9, 210.0), (0.8, 183.1), (0.7, 100.0), (0.5, 60.0)]))
SIZES = [(4,), (5, 4)]  # plain numbers, arrays


def observer(shape: tuple[int, ...] = (4,), **options: Any) -> LpvVelocityObserver:
    return LpvVelocityObserver(SCHEDULE, shape, **options)


def full(shape: tuple[int, ...], value: float) -> FloatArray:
    return np.full(shape, value)


@pytest.mark.parametrize("shape", [(), *SIZES])
def test_a_good_step_returns_what_a_log_needs(shape: tuple[int, ...]) -> None:
    runner = observer(shape)
    runner.reset(state=[1e-4, 0.5])
    runner.step(full(shape, 0.0), full(shape, 0.0), full(shape, -40.0))
    before = runner.state
    step = runner.step(full(shape, 1.5), full(shape, 0.2), full(shape, -41.0))
    assert step.estimate.shape == (*shape, 2)
    assert step.used.all()
    assert not step.flags.any()
    np.testing.assert_array_equal(step.parameter, full(shape, 41.0))
    C = SCHEDULE.plant_at(41.0).C[0]
    np.testing.assert_allclose(step.innovation, 0.2 - before @ C, rtol=1e-12)
    np.testing.assert_array_equal(step.estimate, runner.state)


@pytest.mark.parametrize("shape", SIZES)
def test_constant_inputs_lead_to_the_closed_form_steady_state(shape: tuple[int, ...]) -> None:
    runner = observer(shape)
    u, y, p = 0.3, 0.25, 60.0
    for _ in range(4000):
        step = runner.step(full(shape, u), full(shape, y), full(shape, p))
    A, B, C, _ = SCHEDULE.plant_at(p)
    L = SCHEDULE.gain(p)
    steady = -np.linalg.solve(A - L @ C, B[:, 0] * u + L[:, 0] * y)
    np.testing.assert_allclose(step.estimate, np.broadcast_to(steady, (*shape, 2)), rtol=1e-10)


@pytest.mark.parametrize("shape", SIZES)
@pytest.mark.parametrize("speed", [0.0, 1e-9, 0.3, 90.0])
def test_missing_measurements_coast_on_the_kinematics(shape: tuple[int, ...], speed: float) -> None:
    runner = observer(shape)
    runner.reset(state=[2e-3, 0.7])
    y = full(shape, 0.1)
    y[..., 1] = np.nan
    y[..., 2] = np.inf
    step = runner.step(full(shape, 4.0), y, full(shape, speed))
    A, B, _, _ = SCHEDULE.plant_at(speed)
    augmented = np.zeros((3, 3))
    augmented[:2, :2], augmented[:2, 2] = A, 4.0 * B[:, 0]
    coasted = (expm(augmented * SCHEDULE.sample_time) @ [2e-3, 0.7, 1.0])[:2]
    for corner in (1, 2):
        np.testing.assert_allclose(
            step.estimate[..., corner, :], np.broadcast_to(coasted, (*shape[:-1], 2)), rtol=1e-13
        )
    assert (step.flags & ~int(Flag.RESET) == [0, 1, 1, 0]).all()
    assert (step.used == [True, False, False, True]).all()
    assert (np.isnan(step.innovation) == [False, True, True, False]).all()


@pytest.mark.parametrize("shape", SIZES)
def test_missing_input_is_held(shape: tuple[int, ...]) -> None:
    held, given = observer(shape), observer(shape)
    y, p = full(shape, 0.1), full(shape, 30.0)
    lost = full(shape, np.nan)
    first = held.step(lost, y, p)
    assert (first.flags == Flag.MISSING_INPUT).all()
    given.step(full(shape, 0.0), y, p)
    for u in (2.0, np.nan, np.inf, -np.inf, 1e200):
        step = held.step(full(shape, u), y, p)
        expected = given.step(full(shape, 2.0), y, p)
        np.testing.assert_array_equal(step.estimate, expected.estimate)
        assert (step.flags == (0 if u == 2.0 else Flag.MISSING_INPUT)).all()
        assert step.used.all()


@pytest.mark.parametrize("shape", SIZES)
def test_missing_parameter_is_held_and_its_rate_counts_the_gap(shape: tuple[int, ...]) -> None:
    runner = observer(shape)
    u, y = full(shape, 0.0), full(shape, 0.1)
    step = runner.step(u, y, full(shape, np.nan))
    assert (step.flags == Flag.MISSING_PARAMETER).all()
    np.testing.assert_array_equal(step.parameter, full(shape, 0.0))
    assert not runner.step(u, y, full(shape, 30.0)).flags.any()  # nothing to compare with
    for _ in range(4):
        step = runner.step(u, y, full(shape, np.nan))
        assert (step.flags == Flag.MISSING_PARAMETER).all()
        np.testing.assert_array_equal(step.parameter, full(shape, 30.0))
    assert not runner.step(u, y, full(shape, 49.0)).flags.any()  # 19 rad/s in 25 ms
    assert (runner.step(u, y, full(shape, 54.0)).flags == Flag.RATE_OUT_OF_RANGE).all()  # 5 rad/s in 5 ms


@pytest.mark.parametrize("shape", SIZES)
def test_outside_the_box_is_clipped_and_flagged(shape: tuple[int, ...]) -> None:
    runner, clipped = observer(shape), observer(shape)
    u, y = full(shape, 0.2), full(shape, 0.1)
    speed = full(shape, 20.0)
    for value, flag in [(139.0, 0), (142.0, 16), (-142.0, 48), (-139.0, 0), (-135.1, 0), (-131.0, 32), (1e90, 48)]:
        speed[..., 2] = value
        step = runner.step(u, y, speed)
        expected = clipped.step(u, y, np.clip(np.abs(speed), 0, 140))
        np.testing.assert_array_equal(step.estimate, expected.estimate)
        assert (step.flags == [0, 0, flag, 0]).all()
        assert step.used.all()


@pytest.mark.parametrize("shape", SIZES)
def test_a_magnitude_that_passes_through_zero_fell_and_rose(shape: tuple[int, ...]) -> None:
    runner = observer(shape)
    u, y = full(shape, 0.2), full(shape, 0.1)
    for value, flag in [(1.9, 0), (-1.9, 0), (3.0, Flag.RATE_OUT_OF_RANGE), (3.0, 0)]:
        assert (runner.step(u, y, full(shape, value)).flags == flag).all()


@pytest.mark.parametrize("shape", SIZES)
def test_refusing_names_value_range_sample_and_entry_and_keeps_the_state(shape: tuple[int, ...]) -> None:
    runner = observer(shape, outside="refuse", stale_after=3)
    u, y = full(shape, 0.2), full(shape, 0.1)
    for value in (137.0, 140.0):
        runner.step(u, y, full(shape, value))
    before = runner.save()
    speed = full(shape, 139.0)
    speed[..., 3] = 212.0
    entry = r"entry 3" if len(shape) == 1 else r"entry \(0, 3\)"
    box = r"wheel_speed = 212 rad/s is outside the certified range \[0, 140\] rad/s"
    with pytest.raises(RangeError, match=rf"^{box} \(sample 2, {entry}\)$"):
        runner.step(u, y, speed)
    speed[..., 3] = 130.0
    rates = r"wheel_speed changes at -2000 rad/s/s, outside the certified rates \[-800, 800\] rad/s/s"
    with pytest.raises(RangeError, match=rf"^{rates} \(sample 2, {entry}\)$"):
        runner.step(u, y, speed)
    for key, array in runner.save().items():
        np.testing.assert_array_equal(array, before[key])
    assert not runner.step(u, y, full(shape, 139.0)).flags.any()


@pytest.mark.parametrize("shape", SIZES)
def test_stale_measurements_coast(shape: tuple[int, ...]) -> None:
    runner = observer(shape, stale_after=3)
    u, p = full(shape, 0.2), full(shape, 50.0)
    y = full(shape, 0.1)
    flags = []
    for sample in range(8):
        y[..., 0] = 0.1 + 0.01 * sample
        y[..., 1] = np.nan if sample == 2 else 0.1  # a gap does not make a frozen sensor fresh
        y[..., 2] = 0.3 if sample == 5 else 0.1
        step = runner.step(u, y, p)
        flags.append(step.flags.reshape(-1, 4)[-1].tolist())
        assert (step.used == (step.flags == 0)).all()
        assert np.isfinite(step.innovation[..., [0, 2, 3]]).all()
    assert [row[0] for row in flags] == [0] * 8
    assert [row[1] for row in flags] == [0, 0, 1, 0, 2, 2, 2, 2]
    assert [row[2] for row in flags] == [0, 0, 0, 2, 2, 0, 0, 0]
    assert [row[3] for row in flags] == [0, 0, 0, 2, 2, 2, 2, 2]


@pytest.mark.parametrize("shape", SIZES)
def test_estimates_stay_finite_whatever_arrives(shape: tuple[int, ...]) -> None:
    runner = observer(shape, stale_after=2)
    draw = np.random.default_rng(5)
    odd = np.array([np.nan, np.inf, -np.inf, 1e308, -1e308, 1e99, 0.0, -0.0, 1.0])
    for sample in range(600):
        u, y, p = (draw.choice(odd, shape) if sample < 400 else full(shape, np.nan) for _ in range(3))
        step = runner.step(u, y, p)
        assert np.isfinite(step.estimate).all()
        assert np.isfinite(step.parameter).all()
        assert (step.flags[~step.used] & int(Flag.MISSING_MEASUREMENT | Flag.STALE_MEASUREMENT) > 0).all()
    for _ in range(3000):  # and the observer recovers, even from 1e99
        step = runner.step(full(shape, 0.0), draw.normal(0, 1e-3, shape), full(shape, 30.0))
    assert (np.abs(step.estimate) < 1).all()


@pytest.mark.parametrize("shape", SIZES)
def test_an_unstable_model_that_coasts_for_long_starts_again(shape: tuple[int, ...]) -> None:
    content = schedule_content(gains=(100.0, 100.0))
    with_matrix(content, "A", [[50, 1], [0, 50]])
    with_matrix(content, "C", [[1, 1]])
    runner = LpvVelocityObserver(GainSchedule.from_content(content), shape)
    runner.reset(state=1.0)
    seen = 0
    for _ in range(1000):
        step = runner.step(full(shape, 1.0), full(shape, np.nan), full(shape, 3.0))
        assert np.isfinite(step.estimate).all()
        seen |= int(np.bitwise_or.reduce(step.flags, axis=None))
    assert seen == Flag.RESET | Flag.MISSING_MEASUREMENT


@pytest.mark.parametrize("arguments", [(3, 4, 4), (4, 3, 4), (4, 4, 3)])
def test_wrong_shapes_are_refused_with_both_shapes(arguments: tuple[int, ...]) -> None:
    with pytest.raises(EstimatorError, match=r"has shape \(3,\), expected \(4,\) or one number"):
        observer().step(*(np.zeros(size) for size in arguments))
    with pytest.raises(EstimatorError, match="measurement is not an array of numbers"):
        observer().step(np.zeros(4), ["a", "b", "c", "d"], np.zeros(4))  # type: ignore[list-item]


def test_options_that_mean_nothing_are_refused() -> None:
    with pytest.raises(EstimatorError, match="outside = 'ignore' is not known; use 'flag' or 'refuse'"):
        observer(outside="ignore")
    with pytest.raises(EstimatorError, match="stale_after = 0 samples must be at least 1"):
        observer(stale_after=0)
    with pytest.raises(EstimatorError, match=r"batch_shape = \(0,\) holds no entries"):
        observer((0,))


def test_other_sizes_and_explosive_gains_are_refused() -> None:
    content = schedule_content()
    content["model"]["inputs"] = []
    with_matrix(content, "B", [[], []])
    with_matrix(content, "D", [[]])
    with pytest.raises(EstimatorError, match="2 states, 0 inputs and 1 outputs; this observer is for 2, 1 and 1"):
        LpvVelocityObserver(GainSchedule.from_content(content))
    content = schedule_content()
    with_matrix(content, "A", [[0, 1], [0, 0]], [[-1e40, 0], [0, 0]], [[0, 0], [0, -1e90]])
    with pytest.raises(ScheduleError, match=r"multiply to more than 1e\+50 in one sample, .* check their units"):
        LpvVelocityObserver(GainSchedule.from_content(content))
    content = schedule_content(gains=(0.0, 0.0))
    with_matrix(content, "A", [[-1e4, 1], [0, 0]], [[900, 0], [0, 0]], [[-9, 0], [0, 0]])  # 12500 1/s at 50 rad/s
    with pytest.raises(ScheduleError, match=r"grows by e\^\d+ in one sample at wheel_speed = \d+.* rad/s; check"):
        LpvVelocityObserver(GainSchedule.from_content(content))
    content = schedule_content(gains=(-50.0, 183.1))
    with pytest.raises(ScheduleError, match=r"grows by e\^\d+ in one sample at wheel_speed = 0 rad/s; check the signs"):
        LpvVelocityObserver(GainSchedule.from_content(content))
