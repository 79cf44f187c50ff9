"""Two motions of the model of P4 that no sensor tells apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.sideslip import FourWheelModel
from studies.papers.ekf_ukf_lateral.observability import substitute_car
from synthesis.polynomials.matrix import FloatArray

STEP = 0.001  # s
PRINTED_GRAVITY = 9.81  # m/s^2, of the loads at rest
SPLIT = 800.0  # N, by which the twins differ at the start, to each side


@dataclass(frozen=True)
class Twins:
    """Time (n,) in s, steering (n,) in rad, states (n, 2, 8) and outputs (n, 2, 4) of both motions."""

    time: FloatArray
    steering: FloatArray
    states: FloatArray
    outputs: FloatArray


def twins(seconds: float = 1.5, front: bool = False, steered: bool = True) -> Twins:
    """A slalom at 20 m/s from two starts that differ in the rear left-right split (or, with `front`, the front one).

    Not `steered`: straight ahead with held steering, where the front split is hidden as well.
    """
    car = substitute_car()
    x = np.zeros((2, 8))
    x[:, 1], x[:, 7] = 20.0, 300.0
    left = 3 if front else 5
    x[1, left], x[1, left + 1] = SPLIT, -SPLIT
    time = np.arange(0.0, seconds, STEP)
    steering = np.radians(3.0) * np.sin(2.0 * np.pi * 0.7 * time) * steered
    weight = car.mass * PRINTED_GRAVITY / (2 * (car.front_axle_distance + car.rear_axle_distance))
    ahead, behind = weight * car.rear_axle_distance, weight * car.front_axle_distance
    loads = np.broadcast_to((ahead, ahead, behind, behind), (2, 4))
    states, outputs = np.empty((len(time), 2, 8)), np.empty((len(time), 2, 4))
    for k, angle in enumerate(steering):
        model = FourWheelModel.at(car, STEP, np.full(2, angle), loads, 1.0)
        states[k], outputs[k] = x, model.measurement(x)
        x = model.transition(x)
    return Twins(time, steering, states, outputs)
