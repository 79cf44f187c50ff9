"""Similarity bounds, common Lyapunov functions and the joint spectral radius against closed forms and independent checks."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar

from analysis.errors import AnalysisError
from analysis.norms.hinf import stability_margin
from analysis.switching.common_lyapunov import common_quadratic_lyapunov
from analysis.switching.joint_spectral_radius import joint_spectral_radius
from analysis.switching.jsr_ellipsoid import proved_bound
from analysis.switching.jsr_polytope import proved_polytope_bound
from analysis.switching.jsr_products import multiply_out
from analysis.switching.pair import exact_pair_test, pair_margin
from analysis.switching.similarity import (
    best_diagonal_transform,
    common_growth,
    diagonal_window,
    similarity_bound,
    symmetric_growth,
)
from synthesis.lmi.result import Verdict

ZELENTSOVSKY = np.array([[0.0, 1.0], [-2.0, -1.0]]), np.array([[0.0, 0.0], [-1.0, 0.0]])  # x' = (A0 + p(t) A1) x
GOLDEN = np.array([[[1.0, 1.0], [0.0, 1.0]], [[1.0, 0.0], [1.0, 1.0]]])  # radius: the golden ratio, by A0 A1
FINITENESS = 0.749326546330367  # Hare, Morris, Sidorov, Theys 2011: no finite product attains the radius


# --- similarity -------------------------------------------------------------------------------------------------------


def test_best_diagonal_transform_is_the_minimum() -> None:
    rng = np.random.default_rng(0)
    A = rng.normal(size=(40, 2, 2))
    found = best_diagonal_transform(A)
    for matrix, gamma, growth in zip(A, found.gamma, found.growth, strict=True):
        searched = minimize_scalar(
            lambda g, m=matrix: float(symmetric_growth(m, np.diag([np.exp(g), 1.0]))), bounds=(-12, 12), method="bounded",
            options={"xatol": 1e-10},
        )  # fmt: skip
        assert growth == pytest.approx(searched.fun, abs=1e-9)
        assert symmetric_growth(matrix, np.diag([gamma, 1.0])) == pytest.approx(growth, abs=1e-12)
        if matrix[0, 1] * matrix[1, 0] > 0.0:
            assert growth == pytest.approx(np.linalg.eigvals(matrix).real.max(), abs=1e-12)
    assert found.attained.all()


def test_triangular_matrices_do_not_attain_their_infimum() -> None:
    found = best_diagonal_transform(
        [[[-1.0, 5.0], [0.0, -2.0]], [[-1.0, 0.0], [5.0, -2.0]], [[-1.0, 0.0], [0.0, -2.0]]]
    )
    np.testing.assert_array_equal(found.growth, -1.0)
    np.testing.assert_array_equal(found.gamma, [0.0, np.inf, 1.0])
    np.testing.assert_array_equal(found.attained, [False, False, True])


def test_diagonal_windows_are_where_the_symmetric_part_is_negative() -> None:
    rng = np.random.default_rng(1)
    A = rng.normal(size=(200, 2, 2)) - 0.8 * np.eye(2)
    low, high = diagonal_window(A)
    assert 20 < np.isnan(low).sum() < 180
    for matrix, a, b in zip(A, low, high, strict=True):
        if np.isnan(a):
            values = [float(symmetric_growth(matrix, np.diag([g, 1.0]))) for g in np.geomspace(1e-3, 1e3, 61)]
            assert min(values) >= 0.0
            continue
        for gamma, inside in ((a * 1.001, True), (b * 0.999, True), (a * 0.999, False), (b * 1.001, False)):
            assert (symmetric_growth(matrix, np.diag([gamma, 1.0])) < 0.0) == inside


def test_the_corrected_bound_holds_in_simulation() -> None:
    rng = np.random.default_rng(4)
    A = np.array([[-3.0, 40.0], [-1.0, -2.0]])
    B, T = np.array([[1.0, 0.2], [0.0, 1.0]]), np.diag([0.16, 1.0])
    bound = similarity_bound(A, B, T, disturbance=1.5)
    assert bound.bounded
    times = np.linspace(0.0, 4.0, 201)
    for _ in range(5):
        start, turn, phase = rng.normal(size=2), rng.uniform(0.0, 9.0), rng.uniform(0.0, 6.0)

        def rhs(t, e, turn=turn, phase=phase):
            return A @ e + B @ (1.5 * np.array([np.cos(turn * t + phase), np.sin(turn * t + phase)]))

        path = solve_ivp(rhs, (0.0, 4.0), start, t_eval=times, rtol=1e-9, atol=1e-12).y
        assert (np.linalg.norm(T @ path, axis=0) <= bound.transformed_error(times, start) * (1 + 1e-7)).all()


def test_printed_young_step_is_false_and_the_corrected_one_tight() -> None:
    """Claim P3-prop1-young: with B rho = eps e the left side is eps, the printed right side eps/2."""
    e, eps = np.array([0.6, 0.8]), 0.3
    force = eps * e
    left = e @ force
    corrected = force @ force / (2 * eps) + eps / 2 * e @ e
    assert left == pytest.approx(corrected)
    assert left > 0.5 * (force @ force / (2 * eps) + eps / 2 * e @ e)


def test_bounds_of_unstable_and_undisturbed_systems() -> None:
    assert not similarity_bound([[1.0]], [[1.0]], [[1.0]], 1.0).bounded
    quiet = similarity_bound([[-2.0]], [[1.0]], [[1.0]], 0.0, epsilon=1e-9)
    assert quiet.energy(1.0, 1.0) == pytest.approx(np.exp(-4.0), rel=1e-8)


# --- common quadratic Lyapunov functions ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("k", "verdict"), [(3.8284, "certified"), (3.82843, "refuted"), (6.5, "refuted"), (1.0, "certified")]
)
def test_zelentsovsky_quadratic_margin(k, verdict) -> None:
    """Quadratic margin exactly 1 + 2 sqrt(2) = 3.828427 (benchmark zelentsovsky_k): LMI and exact test agree on both sides."""
    A0, A1 = ZELENTSOVSKY
    modes = np.stack([A0, A0 + k * A1])
    assert common_quadratic_lyapunov(modes).verdict == verdict
    assert exact_pair_test(*modes) == verdict
    assert (pair_margin(*modes) > 0.0) == (verdict == "certified")


def test_zelentsovsky_margin_by_root_finding() -> None:
    A0, A1 = ZELENTSOVSKY
    k = brentq(lambda k: float(pair_margin(A0, A0 + k * A1)), 1.0, 6.0, xtol=1e-13)
    assert k == pytest.approx(1.0 + 2.0 * np.sqrt(2.0), abs=1e-10)


def test_zelentsovsky_worst_case_switching() -> None:
    """Exact margin 6.985129: the worst law alternates between the two ends with one dwell time each."""
    A0, A1 = ZELENTSOVSKY

    def fastest(k):
        dwell = np.linspace(0.05, 2.0, 120)
        one, two = expm(dwell[:, None, None] * A0), expm(dwell[:, None, None] * (A0 + k * A1))
        rate = np.abs(np.linalg.eigvals(one[:, None] @ two)).max(axis=-1)
        i, j = np.unravel_index(rate.argmax(), rate.shape)
        fine_a, fine_b = dwell[i] + np.linspace(-0.02, 0.02, 81), dwell[j] + np.linspace(-0.02, 0.02, 81)
        one, two = expm(fine_a[:, None, None] * A0), expm(fine_b[:, None, None] * (A0 + k * A1))
        return float(np.abs(np.linalg.eigvals(one[:, None] @ two)).max()) - 1.0

    assert brentq(fastest, 6.0, 8.0, xtol=1e-7) == pytest.approx(6.985129, rel=1e-5)


def test_markus_yamabe_rotation_rate() -> None:
    """A(p) = R(p)'A0 R(p): in the rotating frame a constant rate r gives A0 plus or minus r J; unstable from 1 - 1/sqrt(2)."""
    A0, J = np.array([[0.5, 1.0], [-1.0, -1.0]]), np.array([[0.0, 1.0], [-1.0, 0.0]])
    assert stability_margin(A0) == pytest.approx(-0.25)
    rate = brentq(lambda r: float(stability_margin(A0 - r * J)), 0.0, 0.9, xtol=1e-14)
    assert rate == pytest.approx(1.0 - 1.0 / np.sqrt(2.0), abs=1e-9)
    assert rate == pytest.approx(0.2928932188134524, rel=1e-4)


