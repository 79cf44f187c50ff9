"""Staircase forms, distances and three verdicts on pairs whose hidden part is known by construction."""

from __future__ import annotations

from typing import Any, cast

import control  # type: ignore[import-untyped]
import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import ortho_group

from analysis import (
    controllability_staircase,
    detectable,
    distance_to_uncontrollability,
    distance_to_undetectability,
    distance_to_unobservability,
    distance_to_unstabilizability,
    hautus_test,
    observability_staircase,
    stabilizable,
)
from analysis.errors import AnalysisError
from analysis.observability.exact_hidden import hidden_is_stable, hidden_part
from analysis.observability.growing_part import growing_mode, least_seen
from analysis.observability.hautus_distance import Region, below, border_clear, least
from analysis.observability.pair_balance import balanced_pair
from analysis.observability.pairs import without_dust
from analysis.observability.witness_gain import proved_distance
from synthesis import Verdict

VELOCITY = ([[0.0, 1.0], [0.0, 0.0]], [[0.0, 1.0]])  # a double integrator whose position is hidden
POSITION = ([[0.0, 1.0], [0.0, 0.0]], [[1.0, 0.0]])


def rotated(A: Any, C: Any, seed: int) -> tuple[Any, Any]:
    U = ortho_group.rvs(len(A), random_state=seed)
    return U @ np.array(A) @ U.T, np.array(C) @ U.T


def chain(size: int, eigenvalue: float, seed: int, seen: bool) -> tuple[Any, Any]:
    """A Jordan block beside fast modes, rotated; its eigenvector is hidden, or measured."""
    draw = np.random.default_rng(seed)
    n = size + int(draw.integers(0, 3))
    A = np.diag(-4.0 - 2.0 * np.arange(n))
    A[:size, :size] = eigenvalue * np.eye(size) + np.diag(np.ones(size - 1), 1)
    outputs = draw.uniform(0.5, 1.0, (1, n)) * ((np.arange(n) > 0) | seen)
    return rotated(A, outputs, seed)


def test_a_staircase_separates_what_was_put_together() -> None:
    """Hidden modes -3 and 0.5 behind a rotation: orthogonal T, zero blocks, the modes, the Kalman rank, the null space."""
    draw = np.random.default_rng(4)
    A = np.zeros((5, 5))
    A[:3, :3], A[3:, :3], A[3:, 3:] = draw.normal(size=(3, 3)), draw.normal(size=(2, 3)), [[-3.0, 2.0], [0.0, 0.5]]
    A, C = rotated(A, np.hstack([draw.normal(size=(2, 3)), np.zeros((2, 2))]), 7)
    found = observability_staircase(A, C)
    assert found.stages == (2, 1) and found.order == 3 and found.residual < 1e-14
    T = found.transform
    np.testing.assert_allclose(T.T @ T, np.eye(5), atol=1e-14)
    np.testing.assert_allclose(T.T @ A @ T, found.A, atol=1e-14)
    np.testing.assert_allclose(C @ T, found.outer, atol=1e-14)
    np.testing.assert_allclose(found.A[:3, 3:], 0.0, atol=1e-13)
    np.testing.assert_allclose(np.sort(found.hidden_modes.real), [-3.0, 0.5], rtol=1e-12)
    np.testing.assert_allclose(control.obsv(A, C) @ found.hidden_basis, 0.0, atol=1e-11)
    assert found.seen_basis.shape == (5, 3)
    dual = controllability_staircase(A.T, C.T)
    np.testing.assert_allclose(dual.A, found.A.T, atol=1e-14)
    np.testing.assert_allclose(dual.outer[3:], 0.0, atol=1e-14)
    assert dual.stages == (2, 1)
    assert observability_staircase(A, C + 1e-3).order == 5  # the negative control


def test_the_tolerance_of_a_staircase_is_relative_to_a_and_to_c() -> None:
    A, C = np.array([[-1.0, 0.0], [1e-6, -2.0]]), np.array([[0.0, 1e3]])
    assert observability_staircase(A, C).order == 2
    assert observability_staircase(A, C, tolerance=1e-5).order == 1
    assert observability_staircase(1e9 * A, 1e-9 * C, tolerance=1e-5).order == 1
    assert observability_staircase(A, 0.0 * C).stages == ()
    assert (
        observability_staircase([[-1.0, 0.0], [1e-10, -2.0]], C).order == 2
    )  # exact but for rounding, if nothing is said
    assert observability_staircase(A, C, tolerance=1e-5).residual == pytest.approx(1e-6 / np.linalg.norm(A, 2))


