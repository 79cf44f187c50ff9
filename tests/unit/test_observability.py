"""Time-varying observability matrices, rank loss and frozen modes, on pairs whose answer is known."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.matrix import (
    exact_number,
    frozen_observability_matrix,
    observability_matrix,
    observability_of,
)
from analysis.observability.modes import frozen_modes, hautus_test
from analysis.observability.rank_loss import rank_loss
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.catalogue.longitudinal_speed import WHEEL_MOTION, longitudinal_speed_model
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.models.parameter_set import load_parameter_set
from tests.support.continuous_gramian import continuous_gramian

LATERAL = corner_velocity_model(load_parameter_set("resilient-velocity"), "lateral", 180.0)
SPEED = longitudinal_speed_model(load_parameter_set("longitudinal-speed"))


def ramp_model() -> LpvModel:
    """A = 0, C = [1, p]: observable through the motion of p alone."""
    return LpvModel(
        name="ramp",
        source="closed form",
        states=(Signal("a", "1"), Signal("b", "1")),
        outputs=(Signal("y", "1"),),
        parameters=(SchedulingParameter("p", "1", 0.0, 1.0, -1.0, 1.0),),
        A=sp.zeros(2),
        C=sp.Matrix([[1, sp.Symbol("p")]]),
    )


def test_frozen_rank_is_lower_than_the_time_varying_one() -> None:
    frozen = frozen_observability_matrix(ramp_model())
    assert frozen.state_names == tuple(s.name for s in ramp_model().states)
    moving = observability_matrix(ramp_model())
    assert frozen.frozen and not moving.frozen
    assert "not observability" in frozen.describe()
    assert "frozen" not in moving.describe()
    assert rank_loss(frozen).always
    assert frozen.rank_at({"p": "0.3"}) == 1
    assert moving.rank_at({"p": "0.3", "p_rate": 1}) == 2
    assert rank_loss(moving).condition == sp.Symbol("p_rate")


def test_frozen_rank_is_higher_than_the_time_varying_one() -> None:
    """A rotation seen by a sensor that turns with it: the output never changes, yet every frozen pair is observable."""
    angle = sp.Symbol("angle")
    A = sp.Matrix([[0, -1], [1, 0]])
    C = sp.Matrix([[sp.cos(angle), sp.sin(angle)]])
    frozen = observability_of(A, C, {}, 2)
    moving = observability_of(A, C, {angle: sp.Integer(1)}, 2)
    assert frozen.frozen and frozen.minors() == (-1,)
    assert not moving.frozen and moving.minors() == ()
    assert rank_loss(moving).always
    values = continuous_gramian(
        lambda t: np.array([[0.0, -1.0], [1.0, 0.0]]), lambda t: np.array([[np.cos(t), np.sin(t)]]), 0.0, 3.0
    )
    assert values.rank(1e-8) == 1
    assert hautus_test([[0.0, -1.0], [1.0, 0.0]], [[1.0, 0.0]]).frozen_observable


def test_a_rank_loss_condition_is_the_closed_form_with_symbolic_constants() -> None:
    s0, s1, s2, k, R, w, rate = sp.symbols("sigma0 sigma1 sigma2 kappa effective_radius wheel_speed wheel_speed_rate")
    a = k * R * w
    (det,) = observability_matrix(LATERAL).minors(symbolic=True)
    expected = (s0 - s1 * a) * (s0 + s2 * a) + s1 * (s1 + s2) * k * R * rate
    assert sp.simplify(sp.expand(det - expected)) == 0 or sp.simplify(sp.expand(det + expected)) == 0


def test_rank_drops_exactly_on_the_set_and_nowhere_beside_it() -> None:
    matrix = observability_matrix(LATERAL)
    loss = rank_loss(matrix)
    (root,) = loss.roots_inside("wheel_speed")
    assert root.is_Rational
    assert matrix.rank_at({"wheel_speed": root, "wheel_speed_rate": 0}) == 1
    assert matrix.rank_at({"wheel_speed": root + sp.Rational(1, 10**9), "wheel_speed_rate": 0}) == 2
    assert matrix.rank_at({"wheel_speed": root, "wheel_speed_rate": "0.001"}) == 2
    (hidden,) = matrix.hidden_at({"wheel_speed": root, "wheel_speed_rate": 0})
    assert hidden == sp.Matrix([1, 0])  # the bristle deflection
    (curve,) = loss.curve("wheel_speed_rate")
    at = sp.Rational(40)
    assert matrix.rank_at({"wheel_speed": at, "wheel_speed_rate": curve.subs("wheel_speed", at)}) == 1


def test_interval_over_rates_agrees_with_a_dense_scan() -> None:
    loss = rank_loss(observability_matrix(LATERAL))
    ((low, high),) = loss.interval_over_rates("wheel_speed")
    speeds = np.linspace(0.0, 180.0, 1801)
    (rate,) = loss.curve("wheel_speed_rate")
    reached = np.abs(sp.lambdify("wheel_speed", rate)(speeds)) <= 800.0
    np.testing.assert_array_equal(reached, (speeds >= float(low)) & (speeds <= float(high)))
    assert loss.interval_over_rates("wheel_speed", rates=(0, "0.5"), search=(100, 180)) == ()


def test_several_outputs_lose_rank_only_where_all_minors_vanish() -> None:
    x, y = sp.symbols("x y")
    C = sp.Matrix([[x, 0], [0, x * y], [0, x * (y - 1)]])
    loss = rank_loss(observability_of(sp.zeros(2), C, {x: sp.Integer(0), y: sp.Integer(0)}, 1))
    assert sp.simplify(loss.condition / x**2).is_number
    assert len(loss.leftover) == 2  # y and y - 1 never vanish together
    complete = rank_loss(observability_of(sp.zeros(2), sp.Matrix([[x, 0], [0, 1], [1, 0]]), {x: sp.Integer(0)}, 1))
    assert complete.leftover == ()
    assert not complete.condition.free_symbols


def test_motion_between_parameters_replaces_the_rate_symbol() -> None:
    names = {str(s) for s in observability_matrix(SPEED, motion=WHEEL_MOTION).free_symbols}
    assert names == {"wheel_speed", "wheel_acceleration", "wheel_acceleration_rate"}
    assert "wheel_speed_rate" in {str(s) for s in observability_matrix(SPEED).free_symbols}


def test_frozen_modes_say_which_mode_is_hidden_and_that_it_decays() -> None:
    modes = {m.eigenvalue: m for m in frozen_modes(LATERAL.A, LATERAL.C)}
    a = sp.Symbol("kappa") * sp.Symbol("effective_radius") * sp.Symbol("wheel_speed")
    deflection = modes[-a]
    assert sp.simplify(deflection.hidden_if - (sp.Symbol("sigma0") - sp.Symbol("sigma1") * a)) == 0
    integrator = modes[sp.Integer(0)]
    assert not integrator.always
    assert sp.solve(integrator.hidden_if, "wheel_speed") == [
        -sp.Symbol("sigma0") / (sp.Symbol("effective_radius") * sp.Symbol("kappa") * sp.Symbol("sigma2"))
    ]
    double = {m.eigenvalue: m for m in frozen_modes(SPEED.A.subs("wheel_acceleration", 0), SPEED.C)}[-a]
    assert double.always  # two eigenvectors, one output


def test_hautus_over_a_stack_finds_the_hidden_mode_and_its_decay() -> None:
    root = float(rank_loss(observability_matrix(LATERAL)).roots_inside("wheel_speed")[0])
    numeric = LATERAL.on(np.array([10.0, root, 100.0]))
    test = hautus_test(numeric.A, numeric.C)
    np.testing.assert_array_equal(test.frozen_observable, [True, False, True])
    assert test.frozen_detectable.all()
    hidden = test.eigenvalues[1][test.hidden[1]]
    np.testing.assert_allclose(hidden, -13.4 * 0.33 * root, rtol=1e-12)


def test_a_hidden_mode_that_does_not_decay_is_found() -> None:
    test = hautus_test([np.diag([-1.0, 2.0]), np.diag([-1.0, -2.0])], [[1.0, 0.0]])
    np.testing.assert_array_equal(test.frozen_detectable, [False, True])
    assert hautus_test(np.diag([0.5, 0.9]), [[1.0, 0.0]], discrete=True).frozen_detectable
    assert not hautus_test(np.diag([0.5, 1.0]), [[1.0, 0.0]], discrete=True).frozen_detectable
    assert not hautus_test(np.diag([-1.0, 0.0]), [[1.0, 0.0]]).frozen_detectable  # an integrator does not decay


def test_zero_output_hides_everything() -> None:
    assert hautus_test(-np.eye(2), np.zeros((1, 2))).hidden.all()


@pytest.mark.parametrize(
    ("A", "C", "word"),
    [
        (np.ones((2, 3)), np.ones((1, 2)), "square"),
        (np.eye(2), np.ones((1, 3)), "columns"),
        (np.array([[np.nan, 0.0], [0.0, 1.0]]), np.ones((1, 2)), "not finite"),
        (np.eye(2) * 1j, np.ones((1, 2)), "complex"),
        (np.zeros((3, 2, 2)), np.ones((2, 1, 2)), "broadcast"),
    ],
)
def test_hautus_refuses_bad_matrices(A: object, C: object, word: str) -> None:
    with pytest.raises(AnalysisError, match=word):
        hautus_test(A, C)  # type: ignore[arg-type]


def test_symbolic_bad_input_is_named() -> None:
    with pytest.raises(AnalysisError, match=r"\(2, 3\)"):
        observability_of(sp.zeros(2, 3), sp.zeros(1, 2), {}, 2)
    with pytest.raises(AnalysisError, match="blocks = 0"):
        observability_of(sp.zeros(2), sp.zeros(1, 2), {}, 0)
    with pytest.raises(AnalysisError, match="unknown parameter 'wheel_sped'"):
        observability_matrix(SPEED, motion={"wheel_sped": "wheel_acceleration"})
    matrix = observability_matrix(LATERAL)
    with pytest.raises(AnalysisError, match="no value for wheel_speed_rate"):
        matrix.rank_at({"wheel_speed": 1})
    with pytest.raises(AnalysisError, match="unknown parameter or rate 'speed'"):
        matrix.rank_at({"speed": 1})
    with pytest.raises(AnalysisError, match="not a finite number"):
        matrix.rank_at({"wheel_speed": float("nan"), "wheel_speed_rate": 0})
    with pytest.raises(AnalysisError, match="does not depend on 'wheel_sped'"):
        rank_loss(matrix).roots("wheel_sped")
    with pytest.raises(AnalysisError, match="not linear in one"):
        rank_loss(observability_matrix(SPEED, motion=WHEEL_MOTION)).interval_over_rates("wheel_speed")
    with pytest.raises(AnalysisError, match=r"\(2, 3\)"):
        frozen_modes(sp.zeros(2, 3), sp.zeros(1, 2))


@pytest.mark.parametrize("text", ["__import__('os')", "1e", "nan", "inf", "1/0", ""])
def test_numbers_from_text_are_never_evaluated(text: str) -> None:
    with pytest.raises(AnalysisError, match="not a finite number"):
        exact_number("x", text)
    assert exact_number("x", 0.1) == sp.Rational(1, 10)
    assert exact_number("x", Fraction(1, 3)) == sp.Rational(1, 3)
    with pytest.raises(AnalysisError, match="not a finite number"):
        exact_number("x", sp.Symbol("a"))


def test_continuous_gramian_of_the_ramp_is_the_closed_form() -> None:
    """V = [[T, T^2/2], [T^2/2, T^3/3]], det T^4/12, while every frozen pair has rank 1."""
    for T in (0.1, 1.0, 2.5):
        found = continuous_gramian(lambda t: np.zeros((2, 2)), lambda t: np.array([[1.0, t]]), 0.0, T)
        expected = np.array([[T, T**2 / 2], [T**2 / 2, T**3 / 3]])
        np.testing.assert_allclose(found.gramian, expected, rtol=1e-13)
        np.testing.assert_allclose(np.prod(found.singular_values), T**4 / 12, rtol=1e-12)
        assert found.rank() == 2


def test_continuous_gramian_of_a_constant_pair_solves_the_lyapunov_equation() -> None:
    A, C = np.array([[-1.0, 3.0], [-2.0, -0.5]]), np.array([[1.0, -0.3]])
    found = continuous_gramian(lambda t: A, lambda t: C, 0.0, 1.3)
    ends = found.transition.T @ C.T @ C @ found.transition - C.T @ C  # d/dt of the integrand, integrated
    np.testing.assert_allclose(A.T @ found.gramian + found.gramian @ A, ends, atol=1e-10)


def test_riding_the_rank_loss_curve_hides_a_direction_and_crossing_it_does_not() -> None:
    """The set is not a frozen artefact: held at the root the gramian is singular, driven across it is not."""
    root = float(rank_loss(observability_matrix(LATERAL)).roots_inside("wheel_speed")[0])

    def gramian(rate: float) -> int:
        def at(t: float) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[type-arg]
            numeric = LATERAL.on([root + rate * (t - 0.05)])
            return numeric.A[0], numeric.C[0]

        found = continuous_gramian(lambda t: at(t)[0], lambda t: at(t)[1], 0.0, 0.1, intervals=8)
        return int(found.rank(1e-9))

    assert gramian(0.0) == 1
    assert gramian(20.0) == 2


def test_continuous_gramian_refuses_bad_input() -> None:
    def zero(t: float) -> np.ndarray:  # type: ignore[type-arg]
        return np.zeros((2, 2))

    with pytest.raises(AnalysisError, match="start < stop"):
        continuous_gramian(zero, zero, 1.0, 1.0)
    with pytest.raises(AnalysisError, match="needs 2 columns"):
        continuous_gramian(zero, lambda t: np.zeros((1, 3)), 0.0, 1.0)
    with pytest.raises(AnalysisError, match="not finite"):
        continuous_gramian(zero, lambda t: np.full((1, 2), np.nan), 0.0, 1.0)
    with pytest.raises(AnalysisError, match="intervals = 0"):
        continuous_gramian(zero, zero, 0.0, 1.0, intervals=0)


@pytest.mark.parametrize(
    ("entry", "hidden"), [(-2.7e-15, True), (3e-13, True), (0.0, True), (1e-9, False), (-0.02, False)]
)
def test_what_cancellation_leaves_in_an_entry_is_no_sensor(entry: float, hidden: bool) -> None:
    """0.821 beside the difference of two numbers of some 400, each rounded: up to 2e-13 of it is no information."""
    test = hautus_test([[-160.0, 1.0], [0.0, 0.0]], [[entry, 0.821]])
    assert test.frozen_observable == (not hidden)
