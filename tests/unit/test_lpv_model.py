"""The symbolic model type: what it refuses, and that its numbers are those of the symbols."""

from __future__ import annotations

import dataclasses
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from estimators.errors import GainsmithError
from synthesis.design.export import formula
from synthesis.errors import ModelError
from synthesis.models.formula import parse, read
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Constant, SchedulingParameter, Signal
from tests.support.lmi_cases import corner, parameter, small_model

p, q, k, m = sp.symbols("p q k m")


def mass_spring_damper() -> LpvModel:
    """A model of one's own: stiffness between 50 and 200 N/m, changing by at most 30 N/m a second."""
    stiffness, mass, damping = sp.symbols("stiffness mass damping")
    return LpvModel(
        name="mass-spring-damper",
        source="any textbook: m x'' + c x' + k x = f",
        states=(Signal("position", "m"), Signal("velocity", "m/s")),
        inputs=(Signal("force", "N"),),
        outputs=(Signal("measured_position", "m"),),
        disturbances=(Signal("force_error", "N"), Signal("noise", "m")),
        parameters=(SchedulingParameter("stiffness", "N/m", 50.0, 200.0, -30.0, 30.0),),
        constants={"mass": Constant(2.0, "kg", "weighed"), "damping": Constant(3.0, "N*s/m", "measured")},
        A=sp.Matrix([[0, 1], [-stiffness / mass, -damping / mass]]),
        B=sp.Matrix([0, 1 / mass]),
        C=sp.Matrix([[1, 0]]),
        E=sp.Matrix([[0, 0], [1 / mass, 0]]),
        F=sp.Matrix([[0, 1]]),
    )


def test_own_model_has_the_closed_form_poles() -> None:
    stiffness = np.array([50.0, 87.5, 200.0])
    numeric = mass_spring_damper().on(stiffness)
    decay, frequency = 0.75, np.sqrt(stiffness / 2.0 - 0.75**2)
    poles = np.sort_complex(np.linalg.eigvals(numeric.A))
    np.testing.assert_allclose(poles[:, 1], -decay + 1j * frequency, rtol=1e-13)
    np.testing.assert_allclose(numeric.B[0], [[0.0], [0.5]])
    np.testing.assert_allclose(numeric.D, np.zeros((3, 1, 1)))  # B, D, E, F default to zero


def test_error_dynamics_are_those_of_the_definition() -> None:
    numeric = mass_spring_damper().on([60.0, 120.0])
    gain = np.array([[2.0], [5.0]])
    A_e, B_e = numeric.error_dynamics(gain)
    for i in range(2):
        np.testing.assert_allclose(A_e[i], numeric.A[i] - gain @ numeric.C[i])
        np.testing.assert_allclose(B_e[i], [[0.0, -2.0], [0.5, -5.0]])
    per_point, _ = numeric.error_dynamics(np.stack([gain, 2.0 * gain]))
    np.testing.assert_allclose(per_point[1], numeric.A[1] - 2.0 * gain @ numeric.C[1])


def refused(message: str, **changes: Any) -> Any:
    return pytest.param(changes, message, id=message)


HALF_DEFINED = [
    refused("symbol(s) k are neither parameter nor constant", A=[[k, 1], [-p, -1]]),
    refused("shape (2, 3)", A=[[0, 1, 0], [-p, -1, 0]]),
    refused("C has the shape (1, 3)", C=[[1, 0, p]], outputs=(Signal("y1", "1"),), A=[[0, 1], [-p, -1]]),
    refused("F has the shape (1, 2)", E=[[0], [1]], F=[[1, 1]]),
    refused("uses the name(s) x1 twice", states=(Signal("x1", "1"), Signal("x1", "1"))),
    refused("uses the name(s) y1 twice", states=(Signal("x1", "1"), Signal("y1", "1"))),
    refused("uses the name(s) p twice", constants={"p": Constant(1.0, "1", "made")}),
    refused("has no source", source="  "),
    refused("appear in no matrix", parameters=(parameter(), parameter("idle"))),
    refused("needs at least one state", states=()),
    refused("needs at least one state and one output", outputs=()),
    refused("A[1,0] = -sin(p) is neither polynomial nor rational", A=[[0, 1], [-sp.sin(p), -1]]),
    refused("exp(p) is neither polynomial nor rational", A=[[0, 1], [-sp.exp(p), -1]]),
    refused("Abs(p) is neither polynomial nor rational", A=[[0, 1], [-sp.Abs(p), -1]]),
    refused("sqrt(p) is neither polynomial nor rational", A=[[0, 1], [-sp.sqrt(p), -1]]),
    refused("denominator vanishes at the middle", A=[[0, 1], [-1 / p, -1]]),
    refused("denominator vanishes inside the range, near p = 0.5", A=[[0, 1], [-1 / (p - sp.Rational(1, 2)) ** 2, -1]]),
    refused("denominator vanishes inside the range", A=[[0, 1], [-1 / (p + 1), -1]]),  # at the very end
    refused("denominator vanishes inside the range, ", A=[[0, 1], [-1 / (3 * p - 1), -1]]),
]


