"""Critical drop probabilities against closed forms, bisection and the runtime observer, and questions without an answer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from analysis.drops.frozen import critical_drop_probability, drop_radius, mean_square_stable_intervals
from analysis.drops.gilbert_elliott import (
    critical_recovery_probability,
    gilbert_elliott,
    stability_region,
    stable_recovery_intervals,
)
from analysis.drops.modes import runtime_drop_modes, schedule_drop_modes
from analysis.errors import AnalysisError
from estimators import GainSchedule, LpvVelocityObserver
from estimators.errors import RangeError
from tests.support.schedule_content import schedule_content

SCHEDULE = GainSchedule.from_content(schedule_content())
SAMPLED = GainSchedule.from_content(
    schedule_content(update="sampled", gains=[(6e-4, 0.5), (3e-4, 0.4), (0.0, 0.3), (-1e-4, 0.2)])
)
EITHER = pytest.mark.parametrize("schedule", [SCHEDULE, SAMPLED], ids=["held", "sampled"])


def bisected(A0: np.ndarray, A1: np.ndarray) -> float:
    """The first crossing of the full Kronecker radius: a scan from below, then bisection to 1e-12."""

    def radius(p: np.ndarray | float) -> np.ndarray:
        weight = np.asarray(p)[..., None, None]
        return np.abs(np.linalg.eigvals(weight * np.kron(A0, A0) + (1 - weight) * np.kron(A1, A1))).max(-1)

    scan = np.linspace(0.0, 1.0, 401)
    above = scan[:-1][radius(scan[:-1]) >= 1.0]
    if not len(above):
        return 1.0
    low, high = max(above[0] - 1 / 400, 0.0), above[0]
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if radius(middle) < 1.0 else (low, middle)
    return 0.5 * (low + high)


@pytest.mark.parametrize(("a", "c"), [(1.25, 0.5), (2.0, 0.0), (1.01, 0.99), (-1.5, 0.3)])
def test_scalar_closed_form(a: float, c: float) -> None:
    """p a^2 + (1 - p) c^2 = 1."""
    expected = (1 - c**2) / (a**2 - c**2)
    assert critical_drop_probability([[a]], [[c]]) == pytest.approx(expected, rel=1e-13)
    # The same in two and in three states, through the closed form and through the eigenvalue problem.
    for n in (2, 3):
        found = critical_drop_probability(np.diag([a] + [0.1] * (n - 1)), np.diag([c] + [0.2] * (n - 1)))
        assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_random_pairs_against_bisection(n: int) -> None:
    draw = np.random.default_rng(n)
    A0, A1 = draw.normal(0, 0.9 / np.sqrt(n), (25, n, n)), draw.normal(0, 0.5 / np.sqrt(n), (25, n, n))
    A0 *= 1.3
    found = critical_drop_probability(A0, A1)
    expected = [bisected(a, b) for a, b in zip(A0, A1, strict=True)]
    np.testing.assert_allclose(found, expected, atol=2e-9)
    assert ((found > 0) & (found < 1)).sum() >= 5


def test_planar_closed_form_equals_the_general_eigenvalue_problem() -> None:
    draw = np.random.default_rng(0)
    A0, A1 = draw.normal(size=(2000, 2, 2)), 0.4 * draw.normal(size=(2000, 2, 2))
    padded = (np.pad(A, ((0, 0), (0, 1), (0, 1))) for A in (A0, A1))
    np.testing.assert_allclose(critical_drop_probability(A0, A1), critical_drop_probability(*padded), atol=1e-11)


def test_limits_zero_and_one() -> None:
    unstable, stable, slow = np.diag([1.2, 0.5]), np.diag([0.3, 0.2]), np.diag([0.9, 0.1])
    for n in (2, 3):
        pad = [(0, n - 2)] * 2
        u, s, w = (np.pad(A, pad) for A in (unstable, stable, slow))
        assert critical_drop_probability(w, u) == 0.0  # received loop unstable
        assert critical_drop_probability(w, np.eye(n)) == 0.0  # received loop marginal
        assert critical_drop_probability(w, s) == 1.0  # kinematics stable by themselves
        # Marginal without drops' help: stable for every p < 1.
        assert critical_drop_probability(np.eye(n), s) == pytest.approx(1.0, abs=1e-12)


def test_radius_above_one_in_between_returns_to_one_at_the_integrator() -> None:
    """Coasting on z' = v: an exact eigenvalue 1 at p = 1, and growth before it."""
    A0 = np.array([[1.0, 0.0], [0.0, 0.9]])
    shear = np.array([[1.0, 3.0], [0.0, 1.0]])
    A0, A1 = shear @ A0 @ np.linalg.inv(shear), np.array([[0.2, 0.0], [1.1, 0.2]])
    p = float(critical_drop_probability(A0, A1))
    assert 0.0 < p < 1.0
    assert drop_radius(A0, A1, p) == pytest.approx(1.0, abs=1e-12)
    assert drop_radius(A0, A1, 0.5 * (1 + p)) > 1.0
    assert drop_radius(A0, A1, 1.0) == pytest.approx(1.0, abs=1e-12)
    ((low, high),) = mean_square_stable_intervals(A0, A1)
    assert (low, high) == pytest.approx((0.0, p), abs=1e-10)


