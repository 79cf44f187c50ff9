r"""Where the sideslip filter of P5 is observable, in closed form.

With F_i = K_i beta_i the direction n = (1, K_1/beta_1, K_2/beta_2) changes no output: slips grow by as much as stiffnesses
fall. The first derivative of F_i sees it unless beta_i' = g beta_i, where g = -V'/V is the relative deceleration that the
forces of (10) stand for. Both at once, and rank is lost: for example in every steady turn at constant speed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import sympy as sp

from synthesis.models.catalogue.single_track import adaptive_stiffness_model
from synthesis.polynomials.matrix import FloatArray


def symbolic() -> tuple[sp.Matrix, sp.Matrix, list[sp.Expr]]:
    """Gradients of the outputs (3, 3) and of their first derivatives (3, 3), inputs moving; and the slip angles."""
    model = adaptive_stiffness_model()
    x, u = list(model.state_symbols), list(model.input_symbols)
    rates = [sp.Symbol(f"{symbol}_rate") for symbol in u]
    H = model.h.jacobian(x)
    motion = H * model.f + model.h.jacobian(u) * sp.Matrix(rates)
    delta, r, v, _ = u
    front, rear = sp.symbols("front_axle_distance rear_axle_distance")
    return H, motion.jacobian(x), [delta - x[0] - front * r / v, -x[0] + rear * r / v]


def rank_loss_identities() -> tuple[sp.Expr, sp.Expr]:
    r"""det [dF_1; dF_2; dF_i'] - K_i beta_(3-i) (beta_i' - g beta_i) for i = 1, 2: zero if the closed form is right."""
    H, moved, (b1, b2) = symbolic()
    model = adaptive_stiffness_model()
    delta, _, v, drive = model.input_symbols
    beta, d1, d2 = model.state_symbols
    m, c1, c2 = sp.symbols("mass front_stiffness rear_stiffness")
    forces = ((c1 + d1) * b1, (c2 + d2) * b2)
    along = drive * sp.cos(delta - beta) - forces[0] * sp.sin(delta - beta) + forces[1] * sp.sin(beta)
    g = -along / (m * v)
    found = []
    for i, (slip, other, stiffness) in enumerate(((b1, b2, c1 + d1), (b2, b1, c2 + d2))):
        inputs = sum(slip.diff(u) * sp.Symbol(f"{u}_rate") for u in model.input_symbols)
        rate = slip.diff(beta) * model.f[0] + inputs
        det = H[0, :].cross(H[1, :]).dot(moved[i, :])
        found.append(sp.expand(det - stiffness * other * (rate - g * slip)))
    return found[0], found[1]


def third_row_repeats() -> bool:
    """Whether the acceleration adds no rank: m dy_3 = cos(delta) dy_1 + dy_2 identically."""
    H, _, _ = symbolic()
    difference = H[2, :] * sp.Symbol("mass") - H[0, :] * sp.cos(sp.Symbol("steering_angle")) - H[1, :]
    return all(sp.simplify(entry) == 0 for entry in difference)


def numeric_gradients() -> Callable[..., Any]:
    """The six rows of `symbolic` as a function of state, inputs and input rates, the car's constants inserted."""
    H, moved, _ = symbolic()
    model = adaptive_stiffness_model()
    constants = {sp.Symbol(name): constant.value for name, constant in model.constants.items()}
    rates = [sp.Symbol(f"{symbol}_rate") for symbol in model.input_symbols]
    rows = sp.Matrix.vstack(H[:2, :], moved[:2, :]).subs(constants)
    function: Callable[..., Any] = sp.lambdify(
        [*model.state_symbols, *model.input_symbols, *rates], rows, "numpy", cse=True
    )
    return function


STATE_SIZE = np.array([0.05, 3e4, 3e4])  # rad, N/rad, N/rad
FORCE_SIZE = np.array([2e3, 2e3, 2e4, 2e4])  # N and N/s


def third_singular_value(signals: dict[str, FloatArray], rates: dict[str, FloatArray]) -> FloatArray:
    """Third singular value over the first (n,) of [dF_1; dF_2; dF_1'; dF_2'] in typical sizes, along a drive.

    `signals` (n,) each: sideslip and the four inputs by name; stiffness corrections are zero. `rates`: of the inputs.
    """
    model = adaptive_stiffness_model()
    rows = numeric_gradients()
    zero = np.zeros_like(signals["sideslip"])
    values = [signals["sideslip"], zero, zero, *(signals[str(u)] for u in model.input_symbols)]
    moving = [rates.get(str(u), zero) for u in model.input_symbols]
    found = np.array([np.asarray(rows(*sample), float) for sample in np.stack([*values, *moving], axis=1)])
    scaled = found * STATE_SIZE / FORCE_SIZE[:, None]
    singular = np.linalg.svd(scaled, compute_uv=False)
    return np.asarray(singular[:, 2] / singular[:, 0])
