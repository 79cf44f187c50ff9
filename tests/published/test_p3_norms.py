"""Fig. 2 of P3 and the floor under it, recomputed. References: independent recomputation by closed form and by sweep."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from scipy.optimize import brentq

from analysis.errors import AnalysisError
from analysis.norms.hinf import hinf_norm, stability_margin
from analysis.norms.observer_error import error_hinf_norm
from analysis.norms.static_gain import static_gain
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.models.parameter_set import load_parameter_set
from tests.support.level_crossing import crosses_level

BOTH = ("friction", "acceleration_error")
SPEEDS = np.linspace(0.0, 140.0, 141)


def observer(direction):
    parameters = load_parameter_set("resilient-velocity")
    gains = parameters.tire[direction].published.gains
    return corner_velocity_model(parameters, direction), np.array(gains)[:, None]


def floor(direction, speed):
    tire = load_parameter_set("resilient-velocity").tire[direction]
    a = tire.kappa.value * 0.33 * speed  # R_e of P3 Table I
    return tire.sigma0.value / (tire.sigma0.value + tire.sigma2.value * a)


def test_fig_2_longitudinal() -> None:
    """Published axis 0.9985..1; reference values of the recomputation to 1e-8."""
    model, gain = observer("longitudinal")
    found = error_hinf_norm(model, gain, SPEEDS, BOTH)
    assert found.norm.min() >= 0.9985
    assert found.norm.max() == pytest.approx(1.0, abs=5e-6)
    np.testing.assert_allclose(
        found.norm[[0, 40, 80, 140]], [1.00000465, 0.99973783, 0.99947116, 0.99907141], atol=5e-9
    )
    np.testing.assert_array_equal(found.frequency, 0.0)


def test_fig_2_lateral() -> None:
    """Published axis 0.995..1.005; values of the recomputation printed to four digits (P3 notes 4)."""
    model, gain = observer("lateral")
    both = error_hinf_norm(model, gain, SPEEDS, BOTH).norm
    printed = [1.0026, 1.0019, 1.0013, 1.0006, 1.0000, 0.9993, 0.9987, 0.9981]
    np.testing.assert_allclose(both[::20], printed, atol=5.01e-5)
    assert both.min() >= 0.995
    assert both.max() <= 1.005
    friction = error_hinf_norm(model, gain, SPEEDS, ("friction",)).norm
    printed = [1.0, 0.9993, 0.9987, 0.9980, 0.9973, 0.9967, 0.9960, 0.9953]  # 0.996649 at 100 rad/s is printed 0.9967
    np.testing.assert_allclose(friction[::20], printed, atol=5.2e-5)


def test_the_norm_is_the_static_gain_matrix() -> None:
    """Independent check: all four channels peak at zero frequency, where a 2 x 2 inverse gives the norm."""
    for direction in ("longitudinal", "lateral"):
        model, gain = observer(direction)
        A_e, B_e = model.on(SPEEDS).error_dynamics(gain)
        static = np.linalg.svd(np.linalg.solve(A_e, B_e[..., :2]), compute_uv=False)[:, 0]
        np.testing.assert_allclose(error_hinf_norm(model, gain, SPEEDS, BOTH).norm, static, rtol=1e-12)
        assert not crosses_level(A_e, B_e[..., :2], np.eye(2), None, static * (1 + 1e-8)).any()


def test_the_norm_exceeds_one_at_low_speed() -> None:
    """The text claims <= 1 for both observers: true for friction alone, false for both disturbances (claim P3-fig2-nonexp)."""
    crossings = {}
    for direction in ("longitudinal", "lateral"):
        model, gain = observer(direction)

        def excess(speed, model=model, gain=gain):
            return float(error_hinf_norm(model, gain, [speed], BOTH).norm[0]) - 1.0

        crossings[direction] = brentq(excess, 0.0, 140.0, xtol=1e-10)
        friction = error_hinf_norm(model, gain, SPEEDS, ("friction",), ("relative_velocity",)).norm
        assert (friction <= 1.0 + 1e-12).all()
    assert crossings["longitudinal"] == pytest.approx(0.697, abs=5e-4)
    assert crossings["lateral"] == pytest.approx(79.71, abs=5e-3)


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
def test_no_gain_moves_the_static_friction_gain(direction) -> None:
    """-sigma0/(sigma0 + sigma2 a) for every L, symbolically (claim P3-hinf-floor)."""
    model, _ = observer(direction)
    s0, s2, kappa, radius, speed = sp.symbols("sigma0 sigma2 kappa effective_radius wheel_speed")
    found = static_gain(model, "friction", "relative_velocity")
    assert sp.simplify(found.expression + s0 / (s0 + s2 * kappa * radius * speed)) == 0
    assert found.free_of_gain
    # negative control: the acceleration error is attenuated by the gain
    other = static_gain(model, "acceleration_error", "relative_velocity")
    assert not other.free_of_gain


@pytest.mark.parametrize("direction", ["longitudinal", "lateral"])
def test_the_floor_holds_for_random_stable_gains(direction) -> None:
    model, _ = observer(direction)
    rng = np.random.default_rng(2)
    gains = 10.0 ** rng.uniform([-2.0, 0.0], [0.5, 4.0], size=(400, 2))[..., None]
    speeds = rng.uniform(0.0, 140.0, 400)
    A_e, B_e = model.on(speeds).error_dynamics(gains)
    stable = stability_margin(A_e) < 0.0
    assert stable.sum() > 100
    norm = hinf_norm(A_e, B_e[..., :1], np.array([[0.0, 1.0]])).norm[stable]
    lowest = floor(direction, speeds[stable])
    assert (norm >= lowest * (1 - 1e-9)).all()
    assert (norm / lowest).min() == pytest.approx(1.0, abs=1e-9)  # and it is reached


def test_an_integrator_out_of_reach_has_no_static_gain() -> None:
    one, speed = sp.Integer(1), sp.Symbol("p")
    model = LpvModel(
        "hidden integrator", "made up", (Signal("x", "m"), Signal("b", "m")), (Signal("y", "m"),),
        (SchedulingParameter("p", "1", 1.0, 2.0, 0.0, 0.0),), A=sp.Matrix([[-speed, 0], [0, 0]]), C=sp.Matrix([[one, 0]]),
        disturbances=(Signal("d", "m/s"),), E=sp.Matrix([1, 1]),
    )  # fmt: skip
    with pytest.raises(AnalysisError, match="undetectable integrator"):
        static_gain(model, "d", "x")


def test_example_1_stability_margin() -> None:
    """Published -327.1 at 40 rad/s (claim P3-ex1-eig)."""
    model, gain = observer("longitudinal")
    margin = stability_margin(model.on([40.0]).error_dynamics(gain)[0])[0]
    assert margin == pytest.approx(-327.1, abs=0.05)
    assert margin == pytest.approx(-327.143005949, abs=1e-8)  # independent recomputation