@pytest.mark.parametrize("discrete", [False, True])
def test_lmi_and_exact_test_agree_on_random_pairs(discrete) -> None:
    rng = np.random.default_rng(8)
    A = rng.normal(size=(60, 2, 2, 2))
    poles = np.linalg.eigvals(A)
    if discrete:
        A = A * (0.97 / np.abs(poles).max(axis=-1))[..., None, None]
    else:
        A = A - (poles.real.max(axis=-1) + 0.05)[..., None, None] * np.eye(2)
    margins = pair_margin(A[:, 0], A[:, 1], discrete)
    seen = {Verdict.CERTIFIED: 0, Verdict.REFUTED: 0}
    for pair, margin in zip(A, margins, strict=True):
        verdict = common_quadratic_lyapunov(pair, discrete).verdict
        if abs(margin) > 1e-6:
            assert verdict is (Verdict.CERTIFIED if margin > 0.0 else Verdict.REFUTED)
            assert exact_pair_test(pair[0], pair[1], discrete) is verdict
            seen[verdict] += 1
    assert min(seen.values()) >= 5


@pytest.mark.parametrize("discrete", [False, True])
def test_certificates_hold_and_multipliers_refute(discrete) -> None:
    rng = np.random.default_rng(2)
    Q = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    T = np.diag([1e-3, 1.0, 30.0, 1e4]) @ Q  # badly scaled states
    S = rng.normal(size=(3, 4, 4))
    good = (
        0.3 * S / np.linalg.norm(S, 2, axis=(-2, -1))[:, None, None]
        if discrete
        else S - np.swapaxes(S, 1, 2) - np.eye(4)
    )
    modes = T @ good @ np.linalg.inv(T)
    found = common_quadratic_lyapunov(modes, discrete)
    assert found.verdict is Verdict.CERTIFIED
    D = np.diag(1.0 / np.sqrt(np.diag(found.P)))
    for A in modes:
        change = A.T @ found.P @ A - found.P if discrete else A.T @ found.P + found.P @ A
        assert np.linalg.eigvalsh(D @ change @ D).max() < 0.0
    bad = modes.copy()
    bad[1] = -modes[1] if not discrete else 1.2 * np.eye(4) - 0.1 * modes[1]  # one unstable mode
    refuted = common_quadratic_lyapunov(bad, discrete)
    assert refuted.verdict is Verdict.REFUTED
    total = sum(A @ X @ A.T - X if discrete else A @ X + X @ A.T for A, X in zip(bad, refuted.X, strict=True))
    E = np.diag(1.0 / np.sqrt(np.diag(np.sum(refuted.X, axis=0))))
    assert np.linalg.eigvalsh(E @ total @ E).min() > 0.0
    assert min(np.linalg.eigvalsh(E @ X @ E).min() for X in refuted.X) > 0.0


