"""Observability of the model of P4: variants, ranks, and what no output sees."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import sympy as sp

from analysis.errors import AnalysisError
from analysis.lie_rank import LieRankTest
from analysis.lie_structure import GenericRank, generic_rank
from estimators.sideslip import FourWheel, FourWheelModel
from synthesis.models.catalogue.four_wheel import SUBSTITUTES, four_wheel_model
from synthesis.models.nonlinear import NonlinearModel
from synthesis.polynomials.matrix import FloatArray

ORDER = 4  # Lie derivatives taken; the rank is complete after the first
RANGES = {
    "yaw_rate": (-0.6, 0.6), "speed": (5.0, 40.0), "sideslip": (-0.05, 0.05), "force_fl": (-4e3, 4e3),
    "force_fr": (-4e3, 4e3), "force_rl": (-4e3, 4e3), "force_rr": (-4e3, 4e3), "front_force_x": (-4e3, 4e3),
    "steering_angle": (-0.2, 0.2), "load_fl": (1e3, 6e3), "load_fr": (1e3, 6e3), "load_rl": (1e3, 6e3),
    "load_rr": (1e3, 6e3),
}  # fmt: skip
STRAIGHT = {**RANGES, "steering_angle": (0.0, 0.0)}
# A left bend at 20 m/s and about 0.5 g: loads and forces are larger on the right.
STATE: Mapping[str, Any] = {
    "yaw_rate": "0.25", "speed": 20, "sideslip": "0.01", "force_fl": 1400, "force_fr": 2200, "force_rl": 1100,
    "force_rr": 1700, "front_force_x": 700,
}  # fmt: skip
LOADS: Mapping[str, Any] = {"load_fl": 3200, "load_fr": 4800, "load_rl": 2400, "load_rr": 3700}
# Typical sizes of the states and of the outputs (and of their rates), to compare singular values.
STATE_SIZE = np.array([0.4, 8.0, 0.1, 2000.0, 2000.0, 1500.0, 1500.0, 2000.0])
OUTPUT_SIZE = np.array([0.4, 8.0, 3.0, 3.0])
RATE = 10.0  # 1/s, by which output rates are compared with outputs


@cache
def corrected_model() -> NonlinearModel:
    """The model of the catalogue: y_4 ends in x_8 sin(u_1)."""
    return four_wheel_model()


@cache
def printed_output_model() -> NonlinearModel:
    """The model with y_4 of (12) as printed: x_6 sin(u_1) in place of x_8 sin(u_1)."""
    model = corrected_model()
    x6, x8, u1, m = sp.symbols("force_rl front_force_x steering_angle mass")
    return _with_outputs(model, [*model.h[:3], model.h[3] + (x6 - x8) * sp.sin(u1) / m])


@cache
def rear_difference_model() -> NonlinearModel:
    """The corrected model with the rear right lateral force as a fifth output."""
    model = corrected_model()
    return _with_outputs(model, [*model.h, sp.Symbol("force_rr")])


@cache
def in_numbers(model: NonlinearModel) -> NonlinearModel:
    """The same model with its constants as exact rationals in the equations: inserted once, not at every evaluation."""
    values = {sp.Symbol(name): sp.Rational(str(constant.value)) for name, constant in model.constants.items()}
    f, h = (sp.Matrix(matrix).applyfunc(lambda entry: entry.xreplace(values)) for matrix in (model.f, model.h))
    return NonlinearModel(model.name, model.source, model.states, model.outputs, f, h, model.inputs)


def _with_outputs(model: NonlinearModel, h: list[sp.Expr]) -> NonlinearModel:
    outputs = (*model.outputs, model.states[6])[: len(h)]
    return NonlinearModel(
        model.name, model.source, model.states, outputs, model.f, sp.Matrix(h), model.inputs, model.constants
    )


@cache
def rank_of(model: NonlinearModel, straight: bool) -> GenericRank:
    """Lie rank at a random state and moving inputs (almost every one has it); `straight`: the steering angle is held at zero."""
    return generic_rank(in_numbers(model), STRAIGHT if straight else RANGES, samples=1, order=ORDER, seed=4)


@cache
def rank_through_straight(rate: str = "0.1") -> int:
    """The rank of the corrected model at zero steering that moves at `rate` in rad/s."""
    return LieRankTest(in_numbers(corrected_model()), ORDER).at(STATE, {"steering_angle": [0, rate], **LOADS}).rank


def singular_at_standstill() -> bool:
    """Whether the model has no Taylor series at zero speed (sideslip rate divides by it)."""
    try:
        LieRankTest(in_numbers(corrected_model()), 1).at({**STATE, "speed": 0}, {"steering_angle": "0.05", **LOADS})
    except AnalysisError:
        return True
    return False


def rear_split_is_hidden(model: NonlinearModel) -> bool:
    r"""f(x + s v) = f(x) - (V_g / sigma_2) s v and h(x + s v) = h(x) for every x, u, s and all constants, v = e_6 - e_7.

    Then two motions that start with the same rear sum and another rear split have the same outputs for ever, whatever the
    inputs do: rank 7 at most. An identity of expressions, no linearisation.
    """
    s, speed, length = sp.symbols("s speed rear_relaxation")
    shift = {sp.Symbol("force_rl"): sp.Symbol("force_rl") + s, sp.Symbol("force_rr"): sp.Symbol("force_rr") - s}
    v = sp.Matrix([0, 0, 0, 0, 0, 1, -1, 0])
    moved = model.f.subs(shift, simultaneous=True) - model.f + speed / length * s * v
    seen = model.h.subs(shift, simultaneous=True) - model.h
    return all(sp.expand(entry) == 0 for entry in (*moved, *seen))


@dataclass(frozen=True)
class Sight:
    """Singular values (..., 8), descending, of the gradients of [y; y'] by the states, both in typical sizes."""

    values: FloatArray

    @property
    def relative(self) -> FloatArray:
        """Divided by the largest one."""
        return np.asarray(self.values / self.values[..., :1])


def sight(steering: FloatArray, speed: FloatArray, printed: bool = False) -> Sight:
    """Of y and its first derivative in the bend `STATE` at other steering angles [rad] and speeds [m/s].

    h is linear in x, so with held steering the gradient of y' is H A: eight rows, as many as states. `printed` takes y_4 of
    (12) as printed.
    """
    angle, v = np.broadcast_arrays(np.asarray(steering, float), np.asarray(speed, float))
    x = np.broadcast_to([float(value) for value in STATE.values()], (*angle.shape, 8)).copy()
    x[..., 1] = v
    step = 1e-4  # s; the Euler step is undone below, and T V / sigma stays below 1
    loads = np.broadcast_to([float(value) for value in LOADS.values()], (*angle.shape, 4))
    model = FourWheelModel.at(substitute_car(), step, angle, loads, 1e-3)
    A = (model.transition_jacobian(x) - np.eye(8)) / step
    H = model.measurement_jacobian(x)
    if printed:
        H[..., 3, 7], H[..., 3, 5] = 0.0, H[..., 3, 5] + np.sin(angle) / model.vehicle.mass
    rows = np.concatenate([H, H @ A / RATE], axis=-2)
    scaled = rows * STATE_SIZE / np.tile(OUTPUT_SIZE, 2)[:, None]
    return Sight(np.linalg.svd(scaled, compute_uv=False))


def substitute_car() -> FourWheel:
    """The substitutes of the model (P4 prints no values) as the runtime takes them."""
    value = {name: constant.value for name, constant in SUBSTITUTES.items()}
    return FourWheel(
        mass=value["mass"],
        yaw_inertia=value["yaw_inertia"],
        front_axle_distance=value["front_axle_distance"],
        rear_axle_distance=value["rear_axle_distance"],
        track=value["track"],
        front_stiffness=value["front_stiffness"],
        rear_stiffness=value["rear_stiffness"],
        front_relaxation=value["front_relaxation"],
        rear_relaxation=value["rear_relaxation"],
        friction=value["friction"],
    )