def test_the_distance_of_a_double_integrator_in_closed_form() -> None:
    """The Gramian of [A - zI; C] has the least eigenvalue 1 - |z| + |z|^2, so sqrt(3)/2 at |z| = 1/2; beyond |z| = 1 it is 1."""
    for call in (distance_to_unobservability, distance_to_undetectability):
        found = call(*POSITION, gap=1e-3)
        assert found.lower <= np.sqrt(0.75) <= found.upper * (1 + 1e-14)
        assert found.upper == pytest.approx(np.sqrt(0.75), rel=1e-9) and found.lower > 0.995 * found.upper
        assert abs(found.mode) == pytest.approx(0.5, rel=1e-3)
    assert distance_to_undetectability(*POSITION, discrete=True).upper == pytest.approx(1.0, rel=1e-12)
    assert distance_to_unobservability(*VELOCITY).upper == 0.0


def test_the_distance_of_one_state_in_closed_form() -> None:
    """min over Re z >= 0 of hypot(a - z, c) is hypot(a, c) for a < 0, and c for a >= 0; discrete time: from the unit circle."""
    for a, c in ((-3.0, 0.4), (-1e-3, 1e-6), (2.0, 0.1)):
        found = distance_to_undetectability([[a]], [[c]])
        assert found.upper == pytest.approx(np.hypot(min(a, 0.0), c), rel=1e-12)
        assert distance_to_unstabilizability([[a]], [[c]]).upper == found.upper
        assert distance_to_unobservability([[a]], [[c]]).upper == pytest.approx(c, rel=1e-12)
    assert distance_to_undetectability([[0.6]], [[0.3]], discrete=True).upper == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize("discrete", [False, True])
def test_both_sides_of_a_distance_against_a_general_minimiser(discrete: bool) -> None:
    draw = np.random.default_rng(11)
    for n in (2, 3, 5):
        A, C = draw.normal(size=(n, n)), draw.normal(size=(1, n))

        def value(z: Any, A: Any = A, C: Any = C) -> float:
            point = complex(z[0], z[1])
            point = point / min(1.0, abs(point) or 1.0) if discrete else complex(abs(point.real), point.imag)
            return float(np.linalg.svd(np.vstack([A - point * np.eye(len(A)), C]), compute_uv=False)[-1])

        starts = [(z.real, z.imag + d) for z in np.linalg.eigvals(A) for d in (0.0, 0.3)]
        best = min(
            minimize(value, s, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}).fun for s in starts
        )
        found = distance_to_undetectability(A, C, discrete, gap=0.02)
        assert found.lower <= best * (1 + 1e-9) and found.upper == pytest.approx(best, rel=1e-6)
        assert found.lower > 0.95 * best


def test_subdivision_needs_no_good_upper_bound() -> None:
    """Started from a value that is too high, it neither passes the minimum over nor claims more than it."""
    A, C = np.diag([1.0, 0.1]), np.array([[1e-3, 1.0]])  # the minimum is at the edge of the region, |z| = |A|
    lower, upper, place = below(A, C, Region.RIGHT, 0.5, 0.05, 20_000)
    exact = distance_to_unobservability(A, C, gap=1e-3)
    assert 0.9 * exact.upper < lower <= exact.upper <= upper < 1.1 * exact.upper
    assert place is not None and abs(place - 1.0) < 2e-3
    draw = np.random.default_rng(8)
    for _ in range(6):
        A, C = draw.normal(size=(3, 3)), draw.normal(size=(1, 3))
        for region in Region:
            least_value = least(A, C, region)[0]
            lower, upper, _ = below(A, C, region, 1.5 * least_value, 0.05, 20_000)
            assert 0.94 * upper < lower <= least_value * (1 + 1e-9) and upper < 1.06 * least_value
    assert least(np.array(POSITION[0]), np.array(POSITION[1]), Region.PLANE)[0] == pytest.approx(
        np.sqrt(0.75), rel=1e-6
    )  # beside a saddle


def test_the_lower_side_of_a_hidden_chain_comes_from_a_gain() -> None:
    """With hardly any evaluations subdivision says nothing, and says so with a lower side of zero."""
    A, C = chain(3, 0.3, 1, seen=True)
    found = distance_to_undetectability(A, C, evaluations=4)
    assert 0.02 < found.lower < found.upper < 0.5
    assert below(A, C, Region.RIGHT, found.upper, 0.01, 4)[0] == 0.0