def test_decoupled_states_are_decided_block_by_block() -> None:
    A, B = np.array([[-0.1, 10.0], [-1.0, -0.1]]), np.array([[-0.1, 1.0], [-10.0, -0.1]])
    for coupling in (0.0, 7.0):  # a third state that is driven by the others, or is not
        one, two = (np.block([[M, np.zeros((2, 1))], [coupling * np.ones((1, 2)), -np.eye(1)]]) for M in (A, B))
        assert stability_margin(np.stack([one, two])).max() < 0.0
        refuted = common_quadratic_lyapunov(np.stack([one, two]))
        assert (refuted.verdict, refuted.states) == (Verdict.REFUTED, (0, 1))
        for modes in ([one, one], [one.T, one.T], [one, one - 0.1 * np.eye(3)]):
            found = common_quadratic_lyapunov(np.stack(modes))
            assert found.verdict is Verdict.CERTIFIED
            assert np.linalg.eigvalsh(found.P).min() > 0.0
            for M in modes:
                assert np.linalg.eigvalsh(M.T @ found.P + found.P @ M).max() < 0.0


def test_the_boundary_is_no_certificate() -> None:
    marginal = np.array([[[0.0, 1.0], [-1.0, 0.0]]])
    assert common_quadratic_lyapunov(marginal).verdict is not Verdict.CERTIFIED
    assert exact_pair_test(marginal[0], marginal[0]) is Verdict.REFUTED


