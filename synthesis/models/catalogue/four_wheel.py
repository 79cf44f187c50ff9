"""The four-wheel model with Dugoff tires behind a relaxation lag (P4 (1)-(12))."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from synthesis.errors import ModelError
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.param import Constant, Signal

_P5 = "P5 Table B.1 (same car; P4 prints no values)"
_CHOSEN = "chosen; P4 prints no value"

# P4 prints none of these: values of the same car from P5, halved per tire, and free choices declared as such.
SUBSTITUTES: Mapping[str, Constant] = {
    "mass": Constant(1447.0, "kg", _P5),
    "yaw_inertia": Constant(3000.0, "kg*m^2", _P5),
    "front_axle_distance": Constant(1.12, "m", _P5),
    "rear_axle_distance": Constant(1.46, "m", _P5),
    "front_stiffness": Constant(32500.0, "N/rad", f"{_P5}, half an axle"),
    "rear_stiffness": Constant(25000.0, "N/rad", f"{_P5}, half an axle"),
    "track": Constant(1.5, "m", _CHOSEN),
    "friction": Constant(1.0, "1", _CHOSEN + " (dry: 0.9 to 1.1)"),
    "front_relaxation": Constant(0.5, "m", _CHOSEN),
    "rear_relaxation": Constant(0.5, "m", _CHOSEN),
}


def dugoff_force(stiffness: sp.Expr, tangent: sp.Expr, load: sp.Expr, friction: sp.Expr) -> sp.Expr:
    r"""C t f(lambda), t = tan(alpha), lambda = mu F_z / (2 C |t|), f = (2 - lambda) lambda for lambda < 1, else 1 (P4 (3)-(5)).

    P4 (3) prints a minus sign, which with the slip angle of (2) turns the car unstable; here positive slip gives positive
    force. Written as three branches so that no absolute value is differentiated: below lambda = 1 the force is
    +-mu F_z (1 - mu F_z / (4 C |t|)).
    """
    limit = friction * load
    return sp.Piecewise(
        (limit * (1 - limit / (4 * stiffness * tangent)), 2 * stiffness * tangent > limit),
        (-limit * (1 + limit / (4 * stiffness * tangent)), -2 * stiffness * tangent > limit),
        (stiffness * tangent, True),
    )


def four_wheel_model(constants: Mapping[str, Constant] = SUBSTITUTES, force_sign: int = 1) -> NonlinearModel:
    r"""The 8-state observer model of P4 (11)-(12): X = [r, V_g, beta, F_y11, F_y12, F_y21, F_y22, F_x1].

    Inputs delta and the four loads; outputs r, V_g, a_x, a_y. Corrected: y_4 ends in x_8 sin u_1 (printed x_6), V_g in
    the third row is x_2, and the force in (6) is the quasi-static Dugoff one. `force_sign=-1` keeps the printed minus of
    (3). Raises ModelError for a missing constant and another sign.
    """
    if force_sign not in (-1, 1):
        raise ModelError(f"force_sign = {force_sign} must be 1 (corrected) or -1 (as printed)")
    missing = sorted(set(SUBSTITUTES) - set(constants))
    if missing:
        raise ModelError(f"model 'four-wheel': constant(s) {', '.join(missing)} are missing; give unit and source")
    names = list(SUBSTITUTES)
    m, inertia, l1, l2, c1, c2, track, mu, sigma1, sigma2 = sp.symbols(" ".join(names))
    states = ("yaw_rate", "speed", "sideslip", "force_fl", "force_fr", "force_rl", "force_rr", "front_force_x")
    r, v, beta, f11, f12, f21, f22, fx = sp.symbols(" ".join(states))
    delta, *loads = sp.symbols("steering_angle load_fl load_fr load_rl load_rr")
    sine, cosine = sp.sin(delta), sp.cos(delta)
    front, rear = f11 + f12, f21 + f22
    turned = beta - delta

    def lag(force: sp.Expr, arm: sp.Expr, side: int, steer: sp.Expr, index: int) -> sp.Expr:
        alpha = steer - sp.atan((v * beta + arm * r) / (v - side * track * r / 2))
        stiffness, length = (c1, sigma1) if index < 2 else (c2, sigma2)
        steady = force_sign * dugoff_force(stiffness, sp.tan(alpha), loads[index], mu)
        return v / length * (steady - force)

    units = ["rad/s", "m/s", "rad", *["N"] * 5]
    return NonlinearModel(
        name="four-wheel",
        source="P4 (1)-(6), (11)-(12) with the corrections of the docstring",
        states=tuple(Signal(name, unit) for name, unit in zip(states, units, strict=True)),
        inputs=(Signal("steering_angle", "rad"), *(Signal(str(load), "N") for load in loads)),
        outputs=(
            Signal("yaw_rate", "rad/s"),
            Signal("speed", "m/s"),
            Signal("longitudinal_acceleration", "m/s^2"),
            Signal("lateral_acceleration", "m/s^2"),
        ),
        constants={name: constants[name] for name in names},
        f=sp.Matrix(
            [
                (l1 * (front * cosine + fx * sine) - l2 * rear + track / 2 * (f11 - f12) * sine) / inertia,
                (fx * sp.cos(turned) + front * sp.sin(turned) + rear * sp.sin(beta)) / m,
                (-fx * sp.sin(turned) + front * sp.cos(turned) + rear * sp.cos(beta)) / (m * v) - r,
                lag(f11, l1, 1, delta, 0),
                lag(f12, l1, -1, delta, 1),
                lag(f21, -l2, 1, sp.Integer(0), 2),
                lag(f22, -l2, -1, sp.Integer(0), 3),
                0,
            ]
        ),
        h=sp.Matrix([r, v, (fx * cosine - front * sine) / m, (front * cosine + rear + fx * sine) / m]),
    )
