"""Single-track sideslip with cornering stiffnesses as states: transition, measurement and Jacobians.

Slip angles are positive where they give a positive force (to the left).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from estimators.vehicle import SingleTrack

REST_TIME = 0.1  # s, with which sideslip fades away at standstill


class CorneringModel(NamedTuple):
    """P5 (10)-(17), Euler discretised, at given inputs (...).

    States, last axis: sideslip in rad, corrections of the front and the rear axle stiffness in N/rad; outputs F_yw1 and
    F_yw2 in N, lateral acceleration in m/s^2. With the sideslip as the only state the stiffnesses are fixed (ORL, (12)).
    """

    vehicle: SingleTrack
    sample_time: float
    steering: FloatArray  # rad
    yaw_rate: FloatArray  # rad/s
    speed: FloatArray  # m/s, positive
    drive: FloatArray  # F_xw1 in N
    at_rest: BoolArray  # sideslip fades with 0.1 s, the stiffnesses stay

    def slip_angles(self, beta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """beta_1 and beta_2 of (11)."""
        v, turn = self.vehicle, self.yaw_rate / self.speed
        return self.steering - beta - v.front_axle_distance * turn, -beta + v.rear_axle_distance * turn

    def stiffness(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """C_1 + dC_1 and C_2 + dC_2, (...) each."""
        v = self.vehicle
        if x.shape[-1] == 1:
            return np.full(x.shape[:-1], v.front_stiffness), np.full(x.shape[:-1], v.rear_stiffness)
        return v.front_stiffness + x[..., 1], v.rear_stiffness + x[..., 2]

    def transition(self, x: FloatArray) -> FloatArray:
        """x + T f, (16), (17)."""
        beta, (front, rear), (slip_1, slip_2) = x[..., 0], self.stiffness(x), self.slip_angles(x[..., 0])
        turned = self.steering - beta
        force = self.drive * np.sin(turned) + front * slip_1 * np.cos(turned) + rear * slip_2 * np.cos(beta)
        out = x.copy()
        out[..., 0] = np.where(
            self.at_rest,
            math.exp(-self.sample_time / REST_TIME) * beta,
            beta + self.sample_time * (force / (self.vehicle.mass * self.speed) - self.yaw_rate),
        )
        return out

    def transition_jacobian(self, x: FloatArray) -> FloatArray:
        """Derivative of `transition`, (..., n, n)."""
        beta, (front, rear), (slip_1, slip_2) = x[..., 0], self.stiffness(x), self.slip_angles(x[..., 0])
        turned = self.steering - beta
        sine, cosine = np.sin(turned), np.cos(turned)
        scale = np.where(self.at_rest, 0.0, self.sample_time / (self.vehicle.mass * self.speed))
        F = np.zeros((*x.shape, x.shape[-1]))
        F[..., range(x.shape[-1]), range(x.shape[-1])] = 1.0
        slope = -self.drive * cosine + front * (slip_1 * sine - cosine) - rear * (np.cos(beta) + slip_2 * np.sin(beta))
        F[..., 0, 0] = np.where(self.at_rest, math.exp(-self.sample_time / REST_TIME), 1.0 + scale * slope)
        if x.shape[-1] > 1:
            F[..., 0, 1], F[..., 0, 2] = scale * slip_1 * cosine, scale * slip_2 * np.cos(beta)
        return F

    def measurement(self, x: FloatArray) -> FloatArray:
        """F_yw1, F_yw2, lateral acceleration: (15)."""
        (front, rear), (slip_1, slip_2) = self.stiffness(x), self.slip_angles(x[..., 0])
        sine, cosine = np.sin(self.steering), np.cos(self.steering)
        one, two = front * slip_1, rear * slip_2
        return np.stack((one, two, (one * cosine + two + self.drive * sine) / self.vehicle.mass), axis=-1)

    def measurement_jacobian(self, x: FloatArray) -> FloatArray:
        """Derivative of `measurement`, (..., 3, n)."""
        (front, rear), (slip_1, slip_2) = self.stiffness(x), self.slip_angles(x[..., 0])
        cosine, mass = np.cos(self.steering), self.vehicle.mass
        H = np.zeros((*x.shape[:-1], 3, x.shape[-1]))
        H[..., 0, 0], H[..., 1, 0], H[..., 2, 0] = -front, -rear, -(front * cosine + rear) / mass
        if x.shape[-1] > 1:
            H[..., 0, 1], H[..., 1, 2] = slip_1, slip_2
            H[..., 2, 1], H[..., 2, 2] = slip_1 * cosine / mass, slip_2 / mass
        return H