def test_two_stable_loops_may_be_unstable_in_between() -> None:
    """A0 and A1 nilpotent: radius 100 sqrt(p (1-p)) by hand, so p (1-p) = 1e-4."""
    A0, A1 = [[0.0, 10.0], [0.0, 0.0]], [[0.0, 0.0], [10.0, 0.0]]
    p = 0.5 - np.sqrt(0.25 - 1e-4)
    assert critical_drop_probability(A0, A1) == pytest.approx(p, rel=1e-10)
    intervals = mean_square_stable_intervals(A0, A1)
    np.testing.assert_allclose(intervals, [(0.0, p), (1.0 - p, 1.0)], atol=1e-9)


def test_two_unstable_loops_may_be_stable_in_between() -> None:
    A0, A1 = np.diag([1.1, 0.0]), np.diag([0.0, 1.1])
    assert critical_drop_probability(A0, A1) == 0.0
    np.testing.assert_allclose(mean_square_stable_intervals(A0, A1), [(1 - 1 / 1.21, 1 / 1.21)], rtol=1e-10)
    assert mean_square_stable_intervals(1.1 * np.eye(2), 1.2 * np.eye(2)) == ()
    assert mean_square_stable_intervals(np.eye(2), np.eye(2)) == ()


def test_states_of_very_different_size_do_not_matter() -> None:
    draw = np.random.default_rng(5)
    A0, A1 = draw.normal(size=(200, 2, 2)), 0.4 * draw.normal(size=(200, 2, 2))
    S = np.diag([1.0, 1e6])
    scaled = (S @ A @ np.linalg.inv(S) for A in (A0, A1))
    np.testing.assert_allclose(critical_drop_probability(A0, A1), critical_drop_probability(*scaled), atol=1e-9)


@pytest.mark.parametrize(
    ("A0", "A1", "words"),
    [
        (np.zeros((2, 3)), np.zeros((2, 2)), "open_loop .* square"),
        (np.zeros((2, 2)), np.zeros((3, 3)), "one size"),
        ([[np.nan]], [[0.0]], "not finite"),
        (np.zeros((3, 2, 2)), np.zeros((4, 2, 2)), "broadcast"),
        ("text", [[0.0]], "numbers"),
        (np.zeros((0, 0)), np.zeros((0, 0)), "square"),
    ],
)
def test_bad_pairs_are_refused(A0: object, A1: object, words: str) -> None:
    with pytest.raises(AnalysisError, match=words):
        critical_drop_probability(A0, A1)  # type: ignore[arg-type]


def test_bad_probabilities_are_refused() -> None:
    for p in (-0.1, 1.1, np.nan):
        with pytest.raises(AnalysisError, match=r"outside|finite"):
            drop_radius([[1.0]], [[0.5]], p)
        with pytest.raises(AnalysisError, match=r"outside|finite"):
            gilbert_elliott([[1.0]], [[0.5]], p, 0.5)
    with pytest.raises(AnalysisError, match="one pair"):
        mean_square_stable_intervals(np.zeros((3, 2, 2)), np.zeros((3, 2, 2)))
    with pytest.raises(AnalysisError, match="broadcast"):
        drop_radius(np.zeros((3, 2, 2)), np.zeros((3, 2, 2)), [0.1, 0.2])


