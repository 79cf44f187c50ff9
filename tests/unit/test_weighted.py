"""Dynamic weights in series: against products of frequency responses, and weights that are none."""

from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest
import sympy as sp

from estimators.arrays import FloatArray
from synthesis.errors import ModelError
from synthesis.models.lpv import LpvModel
from synthesis.models.weighted import weighted
from tests.support.lmi_cases import parameter, small_model

p = sp.Symbol("p")
PLANT = small_model(
    [[0, 1], [-2 - p, -1]], [[1, p]], [parameter(rate=np.inf)], B=[[0], [1]], D=[[sp.Rational(1, 2)]],
    E=[[1, 0], [0, 1]], F=[[0, 3]],
)  # fmt: skip
SLOW, LEAD, SHAPING = control.tf([0.3, 1.2], [1, 0.04]), control.tf([1, 1], [0.01, 2]), control.tf([5], [1, 2, 9])
FREQUENCIES = np.array([0.0, 0.3, 2.0, 50.0])
SIGNALS = ("x1", "x2", "y1", "u1")


def response(model: LpvModel, place: float) -> dict[str, FloatArray]:
    """Of states, outputs and inputs, by name, to u and all disturbances: (frequencies, 1 + nd)."""
    at, n = model.on([place]), len(model.states)
    resolvent = np.linalg.inv(1j * FREQUENCIES[:, None, None] * np.eye(n) - at.A[0])
    x = resolvent @ np.hstack([at.B[0], at.E[0]])
    y = at.C[0] @ x + np.hstack([at.D[0], at.F[0]])
    u = np.broadcast_to(np.eye(1, x.shape[2]), (len(x), 1, x.shape[2]))
    names = [s.name for group in (model.states, model.outputs, model.inputs) for s in group]
    return {name: np.concatenate([x, y, u], axis=1)[:, i] for i, name in enumerate(names)}


@pytest.mark.parametrize("signal", SIGNALS)
def test_weighted_signals_are_products_of_frequency_responses(signal: str) -> None:
    """v = W s at a state, an output with feedthrough and an input; d2 passes a shaping filter first."""
    model = weighted(PLANT, {signal: SLOW, "u1" if signal != "u1" else "y1": LEAD, "d2": SHAPING})
    plain, shaped = response(PLANT, 0.4), response(model, 0.4)
    weights = {name: np.array([complex(w(1j * f)) for f in FREQUENCIES])[:, None] for name, w in
               (("slow", SLOW), ("lead", LEAD), ("shaping", SHAPING))}  # fmt: skip
    before = np.concatenate([np.ones((4, 2)), weights["shaping"]], axis=1)
    np.testing.assert_allclose(shaped["x1"], plain["x1"] * before, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        shaped[f"{signal}_weighted"], weights["slow"] * plain[signal] * before, rtol=1e-9, atol=1e-12
    )
    assert model.outputs[0].name == "y1" and len(model.states) == 2 + 1 + 1 + 2
    assert model.disturbances == PLANT.disturbances and model.parameters == PLANT.parameters


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        ({"x3": SLOW}, "x3"),
        ({"x1": control.tf([1, 0, 0], [1, 1])}, "no proper linear system"),
        ({"x1": control.ss([[-1.0]], [[1.0, 2.0]], [[1.0]], [[0.0, 0.0]])}, "2 inputs"),
        ({"x1": control.tf([1], [1, 0.5], 0.1)}, "continuous time"),
        ({"x1": "fast"}, "no proper linear system"),
    ],
)
def test_what_is_no_weight_is_refused(weights: dict[str, Any], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        weighted(PLANT, weights)
