"""Lateral dynamics of a car over its speed: a rational model, and the same plant in plain floats."""

from __future__ import annotations

import numpy as np
import sympy as sp

from synthesis.models.catalogue.single_track import PEUGEOT_307
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal

LOW, HIGH = 5.0, 40.0


def single_track(low: float = LOW, high: float = HIGH) -> LpvModel:
    """v_y and yaw rate of a Peugeot 307 over speed (Rajamani 2012, (2.31) without sideslip): entries with V and 1/V."""
    names = "mass yaw_inertia front_axle_distance rear_axle_distance front_stiffness rear_stiffness"
    m, inertia, a, b, front, rear = sp.symbols(names)
    V, turn = sp.Symbol("speed"), a * front - b * rear
    return LpvModel(
        name="single-track",
        source="Rajamani 2012; P5 Table B.1",
        parameters=(SchedulingParameter("speed", "m/s", low, high, -8.0, 8.0),),
        states=(Signal("side_velocity", "m/s"), Signal("yaw_rate", "rad/s")),
        inputs=(Signal("steering", "rad"),),
        outputs=(Signal("gyro", "rad/s"), Signal("accelerometer", "m/s^2")),
        disturbances=(Signal("wind", "m/s^2"), Signal("gyro_noise", "rad/s"), Signal("noise", "m/s^2")),
        constants=dict(PEUGEOT_307),
        A=sp.Matrix(
            [
                [-(front + rear) / (m * V), -V - turn / (m * V)],
                [-turn / (inertia * V), -(a**2 * front + b**2 * rear) / (inertia * V)],
            ]
        ),
        B=sp.Matrix([[front / m], [a * front / inertia]]),
        C=sp.Matrix([[0, 1], [-(front + rear) / (m * V), -turn / (m * V)]]),
        D=sp.Matrix([[0], [front / m]]),
        E=sp.Matrix([[1, 0, 0], [0, 0, 0]]),
        F=sp.Matrix([[0, 1, 0], [1, 0, 1]]),
    )


def numbers(V: float) -> tuple[np.ndarray, ...]:
    """The same plant in plain floats."""
    m, J, a, b, front, rear = (
        PEUGEOT_307[key].value
        for key in (
            *("mass", "yaw_inertia", "front_axle_distance", "rear_axle_distance", "front_stiffness", "rear_stiffness"),
        )
    )
    turn = a * front - b * rear
    A = np.array(
        [[-(front + rear) / (m * V), -V - turn / (m * V)], [-turn / (J * V), -(a**2 * front + b**2 * rear) / (J * V)]]
    )
    B, D = np.array([[front / m], [a * front / J]]), np.array([[0.0], [front / m]])
    return A, B, np.array([[0.0, 1.0], [A[0, 0], A[0, 1] + V]]), D