def test_unstable_modes_have_margin_minus_infinity() -> None:
    stable, unstable = -np.eye(2), np.diag([1.0, -1.0])
    np.testing.assert_array_equal(pair_margin(np.stack([stable, unstable]), stable), [2.0, -np.inf])
    assert pair_margin(0.5 * stable, 2.0 * stable, discrete=True) == -np.inf
    assert exact_pair_test(0.5 * stable, 2.0 * stable, discrete=True) is Verdict.REFUTED


# --- joint spectral radius --------------------------------------------------------------------------------------------


def brute_force(modes, length):
    """The largest rate of all products up to a length, and the smallest bound by their norms."""
    low, high = 0.0, np.inf
    for k in range(1, length + 1):
        words = [multiply_out(modes, word) for word in product(range(len(modes)), repeat=k)]
        low = max(low, max(np.abs(np.linalg.eigvals(P)).max() for P in words) ** (1.0 / k))
        high = min(high, max(np.linalg.norm(P, 2) for P in words) ** (1.0 / k))
    return low, high


def test_golden_ratio_pair() -> None:
    found = joint_spectral_radius(GOLDEN)
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    assert found.lower <= golden <= found.upper
    assert found.upper - found.lower < 1e-12
    assert sorted(found.product) == [0, 1]
    assert found.verdict is Verdict.REFUTED


def test_a_pair_without_a_maximising_product_is_still_bracketed() -> None:
    found = joint_spectral_radius(np.stack([GOLDEN[0], FINITENESS * GOLDEN[1]]))
    assert found.closed
    assert found.upper - found.lower <= 1e-4 * found.lower
    low, high = brute_force(np.stack([GOLDEN[0], FINITENESS * GOLDEN[1]]), 9)
    assert low <= found.lower * (1 + 1e-12)
    assert found.upper <= high


