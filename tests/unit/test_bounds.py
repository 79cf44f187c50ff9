"""Bounds of the force observers: exact simulations with worst-sign disturbances stay below them, and some attain them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.bounds.forces import (
    best_split,
    force_observer_bound,
    sharp_unknown_input_bound,
    unknown_input_bound,
    wheel_error_is_hurwitz,
    wheel_error_matrix,
)
from analysis.bounds.sliding_mode import (
    OUTPUTS,
    PUBLISHED,
    SlidingModeGains,
    linear_zone_matrix,
    reaching_time,
    sampled_radius,
    sliding_mode_convergence,
    smallest_zone_widths,
)
from analysis.errors import AnalysisError
from analysis.loads import vertical_loads
from estimators.vehicle import RigidBody
from synthesis.models.catalogue.single_track import PEUGEOT_307
from synthesis.models.discretise import zero_order_hold
from synthesis.models.parameter_set import load_parameter_set

Array = Any
CAR = RigidBody(*(constant.value for constant in list(PEUGEOT_307.values())[:4]))
EXACT = SlidingModeGains.of(
    omega1=10, omega4=40000, omega5=40000 * 1.46 / 1.12, omega7=-40000, omega8=40000, omega12=50000
)


def held(rate: float, step: float, disturbance: Array, start: float) -> Array:
    """e' = -rate e + d with d held over each sample, exactly; shape (K + 1,)."""
    Phi, Gamma = zero_order_hold(np.array([[-rate]]), np.array([[1.0]]), step)
    out = [start]
    for value in disturbance:
        out.append(float(Phi[0, 0]) * out[-1] + float(Gamma[0, 0]) * value)
    return np.array(out)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_no_bounded_disturbance_beats_proposition_1(seed: int) -> None:
    random = np.random.default_rng(seed)
    eta3, rate, start = random.uniform(1, 80), random.uniform(0, 500), random.normal() * 20
    step = random.uniform(1e-3, 5e-2)
    wild = rate * random.choice([-1.0, 1.0], 200)
    e = held(eta3, step, wild, start)
    t = step * np.arange(201)
    bound = force_observer_bound(eta3, rate, abs(start))
    assert (np.abs(e) <= bound.at(t) * (1 + 1e-12) + 1e-12).all()
    ramp = held(eta3, 40.0 / eta3, np.array([rate]), 0.0)
    np.testing.assert_allclose(ramp[-1], bound.ultimate, rtol=1e-9, atol=1e-12)  # attained by a ramp


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), split=st.floats(0.01, 0.99))
def test_theorem_1_holds_for_every_split_and_the_sharp_bound_lies_below(seed: int, split: float) -> None:
    random = np.random.default_rng(seed)
    K, b, start, step = random.uniform(0.5, 60), random.uniform(0, 300), random.normal() * 10, 4e-3
    sign = np.sign(start) or 1.0
    e = held(K, step, np.full(500, sign * b), start)  # the worst sign throughout
    t = step * np.arange(501)
    sharp = sharp_unknown_input_bound(K, b, abs(start), t)
    np.testing.assert_allclose(np.abs(e), sharp, rtol=1e-10, atol=1e-10)
    assert (sharp <= unknown_input_bound(K, b, abs(start), split).at(t) * (1 + 1e-12)).all()


def test_the_best_split_is_one_half_in_the_long_run_and_smaller_before() -> None:
    grid = np.linspace(0.01, 0.99, 99)
    ultimate = [unknown_input_bound(5.0, 2.0, 0.0, xi).ultimate for xi in grid]
    assert grid[int(np.argmin(ultimate))] == pytest.approx(0.5)
    assert unknown_input_bound(5.0, 2.0).ultimate == pytest.approx(2.0 / 5.0, rel=1e-15)
    assert best_split(5.0, 2.0, 10.0) == 0.5
    early = best_split(5.0, 2.0, 10.0, 0.3)
    assert early < 0.5
    values = [float(unknown_input_bound(5.0, 2.0, 10.0, xi).at(0.3)) for xi in grid]
    assert float(unknown_input_bound(5.0, 2.0, 10.0, early).at(0.3)) <= min(values) * (1 + 1e-9)
    assert best_split(5.0, 2.0, 10.0, 50.0) == pytest.approx(0.5, abs=1e-3)


