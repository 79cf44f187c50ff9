"""Both blocks of P5 on recorded signals, and a single-track car with saturating axles, a tire that they do not know.

Block 1: forces by sliding mode; block 2: rear sideslip with adapted or fixed stiffness.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from estimators import sideslip
from estimators.arrays import FloatArray
from estimators.sideslip import SingleTrack, SlidingModeObserver, wheel_axes
from studies.papers.smo_ekf_sideslip.inputs import CAR, GRAVITY, SAMPLE_TIME, WHEELBASE, published_car

LINEAR = 1e9  # friction so large that the axles are linear: an observer with the right stiffness has no model error


@dataclass(frozen=True)
class Signals:
    """What the car measures, (..., n) each: rad/s, m/s^2 twice, rad, and the speed in m/s."""

    yaw_rate: FloatArray
    ay: FloatArray
    ax: FloatArray
    steering: FloatArray
    speed: FloatArray


def axle_forces(car: SingleTrack, signals: Signals, start: FloatArray | None = None) -> FloatArray:
    """States of block 1, (..., n, 4): yaw rate rad/s, F_y1, F_yw2, F_x1 in N; with its default linear zones."""
    observer = SlidingModeObserver(car, signals.yaw_rate.shape[:-1], SAMPLE_TIME)
    if start is not None:
        observer.reset(state=start)
    measured = np.stack([signals.yaw_rate, signals.ay, signals.ax], axis=-1)
    return np.stack([observer.step(measured[..., k, :]).state for k in range(measured.shape[-2])], axis=-2)


def rear_sideslip(
    car: SingleTrack, signals: Signals, state: FloatArray, adaptive: bool = True
) -> tuple[FloatArray, FloatArray]:
    """beta_2 (..., n), rad, and stiffness of both axles (..., n, 2), N/rad, by block 2 from the states of block 1."""
    kind = sideslip.AdaptiveStiffnessObserver if adaptive else sideslip.FixedStiffnessObserver
    shape = signals.yaw_rate.shape
    observer = kind(car, shape[:-1], SAMPLE_TIME)
    forces = wheel_axes(state, signals.steering)  # P5 (9)
    measured = np.concatenate([forces[..., 1:], signals.ay[..., None]], axis=-1)
    rear, stiffness = np.empty(shape), np.empty((*shape, 2))
    for k in range(shape[-1]):
        steering, yaw_rate, speed = (values[..., k] for values in (signals.steering, signals.yaw_rate, signals.speed))
        step = observer.step(steering, yaw_rate, speed, forces[..., k, 0], measured[..., k, :])
        rear[..., k], stiffness[..., k, :] = step.rear_sideslip, step.stiffness
    return rear, stiffness


class Estimates(NamedTuple):
    """For k assumed cars: rear sideslip (n, k) rad; stiffness (n, k, 2) N/rad; F_y1, F_yw2, F_x1 in body axes (n, k, 3) N."""

    rear_sideslip: FloatArray
    stiffness: FloatArray
    forces: FloatArray


def estimates(signals: Signals, cars: Sequence[SingleTrack], adaptive: bool = True) -> Estimates:
    """Both blocks on signals (n,), for several assumed cars."""
    states = {car.mass: axle_forces(car, signals) for car in cars}  # block 1 knows the mass alone
    found = [(*rear_sideslip(car, signals, states[car.mass], adaptive), states[car.mass][:, 1:]) for car in cars]
    return Estimates(*(np.stack(values, axis=1) for values in zip(*found, strict=True)))


@dataclass(frozen=True)
class SimulatedRun(Signals):
    """Signals (n,) with what the car does: time s, sideslip rad; slips (n, 2) rad of front and rear axle.

    Wheel-axis forces in N: `forces` (n, 2) lateral, `front_force_x` (n,).
    """

    time: FloatArray
    sideslip: FloatArray
    slips: FloatArray
    forces: FloatArray
    front_force_x: FloatArray

    @property
    def rear_sideslip(self) -> FloatArray:
        """beta_2 of (11)."""
        return self.slips[:, 1]

    def body_forces(self) -> FloatArray:
        """F_y1, F_yw2, F_x1 (n, 3) in body axes: what the force observer estimates."""
        sine, cosine = np.sin(self.steering), np.cos(self.steering)
        front = self.forces[:, 0] * cosine + self.front_force_x * sine
        along = self.front_force_x * cosine - self.forces[:, 0] * sine
        return np.stack([front, self.forces[:, 1], along], axis=1)


def with_noise(run: SimulatedRun, seed: int = 0) -> SimulatedRun:
    """The same run with white noise on what is measured: yaw rate 0.2 deg/s, accelerations 0.1 m/s^2."""
    random = np.random.default_rng(seed)
    sizes = {"yaw_rate": np.radians(0.2), "ax": 0.1, "ay": 0.1}
    noisy = {name: getattr(run, name) + size * random.standard_normal(run.time.size) for name, size in sizes.items()}
    return replace(run, **noisy)


def slalom(time: float) -> float:
    """Straight for 5 s, then ever wider swings up to 3.2 degrees at 0.25 Hz."""
    share = min(max((time - 5.0) / 4.0, 0.0), 1.0)
    return float(np.radians(3.2) * share * np.sin(0.5 * np.pi * (time - 5.0)))


def steady_turn(time: float) -> float:
    """From straight into a turn with 3 degrees within a second, then held."""
    return float(np.radians(3.0) * min(max(time - 1.0, 0.0), 1.0))


def simulate(
    steering: Callable[[float], float] = slalom, speed: float = 17.0, seconds: float = 20.0, friction: float = 1.0
) -> SimulatedRun:
    """F_i = D_i tanh(C_i beta_i / D_i) with D_i = friction times the axle load; F_xw1 keeps the speed constant.

    P5 (10), (11) and (1) with the front forces turned into body axes. A large `friction` makes the axles linear.
    """
    car, front, rear = published_car(), CAR.front_axle_distance, CAR.rear_axle_distance
    limit = friction * (car.mass * GRAVITY / WHEELBASE) * np.array([rear, front])
    stiffness = np.array([car.front_stiffness, car.rear_stiffness])

    def forces(angle: Any, beta: Any, yaw: Any) -> tuple[FloatArray, FloatArray, Any]:
        """Slips (..., 2), lateral forces (..., 2), and the longitudinal force for which V' = 0."""
        slips = np.stack([angle - beta - front * yaw / speed, -beta + rear * yaw / speed], axis=-1)
        across = limit * np.tanh(stiffness * slips / limit)
        turned = angle - beta
        return slips, across, (across[..., 0] * np.sin(turned) - across[..., 1] * np.sin(beta)) / np.cos(turned)

    def rate(t: float, x: FloatArray) -> list[float]:
        angle = steering(t)
        _, across, pull = forces(angle, x[0], x[1])
        turned = angle - x[0]
        lateral = pull * np.sin(turned) + across[0] * np.cos(turned) + across[1] * np.cos(x[0])
        turn = front * (across[0] * np.cos(angle) + pull * np.sin(angle)) - rear * across[1]
        return [lateral / (car.mass * speed) - x[1], turn / car.yaw_inertia]

    time = np.arange(0.0, seconds, SAMPLE_TIME)
    beta, yaw = solve_ivp(rate, (0.0, seconds), [0.0, 0.0], t_eval=time, rtol=1e-8, atol=1e-10, max_step=0.05).y
    angle = np.array([steering(t) for t in time])
    slips, across, pull = forces(angle, beta, yaw)
    along = pull * np.cos(angle) - across[:, 0] * np.sin(angle)
    side = across[:, 0] * np.cos(angle) + pull * np.sin(angle) + across[:, 1]
    signals = (yaw, side / car.mass, along / car.mass, angle, np.full(time.shape, speed))
    return SimulatedRun(*signals, time, beta, slips, across, pull)
