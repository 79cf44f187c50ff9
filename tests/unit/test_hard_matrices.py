"""Answers on matrices that are hard for floating point, and models written as users write them: closed forms, exact fractions."""

from __future__ import annotations

from fractions import Fraction
from math import sqrt

import numpy as np
import pytest
import sympy as sp
from scipy.stats import ortho_group
from sympy.polys.matrices import DomainMatrix

from analysis import (
    critical_drop_probability,
    frozen_modes,
    generic_rank,
    h2_norm,
    hautus_test,
    mean_square_stable_intervals,
    observability_matrix,
    observability_of,
    rank_loss,
    stable_recovery_intervals,
    stationary_distribution,
)
from analysis.drops.balance import balanced
from analysis.drops.intermittent import certify_static_gain, static_critical_arrival, static_gain_radius
from synthesis import LpvModel, NonlinearModel, SchedulingParameter, Signal, Verdict


def signals(*names: str) -> tuple[Signal, ...]:
    return tuple(Signal(name, "1") for name in names)


def nonlinear(states: str, f: list[sp.Expr], h: sp.Expr, inputs: str = "") -> NonlinearModel:
    names = signals(*states.split())
    return NonlinearModel("m", "a test", names, signals("y"), sp.Matrix(f), sp.Matrix([h]), signals(*inputs.split()))


def lpv(A: list[list[sp.Expr]], C: list[list[sp.Expr]]) -> LpvModel:
    parameter = SchedulingParameter("p", "1", -2.0, 2.0, -1.0, 1.0)
    outputs = signals(*(f"y{i}" for i in range(len(C))))
    states = signals(*(f"x{i}" for i in range(len(A))))
    return LpvModel("m", "a test", states, outputs, (parameter,), sp.Matrix(A), sp.Matrix(C))


@pytest.mark.parametrize("declared", [{}, {"real": True}, {"positive": True}])
def test_assumptions_of_symbols_change_no_answer(declared: dict[str, bool]) -> None:
    x, y = sp.symbols("x y", **declared)
    found = generic_rank(nonlinear("x y", [y, -x], x), {"x": (-1.0, 1.0), "y": (-1.0, 1.0)})
    assert found.rank == 2 and found.structure.proved
    p, plain = sp.Symbol("p", **declared), sp.Symbol("p")
    rate = sp.Symbol("p_rate")
    wanted = sp.Matrix([[plain, 1], [rate, plain]])
    assert observability_matrix(lpv([[0, 1], [0, 0]], [[p, 1]])).matrix == wanted
    assert observability_of(sp.Matrix([[0, 1], [0, 0]]), sp.Matrix([[p, 1]]), {p: rate}, 2).matrix == wanted


def test_directions_that_depend_on_the_point_prove_nothing() -> None:
    """f = 0 and h = x^2 + y^2: rank 1 everywhere, and no constant direction is hidden; h = x + y hides x - y, proved."""
    x, y = sp.symbols("x y")
    ranges = {"x": (1.0, 2.0), "y": (1.0, 2.0)}
    round_ = generic_rank(nonlinear("x y", [0, 0], x**2 + y**2), ranges)
    assert round_.rank == 1 and not round_.structure.proved
    flat = generic_rank(nonlinear("x y", [0, 0], x + y), ranges)
    assert flat.rank == 1 and flat.structure.proved and flat.structure.describe()[0] in ("- x + y", "x - y")


def test_as_many_input_derivatives_as_the_order_needs() -> None:
    """y = sum of x_i u_i with constant x: five derivatives of the inputs tell five states, held inputs one."""
    xs, us = sp.symbols("x1:6"), sp.symbols("u1:6")
    model = nonlinear("x1 x2 x3 x4 x5", [0] * 5, sum(a * b for a, b in zip(xs, us, strict=True)), "u1 u2 u3 u4 u5")
    ranges = {str(s): (-1.0, 1.0) for s in (*xs, *us)}
    assert generic_rank(model, ranges).rank == 5
    assert generic_rank(model, ranges, moving_inputs=False).rank == 1


def test_a_special_point_may_need_more_than_the_generic_order() -> None:
    """S' = 1 + a S^2 from S = 0: a shows in the third derivative first."""
    s, a = sp.symbols("S a")
    model, ranges = nonlinear("S a", [1 + a * s**2, 0], s), {"S": (0.0, 0.0), "a": (1.0, 2.0)}
    assert generic_rank(model, ranges).rank == 2
    assert generic_rank(model, ranges, order=2).rank == 1