def test_a_weaker_gain_breaks_the_bound_of_a_stronger_one() -> None:
    e = held(25.0, 0.01, np.full(500, 100.0), 0.0)
    assert np.abs(e).max() > force_observer_bound(50.6, 100.0).ultimate
    assert np.abs(e).max() <= force_observer_bound(25.0, 100.0).ultimate * (1 + 1e-12)


@given(eta1=st.floats(-5, 5), eta2=st.floats(-50, 50))
def test_wheel_error_is_hurwitz_exactly_for_positive_gains(eta1: float, eta2: float) -> None:
    stable = wheel_error_is_hurwitz(eta1, eta2, 1.68, 0.33)
    assert stable == (0.33 * eta1 / 1.68 > 0.0 and eta2 / 1.68 > 0.0)
    slowest = np.linalg.eigvals(wheel_error_matrix(eta1, eta2, 1.68, 0.33)).real.max()
    if abs(slowest) > 1e-6:
        assert stable == (slowest < 0.0)


def simulate(gains: SlidingModeGains, start: Array, time: float, step: float, rates: Array | None = None) -> Array:
    """x~ of P5 (A.1) by small Euler steps with the bare sign; start (4,), force rates (4,) added; (K + 1, 4)."""
    m, out = CAR.mass, [np.array(start, float)]
    drive = np.zeros(4) if rates is None else np.asarray(rates, float)
    for _ in range(round(time / step)):
        x = out[-1]
        y = np.sign([x[0], (x[1] + x[2]) / m, x[3] / m])
        slope = -gains.matrix @ y + drive
        slope[0] += (CAR.front_axle_distance * x[1] - CAR.rear_axle_distance * x[2]) / CAR.yaw_inertia
        out.append(x + step * slope)
    return np.array(out)


def moment(x: Array) -> Array:
    return CAR.front_axle_distance * x[..., 1] - CAR.rear_axle_distance * x[..., 2]


def test_forces_converge_and_the_split_decays_at_the_rate_of_a12() -> None:
    x = simulate(EXACT, [0.3, 3000.0, -2000.0, 1500.0], 1.2, 2e-5)
    after = sliding_mode_convergence(EXACT, CAR)
    sliding = slice(round(0.3 / 2e-5), round(0.8 / 2e-5), 500)
    t = 2e-5 * np.arange(len(x))[sliding]
    rate = -np.polyfit(t, np.log(np.abs(moment(x[sliding]))), 1)[0]
    assert rate == pytest.approx(after.split_decay_rate, rel=2e-3)
    assert abs(x[-1, 0]) < 1e-3 and abs(x[-1, 3]) < 3.0 and abs(x[-1, 1] + x[-1, 2]) < 5.0


def test_local_condition_of_a4_is_no_limit_of_convergence() -> None:
    """Start at twice the moment that (A.4) allows: the yaw error grows first, and is caught within the global bound."""
    start = [0.2, 30_000.0, -18_082.0, 0.0]
    assert abs(moment(np.array(start))) == pytest.approx(60_000.0, rel=1e-3)
    local = sliding_mode_convergence(EXACT, CAR, abs(moment(np.array(start))))
    assert not local.holds and local.yaw_margin < 0.0
    limit = reaching_time(EXACT, CAR, start[0], float(moment(np.array(start))))
    x = simulate(EXACT, start, limit, 1e-4)
    assert abs(x[:, 0]).max() > 0.25
    assert abs(x[-1, 0]) < 5e-3
    assert abs(moment(x[-1])) < local.yaw_moment_limit


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_reaching_time_bounds_every_start(seed: int) -> None:
    random = np.random.default_rng(seed)
    yaw, s = random.uniform(-1, 1), random.uniform(-60_000, 60_000)
    span = CAR.front_axle_distance + CAR.rear_axle_distance
    x = simulate(EXACT, [yaw, s / span, -s / span, 0.0], reaching_time(EXACT, CAR, yaw, s) + 0.02, 2e-4)
    assert np.abs(x[-50:, 0]).max() < 0.02  # within the chatter of the step


