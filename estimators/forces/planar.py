"""The car as one rigid body in the plane: what axle forces do to a_x, a_y and the yaw acceleration.

P1 (9), (10) with the third output read as dr/dt; states F_yf, F_yr and the difference of the front axle, right minus left,
dF_yf (N); forces in the tyre frame, F_y positive to the left, steering angle delta of both front wheels positive to the
left. So a positive slip angle v_yt/v_xt goes with a negative F_y.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.interpolate import FloatArray
from estimators.vehicle import VehicleParameters


class PlanarModel(NamedTuple):
    """y = C x + d; leading axes as the steering angle."""

    C: FloatArray  # (..., 3, 3), rows a_x, a_y, dr/dt, columns F_yf, F_yr, dF_yf
    d: FloatArray  # (..., 3), m/s^2, m/s^2, rad/s^2


def planar_model(vehicle: VehicleParameters, steer: FloatArray, longitudinal_force: FloatArray) -> PlanarModel:
    """C(delta) and the known part d of P1 (10); `steer` (...) rad, `longitudinal_force` (..., 4) N in the wheel planes.

    det C = T_f sin^2(delta)/(2 m^2 I_z): with the wheels straight the difference of the front axle does not show.
    """
    m, inertia = vehicle.mass, vehicle.yaw_inertia
    front, rear = vehicle.front_axle_distance, vehicle.rear_axle_distance
    half_front, half_rear = vehicle.front_track / 2.0, vehicle.rear_track / 2.0
    sine, cosine = np.sin(steer), np.cos(steer)
    C = np.zeros((*np.shape(steer), 3, 3))
    C[..., 0, 0] = -sine / m
    C[..., 1, 0], C[..., 1, 1] = cosine / m, 1.0 / m
    C[..., 2, 0], C[..., 2, 1] = front * cosine / inertia, -rear / inertia
    C[..., 2, 2] = -half_front * sine / inertia
    fl, fr, rl, rr = (longitudinal_force[..., i] for i in range(4))
    both = fl + fr
    d: FloatArray = np.empty((*np.shape(steer), 3))
    d[..., 0] = (both * cosine + rl + rr) / m
    d[..., 1] = across = both * sine / m
    d[..., 2] = (front * m * across + half_front * (fr - fl) * cosine + half_rear * (rr - rl)) / inertia
    return PlanarModel(C, d)


def planar_outputs(
    vehicle: VehicleParameters, steer: FloatArray, longitudinal_force: FloatArray, lateral_force: FloatArray
) -> FloatArray:
    """a_x, a_y (m/s^2) and dr/dt (rad/s^2), (..., 3), from the forces of the four corners (..., 4), N: P1 (9)."""
    fl, fr, rl, rr = (lateral_force[..., i] for i in range(4))
    states = np.stack((fl + fr, rl + rr, fr - fl), axis=-1)
    model = planar_model(vehicle, steer, longitudinal_force)
    out: FloatArray = (model.C @ states[..., None])[..., 0] + model.d
    return out
