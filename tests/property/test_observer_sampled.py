"""Gains that correct once a sample, xhat+ = e^(TA) xhat + T phi(TA) B u + K (y - C xhat - D u), by independent ways."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from estimators import Flag, GainSchedule, LpvVelocityObserver
from estimators.arrays import FloatArray
from estimators.velocity import SwitchedVelocityObserver, with_constant_gain
from tests.support.schedule_content import PUBLISHED, schedule_content, with_matrix

FEW, MANY = (4,), (7, 4)  # plain numbers, arrays
SIZES = pytest.mark.parametrize("shape", [FEW, MANY], ids=["few", "many"])
T = 0.005
LOW, HIGH = 20.0, 140.0
POINTS = (LOW, 55.0, 90.0, HIGH)
GAINS = [(1.18e-3, 0.048), (8.8e-4, 0.076), (5.9e-4, 0.134), (4.2e-4, 0.217)]  # poles near 0.6 on the published tire


class Random:
    """A plant of any order up to three in p, and gains; what the textbook needs is kept as coefficients of 1, p, p^2, p^3."""

    def __init__(self, seed: int, order: int) -> None:
        draw = np.random.default_rng(seed)
        sizes = {"A": (2, 2), "B": (2, 1), "C": (1, 2), "D": (1, 1)}
        # Powers of p/100, so that all orders matter alike.
        self.powers = {
            key: [draw.normal(0, 30.0 if key == "A" else 1.0, shape) / 100.0**k for k in range(order + 1)]
            for key, shape in sizes.items()
        }
        self.table = draw.normal(0, 0.5, (len(POINTS), 2))
        content = schedule_content(gains=self.table.tolist(), breakpoints=POINTS, update="sampled")
        for key, coefficients in self.powers.items():
            with_matrix(content, key, *(matrix.tolist() for matrix in coefficients))
        self.schedule = GainSchedule.from_content(content)

    def at(self, key: str, p: float) -> FloatArray:
        return np.asarray(sum(matrix * p**k for k, matrix in enumerate(self.powers[key])))

    def gain(self, p: float) -> FloatArray:
        return np.array([np.interp(p, POINTS, column) for column in self.table.T])

    def textbook(self, x: FloatArray, u: float, y: float, p: float, coast: bool) -> tuple[FloatArray, float]:
        """The state one sample later, and the innovation; e^(TA) and T phi(TA) B are blocks of one exponential."""
        block = np.zeros((3, 3))
        block[:2, :2], block[:2, 2:] = T * self.at("A", p), T * self.at("B", p)
        moved = expm(block)
        innovation = float(y - (self.at("C", p) @ x)[0] - self.at("D", p)[0, 0] * u)
        correction = np.zeros(2) if coast else self.gain(p) * innovation
        return moved[:2, :2] @ x + moved[:2, 2] * u + correction, innovation


@SIZES
@pytest.mark.parametrize("order", [0, 1, 2, 3])
@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 2**31))
def test_a_step_is_the_textbook_formula(shape: tuple[int, ...], order: int, seed: int) -> None:
    plant, draw = Random(seed, order), np.random.default_rng(seed + 1)
    runner = LpvVelocityObserver(plant.schedule, shape)
    state = draw.normal(size=(*shape, 2))
    runner.reset(state=state)
    u, y, p = draw.normal(0, 5, shape), draw.normal(0, 2, shape), draw.uniform(LOW, HIGH, shape)
    p.flat[:3] = LOW, HIGH, POINTS[1]
    coast = draw.random(shape) < 0.3
    step = runner.step(u, np.where(coast, np.nan, y), p)
    np.testing.assert_array_equal(step.used, ~coast)
    for index in np.ndindex(shape):
        expected, innovation = plant.textbook(state[index], u[index], y[index], p[index], bool(coast[index]))
        np.testing.assert_allclose(step.estimate[index], expected, rtol=1e-11, atol=1e-11 * np.abs(expected).max())
        if not coast[index]:
            np.testing.assert_allclose(step.innovation[index], innovation, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("order", [1, 3])
@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 2**31))
def test_a_batch_is_a_loop(order: int, seed: int) -> None:
    """Arrays and plain numbers agree over many samples, with gaps in every channel."""
    schedule, draw = Random(seed, order).schedule, np.random.default_rng(seed)
    together = LpvVelocityObserver(schedule, MANY, stale_after=2)
    alone = [LpvVelocityObserver(schedule, FEW, stale_after=2) for _ in range(MANY[0])]
    for _ in range(12):
        u, y, p = draw.normal(0, 3, MANY), np.round(draw.normal(0, 0.5, MANY), 1), draw.uniform(LOW - 5, HIGH + 5, MANY)
        for channel in (u, y, p):
            channel[draw.random(MANY) < 0.1] = np.nan
        step = together.step(u, y, p)
        rows = [runner.step(u[row], y[row], p[row]) for row, runner in enumerate(alone)]
        for field in ("used", "flags", "parameter"):
            np.testing.assert_array_equal(getattr(step, field), [getattr(row, field) for row in rows])
        size = 1.0 + np.abs(step.estimate).max()
        for field in ("estimate", "innovation"):
            np.testing.assert_allclose(getattr(step, field), [getattr(row, field) for row in rows], atol=1e-12 * size)


@SIZES
def test_coasting_is_a_gain_of_zero(shape: tuple[int, ...]) -> None:
    """A missing measurement moves the estimate as K = 0 does, and as the update "held" does: the plant alone."""
    plant = Random(3, 3)
    zeros = np.zeros_like(plant.schedule.table)
    runners = [
        LpvVelocityObserver(schedule, shape)
        for schedule in (plant.schedule, replace(plant.schedule, table=zeros), replace(plant.schedule, update="held"))
    ]
    draw = np.random.default_rng(0)
    for runner in runners:
        runner.reset(state=[0.3, -2.0])
    for k in range(20):
        u, y, p = draw.normal(0, 5, shape), draw.normal(0, 2, shape), np.full(shape, 30.0 + k)
        lost = np.full(shape, np.nan)
        steps = [runner.step(u, given, p) for runner, given in zip(runners, (lost, y, lost), strict=True)]
        np.testing.assert_allclose(steps[0].estimate, steps[1].estimate, rtol=1e-13)
        np.testing.assert_allclose(steps[0].estimate, steps[2].estimate, rtol=1e-13)
    assert (steps[0].flags == Flag.MISSING_MEASUREMENT).all()
    assert steps[1].used.all()


def course(steps: int) -> tuple[FloatArray, FloatArray]:
    """An input that never rests, and a wheel speed that moves at the rates of the box (800 rad/s^2)."""
    k = np.arange(steps)
    return 20.0 * np.sin(0.3 * k) + 8.0 * np.sin(1.1 * k), 75.0 + 60.0 * np.sin(0.06 * k)


def errors(schedule: GainSchedule, shape: tuple[int, ...], moving: bool, steps: int = 400) -> tuple[FloatArray, float]:
    """The error of every sample relative to the size of the plant's states, which an exact plant runs in parallel.

    The tire of P1: z' = -kappa R w z + v, v' = u, y = (sigma0 - sigma1 kappa R w) z + (sigma1 + sigma2) v.
    """
    sigma0, sigma1, sigma2, kappa = PUBLISHED["longitudinal"]["constants"]
    observer = LpvVelocityObserver(schedule, shape)
    observer.reset(state=[2e-3, -1.0])
    x, found, sizes = np.zeros(2), [], []
    for u, p in zip(*course(steps), strict=True):
        given = float(u) if moving else 0.0
        decay = kappa * 0.33 * p
        y = (sigma0 - sigma1 * decay) * x[0] + (sigma1 + sigma2) * x[1]
        step = observer.step(np.full(shape, given), np.full(shape, y), np.full(shape, p))
        block = np.zeros((3, 3))
        block[:2, :2], block[1, 2] = [[-T * decay, T], [0.0, 0.0]], T
        x = (expm(block) @ [*x, given])[:2]
        found.append(np.abs((step.estimate - x) * [200.0, 1.0]).max())
        sizes.append(np.abs(x * [200.0, 1.0]).max())
    return np.array(found), max(*sizes, 1e-3)


@SIZES
def test_the_error_of_a_plant_that_moves_decays_to_rounding(shape: tuple[int, ...]) -> None:
    """e+ = (e^(TA) - K C) e needs nothing of the plant, so neither input nor wheel speed is in it.

    The negative control is the update "held" with the published gains: while the plant stands still its error decays as well,
    but not while the plant moves; nor does it with the very same gains.
    """
    sampled = GainSchedule.from_content(
        schedule_content(gains=GAINS, breakpoints=(0.0, 30.0, 80.0, 140.0), update="sampled")
    )
    error, size = errors(sampled, shape, moving=True)
    assert error[0] > 0.1
    assert error[100:].max() < 1e-12 * size
    held = GainSchedule.from_content(schedule_content())
    still, _ = errors(held, shape, moving=False)
    assert still[-100:].max() < 1e-12
    moved, size = errors(held, shape, moving=True)
    assert moved[-100:].max() > 1e-2 * size
    wrong, size = errors(replace(sampled, update="held"), shape, moving=True)
    assert wrong[-100:].max() > 1e-2 * size


@SIZES
def test_memory_continues_bit_for_bit(shape: tuple[int, ...]) -> None:
    schedule, draw = Random(11, 3).schedule, np.random.default_rng(2)
    first, second = (LpvVelocityObserver(schedule, shape, stale_after=2) for _ in range(2))
    for k in range(60):
        u, y, p = draw.normal(0, 1, (3, *shape))
        p = 70 + p
        for channel in (u, y, p):
            channel[draw.random(shape) < 0.1] = np.nan
        if k == 30:
            first.reset(np.arange(np.prod(shape)).reshape(shape) % 3 == 0, [0.1, 2.0])
            second.restore(first.save())
        found = first.step(u, np.round(y), p)
        if k >= 30:
            for mine, theirs in zip(found, second.step(u, np.round(y), p), strict=True):
                assert mine.tobytes() == theirs.tobytes()


@SIZES
def test_a_schedule_of_either_update_may_stand_in_either_mode(shape: tuple[int, ...]) -> None:
    """Each mode advances the shared state by the update of its own schedule."""
    sampled = GainSchedule.from_content(schedule_content(gains=GAINS, update="sampled"))
    published = with_constant_gain(sampled)
    assert published.update == "held"
    switched = SwitchedVelocityObserver(sampled, batch_shape=shape)
    plain = {0.0: LpvVelocityObserver(sampled, shape), 0.3: LpvVelocityObserver(published, shape)}
    draw = np.random.default_rng(4)
    for k in range(30):
        slip = 0.3 if k % 3 == 0 else 0.0
        u, y, p = draw.normal(0, 3, shape), draw.normal(0, 0.3, shape), np.full(shape, 40.0 + k)
        for runner in plain.values():
            runner.reset(state=switched.state)
        step, expected = switched.step(u, y, p, np.full(shape, slip)), plain[slip].step(u, y, p)
        np.testing.assert_allclose(step.estimate, expected.estimate, rtol=1e-12, atol=1e-15)
