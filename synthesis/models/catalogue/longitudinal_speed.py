"""The three-state longitudinal speed model (P2 (17)-(19))."""

from __future__ import annotations

import math

import sympy as sp

from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.models.parameter_set import ParameterSet, quantities

# d(wheel_speed)/dt is itself a parameter of this model: analyses that differentiate must be told so.
WHEEL_MOTION = {"wheel_speed": "wheel_acceleration"}


def longitudinal_speed_model(
    parameters: ParameterSet,
    wheel_speed_maximum: float = 140.0,
    wheel_acceleration_maximum: float = 800.0,
    wheel_jerk_maximum: float = math.inf,
) -> LpvModel:
    r"""z [m], V_r [m/s] and z' [m/s] of one tire, scheduled by omega [rad/s] >= 0 and omega' [rad/s^2] (P2 (19)).

    z'  = -a z + V_r + d_friction,                             a = kappa R_e omega
    V_r' = u + d_acceleration
    z'' = V_r' - kappa R_e omega' z - a z' + d_friction_rate   (the derivative of the first line, M^-1 applied)
    mu  = sigma0 z + sigma2 V_r + sigma1 z' + n

    so B = [0, 1, 1]'. The noise of P2 (19) is printed with two entries for three rows: the friction term enters row 1,
    its derivative row 3, and an acceleration error rows 2 and 3, because M^-1 adds row 2 to row 3.
    """
    if "longitudinal" not in parameters.tire:
        raise ModelError(
            f"parameter set '{parameters.id}': {unknown('tire direction', 'longitudinal', parameters.tire)}"
        )
    if "effective_radius" not in parameters.vehicle:
        raise ModelError(f"parameter set '{parameters.id}' has no vehicle.effective_radius [m]; add it")
    constants = {name: q.constant() for name, q in quantities(parameters.tire["longitudinal"]).items()}
    constants["effective_radius"] = parameters.vehicle["effective_radius"].constant()
    s0, s1, s2, kappa, radius = sp.symbols("sigma0 sigma1 sigma2 kappa effective_radius")
    omega, acceleration = sp.symbols("wheel_speed wheel_acceleration")
    a = kappa * radius * omega
    top = wheel_acceleration_maximum
    return LpvModel(
        name="longitudinal-speed",
        source="P2 (17)-(19), M^-1 multiplied out",
        states=(
            Signal("bristle_deflection", "m"),
            Signal("relative_velocity", "m/s"),
            Signal("bristle_velocity", "m/s"),
        ),
        inputs=(Signal("relative_acceleration", "m/s^2"),),
        outputs=(Signal("normalised_force", "1"),),
        disturbances=(
            Signal("friction", "m/s"),
            Signal("acceleration_error", "m/s^2"),
            Signal("friction_rate", "m/s^2"),
            Signal("force_noise", "1"),
        ),
        parameters=(
            SchedulingParameter("wheel_speed", "rad/s", 0.0, wheel_speed_maximum, -top, top, absolute=True),
            SchedulingParameter("wheel_acceleration", "rad/s^2", -top, top, -wheel_jerk_maximum, wheel_jerk_maximum),
        ),
        constants=constants,
        A=sp.Matrix([[-a, 1, 0], [0, 0, 0], [-kappa * radius * acceleration, 0, -a]]),
        B=sp.Matrix([0, 1, 1]),
        C=sp.Matrix([[s0, s2, s1]]),
        E=sp.Matrix([[1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 1, 0]]),
        F=sp.Matrix([[0, 0, 0, 1]]),
    )
