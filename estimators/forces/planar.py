"""The car as one rigid body in the plane: what axle forces do to a_x, a_y and the yaw acceleration.

P1 (9), (10) with the third output read as dr/dt; states F_yf, F_yr and the difference of the front axle, right minus left,
dF_yf (N); forces in the tyre frame, F_y positive to the left, steering angle delta of both front wheels positive to the
left. So a positive slip angle v_yt/v_xt goes with a negative F_y.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np

from estimators.arrays import FloatArray
from estimators.vehicle import VehicleParameters

Number = TypeVar("Number", float, FloatArray)


class PlanarModel(NamedTuple):
    """y = C x + d; leading axes as the steering angle."""

    C: FloatArray  # (..., 3, 3), rows a_x, a_y, dr/dt, columns F_yf, F_yr, dF_yf
    d: FloatArray  # (..., 3), m/s^2, m/s^2, rad/s^2


def planar_model(vehicle: VehicleParameters, steer: FloatArray, longitudinal_force: FloatArray) -> PlanarModel:
    """C(delta) and the known part d of P1 (10); `steer` (...) rad, `longitudinal_force` (..., 4) N in the wheel planes.

    det C = T_f sin^2(delta)/(2 m^2 I_z): with the wheels straight the difference of the front axle does not show.
    """
    rows, d = planar_entries(vehicle, np.sin(steer), np.cos(steer), *(longitudinal_force[..., i] for i in range(4)))
    C, offset = np.zeros((*np.shape(steer), 3, 3)), np.empty((*np.shape(steer), 3))
    C[..., 0, 0], C[..., 1, 0], C[..., 1, 1], C[..., 2, 0], C[..., 2, 1], C[..., 2, 2] = rows
    offset[..., 0], offset[..., 1], offset[..., 2] = d
    return PlanarModel(C, offset)


def planar_entries(
    vehicle: VehicleParameters, sine: Number, cosine: Number, fl: Number, fr: Number, rl: Number, rr: Number
) -> tuple[tuple[Number, Number, float, Number, float, Number], tuple[Number, Number, Number]]:
    """C11, C21, C22, C31, C32, C33 (the others are zero) and d of `planar_model`, of numbers or of arrays.

    `sine` and `cosine` are those of the steering angle, the forces F_x of the four corners.
    """
    m, inertia = vehicle.mass, vehicle.yaw_inertia
    front, half_front = vehicle.front_axle_distance, vehicle.front_track / 2.0
    rows = (
        -sine / m,
        cosine / m,
        1.0 / m,
        front * cosine / inertia,
        -vehicle.rear_axle_distance / inertia,
        -half_front * sine / inertia,
    )
    both = fl + fr
    across = both * sine / m
    turn = front * m * across + half_front * (fr - fl) * cosine + vehicle.rear_track / 2.0 * (rr - rl)
    return rows, ((both * cosine + rl + rr) / m, across, turn / inertia)


def planar_outputs(
    vehicle: VehicleParameters, steer: FloatArray, longitudinal_force: FloatArray, lateral_force: FloatArray
) -> FloatArray:
    """a_x, a_y (m/s^2) and dr/dt (rad/s^2), (..., 3), from the forces of the four corners (..., 4), N: P1 (9)."""
    fl, fr, rl, rr = (lateral_force[..., i] for i in range(4))
    states = np.stack((fl + fr, rl + rr, fr - fl), axis=-1)
    model = planar_model(vehicle, steer, longitudinal_force)
    out: FloatArray = (model.C @ states[..., None])[..., 0] + model.d
    return out
