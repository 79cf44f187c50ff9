"""Lie-derivative rank on models whose observability is known, and the models of the catalogue."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import sympy as sp
from flint import ctx

from analysis.errors import AnalysisError
from analysis.observability.lie_rank import LieRankTest
from analysis.observability.lie_series import series_arithmetic
from analysis.observability.lie_structure import generic_rank
from synthesis.errors import ModelError
from synthesis.models.catalogue.four_wheel import SUBSTITUTES, four_wheel_model
from synthesis.models.catalogue.longitudinal_speed import longitudinal_speed_model
from synthesis.models.catalogue.planar_force import planar_force_model
from synthesis.models.catalogue.single_track import axle_force_model
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.param import Constant, Signal
from synthesis.models.parameter_set import load_parameter_set


def model(f: list[object], h: list[object], inputs: tuple[str, ...] = ()) -> NonlinearModel:
    """States x0, x1, ... without units."""
    return NonlinearModel(
        name="test",
        source="made up",
        states=tuple(Signal(f"x{i}", "1") for i in range(len(f))),
        outputs=tuple(Signal(f"y{i}", "1") for i in range(len(h))),
        inputs=tuple(Signal(name, "1") for name in inputs),
        f=sp.Matrix(f),
        h=sp.Matrix(h),
    )


x0, x1, x2, u = sp.symbols("x0 x1 x2 u")


def test_a_linear_model_has_its_kalman_rank() -> None:
    random = np.random.default_rng(5)
    for hidden in (0, 1, 2):
        A = random.integers(-3, 4, (4, 4))
        A[: 4 - hidden, 4 - hidden :] = 0  # the last states do not reach the others
        C = np.array([[1, 0, 0, 0]])
        kalman = sp.Matrix.vstack(*[sp.Matrix(C) * sp.Matrix(A) ** k for k in range(4)])
        states = sp.symbols("x0:4")
        found = LieRankTest(model(list(sp.Matrix(A) * sp.Matrix(states)), [states[0]])).at(
            {f"x{i}": random.integers(1, 9).item() for i in range(4)}
        )
        assert found.rank == kalman.rank()
        np.testing.assert_allclose(np.array(kalman, float) @ found.unseen, 0.0, atol=1e-10)


def test_symbolic_lie_derivatives_are_the_second_road() -> None:
    """Gradients of L_f^k h by sympy against the power series, with a moving input."""
    f, h = [x1 * sp.sin(x0) + u, sp.exp(-x0) - x1**3], sp.atan(x0 * x1)
    test = LieRankTest(model(f, [h], ("u",)), order=3)
    found = test.at({"x0": "0.3", "x1": "0.7"}, {"u": ["0.2", "-1.1", "0.4", 0]})
    jets = sp.symbols("u u1 u2 u3")
    expression, rows = h, []
    point = dict(zip((x0, x1, *jets), map(sp.Rational, ("0.3", "0.7", "0.2", "-1.1", "0.4", "0")), strict=True))
    for k in range(4):
        rows.append([float(sp.diff(expression, s).subs(point)) / float(sp.factorial(k)) for s in (x0, x1)])
        expression = sum(sp.diff(expression, s) * v for s, v in zip((x0, x1), f, strict=True)) + sum(
            sp.diff(expression, a) * b for a, b in pairwise(jets)
        )
    np.testing.assert_allclose([[float(e.mid()) for e in row] for row in found.rows], rows, rtol=1e-13)


def test_rank_depends_on_the_input() -> None:
    """x1 is seen only while u moves it into the output."""
    test = LieRankTest(model([u * x1, 0], [x0], ("u",)))
    assert test.at({"x0": 1, "x1": 1}, {"u": 1}).rank == 2
    still = test.at({"x0": 1, "x1": 1}, {"u": 0})
    assert still.rank == 1 and still.deficiency == 1
    np.testing.assert_allclose(np.abs(still.unseen.ravel()), [0.0, 1.0], atol=1e-15)
    assert LieRankTest(test.model, order=2).at({"x0": 1, "x1": 1}, {"u": [0, 1]}).rank == 2


def test_singular_point_within_an_observable_model() -> None:
    test = LieRankTest(model([0, 0], [x0, x0 * x1]))
    assert test.at({"x0": 1, "x1": 5}).rank == 2
    assert test.at({"x0": 0, "x1": 5}).rank == 1
    assert generic_rank(test.model, {"x0": (-1, 1), "x1": (-1, 1)}).rank == 2


def test_structural_directions_are_found_and_proved_with_their_dynamics() -> None:
    """y sees x0 and x1 + 2 x2 only; the direction (0, -2, 1) lives on at the rate -3."""
    total = x1 + 2 * x2
    found = generic_rank(
        model([total**2 - x0, -3 * x1 + sp.sin(total), -3 * x2 + x0], [x0]), {f"x{i}": (-1, 1) for i in range(3)}
    )
    assert found.rank == 2
    assert found.structure.proved
    assert found.structure.basis in (sp.Matrix([0, -2, 1]), sp.Matrix([0, 1, sp.Rational(-1, 2)]))
    assert found.structure.dynamics == sp.Matrix([[-3]])
    assert "x1" in found.structure.describe()[0]


def test_a_hidden_direction_that_turns_with_the_state_is_not_called_structural() -> None:
    """y = x0^2 + x1^2, x' = 0: one direction is lost everywhere, but never the same one."""
    found = generic_rank(model([0, 0], [x0**2 + x1**2]), {"x0": (0.1, 1), "x1": (0.1, 1)})
    assert found.rank == 1
    assert found.structure.basis.cols == 0