def test_a_rotated_double_integrator_is_undecided_and_its_integers_are_refuted() -> None:
    exact = detectable([[3, -9], [1, -3]], [[1, -3]])
    assert exact.verdict is Verdict.REFUTED and exact.exact and exact.gain is None
    assert hidden_part(np.array([[3.0, -9.0], [1.0, -3.0]]), np.array([[1.0, -3.0]])).entries() == [0]
    hidden = observability_staircase([[3, -9], [1, -3]], [[1, -3]]).hidden_basis
    np.testing.assert_allclose(np.abs(hidden[:, 0]), np.array([3.0, 1.0]) / np.sqrt(10.0), rtol=1e-14)
    for seed in range(25):
        for shift, discrete in ((0.0, False), (1.0, True)):
            A, C = rotated(shift * np.eye(2) + np.array(VELOCITY[0]), VELOCITY[1], seed)
            found = detectable(A, C, discrete)
            assert found.verdict is not Verdict.CERTIFIED and found.upper < 1e-12
            assert found.exact or "undecided at this precision" in found.reason
            assert hautus_test(A, C, discrete).undecided
            A, C = rotated(shift * np.eye(2) + np.array(POSITION[0]), POSITION[1], seed)
            assert detectable(A, C, discrete).verdict is Verdict.CERTIFIED
            assert hautus_test(A, C, discrete).frozen_observable


@pytest.mark.parametrize("size", [2, 4, 6])
def test_rotated_jordan_blocks_have_three_answers(size: int) -> None:
    wanted = {-0.5: Verdict.CERTIFIED, 0.0: Verdict.INCONCLUSIVE, 0.3: Verdict.REFUTED}
    for seed, (eigenvalue, verdict) in enumerate(wanted.items()):
        A, C = chain(size, eigenvalue, seed, seen=False)
        found = detectable(A, C)
        assert found.verdict is verdict
        assert stabilizable(A.T, C.T).verdict is verdict
        np.testing.assert_allclose(found.hidden_modes, [eigenvalue], atol=1e-12)
        A, C = chain(size, eigenvalue, seed, seen=True)
        seen = detectable(A, C)
        assert seen.verdict is Verdict.CERTIFIED and 0.0 < seen.lower <= seen.upper
        assert np.linalg.eigvals(A - seen.gain @ C).real.max() < 0.0


@pytest.mark.parametrize("unit", [1.0, 1e5, 1e-9, 3e13])
def test_units_decide_nothing(unit: float) -> None:
    draw = np.random.default_rng(2)
    A = np.block([[draw.normal(size=(2, 2)), np.zeros((2, 1))], [draw.normal(size=(1, 2)), np.full((1, 1), 0.7)]])
    C, d = np.array([[1.0, 0.5, 0.0], [0.2, 1.0, 0.0]]), np.array([1.0, unit, np.sqrt(unit)])
    A, outputs = A / d[:, None] * d, C * d * np.array([[unit**2], [1.0]])
    assert detectable(A, outputs).verdict is Verdict.REFUTED
    assert not hautus_test(A, outputs).frozen_detectable
    seen = outputs + np.array([[0.0, 0.0, 1.0]]) * d * unit**2
    found = detectable(A, seen)
    assert found.verdict is Verdict.CERTIFIED and hautus_test(A, seen).frozen_observable
    assert np.linalg.eigvals(A - found.gain @ seen).real.max() < 0.0
    drive = stabilizable(A.T, seen.T)
    assert np.linalg.eigvals(A.T - seen.T @ drive.gain).real.max() < 0.0


def test_rounding_in_the_place_of_a_zero_is_no_sensor() -> None:
    A, tilted = np.diag([-1.0, 2.0]), [[1.0, np.cos(np.pi / 2)]]
    found = detectable(A, tilted)
    assert found.verdict is Verdict.INCONCLUSIVE and "entries below rounding" in found.reason
    assert hautus_test(A, tilted).hidden.any()
    assert detectable(A, [[1.0, 1e-13]]).verdict is Verdict.CERTIFIED
    clean, outputs = without_dust(np.array([[1.0, 1e-17], [1.0, 1.0]]), np.array([[1e-17, 1.0]]))
    assert clean[0, 1] == 0.0 and outputs[0, 0] == 0.0
    kept, _ = without_dust(np.array([[0.0, 1e-17], [1.0, 0.0]]), np.eye(2))
    assert kept[0, 1] == 1e-17  # the largest of its row
    kept, _ = without_dust(np.array([[1.0, 1e-17], [0.0, 1e-17]]), np.eye(2))
    assert kept[0, 1] == 1e-17  # the largest of its column