@pytest.mark.parametrize(("changes", "message"), HALF_DEFINED)
def test_half_defined_models_do_not_exist(changes: dict[str, Any], message: str) -> None:
    given_ = {"A": [[0, 1], [-p, -1]], "C": [[1, 0]]} | changes
    with pytest.raises(ModelError) as error:
        small_model(given_.pop("A"), given_.pop("C"), **given_)
    assert message in str(error.value)


def test_a_denominator_that_stays_away_from_zero_is_accepted() -> None:
    model = small_model([[0, 1], [-1 / (p + sp.Rational(101, 100)), -1]], [[1, 0]])
    assert not model.polynomial.is_polynomial
    np.testing.assert_allclose(model.on([-1.0]).A[0, 1, 0], -100.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("p", "1", 0.0, np.inf, -1.0, 1.0), "is not finite; bound it"),
        (("p", "1", np.nan, 1.0, -1.0, 1.0), "is not finite; bound it"),
        (("p", "1", 1.0, 0.0, -1.0, 1.0), "is empty or reversed"),
        (("p", "1", 1.0, 1.0, -1.0, 1.0), "is empty or reversed"),
        (("p", "1", 0.0, 1.0, 1.0, 2.0), "must contain 0"),
        (("p", "1", 0.0, 1.0, 1.0, -1.0), "must contain 0"),
        (("p", "1", 0.0, 1.0, np.nan, 1.0), "a rate bound is not a number"),
        (("p", "rad/sec^^2", 0.0, 1.0, -1.0, 1.0), "is not a unit"),
        (("p", "furlongz", 0.0, 1.0, -1.0, 1.0), "'furlongz' is not a unit"),
        (("p", "", 0.0, 1.0, -1.0, 1.0), "the unit is missing; write '1'"),
        (("p", "1", -1.0, 1.0, -1.0, 1.0, True), "enters as absolute value"),
    ],
)
def test_scheduling_parameters_are_bounded(arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ModelError) as error:
        SchedulingParameter(*arguments)
    assert message in str(error.value)
    assert "'p'" in str(error.value)


def test_units_of_signals_and_constants_are_checked() -> None:
    with pytest.raises(ModelError, match=r"signal 'speed': 'mps2' is not a unit"):
        Signal("speed", "mps2")
    with pytest.raises(ModelError, match="finite number"):
        Constant(float("nan"), "1", "nowhere")
    with pytest.raises(ModelError, match="not a unit"):
        Constant(1.0, "no-such-unit", "nowhere")


@pytest.mark.parametrize("value", [-1.1, 1.1, np.nan, np.inf, -np.inf])
def test_grid_outside_the_range_is_refused_with_the_place(value: float) -> None:
    model = small_model([[-1 - p]], [[1]])
    with pytest.raises(ModelError, match=r"is outside \[-1, 1\] 1 \(grid point 2\)"):
        model.on([0.0, 0.5, value])


def test_grid_of_a_wrong_shape_is_refused() -> None:
    model = small_model([[-1 - p * q]], [[1]], (parameter("p"), parameter("q")))
    with pytest.raises(ModelError, match="does not fit 2 parameters"):
        model.on([0.0, 0.5, 0.7])
    assert model.on([0.0, 0.5]).A.shape == (1, 1, 1)