def test_moving_forces_leave_the_stated_split_error_and_no_more() -> None:
    rates = (3000.0, 2000.0, 0.0)
    stated = sliding_mode_convergence(EXACT, CAR, force_rates=rates)
    x = simulate(EXACT, [0.0, 0.0, 0.0, 0.0], 2.5, 1e-4, rates=[0.0, 3000.0, -2000.0, 0.0])
    assert abs(moment(x[-1])) == pytest.approx(stated.split_ultimate, rel=1e-2)  # the worst signs attain it
    assert np.abs(moment(x)).max() <= stated.split_ultimate * 1.01
    quiet = simulate(EXACT, [0.0, 0.0, 0.0, 0.0], 2.5, 1e-4, rates=[0.0, 3000.0, 2000.0, 0.0])
    assert np.abs(moment(quiet)).max() < stated.split_ultimate


def test_weak_gains_are_refused_and_really_fail() -> None:
    weak = SlidingModeGains.of(
        omega1=10, omega4=40000, omega5=400, omega7=-40000, omega8=400 * 1.12 / 1.46, omega12=1000
    )
    found = sliding_mode_convergence(weak, CAR, force_rates=(3000.0, 2000.0, 1500.0))
    assert not found.holds
    assert {v.condition.split()[0] for v in found.violations} == {"Omega_12", "Omega_5"}
    x = simulate(weak, [0.0, 0.0, 0.0, 0.0], 2.0, 1e-4, rates=[0.0, 3000.0, 2000.0, 1500.0])
    assert abs(x[-1, 3]) > 900.0 and abs(x[-1, 1] + x[-1, 2]) > 5000.0


def test_broken_equalities_are_named_with_their_meaning() -> None:
    crossed = SlidingModeGains.of(omega1=10, omega4=40000, omega5=52000, omega7=-30000, omega8=40000, omega12=50000)
    names = [v.condition for v in sliding_mode_convergence(crossed, CAR).violations]
    assert "Omega_4 = -Omega_7 (7)" in names
    assert reaching_time(crossed, CAR, 0.1, 0.0) == np.inf
    assert sliding_mode_convergence(EXACT, CAR).violations == ()
    dead = sliding_mode_convergence(SlidingModeGains(np.zeros((4, 3))), CAR)
    assert not dead.holds and dead.split_ultimate == np.inf


def test_linear_zone_radius_says_whether_the_sampled_observer_settles() -> None:
    """Both sides of the stability limit against a simulation of the sampled linear error."""
    for widths in ((0.2, 1.0, 1.0), (0.05, 0.1, 0.1)):
        A = linear_zone_matrix(EXACT, CAR, dict(zip(OUTPUTS, widths, strict=True)))
        radius = sampled_radius(A, 0.01)
        scale = np.array([1.0, 1e4, 1e4, 1e4])
        x = np.array([0.01, 100.0, 50.0, 80.0]) / scale
        for _ in range(2000):
            moved = x + 0.01 * A @ (x * scale) / scale
            growth = np.linalg.norm(moved) / np.linalg.norm(x)
            x = moved / np.linalg.norm(moved)
        assert growth == pytest.approx(radius, rel=1e-6)


