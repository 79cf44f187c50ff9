"""Models from tables and from python-control: exact where they are polynomial, honest where not, refused where they do not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import control
import numpy as np
import pytest

from synthesis.certificate.proof import prove
from synthesis.design.deploy import deploy
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.export import schedule_content
from synthesis.design.hinf_observer import Channel, ObserverDesign
from synthesis.design.sampled_observer import design_sampled_observer
from synthesis.errors import ModelError
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal

SPEED = SchedulingParameter("speed", "m/s", 1.0, 5.0, -1.0, 1.0)
LOAD = SchedulingParameter("load", "kg", -2.0, 2.0, -0.5, 0.5)
SIGNALS: dict[str, Any] = {
    "states": (Signal("x", "m"), Signal("v", "m/s")), "outputs": (Signal("y", "m"),), "inputs": (Signal("push", "N"),),
}  # fmt: skip
C = [[1.0, 0.0]]


def truth(speed: Any, load: Any = 0.0) -> np.ndarray:
    """A polynomial of degree (2, 1); its first row has the units 1/s and 1."""
    speed, load = np.broadcast_arrays(np.asarray(speed, float), np.asarray(load, float))
    one = np.ones_like(speed)
    return np.stack(
        [np.stack([0.0 * one, one], -1), np.stack([-3.0 - speed**2 + load, -speed * (1.0 + 0.1 * load)], -1)], -2
    )


def hyperbola(speed: Any) -> np.ndarray:
    """-3/speed is no polynomial."""
    speed = np.asarray(speed, float)
    return np.array([[[0.0, 1.0], [-3.0 / s, -s]] for s in speed.ravel()]).reshape(*speed.shape, 2, 2)


def own(points: Any, A: Any, parameters: Any = (SPEED,), **more: Any) -> LpvModel:
    return LpvModel.from_grid("own", "test", parameters, points, A=A, C=C, B=[[0.0], [0.5]], **SIGNALS, **more)


@pytest.mark.parametrize("shuffled", [False, True])
def test_two_parameters_are_met_exactly_between_the_points(shuffled: bool) -> None:
    """Points by their lines, or as a list in any order; units of the entries are complete."""
    lines = np.linspace(1.0, 5.0, 5), np.array([-2.0, -0.5, 1.0, 2.0])
    mesh = np.meshgrid(*lines, indexing="ij")
    A, points = truth(*mesh), np.stack(mesh, -1).reshape(-1, 2)
    if shuffled:
        order = np.random.default_rng(0).permutation(len(points))
        model = own(points[order], A.reshape(-1, 2, 2)[order], (SPEED, LOAD))
    else:
        model = own({"speed": lines[0], "load": lines[1]}, A, (SPEED, LOAD))
    assert model.disturbances == ()
    inside = np.random.default_rng(1).uniform([1.0, -2.0], [5.0, 2.0], (50, 2))
    np.testing.assert_allclose(model.on(inside).A, truth(*inside.T), rtol=1e-10, atol=1e-10)
    assert {c.unit for c in model.constants.values()} == {"m/s", "kg", "1/s**2", "1/s", "m/N/s**2"}


def test_the_residual_is_stated_and_true() -> None:
    """|Delta A| |x| at every grid point stays within the size that the disturbance has, and is nearly met at one."""
    line = np.linspace(1.0, 5.0, 17)
    model = own({"speed": line}, hyperbola(line), sizes={"x": 0.1}, tolerance=0.02)
    (error,) = model.disturbances
    assert (error.name, error.unit) == ("v_fit_error", "1")
    size = model.constants["v_fit_error_size"]
    assert size.unit in ("m/s**2", "m/s/s") and size.source == "largest residual of the fit"
    worst = 0.1 * np.abs(model.on(line).A - hyperbola(line))[:, 1, 0].max()
    assert worst <= size.value <= 1.002 * worst
    np.testing.assert_array_equal(np.array(model.on([2.0]).E[0]).ravel(), [0.0, size.value])


def test_straight_lines_between_the_points_are_bounded_everywhere() -> None:
    """Dense samples of the interpolant against the fit never exceed the bound; the points alone would promise less."""
    line = np.linspace(1.0, 5.0, 9)
    dense = np.linspace(1.0, 5.0, 2001)
    sizes, found = {"x": 1.0}, {}
    for fit in ("polynomial", "piecewise-linear"):
        model = own({"speed": line}, hyperbola(line), sizes=sizes, degree=4, tolerance=0.1, fit=fit)
        found[fit] = model.constants["v_fit_error_size"].value
    lines = np.interp(dense, line, -3.0 / line)
    worst = np.abs(model.on(dense).A[:, 1, 0] - lines).max()
    assert found["polynomial"] < worst <= found["piecewise-linear"] < 1.1 * worst


def test_from_control_and_back() -> None:
    """The labels become signals; `to_control` returns the systems that went in."""
    line = np.linspace(1.0, 5.0, 5)
    systems = [
        control.ss(
            A, [[0.0, 1.0], [0.5, 0.0]], C, [[0.0, 0.0]], states=["x", "v"], inputs=["push", "wind"], outputs=["y"]
        )
        for A in truth(line)
    ]
    model = LpvModel.from_grid(
        "own", "test", (SPEED,), {"speed": line}, systems, disturbances=(Signal("wind", "1"),), measurement_noise=True
    )
    assert [s.name for s in (*model.states, *model.inputs, *model.disturbances)] == [
        "x",
        "v",
        "push",
        "wind",
        "y_noise",
    ]
    back = model.to_control([3.0], disturbances=True)
    np.testing.assert_allclose(back.A, truth(3.0), atol=1e-10)
    np.testing.assert_allclose(back.B, [[0.0, 1.0, 0.0], [0.5, 0.0, 0.0]], atol=1e-11)
    np.testing.assert_allclose(back.D, [[0.0, 0.0, 1.0]])
    assert back.dt == 0 and back.input_labels == ["push", "wind", "y_noise"] and back.state_labels == ["x", "v"]
    poles = control.poles(model.to_control([3.0]))
    np.testing.assert_allclose(np.sort_complex(poles), np.sort_complex(np.roots([1.0, 3.0, 12.0])), rtol=1e-9)


def test_a_fitted_model_is_designed_for_and_proved_with_its_residual() -> None:
    line = np.linspace(1.0, 5.0, 17)
    model = own({"speed": line}, hyperbola(line), sizes={"x": 0.1}, tolerance=0.02, measurement_noise=True)
    channel = Channel(("v_fit_error", "y_noise"), ("v",), weights=(1.0, 0.01))
    gains = design_sampled_observer(model, ObserverDesign((channel,)), 0.01)
    proofs = prove(schedule_content(deploy(gains, DeploySettings(0.01)), "own"))
    assert all(proof.proved for proof in proofs)
    assert any("1 1 v_fit_error" in proof.claim for proof in proofs)


LINE = np.linspace(1.0, 5.0, 9)
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "beyond the tolerance": ({"A": hyperbola(LINE), "sizes": {"x": 1.0}, "tolerance": 1e-3}, r"A\[1\]\[0\] is off by"),
    "residual without sizes": ({"A": hyperbola(LINE), "tolerance": 0.1}, r"give the largest magnitude of 'x' \[m\] in sizes"),
    "unknown size": ({"sizes": {"z": 1.0}}, "sizes: unknown signal 'z'"),
    "size of zero": ({"sizes": {"x": 0.0}}, "give its largest magnitude, a positive number"),
    "falling line": ({"points": {"speed": LINE[::-1]}}, "does not rise: 5, then 4.5 m/s; sort it"),
    "twice": ({"points": np.r_[LINE[:8], LINE[7:8]]}, "speed = 4.5 m/s stands twice|covers speed from 1 to 4.5"),
    "range beyond the grid": ({"parameters": (replace(SPEED, minimum=0.0),)}, "nothing is extrapolated"),
    "unknown parameter": ({"points": {"sped": LINE}}, "unknown parameter 'sped'; did you mean speed"),
    "one value": ({"points": {"speed": [1.0]}}, "at least two values"),
    "shape": ({"A": truth(LINE)[:5]}, r"A has the shape \(5, 2, 2\); a grid of 9 points needs \(9, rows, columns\)"),
    "columns": ({"C": [[1.0]]}, r"C has \(1, 1\) entries; 1 outputs and 2 states need \(1, 2\)"),
    "not finite": ({"A": np.where(LINE[:, None, None] > 4.9, np.nan, truth(LINE))}, r"A: not finite at \[8, 0, 0\]"),
    "degree": ({"degree": 9}, "one whole number from 0 to 8"),
    "too few points": ({"degree": 3, "points": {"speed": [1.0, 5.0]}, "A": truth([1.0, 5.0])}, r"needs more points than \[2\]"),
    "fit": ({"fit": "spline"}, "fit 'spline' is not known; write polynomial or piecewise-linear"),
    "words": ({"A": "matrix"}, "is not an array of numbers"),
    "no A": ({"A": None}, "give A and C with states and outputs, or systems"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str) -> None:
    change, words = REFUSED[case]
    arguments = {"parameters": (SPEED,), "points": {"speed": LINE}, "A": truth(LINE), "C": C, **SIGNALS, **change}
    with pytest.raises(ModelError, match=words) as caught:
        LpvModel.from_grid("own", "test", **arguments)
    assert "\n" not in str(caught.value)


def test_a_grid_with_a_hole_names_the_hole() -> None:
    mesh = np.stack(np.meshgrid([1.0, 3.0, 5.0], [-2.0, 2.0], indexing="ij"), -1).reshape(-1, 2)
    with pytest.raises(ModelError, match="no grid of 3 x 2: speed = 3 m/s, load = 2 kg is missing"):
        own(np.delete(mesh, 3, 0), truth(*np.delete(mesh, 3, 0).T), (SPEED, LOAD))


def test_systems_that_are_none_are_refused() -> None:
    good = control.ss([[0.0]], [[1.0]], [[1.0]], [[0.0]])
    for systems, words in (
        ([good, control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.1)], "system 1 is discrete"),
        ([good, control.tf([1.0], [1.0, 1.0])], "must be control.StateSpace"),
        ([good, control.ss(np.eye(2), [[1.0], [1.0]], [[1.0, 0.0]], [[0.0]])], "system 1 has other sizes"),
        ([good] * 3, "3 systems for a grid of 2 points"),
    ):
        with pytest.raises(ModelError, match=words):
            LpvModel.from_grid("own", "test", (SPEED,), {"speed": [1.0, 5.0]}, systems)
    with pytest.raises(ModelError, match=r"has no inputs, which control\.StateSpace needs"):
        LpvModel.from_grid("own", "test", (SPEED,), {"speed": LINE}, A=truth(LINE), C=C, states=SIGNALS["states"],
                           outputs=SIGNALS["outputs"]).to_control([3.0])  # fmt: skip