def test_the_precision_of_the_data_decides() -> None:
    A, C = rotated(np.diag([1.0, -1.0]), [[1e-4, 1.0]], 3)
    assert detectable(A, C).verdict is Verdict.CERTIFIED
    rough = detectable(A, C, precision=1e-3)
    assert rough.verdict is Verdict.REFUTED and not rough.exact
    slow, outputs = rotated(np.diag([-1e-4, -1.0]), [[0.0, 1.0]], 3)
    assert detectable(slow, outputs).verdict is Verdict.CERTIFIED
    assert detectable(slow, outputs, precision=1e-3).verdict is Verdict.INCONCLUSIVE


def test_certified_means_a_distance_above_the_precision() -> None:
    A, C = np.array([[0.5, 0.4], [-0.3, 0.2]]), np.array([[1.0, 0.3]])
    verdicts = set()
    for precision in np.geomspace(1e-3, 0.9, 25):
        found = detectable(A, C, precision=float(precision))
        verdicts.add(found.verdict)
        assert found.verdict is not Verdict.CERTIFIED or found.lower > precision
        assert found.lower <= found.upper
    assert len(verdicts) > 1


def test_discrete_time_is_judged_by_the_unit_circle() -> None:
    for mode, verdict in (
        (0.9, Verdict.CERTIFIED),
        (-0.9, Verdict.CERTIFIED),
        (-1.0, Verdict.REFUTED),
        (1.1, Verdict.REFUTED),
    ):
        found = detectable(np.diag([0.5, mode]), [[1.0, 0.0]], discrete=True)
        assert found.verdict is verdict and found.exact is (verdict is Verdict.REFUTED)
    system = control.ss(np.diag([0.5, 1.1]), [[1.0], [0.0]], [[0.0, 1.0]], 0.0, 0.1)
    assert detectable(system).verdict is Verdict.CERTIFIED
    assert stabilizable(system).verdict is Verdict.REFUTED
    assert controllability_staircase(system).order == 1 and observability_staircase(system).order == 1
    assert distance_to_unstabilizability(system).upper == 0.0
    assert distance_to_uncontrollability(control.ss(*POSITION[:1], [[0.0], [1.0]], POSITION[1], 0.0, None)).upper > 0.8


def test_the_proofs_refuse_what_is_false() -> None:
    F = np.array([[-1.0, 5.0], [0.0, -2.0]])
    nothing = np.zeros((1, 2)), np.zeros((2, 1))
    assert proved_distance(F, *nothing, np.diag([1.0, 10.0]), False) > 0.01
    assert proved_distance(F, *nothing, np.eye(2), False) == 0.0  # F + F' is indefinite
    assert proved_distance(-F, *nothing, -np.diag([1.0, 10.0]), False) == 0.0
    assert proved_distance(0.5 * np.eye(2), *nothing, np.eye(2), True) == pytest.approx(0.5, rel=1e-12)
    assert proved_distance(1.5 * np.eye(2), *nothing, np.eye(2), True) == 0.0
    slanted = np.array([[0.5, 50.0], [0.0, 0.5]])  # 0.005 in the corner makes it unstable
    assert 1e-3 < proved_distance(slanted, *nothing, np.diag([1.0, 1e4]), True) <= 0.005
    assert proved_distance(np.diag([-1.0, 1.0]), *nothing, np.diag([1.0, -1.0]), False) == 0.0  # Q > 0, P is not
    gain = np.array([[3.0], [4.0]])
    assert proved_distance(
        -np.eye(2) + gain @ [[1.0, 0.0]], np.array([[1.0, 0.0]]), gain, np.eye(2), False
    ) == pytest.approx(1.0 / np.sqrt(26.0), rel=1e-12)
    assert border_clear(np.diag([1.0, -1.0]), False, 0.9) and not border_clear(np.diag([1.0, -1.0]), False, 1.1)
    assert border_clear(np.array([[0.5, -2.0], [2.0, 0.5]]), False, 0.4)
    assert not border_clear(np.array([[0.5, -2.0], [2.0, 0.5]]), False, 0.6)
    assert border_clear(np.diag([1.5, 0.2]), True, 0.4) and not border_clear(np.diag([-1.5, 0.2]), True, 0.6)