def test_smallest_widths_are_the_limits_of_single_loops() -> None:
    limits = smallest_zone_widths(EXACT, CAR, 0.01)
    for name in ("lateral_acceleration", "longitudinal_acceleration"):
        wide = dict.fromkeys(OUTPUTS, 1e3)
        inside = linear_zone_matrix(EXACT, CAR, {**wide, name: limits[name] * 0.999})
        outside = linear_zone_matrix(EXACT, CAR, {**wide, name: limits[name] * 1.001})
        assert sampled_radius(inside, 0.01) > 1.0 > sampled_radius(outside, 0.01) - 1e-6


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: force_observer_bound(0.0, 1.0), r"eta3 \[1/s\] = 0 must be positive"),
        (lambda: force_observer_bound(1.0, -1.0), "must be >= 0"),
        (lambda: force_observer_bound(float("nan"), 1.0), "not finite"),
        (lambda: force_observer_bound(1.0, 1.0).at(-1.0), "before the start"),
        (lambda: unknown_input_bound(1.0, 1.0, split=0.0), "between 0 and 1"),
        (lambda: unknown_input_bound(1.0, 1.0, split=1.0), "between 0 and 1"),
        (lambda: unknown_input_bound(-1.0, 1.0), "positive"),
        (lambda: best_split(1.0, 1.0, 1.0, -1.0), "time"),
        (lambda: wheel_error_matrix(1.0, 1.0, 0.0, 0.33), "wheel_inertia"),
        (lambda: SlidingModeGains(np.zeros((3, 4))), r"\(4, 3\)"),
        (lambda: SlidingModeGains.of(omega13=1.0), "unknown gain 'omega13'"),
        (lambda: sliding_mode_convergence(PUBLISHED, CAR, float("inf")), "finite"),
        (lambda: linear_zone_matrix(PUBLISHED, CAR, {"yaw_rate": 0.1}), "no width for"),
        (lambda: sampled_radius(np.zeros((2, 3)), 0.01), "square"),
        (lambda: smallest_zone_widths(PUBLISHED, CAR, 0.0), "sample_time"),
        (lambda: vertical_loads(load_parameter_set("corner-estimation"), np.nan, 0.0), "not finite"),
        (lambda: vertical_loads(load_parameter_set("corner-estimation"), [1, 2], [1, 2, 3]), "do not broadcast"),
    ],
)
def test_bad_input_is_refused(call: Any, word: str) -> None:
    with pytest.raises(AnalysisError, match=word):
        call()


def test_the_best_split_is_stationary() -> None:
    """d/dxi of e0 e^(-K (1 - xi) t) + b/(2 K sqrt(xi (1 - xi))) vanishes."""
    K, b, e0, t = 5.0, 2.0, 10.0, 0.3
    xi = best_split(K, b, e0, t)
    falls = b / (2.0 * K) * (1.0 - 2.0 * xi) / (2.0 * (xi * (1.0 - xi)) ** 1.5)
    assert e0 * K * t * np.exp(-K * (1.0 - xi) * t) == pytest.approx(falls, rel=1e-6)


def test_the_linear_zones_see_what_the_vehicle_measures() -> None:
    """Yaw rate alone, the sum of both lateral forces over the mass, the longitudinal force over the mass."""
    unit = SlidingModeGains(np.vstack([np.eye(3), np.zeros((1, 3))]))
    with_zones = linear_zone_matrix(unit, CAR, dict(zip(OUTPUTS, (1.0, 2.0, 4.0), strict=True)))
    without = linear_zone_matrix(SlidingModeGains(np.zeros((4, 3))), CAR, dict.fromkeys(OUTPUTS, 1.0))
    m, lever = CAR.mass, np.array([CAR.front_axle_distance, -CAR.rear_axle_distance]) / CAR.yaw_inertia
    np.testing.assert_allclose(without, [[0.0, *lever, 0.0], *np.zeros((3, 4))], rtol=1e-15)
    seen = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.5 / m, 0.5 / m, 0.0], [0.0, 0.0, 0.0, 0.25 / m], [0.0, 0.0, 0.0, 0.0]]
    np.testing.assert_allclose(without - with_zones, seen, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(("share", "tied"), [(1e-12, True), (1e-6, False), (-1e-6, False)])
def test_the_equality_of_two_gains_is_read_to_nine_digits(share: float, tied: bool) -> None:
    matrix = EXACT.matrix.copy()
    place = np.argwhere(matrix == EXACT[5])[0]
    matrix[tuple(place)] *= 1.0 + share
    gains = SlidingModeGains(matrix)
    named = {v.condition: v for v in sliding_mode_convergence(gains, CAR).violations}
    assert (named == {}) is tied and (reaching_time(gains, CAR, 0.1, 0.0) < np.inf) is tied
    assert sliding_mode_convergence(gains, CAR).holds
    if not tied:
        (violation,) = named.values()
        assert violation.condition.startswith("Omega_5") and violation.amount == pytest.approx(
            EXACT[5] * share, rel=1e-3
        )