def test_numbers_are_read_only_and_the_model_frozen() -> None:
    model = small_model([[-1 - p]], [[1]], E=[[1]])
    grid = np.array([0.0, 0.5])
    numeric = model.on(grid)
    grid[0] = 0.7  # the caller's array stays the caller's
    assert numeric.points[0, 0] == 0.0
    for field in dataclasses.fields(numeric):
        array = getattr(numeric, field.name)
        assert array.dtype == np.float64
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        model.name = "other"  # type: ignore[misc]


def test_with_range_keeps_everything_else() -> None:
    model = small_model([[-2 - p]], [[1]])
    wider = model.with_range("p", -1.5, 3.0)
    np.testing.assert_allclose(wider.on([3.0]).A, [[[-5.0]]])
    with pytest.raises(ModelError, match="outside"):
        model.on([3.0])
    with pytest.raises(ModelError, match=r"unknown parameter 'pp'; did you mean p\?"):
        model.with_range("pp", 0.0, 1.0)
    with pytest.raises(ModelError, match="vanishes"):  # the check is made again for the new range
        small_model([[-1 / (p + 2)]], [[1]]).with_range("p", -3.0, 1.0)


RATIONAL = {
    "A": [[-p * k / (2 + q), 1 - p**2], [(p * q - 1) / (p + 3) ** 2, -m * q**3]],
    "B": [[1 / (p + 3)], [q]],
    "C": [[1 + p, q / (2 + q)]],
    "E": [[p], [1]],
    "F": [[k * p * q]],
}
CONSTANTS = {"k": Constant(0.7, "1", "made"), "m": Constant(-1.25, "1", "made")}


def rational_model() -> LpvModel:
    return small_model(
        RATIONAL["A"], RATIONAL["C"], (parameter("p"), parameter("q", -1.0, 2.0)), constants=CONSTANTS,
        **{key: RATIONAL[key] for key in ("B", "E", "F")},
    )  # fmt: skip


MODEL = rational_model()
LAMBDIFIED = {key: sp.lambdify((p, q, k, m), sp.Matrix(RATIONAL[key]), "numpy") for key in RATIONAL}


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 2.0)), min_size=1, max_size=5))
def test_numbers_equal_sympy_at_random_points(points: list[tuple[float, float]]) -> None:
    numeric = MODEL.on(np.array(points))
    for i, (first, second) in enumerate(points):
        for key, function in LAMBDIFIED.items():
            expected = np.array(function(first, second, 0.7, -1.25), float)
            np.testing.assert_allclose(getattr(numeric, key)[i], expected, rtol=1e-11, atol=1e-12)


def test_extracted_coefficients_are_those_of_the_symbols() -> None:
    poly = MODEL.polynomial
    u, v = p, (q - sp.Rational(1, 2)) / sp.Rational(3, 2)  # the scaled parameters of [-1, 1] and [-1, 2]
    below = sum(sp.Float(c) * u**i * v**j for (i, j), c in np.ndenumerate(poly.denominator[..., 0, 0]))
    for key in RATIONAL:
        array = getattr(poly, key)
        for row, column in np.ndindex(array.shape[2:]):
            above = sum(sp.Float(c) * u**i * v**j for (i, j), c in np.ndenumerate(array[..., row, column]))
            exact = sp.Matrix(RATIONAL[key])[row, column].subs({k: sp.Rational("0.7"), m: sp.Rational("-1.25")})
            difference = sp.Poly(sp.expand(sp.numer(sp.together(above - exact * below))), p, q)
            assert max((abs(float(c)) for c in difference.coeffs()), default=0.0) < 1e-12
    assert float(below.subs({p: 0, q: sp.Rational(1, 2)})) == pytest.approx(1.0)  # one at the middle of the box