def test_a_growing_part_is_hidden_and_clear_of_the_border() -> None:
    A, first = np.diag([5.0, -1.0]), np.eye(2)[:, :1]
    assert growing_mode(A, np.array([[0.0, 1.0]]), [first], False, 1e-9) == 5.0
    assert growing_mode(A, np.array([[1.0, 1.0]]), [first], False, 1e-9) is None  # it is seen
    assert growing_mode(np.array([[1e-9]]), np.zeros((1, 1)), [np.eye(1)], False, 1e-10) == 1e-9
    assert growing_mode(np.array([[1e-9]]), np.zeros((1, 1)), [np.eye(1)], False, 1e-8) is None  # it may as well decay
    turning = np.array([[0.5, -2.0], [2.0, 0.5]])
    found = growing_mode(turning, np.zeros((1, 2)), list(least_seen(turning, np.zeros((1, 2)), 0.5 + 2j)), False, 1e-9)
    assert found is not None and found.real == pytest.approx(0.5) and abs(found.imag) == pytest.approx(2.0)


def test_a_weak_coupling_before_a_hidden_part_does_not_hide_the_refutation() -> None:
    """The staircase divides by the coupling 1e-6 and loses the hidden part in rounding; the least seen direction has it."""
    A, C = np.array([[-1.0, 1e-6, 0.0], [0.5, -2.0, 0.0], [1.0, 1.0, 1.5]]), np.eye(3)[:1]
    for seed in range(6):
        found = detectable(*rotated(A, C, seed))
        assert found.verdict is Verdict.REFUTED and "1.5" in found.reason
        A[2, 2] = -1.5
        assert detectable(*rotated(A, C, seed)).verdict is Verdict.CERTIFIED
        A[2, 2] = 1.5


def test_a_chain_of_weak_couplings_hides_a_mode_from_the_hautus_test() -> None:
    """Each coupling 1e-5 counts, the mode 3 shows by their product 5e-11 alone; at 1e-3 it shows enough."""
    assert hautus_test([[2.0]], [[-3.0]]).distance == pytest.approx(1.0, rel=1e-15)  # in units of |A| and |C|
    for e, hidden in ((1e-5, True), (1e-3, False)):
        A = np.diag([1.0, 2.0, 3.0]) + e * (np.eye(3, k=1) + np.eye(3, k=-1))
        found = hautus_test(A, np.eye(3)[:1])
        np.testing.assert_array_equal(found.hidden, hidden & (found.eigenvalues.real > 2.5))


@pytest.mark.parametrize("angle", [1e-9, 1e-6, 0.7])
def test_a_slightly_turned_double_integrator_is_never_detectable(angle: float) -> None:
    """At 1e-9 an entry of 1e-18 beside 1 would be dust, and without it the pair would be observable."""
    U = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    for shift in (0.0, 1.0):
        A, C = U @ np.array(VELOCITY[0]) @ U.T + shift * np.eye(2), np.array(VELOCITY[1]) @ U.T
        assert detectable(A, C, shift == 1.0).verdict is Verdict.INCONCLUSIVE
        assert hautus_test(A, C, shift == 1.0).undecided


def test_gains_bound_the_distance_to_unobservability_over_both_half_planes() -> None:
    """The mode that is nearly hidden decays: a gain for (A, C) alone knows nothing of it."""
    found = distance_to_unobservability(np.diag([-1.0, 2.0]), [[1e-2, 1.0]], evaluations=4)
    assert found.upper < 2e-2 and 0.0 < found.lower < 0.9 * found.upper


