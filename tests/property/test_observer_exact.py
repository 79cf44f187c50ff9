"""The closed-form update against the matrix exponential, for any gains, poles, model and batch."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from estimators import GainSchedule, LpvVelocityObserver
from estimators.phi import phi
from tests.support.schedule_content import PUBLISHED, schedule_content, with_matrix

FEW, MANY = (4,), (7, 4)  # plain numbers, arrays


def second_road(schedule: GainSchedule, state: Any, u: float, y: float, p: float, coast: bool) -> Any:
    """exp of [[A - L C, B u + L (y - D u)], [0, 0]], with z scaled as the closed loop would like it."""
    A, B, C, D = schedule.plant_at(p)
    L = schedule.gain(p) * (0.0 if coast else 1.0)
    augmented = np.zeros((3, 3))
    augmented[:2, :2] = A - L @ C
    augmented[:2, 2] = B[:, 0] * u + L[:, 0] * ((0.0 if coast else y) - D[0, 0] * u)
    scale = np.array([200.0, 1.0, 1.0])
    balanced = augmented * scale[:, None] / scale
    return (expm(balanced * schedule.sample_time) @ (scale * [*state, 1.0]))[:2] / scale[:2]


def check(schedule: GainSchedule, shape: tuple[int, ...], seed: int, tolerance: float = 1e-11) -> None:
    """One step of a whole batch at random parameters, a third of it coasting."""
    draw = np.random.default_rng(seed)
    runner = LpvVelocityObserver(schedule, shape)
    state = draw.normal(size=(*shape, 2)) * [5e-3, 1.0]
    runner.reset(state=state)
    u, y, p = draw.normal(0, 5, shape), draw.normal(0, 0.5, shape), draw.uniform(0, 140, shape)
    p.flat[:3] = 0.0, 140.0, schedule.breakpoints[1]
    coast = draw.random(shape) < 0.3
    step = runner.step(u, np.where(coast, np.nan, y), p)
    for index in np.ndindex(shape):
        expected = second_road(schedule, state[index], u[index], y[index], p[index], coast[index])
        error = np.abs((step.estimate[index] - expected) * [200.0, 1.0])
        assert error.max() <= tolerance * (1.0 + np.abs(expected * [200.0, 1.0]).max())


@settings(deadline=None, max_examples=25)
@given(
    direction=st.sampled_from(sorted(PUBLISHED)),
    gains=st.lists(st.tuples(st.floats(0.0, 2.0), st.floats(0.0, 600.0)), min_size=4, max_size=4),
    shape=st.sampled_from([FEW, MANY]),
    seed=st.integers(0, 2**31),
)
@example(direction="longitudinal", gains=[(0.68, 183.1)] * 4, shape=MANY, seed=0)  # complex poles at low speed
@example(direction="lateral", gains=[(1.11, 16.7)] * 4, shape=MANY, seed=0)
@example(direction="resilient-longitudinal", gains=[(1.18, 387.0)] * 4, shape=MANY, seed=0)
@example(direction="resilient-longitudinal", gains=[(0.22, 0.1)] * 4, shape=MANY, seed=0)  # nearly an integrator
@example(direction="lateral", gains=[(0.0, 0.0)] * 4, shape=MANY, seed=0)
def test_a_step_is_the_matrix_exponential(
    direction: str, gains: list[tuple[float, float]], shape: tuple[int, ...], seed: int
) -> None:
    check(GainSchedule.from_content(schedule_content(direction, gains=gains)), shape, seed)


@settings(deadline=None, max_examples=25)
@given(
    entries=st.lists(st.floats(-300, 300), min_size=18, max_size=18),
    sample_time=st.sampled_from([1e-5, 1e-3, 5e-3, 0.05]),
    shape=st.sampled_from([FEW, MANY]),
    seed=st.integers(0, 2**31),
)
def test_any_model_of_the_same_size_will_do(
    entries: list[float], sample_time: float, shape: tuple[int, ...], seed: int
) -> None:
    a, b, c = entries[:6], entries[6:12], entries[12:]
    content = schedule_content(gains=[(0.01 * c[0], c[1]), (0.0, 0.0), (0.1, 0.2), (0.01 * c[2], c[3])])
    content["update"]["sample_time"] = sample_time
    square = np.array([[0.0, 1e-4], [-1e-4, 0.0]]) * c[4] * 1e-2
    with_matrix(
        content, "A", [[-abs(a[0]), 0.005 * a[1]], [a[2], -abs(a[3])]], [[0, 0], [0.01 * a[4], 0]], square.tolist()
    )
    with_matrix(content, "B", [[b[0] * 0.01], [b[1]]], [[0], [b[2] * 0.01]])
    with_matrix(content, "C", [[b[3] * 1e-2, 0.0]], [[0.0, b[4] * 1e-4]])
    with_matrix(content, "D", [[b[5] * 1e-2]], [[c[5] * 1e-5]])
    check(GainSchedule.from_content(content), shape, seed, tolerance=1e-9)


@pytest.mark.parametrize("shape", [FEW, MANY])
@pytest.mark.parametrize("offset", [0.0, 1e-14, 1e-9, 1e-4, -1e-4])
def test_double_poles_need_no_case_of_their_own(shape: tuple[int, ...], offset: float) -> None:
    """C = [1 0], A = [[0 1], [0 0]], L = [2 s, s^2 (1 + offset)]: poles at -s, -s, or nearly so."""
    content = schedule_content(gains=(2 * 300.0, 300.0**2 * (1 + offset)))
    with_matrix(content, "A", [[0, 1], [0, 0]])
    with_matrix(content, "C", [[1, 0]])
    check(GainSchedule.from_content(content), shape, 1)


@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 2**31))
def test_a_batch_is_a_loop(seed: int) -> None:
    draw = np.random.default_rng(seed)
    schedule = GainSchedule.from_content(schedule_content(gains=[(0.9, 210.0), (0.8, 183.1), (0.7, 100.0), (0.5, 60)]))
    together = LpvVelocityObserver(schedule, MANY, stale_after=2)
    alone = [LpvVelocityObserver(schedule, FEW, stale_after=2) for _ in range(MANY[0])]
    for _ in range(12):
        u, y, p = draw.normal(0, 3, MANY), np.round(draw.normal(0, 0.5, MANY), 1), draw.uniform(-3, 150, MANY)
        for channel in (u, y, p):
            channel[draw.random(MANY) < 0.1] = np.nan
        step = together.step(u, y, p)
        rows = [runner.step(u[row], y[row], p[row]) for row, runner in enumerate(alone)]
        for field in ("used", "flags", "parameter"):
            np.testing.assert_array_equal(getattr(step, field), [getattr(row, field) for row in rows])
        for field in ("estimate", "innovation"):
            np.testing.assert_allclose(getattr(step, field), [getattr(row, field) for row in rows], atol=1e-12)


def test_chunks_do_not_matter() -> None:
    schedule = GainSchedule.from_content(schedule_content())
    draw = np.random.default_rng(0)
    count = 20_011  # two chunks and a rest
    u, y, p = draw.normal(size=count), draw.normal(size=count), draw.uniform(0, 140, count)
    y[draw.random(count) < 0.01] = np.nan
    large = LpvVelocityObserver(schedule, (count,))
    for _ in range(3):
        step = large.step(u, y, p)
    part = slice(16_000, 16_100)
    small = LpvVelocityObserver(schedule, (100,))
    for _ in range(3):
        expected = small.step(u[part], y[part], p[part])
    np.testing.assert_allclose(step.estimate[part], expected.estimate, rtol=1e-12, atol=1e-15)
    np.testing.assert_array_equal(step.flags[part], expected.flags)


MEANS = st.one_of(st.floats(-800, 5), st.floats(-0.1, 0.1), st.floats(-1e-6, 1e-6), st.just(0.0))


@settings(deadline=None, max_examples=300)
@given(mean=MEANS, kind=st.sampled_from(["any", "near", "square", "small", "zero"]), part=st.floats(-1, 1))
def test_phi_keeps_twelve_digits(mean: float, kind: str, part: float) -> None:
    """Against 60 digits; beta is measured against what it may contribute: beta N, with N as large as m and r."""
    delta = {
        "any": 30.0 * part,
        "near": mean * mean * (1.0 + 1e-3 * part),
        "square": mean * mean,
        "small": 1e-3 * part,
        "zero": 0.0,
    }[kind]
    with mpmath.workdps(60):
        root = mpmath.sqrt(mpmath.mpc(delta))
        upper, lower = mean + root, mean - root
        first, second = ((mpmath.expm1(x) / x if x != 0 else mpmath.mpf(1)) for x in (upper, lower))
        alpha = float(mpmath.re(first + second) / 2)
        if abs(root) > 1e-20:
            beta = float(mpmath.re((first - second) / (2 * root)))
        else:  # the derivative of (e^x - 1)/x
            m = mpmath.mpf(mean)
            beta = float((mpmath.exp(m) * (m - 1) + 1) / m**2) if abs(m) > 1e-20 else 0.5
    alphas, betas = phi(np.full(3, mean), np.full(3, delta))
    scale = abs(alpha) + abs(beta) * (abs(mean) + abs(delta) ** 0.5)
    for a, b in (phi(mean, delta), (alphas[0], betas[0]), (alphas[2], betas[2])):
        assert abs(a - alpha) <= 1e-12 * scale
        assert abs(b - beta) <= 2e-12 * (abs(beta) + scale / (1.0 + abs(mean) + abs(delta) ** 0.5))