@EITHER
def test_coasting_and_received_updates_are_those_of_the_runtime(schedule: GainSchedule) -> None:
    """Two runtime observers that see the same samples differ by the homogeneous update: its matrix is the mode."""
    speeds = np.array([0.0, 7.0, 65.0, 140.0])
    modes = schedule_drop_modes(schedule, speeds)
    for measurement, matrix in ((np.full(4, 0.3), modes.received), (np.full(4, np.nan), modes.dropped)):
        for column in np.eye(2):
            pair = [LpvVelocityObserver(schedule), LpvVelocityObserver(schedule)]
            pair[0].reset(state=column)
            ends = [o.step(np.full(4, 2.0), measurement, speeds).estimate for o in pair]
            np.testing.assert_allclose(ends[0] - ends[1], matrix @ column, rtol=1e-9, atol=1e-13)


@EITHER
def test_modes_of_a_schedule_are_the_formulas_of_its_update(schedule: GainSchedule) -> None:
    for speed in (0.0, 50.0, 140.0):
        modes, plant, T = schedule_drop_modes(schedule, speed), schedule.plant_at(speed), schedule.sample_time
        correction = schedule.gain(speed) @ plant.C
        coasting = expm(T * plant.A)
        received = coasting - correction if schedule is SAMPLED else expm(T * (plant.A - correction))
        np.testing.assert_allclose(modes.dropped, coasting, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(modes.received, received, rtol=1e-12, atol=1e-15)


@EITHER
def test_held_measurement_is_what_the_runtime_makes_of_a_repeated_one(schedule: GainSchedule) -> None:
    """A plant that moves by C dx per sample: the error of the observer follows the modes of (e, x, y used last)."""
    speed, T = 40.0, schedule.sample_time
    plant = schedule.plant_at(speed)
    modes = schedule_drop_modes(schedule, speed, "hold with plant")
    observer = LpvVelocityObserver(schedule, (1,))
    observer.reset(state=np.array([[0.0, 0.5]]))
    x, used = np.array([1e-3, 1.0]), 0.0
    state = np.concatenate([x - observer.state[0], x, [used]])
    for received in (True, True, False, False, True, False):
        used = float((plant.C @ x)[0]) if received else used
        estimate = observer.step(np.zeros(1), np.array([used]), np.array([speed])).estimate[0]
        x = expm(plant.A * T) @ x
        state = (modes.received if received else modes.dropped) @ state
        np.testing.assert_allclose(state, [*(x - estimate), *x, used], rtol=1e-9, atol=1e-12)


def test_policies_answer_differently() -> None:
    """An unstable plant: coasting bears drops up to p_cr, holding a stale measurement bears none. At rest holding bears all."""
    A, C, L, T = [[0.5]], [[1.0]], [[5.0]], 0.5
    coast, hold, full = (runtime_drop_modes(A, C, L, T, policy) for policy in ("coast", "hold", "hold with plant"))
    a, c = np.exp(0.25), np.exp(-4.5 * 0.5)
    assert critical_drop_probability(coast.dropped, coast.received) == pytest.approx((1 - c**2) / (a**2 - c**2))
    assert critical_drop_probability(hold.dropped, hold.received) == 1.0
    assert critical_drop_probability(full.dropped, full.received) == 0.0
    # Staleness itself decays with the chance of a received sample: radius max(p, c^2).
    for p in (0.001, 0.3, 0.8):
        assert drop_radius(hold.dropped, hold.received, p) == pytest.approx(max(p, c**2), rel=1e-9)
    at_rest = runtime_drop_modes([[-0.5]], C, L, T, "hold with plant")
    assert critical_drop_probability(at_rest.dropped, at_rest.received) == 1.0


def test_gains_that_correct_once_a_sample() -> None:
    """The same plant, K = 0.8: c = a - K, and the error of a moving plant has no part of the plant in it."""
    A, C, K, T = [[0.5]], [[1.0]], [[0.8]], 0.5
    coast, hold, full = (
        runtime_drop_modes(A, C, K, T, policy, "sampled") for policy in ("coast", "hold", "hold with plant")
    )
    a = np.exp(0.25)
    c = a - 0.8
    assert critical_drop_probability(coast.dropped, coast.received) == pytest.approx((1 - c**2) / (a**2 - c**2))
    np.testing.assert_allclose(hold.dropped, [[c, 0.8], [0.0, 1.0]], rtol=1e-14)
    np.testing.assert_allclose(hold.received, [[c, 0.0], [0.0, 0.0]], rtol=1e-14)
    np.testing.assert_allclose(full.received, [[c, 0.0, 0.0], [0.0, a, 0.0], [0.0, 1.0, 0.0]], atol=1e-15)
    np.testing.assert_allclose(full.dropped, [[c, 0.8, -0.8], [0.0, a, 0.0], [0.0, 0.0, 1.0]], rtol=1e-14)


def test_bad_modes_are_refused() -> None:
    with pytest.raises(AnalysisError, match="unknown update 'hold'; did you mean held"):
        runtime_drop_modes([[1.0]], [[1.0]], [[1.0]], 0.1, "coast", "hold")  # type: ignore[arg-type]
    with pytest.raises(AnalysisError, match="unknown drop policy 'cost'; did you mean coast"):
        runtime_drop_modes([[1.0]], [[1.0]], [[1.0]], 0.1, "cost")  # type: ignore[arg-type]
    with pytest.raises(AnalysisError, match="do not fit"):
        runtime_drop_modes(np.eye(2), [[1.0, 0.0]], [[1.0]], 0.1)
    with pytest.raises(AnalysisError, match="must be positive"):
        runtime_drop_modes([[1.0]], [[1.0]], [[1.0]], 0.0)
    with pytest.raises(RangeError):
        schedule_drop_modes(SCHEDULE, 150.0)


def test_gilbert_elliott_without_memory_is_independent_dropping() -> None:
    draw = np.random.default_rng(2)
    A0, A1 = 1.2 * draw.normal(size=(300, 2, 2)), 0.4 * draw.normal(size=(300, 2, 2))
    p = critical_drop_probability(A0, A1)
    inside = (p > 0.0) & (p < 1.0)
    assert inside.sum() > 50
    found = critical_recovery_probability(A0[inside], A1[inside], p[inside])
    reached = np.isfinite(found)
    for a, b, x, top in zip(A0[inside], A1[inside], p[inside], found, strict=True):
        # Memoryless dropping at p sits on the boundary; the region need not reach r = 1 from there.
        edges = np.ravel(stable_recovery_intervals(a, b, x))
        assert np.abs(edges - (1 - x)).min(initial=1.0) < 1e-8
        assert np.isinf(top) == (edges[-1] < 1.0)
    assert reached.sum() > 50
    radius = gilbert_elliott(A0, A1, 0.37, 0.63).second_moment_radius()
    np.testing.assert_allclose(radius, drop_radius(A0, A1, 0.37), rtol=1e-9)


def test_scalar_boundary_in_closed_form() -> None:
    """(1 - (1-f) c^2)(1 - (1-r) a^2) = f r a^2 c^2 for scalar modes."""
    a, c = 1.3, 0.6
    f = np.linspace(0.01, 1.0, 23)
    good = 1 - (1 - f) * c**2
    # good (1 - a^2 + r a^2) = f r a^2 c^2, solved for r.
    expected = good * (a**2 - 1) / (a**2 * (good - f * c**2))
    expected = np.where((expected <= 1.0), expected, np.inf)
    np.testing.assert_allclose(critical_recovery_probability([[a]], [[c]], f), expected, rtol=1e-11)


def test_region_and_boundary_agree() -> None:
    draw = np.random.default_rng(8)
    A0, A1 = 0.75 * draw.normal(size=(3, 3)), 0.2 * draw.normal(size=(3, 3))
    A0 *= 1.2 / np.abs(np.linalg.eigvals(A0)).max()
    f, r = np.linspace(0.05, 1.0, 12), np.linspace(0.0, 1.0, 41)
    boundary = critical_recovery_probability(A0, A1, f)
    region = stability_region(A0, A1, f, r)
    assert region.shape == (12, 41)
    away = np.abs(r - boundary[:, None]) > 1e-9
    assert ((region < 1.0) == (r > boundary[:, None]))[away].all()


def test_boundary_at_its_limits() -> None:
    assert critical_recovery_probability([[0.5]], [[0.1]], 0.5) == 0.0
    assert critical_recovery_probability([[1.0]], [[0.1]], 0.5) == 0.0  # an integrator: every recovery above 0 suffices
    assert critical_recovery_probability([[1.5]], [[1.1]], 0.5) == np.inf  # received loop unstable
    assert critical_recovery_probability([[9.0]], [[0.5]], 1.0) == np.inf  # even one lost sample is too many