@pytest.mark.parametrize("eigenvalue", [-2.0, -0.5, 0.0, 0.3, 1.5])
@pytest.mark.parametrize("size", [2, 3, 4])
def test_defective_modes_are_seen_as_what_they_are(size: int, eigenvalue: float) -> None:
    """A rotated Jordan block beside fast stable modes; its eigenvector is hidden, or measured (the negative control)."""
    for seed in range(12):
        draw = np.random.default_rng(seed)
        n = size + int(draw.integers(0, 3))
        A = np.diag(-4.0 - 2.0 * np.arange(n))
        A[:size, :size] = eigenvalue * np.eye(size) + np.diag(np.ones(size - 1), 1)
        hidden = draw.uniform(0.5, 1.0, (1, n)) * (np.arange(n) > 0)
        U = ortho_group.rvs(n, random_state=seed)
        found = hautus_test(U @ A @ U.T, hidden @ U.T)
        assert found.hidden.any() and bool(found.frozen_detectable) is (eigenvalue < 0.0)
        assert bool(found.undecided) is (eigenvalue == 0.0)
        assert not hautus_test(U @ A @ U.T, (hidden + (np.arange(n) == 0)) @ U.T).hidden.any()


def test_the_hidden_vector_of_a_rotated_double_integrator() -> None:
    found = hautus_test([[3, -9], [1, -3]], [[1, -3]])
    assert found.hidden.sum() == 1 and not found.frozen_detectable and found.undecided
    assert hautus_test([[3, -9], [1, -3]], [[1, 0]]).frozen_observable


def test_distinct_neighbours_are_not_taken_for_one_mode() -> None:
    """-1 and -3 are seen, -2, their mean, is hidden."""
    found = hautus_test(np.diag([-1.0, -2.0, -3.0]), [[1.0, 0.0, 1.0]])
    np.testing.assert_array_equal(found.hidden, np.abs(found.eigenvalues + 2.0) < 1e-6)


def test_frozen_modes_by_minors() -> None:
    x = sp.Symbol("x")
    (mode,) = frozen_modes(sp.eye(2), sp.Matrix([[1, 0], [0, x], [0, x]]))
    assert mode.hidden_if == x and not mode.always
    (mode,) = frozen_modes(sp.eye(2), sp.Matrix([[1, 0], [0, x], [0, x + 1]]))
    assert mode.hidden_if == 1


def test_isolated_points_of_lost_rank() -> None:
    """det [C; C A + dC/dt] = -(p - 1)^2 (5 + dp/dt): lost at p = 1 for every rate, nowhere else for rates within 1."""
    p = sp.Symbol("p")
    lost = rank_loss(observability_matrix(lpv([[0, -5], [0, 0]], [[p - 1, (p - 1) * p]])))
    assert lost.interval_over_rates("p") == ((1, 1),)
    assert lost.interval_over_rates("p", rates=(4, 6)) == ((-2, 2),)


def test_h2_norm_of_states_in_very_different_units() -> None:
    found = h2_norm(np.diag([0.5, 0.9999]), [[1e6], [1e-6]], [[0.0, 1e6]], discrete=True)
    assert found == pytest.approx(1.0 / sqrt(1.0 - 0.9999**2), rel=1e-10)


A0, A1 = np.array([[1.2, 0.3], [0.0, 0.5]]), np.array([[0.4, 0.1], [0.2, 0.3]])


@pytest.mark.parametrize("unit", [1.0, 1e5, 1e-8, 3e12])
def test_units_of_states_change_no_drop_probability(unit: float) -> None:
    T = np.diag([1.0, unit])
    first, second = (T @ A @ np.linalg.inv(T) for A in (A0, A1))
    ((low, high),) = mean_square_stable_intervals(first, second)
    assert low == 0.0 and high == pytest.approx(float(critical_drop_probability(A0, A1)), rel=1e-9)
    assert high == pytest.approx(0.6342, abs=5e-5)
    ((low, high),) = stable_recovery_intervals(first, second, 0.2)
    ((same, _),) = stable_recovery_intervals(A0, A1, 0.2)
    assert high == 1.0 and low == pytest.approx(same, rel=1e-9) and 0.3 < low < 0.35


def test_balancing_is_a_similarity_by_powers_of_two() -> None:
    draw = np.random.default_rng(3)
    units = np.exp(draw.uniform(-20.0, 20.0, (50, 4)))
    pairs = [draw.normal(size=(50, 4, 4)) * units[:, :, None] / units[:, None, :] for _ in range(2)]
    found = balanced(*pairs)
    ratio = found[0] / pairs[0]
    np.testing.assert_array_equal(ratio, found[1] / pairs[1])
    np.testing.assert_array_equal(np.frexp(ratio)[0], 0.5)
    size = np.abs(found[0]) + np.abs(found[1])
    assert size.max() < 1e3 * np.median(size)


