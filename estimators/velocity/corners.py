"""Rigid-body kinematics of the four wheel centres: velocities and accelerations in the vehicle and tire frames.

P1 notes 6 with the steering-rate terms that the paper leaves out: 0.3 rad/s of steering at 12 m/s is 3.6 m/s^2.
Corners in the order fl, fr, rl, rr on the last axis; frame x forward, y left, yaw rate and steering to the left.
Accelerations at the centre of gravity without gravity, (11). SI units; leading axes broadcast.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from estimators.arithmetic import Number
from estimators.arrays import FloatArray
from estimators.vehicle import VehicleParameters


class CornerVectors(NamedTuple):
    """A vector at each corner, (..., 4) each: along x and along y of the frame that the function names."""

    x: FloatArray
    y: FloatArray


def rotated(x: Number, y: Number, sine: Number, cosine: Number) -> tuple[Number, Number]:
    """A vector of the vehicle frame in that of a tire; of numbers or of arrays. The inverse takes -sine."""
    return x * cosine + y * sine, y * cosine - x * sine


def at_wheel(x: Number, y: Number, turn: Number, arm_x: Number, arm_y: Number) -> tuple[Number, Number]:
    """x - r y_c, y + r x_c: velocity of a wheel centre from that of the centre of gravity, of numbers or of arrays.

    Likewise the acceleration, with r' for r. The inverse takes -r.
    """
    return x - turn * arm_y, y + turn * arm_x


def tire_motion(
    velocity: tuple[Number, Number],
    acceleration: tuple[Number, Number],
    sine: Number,
    cosine: Number,
    steer_rate: Number,
) -> tuple[Number, Number, Number, Number]:
    """v_xt, v_yt and their time derivatives from V_xc, V_yc and theirs; of numbers or of arrays."""
    along, across = rotated(*velocity, sine, cosine)
    pull_x, pull_y = rotated(*acceleration, sine, cosine)
    return along, across, pull_x + steer_rate * across, pull_y - steer_rate * along


def corner_velocity(
    vehicle: VehicleParameters, vx: npt.ArrayLike, vy: npt.ArrayLike, yaw_rate: npt.ArrayLike
) -> CornerVectors:
    """V_xc = V_x - r y_c, V_yc = V_y + r x_c in the vehicle frame, m/s; arguments (...)."""
    forward, left, turn = (_cornered(value) for value in (vx, vy, yaw_rate))
    return CornerVectors(*at_wheel(forward, left, turn, vehicle.corner_x, vehicle.corner_y))


def tire_frame(vector: CornerVectors, steer: npt.ArrayLike) -> CornerVectors:
    """Turns vectors of the vehicle frame into those of the tires, steered by `steer` (..., 4) rad."""
    angle = np.asarray(steer, dtype=np.float64)
    return CornerVectors(*rotated(vector.x, vector.y, np.sin(angle), np.cos(angle)))


def vehicle_frame(vector: CornerVectors, steer: npt.ArrayLike) -> CornerVectors:
    """The inverse of `tire_frame`: P1 (33), (42), P2 (28), P3 notes 3."""
    return tire_frame(vector, -np.asarray(steer, dtype=np.float64))


def corner_acceleration(
    vehicle: VehicleParameters,
    ax: npt.ArrayLike,
    ay: npt.ArrayLike,
    yaw_rate: npt.ArrayLike,
    yaw_acceleration: npt.ArrayLike,
    vx: npt.ArrayLike,
    vy: npt.ArrayLike,
    steer: npt.ArrayLike,
    steer_rate: npt.ArrayLike,
) -> CornerVectors:
    """Time derivatives of v_xt and v_yt (..., 4), m/s^2, the inputs -B u of the corner observers.

        V_xc' = a_x + r V_y - r' y_c,      V_yc' = a_y - r V_x + r' x_c
        v_xt' = V_xc' cos d + V_yc' sin d + d' v_yt,      v_yt' = V_yc' cos d - V_xc' sin d - d' v_xt

    Args:
        vehicle: lever arms x_c, y_c.
        ax: (...) m/s^2; likewise `ay`, `yaw_rate` rad/s, `yaw_acceleration` rad/s^2, and the present `vx`, `vy` m/s.
        ay: see `ax`.
        yaw_rate: see `ax`.
        yaw_acceleration: see `ax`.
        vx: see `ax`.
        vy: see `ax`.
        steer: (..., 4) rad.
        steer_rate: (..., 4) rad/s; 0 gives the paper's formula.
    """
    a, b, turn, yaw_acceleration = (_cornered(value) for value in (ax, ay, yaw_rate, yaw_acceleration))
    forward, left = _cornered(vx), _cornered(vy)
    body = at_wheel(a + turn * left, b - turn * forward, yaw_acceleration, vehicle.corner_x, vehicle.corner_y)
    angle, rate = np.asarray(steer, dtype=np.float64), np.asarray(steer_rate, dtype=np.float64)
    velocity = corner_velocity(vehicle, vx, vy, yaw_rate)
    return CornerVectors(*tire_motion(velocity, body, np.sin(angle), np.cos(angle), rate)[2:])


def corner_acceleration_by_speed(
    vehicle: VehicleParameters,
    ax: npt.ArrayLike,
    ay: npt.ArrayLike,
    yaw_rate: npt.ArrayLike,
    yaw_acceleration: npt.ArrayLike,
    vy: npt.ArrayLike,
    steer: npt.ArrayLike,
    steer_rate: npt.ArrayLike,
) -> tuple[FloatArray, FloatArray]:
    """p and q (..., 4) of v_xt' = p + q V_x, `corner_acceleration` along the tire, where V_x is what an observer estimates.

    Arguments as there.
    """
    free = corner_acceleration(vehicle, ax, ay, yaw_rate, yaw_acceleration, 0.0, vy, steer, steer_rate).x
    angle, rate = np.asarray(steer, dtype=np.float64), np.asarray(steer_rate, dtype=np.float64)
    unit = (1.0, 0.0), (0.0, -_cornered(yaw_rate))
    return free, np.asarray(tire_motion(*unit, np.sin(angle), np.cos(angle), rate)[2])


def _cornered(value: npt.ArrayLike) -> FloatArray:
    """(...) as (..., 1)."""
    return np.asarray(value, dtype=np.float64)[..., None]
