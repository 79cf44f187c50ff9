"""A drive of a single-track car with saturating axles: the design model of P5 with a tire that it does not know."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from estimators.sideslip import SingleTrack
from synthesis.models.catalogue.single_track import PEUGEOT_307
from synthesis.polynomials.matrix import FloatArray

SAMPLE_TIME = 0.01  # s
PRINTED_GRAVITY = 9.81  # m/s^2, of the limits of the axles
LINEAR = 1e9  # friction so large that the axles are linear: an observer with the right stiffness has no model error
Steering = Callable[[float], float]


def published_car(mass_change: float = 0.0, stiffness_factor: float = 1.0) -> SingleTrack:
    """The car of P5 Table B.1, with another assumed mass [kg] or stiffness."""
    value = {name: constant.value for name, constant in PEUGEOT_307.items()}
    return SingleTrack(
        value["mass"] + mass_change,
        value["yaw_inertia"],
        value["front_axle_distance"],
        value["rear_axle_distance"],
        value["front_stiffness"] * stiffness_factor,
        value["rear_stiffness"] * stiffness_factor,
    )


@dataclass(frozen=True)
class AxleDrive:
    """Samples (n,): time s, steering rad, speed m/s, sideslip rad, yaw rate rad/s; slips (n, 2) rad of front and rear axle.

    Wheel-axis forces in N: `forces` (n, 2) lateral, `drive` (n,) longitudinal in front; accelerations (n,) in m/s^2.
    """

    time: FloatArray
    steering: FloatArray
    speed: FloatArray
    sideslip: FloatArray
    yaw_rate: FloatArray
    slips: FloatArray
    forces: FloatArray
    drive: FloatArray
    longitudinal_acceleration: FloatArray
    lateral_acceleration: FloatArray

    @property
    def rear_sideslip(self) -> FloatArray:
        """beta_2 of (11)."""
        return self.slips[:, 1]

    def body_forces(self) -> FloatArray:
        """F_y1, F_yw2, F_x1 (n, 3) in body axes: what the force observer estimates."""
        sine, cosine = np.sin(self.steering), np.cos(self.steering)
        front = self.forces[:, 0] * cosine + self.drive * sine
        return np.stack([front, self.forces[:, 1], self.drive * cosine - self.forces[:, 0] * sine], axis=1)


def with_noise(drive: AxleDrive, seed: int = 0) -> AxleDrive:
    """The same drive with white noise on what is measured: yaw rate 0.2 deg/s, accelerations 0.1 m/s^2."""
    random = np.random.default_rng(seed)
    n = len(drive.time)
    return replace(
        drive,
        yaw_rate=drive.yaw_rate + np.radians(0.2) * random.standard_normal(n),
        longitudinal_acceleration=drive.longitudinal_acceleration + 0.1 * random.standard_normal(n),
        lateral_acceleration=drive.lateral_acceleration + 0.1 * random.standard_normal(n),
    )


def slalom(time: float) -> float:
    """Straight for 5 s, then ever wider swings up to 3.2 degrees at 0.25 Hz."""
    share = min(max((time - 5.0) / 4.0, 0.0), 1.0)
    return float(np.radians(3.2) * share * np.sin(0.5 * np.pi * (time - 5.0)))


def steady_turn(time: float) -> float:
    """From straight into a turn with 3 degrees within a second, then held."""
    return float(np.radians(3.0) * min(max(time - 1.0, 0.0), 1.0))


def axle_drive(
    steering: Steering = slalom, speed: float = 17.0, seconds: float = 20.0, friction: float = 1.0
) -> AxleDrive:
    """F_i = D_i tanh(C_i beta_i / D_i) with D_i = friction times the axle load; the drive force keeps the speed constant.

    P5 (10), (11) and (1) with the front forces turned into body axes. A large `friction` makes the axles linear.
    """
    car = published_car()
    weight = car.mass * PRINTED_GRAVITY / (car.front_axle_distance + car.rear_axle_distance)
    limit = friction * weight * np.array([car.rear_axle_distance, car.front_axle_distance])
    stiffness = np.array([car.front_stiffness, car.rear_stiffness])

    def forces(angle: Any, beta: Any, yaw: Any) -> tuple[FloatArray, FloatArray, Any]:
        """Slips (..., 2), lateral forces (..., 2), and the drive force for which V' = 0."""
        front, rear = angle - beta - car.front_axle_distance * yaw / speed, -beta + car.rear_axle_distance * yaw / speed
        slips = np.stack([front, rear], axis=-1)
        across = limit * np.tanh(stiffness * slips / limit)
        turned = angle - beta
        drive = (across[..., 0] * np.sin(turned) - across[..., 1] * np.sin(beta)) / np.cos(turned)
        return slips, across, drive

    def rate(t: float, x: FloatArray) -> list[float]:
        angle = steering(t)
        _, across, drive = forces(angle, x[0], x[1])
        turned = angle - x[0]
        lateral = drive * np.sin(turned) + across[0] * np.cos(turned) + across[1] * np.cos(x[0])
        front = across[0] * np.cos(angle) + drive * np.sin(angle)
        turn = (car.front_axle_distance * front - car.rear_axle_distance * across[1]) / car.yaw_inertia
        return [lateral / (car.mass * speed) - x[1], turn]

    time = np.arange(0.0, seconds, SAMPLE_TIME)
    beta, yaw = solve_ivp(rate, (0.0, seconds), [0.0, 0.0], t_eval=time, rtol=1e-8, atol=1e-10, max_step=0.05).y
    angle = np.array([steering(t) for t in time])
    slips, across, drive = forces(angle, beta, yaw)
    along = drive * np.cos(angle) - across[:, 0] * np.sin(angle)
    side = across[:, 0] * np.cos(angle) + drive * np.sin(angle) + across[:, 1]
    constant = np.full(time.shape, speed)
    return AxleDrive(time, angle, constant, beta, yaw, slips, across, drive, along / car.mass, side / car.mass)