@pytest.mark.parametrize("small", [Fraction(1, 10**6), Fraction(1, 10**15), Fraction(1, 10**80)])
def test_stationary_distribution_of_a_nearly_reducible_chain(small: Fraction) -> None:
    """0 <-> 1 <-> 2 with tiny probabilities between them and a transient mode 3: pi_0 = pi_1 = 2 pi_2 by detailed balance."""
    e = float(small)
    P = np.array([[1 - e, e, 0, 0], [e, 1 - 2 * e, e, 0], [0, 2 * e, 1 - 2 * e, 0], [0.3, 0.3, 0.2, 0.2]])
    for order in ([0, 1, 2, 3], [3, 1, 0, 2]):
        found = stationary_distribution(P[np.ix_(order, order)])
        np.testing.assert_allclose(found, np.array([0.4, 0.4, 0.2, 0.0])[order], rtol=1e-14)


def test_stationary_distributions_of_a_batch_in_exact_fractions() -> None:
    draw = np.random.default_rng(0)
    for n in (2, 5, 9):
        P = draw.dirichlet(np.full(n, 0.05), size=(30, n)) + 1e-12
        P /= P.sum(axis=-1, keepdims=True)
        found = stationary_distribution(P)
        for chain, pi in zip(P, found, strict=True):
            rows = [[Fraction(x) for x in row] for row in chain]
            rows = [[x / sum(row) for x in row] for row in rows]
            exact = sp.Matrix(n, n, lambda i, j, r=rows: sp.Rational(r[i][j].numerator, r[i][j].denominator))
            (null,) = DomainMatrix.from_Matrix(exact.T - sp.eye(n)).to_field().nullspace().to_Matrix().tolist()
            np.testing.assert_allclose(pi, [float(v / sum(null)) for v in null], rtol=1e-11)
            np.testing.assert_allclose(pi @ chain, pi, rtol=1e-12)


@pytest.mark.parametrize("step", [1.0, 0.005])
def test_one_output_of_integrators_needs_hardly_a_measurement(step: float) -> None:
    """1 - 1/prod |lambda_u|^2 = 0 for a double integrator: any arrival rate above zero has its gain; at zero there is none."""
    A, C = np.array([[1.0, step], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    for rate in (0.5, 1e-2, 9e-5):
        found = certify_static_gain(A, C, rate)
        assert found.verdict is Verdict.CERTIFIED
        assert static_gain_radius(A, C, found.gain, rate) < 1.0
    assert certify_static_gain(A, C, 0.0).verdict is Verdict.REFUTED
    bracket = static_critical_arrival(A, C)
    assert bracket.lower == bracket.upper == 0.0 and bracket.arrival < 1e-3


def test_integrators_in_rotated_coordinates_are_not_refuted_by_their_rounding() -> None:
    """Their computed eigenvalues are 1 +- 1e-8, for which the theorem would ask a rate of 1e-8: undecided, or a gain."""
    for seed in range(6):
        U = ortho_group.rvs(2, random_state=seed)
        A, C = U @ np.array([[1.0, 1.0], [0.0, 1.0]]) @ U.T, np.array([[1.0, 0.0]]) @ U.T
        assert certify_static_gain(A, C, 1e-10).verdict is not Verdict.REFUTED
        assert certify_static_gain(1.01 * A, C, 1e-3).verdict is Verdict.REFUTED
    still = certify_static_gain(0.5 * A, C, 0.0)  # nothing arrives, and nothing has to
    assert still.verdict is Verdict.CERTIFIED and still.radius < 0.3


def test_one_output_at_the_rate_of_the_theorem() -> None:
    """Random unstable plants: a gain just above 1 - 1/prod |lambda_u|^2, a refutation just below, and a bound for any gain."""
    draw = np.random.default_rng(5)
    for _ in range(12):
        n = int(draw.integers(1, 4))
        A, C = draw.normal(size=(n, n)) * 1.2 / np.sqrt(n) + 0.4 * np.eye(n), draw.normal(size=(1, n))
        size = np.abs(np.linalg.eigvals(A))
        if not (size > 1.0).any():
            continue
        rate = 1.0 - 1.0 / np.prod(size[size > 1.0] ** 2)
        above, below = (certify_static_gain(A, C, r) for r in (rate + 1e-5 * (1 - rate), rate - 1e-5))
        assert (above.verdict, below.verdict) == (Verdict.CERTIFIED, Verdict.REFUTED)
        assert static_gain_radius(A, C, above.gain, above.arrival) < 1.0 <= below.radius
