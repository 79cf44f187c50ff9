"""The lateral force model on planar rigid-body dynamics (P1 (9)-(10))."""

from __future__ import annotations

from typing import Literal

import sympy as sp

from synthesis.errors import ModelError
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.param import Signal
from synthesis.models.parameter_set import ParameterSet

NEEDED = ("mass", "yaw_inertia", "front_axle_distance", "rear_axle_distance", "front_track", "rear_track")


def planar_force_model(
    parameters: ParameterSet, third_output: Literal["yaw_acceleration", "none"] = "yaw_acceleration"
) -> NonlinearModel:
    r"""F_yf, F_yr and F_yfR - F_yfL [N] as a random walk, seen through a_x, a_y [m/s^2] and r' [rad/s^2].

    m a_x = F_xf cos d - F_yf sin d + F_xr,  m a_y = F_yf cos d + F_xf sin d + F_yr
    I_z r' = (F_yf cos d + F_xf sin d) L_f - F_yr L_r + (DF_xf cos d - DF_yf sin d) T_f/2 + DF_xr T_r/2   (P1 (9))

    P1 (10) prints the yaw rate r as third output, which is no function of these states: the row is then missing
    (`third_output="none"`); with r' the determinant is T_f sin(d)^2 / (2 m^2 I_z).
    """
    missing = [name for name in NEEDED if name not in parameters.vehicle]
    if missing:
        raise ModelError(f"parameter set '{parameters.id}' has no vehicle.{', vehicle.'.join(missing)}; add it")
    constants = {name: parameters.vehicle[name].constant() for name in NEEDED}
    m, inertia, front, rear, front_track, rear_track = sp.symbols(" ".join(NEEDED))
    fyf, fyr, dfyf = sp.symbols("front_lateral_force rear_lateral_force front_lateral_difference")
    d, fxf, fxr, dfxf, dfxr = sp.symbols(
        "steering_angle front_longitudinal_force rear_longitudinal_force front_longitudinal_difference "
        "rear_longitudinal_difference"
    )
    sine, cosine = sp.sin(d), sp.cos(d)
    across = fyf * cosine + fxf * sine
    outputs = [
        (Signal("longitudinal_acceleration", "m/s^2"), (fxf * cosine - fyf * sine + fxr) / m),
        (Signal("lateral_acceleration", "m/s^2"), (across + fyr) / m),
    ]
    if third_output == "yaw_acceleration":
        yaw = across * front - fyr * rear + (dfxf * cosine - dfyf * sine) * front_track / 2 + dfxr * rear_track / 2
        outputs.append((Signal("yaw_acceleration", "rad/s^2"), yaw / inertia))
    else:
        constants = {"mass": constants["mass"]}
    return NonlinearModel(
        name="planar-force",
        source="P1 (9)-(10), the matrix rebuilt from (9)",
        states=tuple(Signal(str(s), "N") for s in (fyf, fyr, dfyf)),
        inputs=(Signal("steering_angle", "rad"), *(Signal(str(s), "N") for s in (fxf, fxr, dfxf, dfxr))),
        outputs=tuple(signal for signal, _ in outputs),
        constants=constants,
        f=sp.zeros(3, 1),
        h=sp.Matrix([expression for _, expression in outputs]),
    )
