"""The corner velocity model, longitudinal and lateral (P1 (18)-(26), (36)-(39); P3 (1)-(13))."""

from __future__ import annotations

from typing import Literal

import sympy as sp

from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal
from synthesis.models.parameter_set import ParameterSet, quantities

Direction = Literal["longitudinal", "lateral"]


def corner_velocity_model(
    parameters: ParameterSet,
    direction: Direction,
    wheel_speed_maximum: float = 140.0,
    wheel_speed_rate: float = 800.0,
) -> LpvModel:
    r"""Bristle deflection z [m] and relative velocity v_r [m/s] of one tire, scheduled by |omega| [rad/s].

    z' = -a z + v_r + d_friction,  v_r' = u + d_acceleration,  a = kappa R_e |omega|  (P1 (20)-(22); P3 (3)-(5))
    mu = (sigma0 - sigma1 a) z + (sigma1 + sigma2) v_r + sigma1 d_friction + n  (P1 (23); P3 (6))

    u is R_e omega' - v_xt' (longitudinal) or -v_yt' (lateral); v_r is R_e omega - v_xt or -v_yt. The disturbance
    `friction` stands for -sigma0 |v_r| z / (theta g) (bounded, P1 notes 11 item 6); `force_noise` n is the error of the
    normalised force. The absolute value of P1 (18), (20) is kept throughout (P1 notes 11 item 5).

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> [state.name for state in model.states]
    ['bristle_deflection', 'relative_velocity']
    """
    if direction not in parameters.tire:
        raise ModelError(f"parameter set '{parameters.id}': {unknown('tire direction', direction, parameters.tire)}")
    if "effective_radius" not in parameters.vehicle:
        raise ModelError(f"parameter set '{parameters.id}' has no vehicle.effective_radius [m]; add it")
    constants = {name: q.constant() for name, q in quantities(parameters.tire[direction]).items()}
    constants["effective_radius"] = parameters.vehicle["effective_radius"].constant()
    s0, s1, s2, kappa, radius, omega = sp.symbols("sigma0 sigma1 sigma2 kappa effective_radius wheel_speed")
    a = kappa * radius * omega
    return LpvModel(
        name=f"corner-velocity-{direction}",
        source="P1 (20)-(25), (36)-(39); P3 (3)-(8), (11)-(13), |omega| kept",
        states=(Signal("bristle_deflection", "m"), Signal("relative_velocity", "m/s")),
        inputs=(Signal("relative_acceleration", "m/s^2"),),
        outputs=(Signal("normalised_force", "1"),),
        disturbances=(Signal("friction", "m/s"), Signal("acceleration_error", "m/s^2"), Signal("force_noise", "1")),
        parameters=(
            SchedulingParameter(
                "wheel_speed", "rad/s", 0.0, wheel_speed_maximum, -wheel_speed_rate, wheel_speed_rate, absolute=True
            ),
        ),
        constants=constants,
        A=sp.Matrix([[-a, 1], [0, 0]]),
        B=sp.Matrix([0, 1]),
        C=sp.Matrix([[s0 - s1 * a, s1 + s2]]),
        E=sp.Matrix([[1, 0, 0], [0, 1, 0]]),
        F=sp.Matrix([[s1, 0, 1]]),
    )
