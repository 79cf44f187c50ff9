"""The observer of any size: against matrix exponentials, against itself in batches, with every fault, saved and restored."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator
from scipy.linalg import expm

from estimators import LpvObserver, LpvVelocityObserver
from estimators.errors import EstimatorError, RangeError, ScheduleError
from estimators.faults import Flag
from estimators.interpolate import Multilinear
from estimators.lpv.exact_step import series
from estimators.schedule import GainSchedule
from tests.support.any_size import PERIOD, any_schedule, signals
from tests.support.schedule_content import schedule_content


def exact(schedule: GainSchedule, x: np.ndarray, u: np.ndarray, y: np.ndarray, p: np.ndarray, used: bool) -> np.ndarray:
    """One sample by a matrix exponential of scipy."""
    at = p if len(schedule.parameters) > 1 else p[0]
    A, B, C, D = schedule.plant_at(at)
    L = schedule.gain(at) * used
    held = schedule.update == "held"
    M, drive = (A - L @ C, (B - L @ D) @ u + L @ y) if held else (A, B @ u)
    n = len(x)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n] = PERIOD * M, PERIOD * drive
    after = (expm(whole) @ [*x, 1.0])[:n]
    return after if held else after + L @ (y - C @ x - D @ u)


@pytest.mark.parametrize("update", ["held", "sampled"])
@pytest.mark.parametrize(("sizes", "parameters"), [((1, 1, 1), 1), ((3, 2, 2), 2), ((8, 1, 3), 1), ((4, 0, 2), 3)])
def test_a_step_is_the_exact_update(sizes: tuple[int, int, int], parameters: int, update: str) -> None:
    schedule = any_schedule(sizes, parameters, update=update)
    rng, observer = np.random.default_rng(1), LpvObserver(schedule)
    x = rng.normal(size=sizes[0])
    observer.reset(state=x)
    for k in range(6):
        u, y, p = signals(schedule, rng, ())
        lost = k == 3
        step = observer.step(u, np.full_like(y, np.nan) if lost else y, p)
        x = exact(schedule, x, u, y, p, not lost)
        np.testing.assert_allclose(step.estimate, x, rtol=1e-12, atol=1e-13)
        assert step.used == (not lost)
        assert step.flags == (Flag.RESET if k == 0 else Flag.MISSING_MEASUREMENT if lost else 0)


@pytest.mark.parametrize("speed", [0.01, 3.0, 200.0, 2000.0])
def test_the_series_is_long_enough_on_the_whole_range(speed: float) -> None:
    """Slow and fast plants: |M| from 1e-3 to 40, the relative error stays that of float64."""
    schedule = any_schedule((4, 1, 2), 2, speed=speed, table=np.zeros((3, 3, 4, 2)))
    rng, observer = np.random.default_rng(5), LpvObserver(schedule, (30,))
    x = rng.normal(size=(30, 4))
    observer.reset(state=x)
    u, y, _ = signals(schedule, rng, (30,))
    p = np.array([0.0, 1.0]) + rng.uniform(0.0, 2.0, (30, 2))
    found = observer.step(u, y, p).estimate
    wanted = np.array([exact(schedule, *row, True) for row in zip(x, u, y, p, strict=True)])
    assert np.abs(found - wanted).max() <= 2e-14 * max(1.0, np.abs(wanted).max())


@pytest.mark.parametrize("nu", [1e-6, 0.1, 1.0, 7.3, 49.0])
def test_what_the_series_leaves_out_is_below_the_last_digit(nu: float) -> None:
    """The remainder of a scalar, summed in exact order, at the largest argument; with one term less it would not do."""
    pieces, terms = series(nu)
    z = nu / pieces
    left = sum(z**k / math.factorial(k + 1) for k in range(terms, 120))
    assert left <= 2.0**-53
    assert sum(z**k / math.factorial(k + 1) for k in range(terms - 1, 120)) > 2.0**-53 or terms == 1


def test_a_batch_is_its_entries_one_by_one() -> None:
    schedule = any_schedule((3, 1, 2), 3)
    rng, together = np.random.default_rng(2), LpvObserver(schedule, (2, 3))
    alone = [LpvObserver(schedule) for _ in range(6)]
    for k in range(4):
        u, y, p = signals(schedule, rng, (2, 3))
        if k == 2:
            y[1, 1, 0], p[0, 2, 1] = np.nan, np.nan
        step = together.step(u, y, p)
        for i, one in enumerate(alone):
            place = divmod(i, 3)
            single = one.step(u[place], y[place], p[place])
            for ours, theirs in zip(step, single, strict=True):
                np.testing.assert_allclose(ours[place], theirs, rtol=1e-13, atol=1e-14)


def test_two_states_move_as_in_the_observer_that_is_written_for_them() -> None:
    schedule = GainSchedule.from_content(schedule_content())
    rng, any_size, two = np.random.default_rng(3), LpvObserver(schedule, (5,)), LpvVelocityObserver(schedule, (5,))
    speed = rng.uniform(20.0, 100.0, 5)
    for k in range(40):
        u, y = rng.normal(size=5), rng.normal(size=5)
        y[0] = np.nan if k % 7 == 3 else y[0]
        speed = speed + rng.uniform(-5.0, 5.0, 5)  # faster than the certified 800 rad/s^2 at times
        first, second = any_size.step(u, y, speed), two.step(u, y, speed)
        np.testing.assert_allclose(first.estimate, second.estimate, rtol=1e-11, atol=1e-13)
        np.testing.assert_array_equal(first.flags, second.flags)
        np.testing.assert_array_equal(first.used, second.used)


def test_every_fault_is_flagged_and_the_estimate_stays_finite() -> None:
    schedule = any_schedule((2, 1, 2), 2)
    rng, observer = np.random.default_rng(4), LpvObserver(schedule, stale_after=2)
    u, y, p = signals(schedule, rng, ())
    assert observer.step(u, y, p).flags == 0
    assert observer.step(u, y + 1.0, [9.9, p[1]]).flags == Flag.PARAMETER_OUT_OF_RANGE | Flag.RATE_OUT_OF_RANGE
    late = observer.step([np.inf], [y[0], np.nan], [np.nan, p[1]])
    assert late.flags == (
        Flag.MISSING_INPUT | Flag.MISSING_MEASUREMENT | Flag.MISSING_PARAMETER | Flag.PARAMETER_OUT_OF_RANGE
    )
    assert np.isnan(late.innovation[1]) and np.isfinite(late.innovation[0]) and not late.used
    np.testing.assert_array_equal(late.parameter, [2.0, p[1]])  # held, and clipped to the certified range
    repeats = [observer.step(u, y, p).flags for _ in range(4)]
    assert [bool(f & Flag.STALE_MEASUREMENT) for f in repeats] == [False, False, True, True]
    for _ in range(30):
        step = observer.step(
            rng.choice([np.nan, 1.0, np.inf], 1), rng.choice([np.nan, 1e200, 0.3], 2), rng.normal(size=2) * 50
        )
        assert np.isfinite(step.estimate).all() and step.flags


def test_an_unstable_plant_without_measurements_starts_afresh_before_it_overflows() -> None:
    schedule = any_schedule((2, 1, 1), 2, speed=-600.0)
    observer = LpvObserver(schedule)
    observer.reset(state=[1.0, 1.0])
    flags = [int(observer.step([0.0], [np.nan], [1.0, 2.0]).flags) for _ in range(60)]
    assert any(flag & Flag.RESET for flag in flags[1:])
    assert np.isfinite(observer.state).all()


def test_refusing_leaves_the_state_as_it_was() -> None:
    schedule = any_schedule((2, 1, 1), 2)
    rng, observer = np.random.default_rng(6), LpvObserver(schedule, outside="refuse")
    u, y, p = signals(schedule, rng, ())
    observer.step(u, y, p)
    before = observer.save()
    with pytest.raises(RangeError, match=r"p1 = 7 1 is outside the certified range \[1, 3\] 1 \(sample 1\)"):
        observer.step(u, y, [p[0] + 0.001, 7.0])
    for key, value in observer.save().items():
        np.testing.assert_array_equal(value, before[key])
    with pytest.raises(RangeError, match="p0 changes at"):
        observer.step(u, y, [p[0] + 0.5, p[1]])


def test_saved_and_restored_it_goes_on_bit_for_bit() -> None:
    schedule = any_schedule((3, 1, 2), 2)
    rng, first, second = np.random.default_rng(7), LpvObserver(schedule, (4,)), LpvObserver(schedule, (4,))
    for _ in range(3):
        first.step(*signals(schedule, rng, (4,)))
    second.restore(first.save())
    given = signals(schedule, rng, (4,))
    for ours, theirs in zip(first.step(*given), second.step(*given), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    with pytest.raises(EstimatorError, match="saved with another schedule"):
        LpvObserver(any_schedule((3, 1, 2), 2, sha256="1" * 64), (4,)).restore(first.save())
    with pytest.raises(EstimatorError, match="expected"):
        LpvObserver(schedule, (5,)).restore(first.save())


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_table_is_multilinear_between_its_breakpoints_and_exact_on_them(count: int) -> None:
    rng = np.random.default_rng(8)
    grid = [np.sort(rng.uniform(-5.0, 9.0, size)) for size in (4, 2, 3)[:count]]
    table = rng.normal(size=(*map(len, grid), 2, 3))
    found = Multilinear(grid, table)
    places = np.stack([rng.uniform(line[0], line[-1], 50) for line in grid], axis=-1)
    np.testing.assert_allclose(found(places), RegularGridInterpolator(grid, table)(places), rtol=1e-12, atol=1e-13)
    corners = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, count)
    np.testing.assert_array_equal(found(corners), table.reshape(-1, 2, 3))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sample_time": 1e4}, "check the signs of the gains and the sample time"),
        ({"sample_time": 1e60}, "multiply to more than"),
    ],
)
def test_what_explodes_is_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(ScheduleError, match=words):
        LpvObserver(any_schedule(**change))


def test_wrong_shapes_are_refused_with_the_right_ones() -> None:
    observer = LpvObserver(any_schedule((3, 2, 2), 2), (4,))
    with pytest.raises(EstimatorError, match=r"measurement has shape \(4,\), expected \(4, 2\)"):
        observer.step(np.zeros((4, 2)), np.zeros(4), np.ones((4, 2)))
    with pytest.raises(EstimatorError, match="last axis must hold p0, p1"):
        any_schedule((3, 2, 2), 2).gain(np.zeros(3))
