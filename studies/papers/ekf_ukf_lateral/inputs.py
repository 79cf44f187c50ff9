"""What the claims of P4 start from: the models, the car that stands for the unprinted one, and a bend."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any, Literal

import numpy as np
import sympy as sp

from estimators.sideslip import FourWheel
from synthesis.models.catalogue.four_wheel import SUBSTITUTES, four_wheel_model
from synthesis.models.nonlinear import NonlinearModel

PACKAGE = "studies.papers.ekf_ukf_lateral"
CAR = FourWheel(**{name: constant.value for name, constant in SUBSTITUTES.items()})  # P4 notes 1
SUBSTITUTES_NOTE = (
    "P4 prints no vehicle, tire, covariance or initial values. Mass, yaw inertia, axle distances and stiffnesses are those "
    "that P5 prints for the same car (halved per tire); track 1.5 m, relaxation lengths 0.5 m and friction 1 are chosen."
)
# A left bend at 20 m/s and about 0.5 g: loads and forces are larger on the right. In exact numbers, and as arrays.
STATE: Mapping[str, Any] = {
    "yaw_rate": "0.25", "speed": 20, "sideslip": "0.01", "force_fl": 1400, "force_fr": 2200, "force_rl": 1100,
    "force_rr": 1700, "front_force_x": 700}  # fmt: skip
LOADS: Mapping[str, Any] = {"load_fl": 3200, "load_fr": 4800, "load_rl": 2400, "load_rr": 3700}
STATES, WHEEL_LOADS = (np.array(list(values.values()), float) for values in (STATE, LOADS))
Outputs = Literal["y4 corrected", "y4 as printed", "y4 corrected, F_y22 measured as well"]


@cache
def model_with(outputs: Outputs = "y4 corrected") -> NonlinearModel:
    """The model of the catalogue, where y_4 ends in x_8 sin(u_1); in (12) as printed in x_6 sin(u_1). F_y22: a fifth output."""
    model = four_wheel_model()
    if outputs == "y4 as printed":
        x6, x8, u1, m = sp.symbols("force_rl front_force_x steering_angle mass")
        return replace(model, h=sp.Matrix([*model.h[:3], model.h[3] + (x6 - x8) * sp.sin(u1) / m]))
    if outputs == "y4 corrected":
        return model
    return replace(model, outputs=(*model.outputs, model.states[6]), h=sp.Matrix([*model.h, sp.Symbol("force_rr")]))


@cache
def in_numbers(model: NonlinearModel) -> NonlinearModel:
    """The same model with its constants as exact rationals in the equations: inserted once, not at every evaluation."""
    f, h = model.with_constants_inserted()
    return replace(model, f=f, h=h, constants={})