def test_exact_stability_of_what_is_hidden() -> None:
    """Routh on the border: s^2 + 1, (s + 1)(s^2 + 1), roots at 1 and -1 in discrete time; and one tiny step beside it."""
    none = np.zeros((1, 2))
    turning = np.array([[0.0, 1.0], [-1.0, 0.0]])
    assert not hidden_is_stable(turning, none, False)
    assert hidden_is_stable(turning - np.array([[0.0, 0.0], [0.0, 2.0**-60]]), none, False)
    assert not hidden_is_stable(np.diag([0.5, -1.0]), none, True) and not hidden_is_stable(turning, none, True)
    assert hidden_is_stable(np.diag([0.5, -1.0 + 2.0**-53]), none, True)
    assert hidden_is_stable(np.diag([5.0, -1.0]), np.array([[1.0, 0.0]]), False)
    assert hidden_part(np.diag([5.0, -1.0]), np.array([[0.0, 1.0]])).entries() == [5]
    assert not hidden_is_stable(np.diag([5.0, -1.0]), np.array([[0.0, 1.0]]), False)
    draw = np.random.default_rng(0)
    for _ in range(40):
        A = draw.integers(-3, 2, (4, 4)).astype(float)
        top = float(np.linalg.eigvals(A).real.max())
        if abs(top) > 1e-6:
            assert hidden_is_stable(A, np.zeros((1, 4)), False) is (top < 0.0)


def test_balancing_keeps_zeros_and_rounds_nothing() -> None:
    draw = np.random.default_rng(3)
    units = np.exp(draw.uniform(-20.0, 20.0, (30, 4)))
    A = draw.normal(size=(30, 4, 4)) * units[:, None, :] / units[:, :, None]
    C = draw.normal(size=(30, 2, 4)) * units[:, None, :] * np.exp(draw.uniform(-20.0, 20.0, (30, 2, 1)))
    near, outputs, d, f = balanced_pair(A, C)
    for factor in (d, f):
        np.testing.assert_array_equal(np.frexp(factor)[0], 0.5)
    np.testing.assert_array_equal(near, A * d[:, None, :] / d[:, :, None])
    np.testing.assert_array_equal(outputs, C * d[:, None, :] * f[:, :, None])
    beside = np.abs(near) * (1.0 - np.eye(4))
    assert np.abs(np.log2(beside.sum(axis=-1) / beside.sum(axis=-2))).max() <= 1.5
    assert np.abs(near).max() < 100.0 * np.median(np.abs(near)) and np.abs(outputs).max() <= 2.0 * np.abs(near).max()


def test_groups_of_states_are_sized_by_where_they_lead() -> None:
    """1 drives 0, which is measured, and 2, which is not; couplings of any size come to the level of the loops' own entries."""
    A = np.array([[-2.0, 1e-9, 0.0], [0.0, -1.0, 0.0], [0.0, 1e12, -1.0]])
    near, outputs, _, _ = balanced_pair(A, np.array([[1e-7, 0.0, 0.0]]))
    assert np.diag(near).tolist() == [-2.0, -1.0, -1.0] and (near == 0.0).sum() == 4
    np.testing.assert_allclose(np.log2([near[0, 1], near[2, 1], outputs[0, 0]]), 1.0, atol=0.51)
    _, outputs, _, _ = balanced_pair(np.array([[-1.0, 1e6], [0.0, -1.0]]), np.eye(2))
    np.testing.assert_allclose(np.log2(np.diag(outputs)), 0.0, atol=0.51)  # rows are sized once more after the groups
    both, _, _, _ = balanced_pair(np.stack([A, np.eye(3)]), np.array([[[1e-7, 0.0, 0.0]], [[1.0, 1.0, 1e9]]]))
    np.testing.assert_array_equal(both[0], near)


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: detectable(np.eye(2)), "C is missing"),
        (lambda: stabilizable(np.eye(2)), "B is missing"),
        (lambda: stabilizable(np.eye(2), np.ones((3, 1))), "needs 2 rows"),
        (lambda: detectable(np.ones((2, 2, 2)), np.ones((1, 2))), "hautus_test for a stack"),
        (lambda: observability_staircase(np.ones((2, 2, 2)), np.ones((1, 2))), "one pair"),
        (lambda: distance_to_unobservability(np.ones((2, 2, 2)), np.ones((1, 2))), "one pair"),
        (lambda: detectable(np.eye(2), np.ones((1, 2)), precision=0.0), "precision = 0"),
        (lambda: observability_staircase(np.eye(2), np.ones((1, 2)), tolerance=1.0), "tolerance = 1"),
        (lambda: distance_to_unobservability(np.eye(2), np.ones((1, 2)), gap=1.0), "gap = 1"),
        (lambda: detectable(np.eye(2), np.ones((1, 2)), cast("Any", "discrete")), "not a truth value"),
        (lambda: detectable(np.eye(2) * 1j, np.ones((1, 2))), "complex"),
    ],
)
def test_bad_questions_are_refused(call: Any, word: str) -> None:
    with pytest.raises(AnalysisError, match=word):
        call()
