"""LPV models along families of trims: closed forms, a proved residual, trims that are none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

from synthesis.errors import ModelError
from synthesis.models.ball_bound import largest_magnitude
from synthesis.models.lpv import LpvModel
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.param import Constant, SchedulingParameter, Signal

g, length, mass, friction, angle, rate, torque, lean = sp.symbols("gravity length mass friction angle rate torque lean")
PENDULUM = NonlinearModel(
    "pendulum", "Newton", (Signal("angle", "rad"), Signal("rate", "rad/s")), (Signal("measured", "rad"),),
    sp.Matrix([rate, -g / length * sp.sin(angle) - friction / (mass * length**2) * rate + torque / (mass * length**2)]),
    sp.Matrix([angle]), (Signal("torque", "N*m"),),
    {"gravity": Constant(9.81, "m/s^2", "SI"), "length": Constant(0.5, "m", "ruler"), "mass": Constant(1.5, "kg", "scale"),
     "friction": Constant(0.1, "N*m*s", "test")},
)  # fmt: skip
LEAN = SchedulingParameter("lean", "rad", -1.0, 1.2, -1.0, 1.0)
TRIM = {"angle": lean, "rate": 0, "torque": mass * g * length * sp.sin(lean)}
GRID = np.linspace(-1.0, 1.2, 2001)


def linear(**more: Any) -> LpvModel:
    return LpvModel.from_jacobian(PENDULUM, (LEAN,), TRIM, **more)


def test_a_transcendental_entry_is_fitted_with_a_bound_that_holds() -> None:
    """A[1][0] = -g/l cos(lean) in closed form; the other entries stay symbolic."""
    model = linear(sizes={"angle": 0.2}, disturbances=("torque",), measurement_noise=True)
    assert [s.name for s in model.disturbances] == ["torque", "measured_noise", "rate_fit_error"]
    assert model.A[1, 1] == -friction / (length**2 * mass) and model.E[1, 0] == 1 / (length**2 * mass)
    worst = 0.2 * np.abs(model.on(GRID).A[:, 1, 0] + 9.81 / 0.5 * np.cos(GRID)).max()
    assert 0.0 < worst <= model.constants["rate_fit_error_size"].value < 1.3 * worst


def test_close_enough_is_exact() -> None:
    model = linear(tolerance=1e-9)
    assert model.disturbances == ()
    np.testing.assert_allclose(model.on(GRID).A[:, 1, 0], -19.62 * np.cos(GRID), rtol=0, atol=2e-8)


def test_rational_jacobians_stay_as_they_are() -> None:
    """x' = -x^3 + u at x = p: A = -3 p^2, by hand, without a constant of a fit."""
    x, u, p = sp.symbols("x u p")
    f, h = sp.Matrix([u - x**3]), sp.Matrix([x / (1 + x**2)])
    cubic = NonlinearModel("cubic", "test", (Signal("x", "1"),), (Signal("y", "1"),), f, h, (Signal("u", "1"),))
    model = LpvModel.from_jacobian(cubic, (SchedulingParameter("p", "1", 1.0, 2.0, -1.0, 1.0),), {"x": p, "u": p**3})
    assert sp.Matrix([[-3 * p**2]]) == model.A and sp.Matrix([[1]]) == model.B and not model.constants
    assert sp.simplify(model.C[0] - (1 - p**2) / (1 + p**2) ** 2) == 0


@pytest.mark.parametrize(
    ("trim", "more", "words"),
    [
        ({"torque": 0}, {}, r"no equilibrium: d rate/dt = .* \(rad/s\)/s at lean = .*or name 'rate' in drifting"),
        ({"rate": 1}, {}, "no equilibrium: d angle/dt = 1 "),
        ({"torqe": 0}, {}, "unknown state or input 'torqe'; did you mean torque"),
        ({"torque": sp.Symbol("wind")}, {}, "trim of torque: wind is neither a scheduling parameter nor a constant"),
        ({}, {"disturbances": ("wind",)}, "disturbances: unknown input 'wind'"),
        ({}, {"drifting": ("wind",)}, "drifting: unknown state 'wind'"),
        ({}, {"degree": 1}, r"A\[1\]\[0\] = -gravity\*cos\(lean\)/length is off by .* degree 1; give a higher degree"),
        ({}, {}, "give the largest magnitude of 'angle'"),
    ],
)  # fmt: skip
def test_refused(trim: dict[str, Any], more: dict[str, Any], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        LpvModel.from_jacobian(PENDULUM, (LEAN,), {**TRIM, **trim}, **more)


def test_missing_and_drifting() -> None:
    with pytest.raises(ModelError, match="no value for torque; give a number or an expression"):
        LpvModel.from_jacobian(PENDULUM, (LEAN,), {"angle": lean, "rate": 0})
    moving = {**TRIM, "rate": 1, "torque": TRIM["torque"] + friction}
    assert LpvModel.from_jacobian(PENDULUM, (LEAN,), moving, drifting=("angle",), tolerance=1e-9).A[0, 1] == 1


@pytest.mark.parametrize(
    ("text", "box", "wanted"),
    [
        (sp.sin(lean), [(-1.0, 4.0)], 1.0),
        (lean**6, [(-1.0, 1.0)], 1.0),  # all derivatives but the last vanish in the middle
        (sp.exp(-lean) - lean**2, [(-1.0, 2.0)], 4.0 - np.exp(-2.0)),
        (sp.sqrt(lean + 1) * sp.atan(rate), [(0.0, 3.0), (-1.0, 1.0)], 2.0 * np.pi / 4),
        (sp.cos(lean) - 1 + lean**2 / 2, [(-0.1, 0.1)], 1 - np.cos(0.1) - 0.005),
        (sp.log(lean), [(-1.0, 1.0)], np.inf),
    ],
)  # fmt: skip
def test_bounds_hold_and_are_close(text: sp.Expr, box: list[tuple[float, float]], wanted: float) -> None:
    bound = largest_magnitude(text, [lean, rate][: len(box)], box)
    assert abs(wanted) <= bound <= (1.26 * abs(wanted) if np.isfinite(wanted) else np.inf)