def test_series_settings_of_flint_are_restored_also_after_an_error() -> None:
    before = ctx.cap, ctx.prec
    with pytest.raises(ZeroDivisionError), series_arithmetic(3, 100):
        assert (ctx.cap, ctx.prec) == (3, 100)
        raise ZeroDivisionError
    assert (ctx.cap, ctx.prec) == before


def test_singular_points_are_named() -> None:
    with pytest.raises(AnalysisError, match="x1 = 0 divides"):
        LieRankTest(model([1 / x1, 0], [x0])).at({"x0": 1, "x1": 0})
    with pytest.raises(AnalysisError, match="no Taylor series"):
        LieRankTest(model([sp.log(x1), 0], [x0])).at({"x0": 1, "x1": -1})
    with pytest.raises(AnalysisError, match="switching surface"):
        LieRankTest(model([sp.Piecewise((x1, x0 < 0), (2 * x1, True)), 0], [x0])).at({"x0": 0, "x1": 1})
    with pytest.raises(AnalysisError, match="'gamma' has no series"):
        LieRankTest(model([sp.gamma(x1), 0], [x0])).at({"x0": 1, "x1": 1})
    with pytest.raises(AnalysisError, match="no Taylor series"):
        LieRankTest(model([x1 ** sp.Rational(1, 3), 0], [x0])).at({"x0": 1, "x1": -1})
    with pytest.raises(AnalysisError, match="no Taylor series"):
        LieRankTest(model([x0**x1, 0], [x0])).at({"x0": 0, "x1": 1})


@pytest.mark.parametrize(
    ("state", "inputs", "word"),
    [
        ({"x0": 1}, {"u": 0}, "no value for state x1"),
        ({"x0": 1, "x1": 1, "x9": 2}, {"u": 0}, "unknown state 'x9'"),
        ({"x0": 1, "x1": 1}, {}, "no value for input u"),
        ({"x0": 1, "x1": 1}, {"u": []}, "no value for input u"),
        ({"x0": 1, "x1": float("inf")}, {"u": 0}, "not a finite number"),
        ({"x0": 1, "x1": sp.sqrt(2)}, {"u": 0}, "irrational"),
        ({"x0": 1, "x1": "u"}, {"u": 0}, "not a finite number"),
    ],
)
def test_bad_points_are_refused(state: dict[str, object], inputs: dict[str, object], word: str) -> None:
    with pytest.raises(AnalysisError, match=word):
        LieRankTest(model([u * x1, 0], [x0], ("u",))).at(state, inputs)  # type: ignore[arg-type]


def test_bad_settings_are_refused() -> None:
    plain = model([x1, 0], [x0])
    with pytest.raises(AnalysisError, match="order = -1"):
        LieRankTest(plain, order=-1)
    with pytest.raises(AnalysisError, match="no range for 'x1'"):
        generic_rank(plain, {"x0": (0, 1)})
    with pytest.raises(AnalysisError, match="reversed"):
        generic_rank(plain, {"x0": (0, 1), "x1": (1, 0)})
    with pytest.raises(AnalysisError, match="samples = 0"):
        generic_rank(plain, {"x0": (0, 1), "x1": (0, 1)}, samples=0)


def test_a_nonlinear_model_refuses_to_exist_half_defined() -> None:
    with pytest.raises(ModelError, match=r"symbol\(s\) a are neither"):
        model([sp.Symbol("a"), 0], [x0])
    with pytest.raises(ModelError, match="f has the shape"):
        NonlinearModel("m", "s", (Signal("x0", "1"),), (Signal("y", "1"),), sp.zeros(2, 1), sp.Matrix([x0]))
    with pytest.raises(ModelError, match="no source"):
        NonlinearModel("m", " ", (Signal("x0", "1"),), (Signal("y", "1"),), sp.Matrix([0]), sp.Matrix([x0]))
    with pytest.raises(ModelError, match="twice"):
        NonlinearModel(
            "m", "s", (Signal("x0", "1"),), (Signal("y", "1"),), sp.Matrix([0]), sp.Matrix([x0]),
            constants={"x0": Constant(1.0, "1", "s")},
        )  # fmt: skip
    with pytest.raises(ModelError, match=r"constant\(s\) track are missing"):
        four_wheel_model({k: v for k, v in SUBSTITUTES.items() if k != "track"})
    bare = load_parameter_set("corner-estimation").model_copy(update={"vehicle": {}})
    with pytest.raises(ModelError, match=r"no vehicle\.mass"):
        planar_force_model(bare)
    with pytest.raises(ModelError, match=r"no vehicle\.effective_radius"):
        longitudinal_speed_model(bare)
    with pytest.raises(ModelError, match="unknown constant 'mass'"):
        axle_force_model({})
    with pytest.raises(ModelError, match="force_sign = 2"):
        four_wheel_model(force_sign=2)


def test_linearisation_agrees_with_differences_and_names_missing_values() -> None:
    m = model([x0 * x1 + u**2, sp.sin(x0)], [x0 * x1], ("u",))
    A, B, C, D = m.linearised({"x0": 0.4, "x1": -2.0, "u": 0.3})
    np.testing.assert_allclose(A, [[-2.0, 0.4], [np.cos(0.4), 0.0]], rtol=1e-14)
    np.testing.assert_allclose(B, [[0.6], [0.0]], rtol=1e-14)
    np.testing.assert_allclose(C, [[-2.0, 0.4]], rtol=1e-14)
    assert (D == 0.0).all()
    with pytest.raises(ModelError, match="finite value for u"):
        m.linearised({"x0": 0.4, "x1": -2.0})
    with pytest.raises(ModelError, match="unknown state or input 'v'"):
        m.linearised({"x0": 0.4, "x1": -2.0, "v": 0.3})
    with pytest.raises(ModelError, match="no derivative"):
        model([1 / x0], [x0]).linearised({"x0": 0.0})