def test_scaled_states_keep_poles_and_transfer_function() -> None:
    model = mass_spring_damper()
    scale = np.array([30.0, 0.2])
    scaled = model.polynomial.with_states_scaled(scale)
    T = np.diag(scale)
    plain = model.polynomial
    np.testing.assert_allclose(scaled.A[0], T @ plain.A[0] @ np.linalg.inv(T))
    np.testing.assert_allclose(scaled.E[0], T @ plain.E[0])
    for time in (0.1, 1.0):
        response = scaled.C[0] @ expm((scaled.A[0] + 100.0 * scaled.A[1]) * time) @ scaled.B[0]
        expected = plain.C[0] @ expm((plain.A[0] + 100.0 * plain.A[1]) * time) @ plain.B[0]
        np.testing.assert_allclose(response, expected, rtol=1e-12)


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
def test_corner_error_matrix_is_affine_as_in_26(direction: Any) -> None:
    """P1 (26) with the missing 1 of entry (1,2) put back: A_e = A0 + omega A1."""
    model, published = corner("corner-estimation", direction)
    assert published.gains is not None
    s0, s1, s2, kappa, radius = (
        model.constants[name].value for name in ("sigma0", "sigma1", "sigma2", "kappa", "effective_radius")
    )
    L1, L2 = published.gains
    A0 = np.array([[-L1 * s0, 1.0 - L1 * (s1 + s2)], [-L2 * s0, -L2 * (s1 + s2)]])
    A1 = kappa * radius * np.array([[L1 * s1 - 1.0, 0.0], [L2 * s1, 0.0]])
    omega = np.linspace(0.0, 180.0, 7)
    A_e, B_e = model.on(omega).error_dynamics(np.array([[L1], [L2]]))
    np.testing.assert_allclose(A_e, A0 + omega[:, None, None] * A1, rtol=1e-12)
    expected = [[1.0 - L1 * s1, 0.0, -L1], [-L2 * s1, 1.0, -L2]]  # (25), (39) and the force noise
    np.testing.assert_allclose(B_e, np.broadcast_to(expected, (7, 2, 3)), rtol=1e-12)


def test_corner_model_needs_what_it_needs() -> None:
    from synthesis.models.catalogue.corner import corner_velocity_model
    from synthesis.models.parameter_set import load_parameter_set

    values = load_parameter_set("corner-estimation")
    with pytest.raises(GainsmithError, match="unknown tire direction 'vertical'"):
        corner_velocity_model(values, "vertical")  # type: ignore[arg-type]
    bare = values.model_copy(update={"vehicle": {}})
    with pytest.raises(GainsmithError, match="effective_radius"):
        corner_velocity_model(bare, "lateral")


def test_model_without_parameters_is_a_constant_one() -> None:
    model = LpvModel(
        name="lag",
        source="closed form",
        states=(Signal("x", "m"),),
        outputs=(Signal("y", "m"),),
        parameters=(),
        constants={"rate": Constant(2.0, "1/s", "chosen")},
        A=sp.Matrix([[-sp.Symbol("rate")]]),
        C=sp.Matrix([[1]]),
    )
    numeric = model.on(np.zeros((1, 0)))
    assert numeric.A.tolist() == [[[-2.0]]]
    assert numeric.C.tolist() == [[[1.0]]]


@pytest.mark.parametrize(
    ("entry", "at"),
    [
        (sp.sqrt(2), 1.5 * 2**0.5),
        (sp.pi, 1.5 * np.pi),
        (sp.sin(1), 1.5 * np.sin(1.0)),
        (sp.root(2, 3), 1.5 * 2 ** (1 / 3)),
    ],
)
def test_irrational_numbers_are_taken_at_17_digits_and_written_so(entry: sp.Expr, at: float) -> None:
    p = sp.Symbol("p")
    model = LpvModel(
        "irrational", "test", states=(Signal("x", "1"),), outputs=(Signal("y", "1"),),
        parameters=(SchedulingParameter("p", "1", 1.0, 2.0, -1.0, 1.0),), A=sp.Matrix([[-entry * p]]), C=sp.Matrix([[1]]),
    )  # fmt: skip
    assert float(model.on([1.5]).A[0, 0, 0]) == pytest.approx(-at, rel=1e-15)
    written = formula(model.A[0, 0], model)
    value = read(parse(written, "A"), written, {"p": Fraction(3, 2)}, Fraction, "A")
    assert float(value) == pytest.approx(-at, rel=1e-15)
