"""The single-track models of P5: forces for the sliding-mode observer, sideslip with adaptive stiffness for the EKF."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.param import Constant, Signal

# Peugeot 307 of P5 Table B.1; the stiffnesses are those of whole axles.
PEUGEOT_307: Mapping[str, Constant] = {
    "mass": Constant(1447.0, "kg", "P5 Table B.1"),
    "yaw_inertia": Constant(3000.0, "kg*m^2", "P5 Table B.1 (unit misprinted kg*m^-2)"),
    "front_axle_distance": Constant(1.12, "m", "P5 Table B.1, L_1"),
    "rear_axle_distance": Constant(1.46, "m", "P5 Table B.1, L_2"),
    "front_stiffness": Constant(65000.0, "N/rad", "P5 Table B.1, C_1 of the axle"),
    "rear_stiffness": Constant(50000.0, "N/rad", "P5 Table B.1, C_2 of the axle"),
}


def _chosen(constants: Mapping[str, Constant], names: tuple[str, ...], model: str) -> dict[str, Constant]:
    for name in names:
        if name not in constants:
            raise ModelError(f"model '{model}': {unknown('constant', name, constants)}; give it with unit and source")
    return {name: constants[name] for name in names}


def axle_force_model(
    constants: Mapping[str, Constant] = PEUGEOT_307, rear_longitudinal_force: bool = False
) -> NonlinearModel:
    r"""r, F_y1, F_yw2, F_x1 in body axes with constant forces; outputs r, gamma_y, gamma_x (P5 (1)-(3)). No input.

    I_z r' = L_1 F_y1 - L_2 F_yw2,  m gamma_y = F_y1 + F_yw2,  m gamma_x = F_x1 (+ F_x2)

    P5 neglects the rear longitudinal force so that the system stays observable; `rear_longitudinal_force` adds it as a
    fifth state, to show what is lost.
    """
    names = ("mass", "yaw_inertia", "front_axle_distance", "rear_axle_distance")
    m, inertia, front, rear = sp.symbols(" ".join(names))
    r, fy1, fy2, fx1, fx2 = sp.symbols("yaw_rate front_force_y rear_force_y front_force_x rear_force_x")
    extra = (fx2,) if rear_longitudinal_force else ()
    along = fx1 + fx2 if rear_longitudinal_force else fx1
    return NonlinearModel(
        name="axle-forces",
        source="P5 (1)-(3)",
        states=(Signal("yaw_rate", "rad/s"), *(Signal(str(s), "N") for s in (fy1, fy2, fx1, *extra))),
        outputs=(
            Signal("yaw_rate", "rad/s"),
            Signal("lateral_acceleration", "m/s^2"),
            Signal("longitudinal_acceleration", "m/s^2"),
        ),
        constants=_chosen(constants, names, "axle-forces"),
        f=sp.Matrix([(front * fy1 - rear * fy2) / inertia, 0, 0, 0, *(0 for _ in extra)]),
        h=sp.Matrix([r, (fy1 + fy2) / m, along / m]),
    )


def adaptive_stiffness_model(constants: Mapping[str, Constant] = PEUGEOT_307) -> NonlinearModel:
    r"""beta [rad], Delta C_a1, Delta C_a2 [N/rad]; inputs delta, r, V_g, F_xw1; outputs F_yw1, F_yw2, gamma_y (P5 (10)-(17)).

    beta_1 = delta - beta - L_1 r / V_g, beta_2 = -beta + L_2 r / V_g, F_ywi = (C_i + Delta C_ai) beta_i. Singular at V_g = 0.
    """
    names = ("mass", "front_axle_distance", "rear_axle_distance", "front_stiffness", "rear_stiffness")
    m, front, rear, c1, c2 = sp.symbols(" ".join(names))
    beta, d1, d2 = sp.symbols("sideslip front_stiffness_change rear_stiffness_change")
    delta, r, speed, fx1 = sp.symbols("steering_angle yaw_rate speed front_force_x")
    force1 = (c1 + d1) * (delta - beta - front * r / speed)
    force2 = (c2 + d2) * (-beta + rear * r / speed)
    across = fx1 * sp.sin(delta - beta) + force1 * sp.cos(delta - beta) + force2 * sp.cos(beta)
    return NonlinearModel(
        name="adaptive-stiffness",
        source="P5 (10)-(17)",
        states=(
            Signal("sideslip", "rad"),
            Signal("front_stiffness_change", "N/rad"),
            Signal("rear_stiffness_change", "N/rad"),
        ),
        inputs=(
            Signal("steering_angle", "rad"),
            Signal("yaw_rate", "rad/s"),
            Signal("speed", "m/s"),
            Signal("front_force_x", "N"),
        ),
        outputs=(
            Signal("front_force_y", "N"),
            Signal("rear_force_y", "N"),
            Signal("lateral_acceleration", "m/s^2"),
        ),
        constants=_chosen(constants, names, "adaptive-stiffness"),
        f=sp.Matrix([across / (m * speed) - r, 0, 0]),
        h=sp.Matrix([force1, force2, (force1 * sp.cos(delta) + force2 + fx1 * sp.sin(delta)) / m]),
    )