@pytest.mark.parametrize("seed", range(6))
def test_random_pairs_are_bracketed_to_1e_4(seed) -> None:
    modes = np.random.default_rng(seed).normal(size=(2, 2, 2))
    found = joint_spectral_radius(modes)
    assert found.closed
    low, high = brute_force(modes, 9)
    assert low <= found.upper
    assert found.lower <= high
    assert found.lower >= low * (1 - 1e-12)
    attained = np.abs(np.linalg.eigvals(multiply_out(modes, found.product))).max() ** (1.0 / len(found.product))
    assert attained == pytest.approx(found.lower, rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_upper_bound_can_be_checked_again_and_not_for_larger_modes(seed) -> None:
    modes = np.random.default_rng(seed + 30).normal(size=(3, 2, 2))
    found = joint_spectral_radius(modes)
    if found.proof == "polytope":
        assert proved_polytope_bound(modes, found.vertices) == pytest.approx(found.upper, rel=1e-12)
        assert proved_polytope_bound(1.001 * modes, found.vertices) > found.upper
        assert proved_polytope_bound(modes, found.vertices[:1]) == np.inf  # does not span
    else:
        assert proved_bound(modes, found.P, 10.0 * found.upper) == pytest.approx(found.upper, rel=1e-9)
        assert proved_bound(1.001 * modes, found.P, 10.0 * found.upper) > found.upper


def test_families_with_a_closed_form() -> None:
    rng = np.random.default_rng(5)
    T = rng.normal(size=(3, 3)) + 2.0 * np.eye(3)
    rotations = [expm(t * np.array([[0.0, -1.0, 0.3], [1.0, 0.0, 0.0], [-0.3, 0.0, 0.0]])) for t in (0.3, 1.7, 2.9)]
    cases = [
        (T @ np.stack([np.diag([0.9, 0.1, -0.3]), np.diag([0.2, -0.95, 0.5])]) @ np.linalg.inv(T), 0.95),  # commuting
        (0.8 * T @ np.stack(rotations) @ np.linalg.inv(T), 0.8),  # one compact group
        (np.stack([S + S.T for S in rng.normal(size=(3, 3, 3))]), None),  # symmetric: the largest radius
        (
            np.array([[[0.5, 9.0], [0.0, -0.7]], [[-0.6, -4.0], [0.0, 0.2]]]),
            0.7,
        ),  # triangular: the largest diagonal entry
        (np.array([[[1.0, 1.0], [0.0, 1.0]]]), 1.0),  # Jordan block: powers grow, the rate does not
    ]
    for modes, answer in cases:
        radius = np.abs(np.linalg.eigvals(modes)).max() if answer is None else answer
        found = joint_spectral_radius(modes)
        assert found.closed
        assert found.lower <= radius * (1 + 1e-12)
        assert found.upper >= radius * (1 - 1e-12)


def test_zero_and_marginal_families() -> None:
    nilpotent = np.array([[[0.0, 1.0], [0.0, 0.0]], [[0.0, -3.0], [0.0, 0.0]]])
    assert (joint_spectral_radius(nilpotent).lower, joint_spectral_radius(nilpotent).upper) == (0.0, 0.0)
    crossed = np.array([[[0.0, 1.0], [0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]]])  # each nilpotent, the product is not
    found = joint_spectral_radius(crossed)
    assert found.lower == 1.0
    assert found.upper == pytest.approx(1.0, abs=1e-12)
    integrator = np.array([[[1.0, 0.0], [0.0, 0.5]], [[0.5, 0.0], [0.0, 0.5]]])
    assert joint_spectral_radius(integrator).verdict is Verdict.REFUTED  # marginal is not stable
    assert joint_spectral_radius(0.999 * integrator).verdict is Verdict.CERTIFIED


def test_verdicts_stand_on_both_sides_of_one() -> None:
    rate = joint_spectral_radius(GOLDEN).upper
    assert joint_spectral_radius(GOLDEN / rate * 0.9999).verdict is Verdict.CERTIFIED
    assert joint_spectral_radius(GOLDEN / rate * 1.0001).verdict is Verdict.REFUTED


def test_an_open_bracket_says_so() -> None:
    modes = np.random.default_rng(1).normal(size=(2, 4, 4))
    found = joint_spectral_radius(modes, tolerance=1e-7, depth=3, most_vertices=10)
    assert not found.closed
    low, high = brute_force(modes, 6)
    assert found.lower <= high
    assert low <= found.upper


def test_scaling_is_exact() -> None:
    modes = np.random.default_rng(3).normal(size=(2, 2, 2))
    base, huge = joint_spectral_radius(modes), joint_spectral_radius(modes * 2.0**600)
    assert (huge.lower, huge.upper) == (base.lower * 2.0**600, base.upper * 2.0**600)


# --- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: joint_spectral_radius(np.zeros((2, 2, 3))), "square"),
        (lambda: joint_spectral_radius(np.zeros((2, 2))), "at least 3 axes"),
        (lambda: joint_spectral_radius(np.zeros((0, 2, 2))), "at least one mode"),
        (lambda: joint_spectral_radius(np.full((1, 2, 2), np.nan)), "not finite"),
        (lambda: joint_spectral_radius(np.eye(2)[None], tolerance=-1.0), "tolerance"),
        (lambda: common_quadratic_lyapunov(np.zeros((2, 3))), "axes"),
        (lambda: common_quadratic_lyapunov(np.full((1, 2, 2), np.inf)), "not finite"),
        (lambda: common_quadratic_lyapunov([[[1.0, 2.0], [3.0]]]), "not an array"),
        (lambda: exact_pair_test(np.eye(3), np.eye(3)), "2 states"),
        (lambda: exact_pair_test(np.zeros((1, 2, 2)), np.eye(2)), "one pair"),
        (lambda: pair_margin(np.zeros((2, 2, 2)), np.zeros((3, 2, 2))), "broadcast"),
        (lambda: best_diagonal_transform(np.eye(3)), "2 states"),
        (lambda: diagonal_window(np.eye(3)), "2 states"),
        (lambda: symmetric_growth(np.eye(2), np.zeros((2, 2))), "singular"),
        (lambda: common_growth(np.eye(2)[None], np.eye(3)), "T has the shape"),
        (lambda: similarity_bound(-np.eye(2), np.eye(3), np.eye(2), 1.0), "rows"),
        (lambda: similarity_bound(-np.eye(2), np.eye(2), np.eye(2), -1.0), "disturbance"),
        (lambda: similarity_bound(-np.eye(2), np.eye(2), np.eye(2), 1.0, epsilon=0.0), "epsilon"),
        (lambda: similarity_bound([[-1.0]], [[1.0]], [[1.0]], 1.0).energy(-1.0, 1.0), "negative"),
    ],
)
def test_bad_input_is_refused(call, words) -> None:
    with pytest.raises(AnalysisError, match=words):
        call()
