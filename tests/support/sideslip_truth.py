"""Independent truth for the sideslip observers: planar rigid body in body velocities, integrated by scipy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

from estimators.sideslip import FourWheel, SingleTrack

CAR = FourWheel(1447.0, 3000.0, 1.12, 1.46, 1.5, 32_500.0, 25_000.0, 0.4, 0.5, 1.0)
AXLES = SingleTrack(1447.0, 3000.0, 1.12, 1.46, 65_000.0, 50_000.0)
PERIOD = 0.01


def dugoff(stiffness: float, slip: float, limit: float) -> float:
    """The printed formula, branch by branch."""
    tangent = np.tan(slip)
    if tangent == 0:
        return 0.0
    factor = limit / (2 * stiffness * abs(tangent))
    return float(stiffness * tangent * ((2 - factor) * factor if factor < 1 else 1.0))


def double_track(
    steer: Callable[[float], float], speed: float, seconds: float, drive: float = 0.0, car: FourWheel = CAR
) -> dict[str, np.ndarray]:
    """u, v, r and four lagged forces; loads are static with a lateral transfer by the centripetal acceleration."""
    static = np.array(car.static_loads)
    side = np.array([-1.0, 1.0, -1.0, 1.0])

    def loads(u: float, r: float) -> np.ndarray:
        return np.clip(static + side * 0.25 * car.mass * u * r * 0.5 / car.track * 2, 50, None)

    def accelerations(t: float, x: np.ndarray) -> tuple[float, float, float]:
        forces, delta = x[3:7], steer(t)
        front = forces[0] + forces[1]
        ax = (drive * np.cos(delta) - front * np.sin(delta)) / car.mass
        ay = (front * np.cos(delta) + drive * np.sin(delta) + forces[2] + forces[3]) / car.mass
        moment = car.front_axle_distance * (front * np.cos(delta) + drive * np.sin(delta))
        moment += 0.5 * car.track * (forces[0] - forces[1]) * np.sin(delta)
        return ax, ay, (moment - car.rear_axle_distance * (forces[2] + forces[3])) / car.yaw_inertia

    def rate(t: float, x: np.ndarray) -> list[float]:
        u, v, r = x[:3]
        ax, ay, turn = accelerations(t, x)
        fz, total = loads(u, r), np.hypot(u, v)
        out = [ax + r * v, ay - r * u, turn]
        for k, (px, py, angle, stiffness, sigma) in enumerate(
            [
                (car.front_axle_distance, 0.5, steer(t), car.front_stiffness, car.front_relaxation),
                (car.front_axle_distance, -0.5, steer(t), car.front_stiffness, car.front_relaxation),
                (-car.rear_axle_distance, 0.5, 0.0, car.rear_stiffness, car.rear_relaxation),
                (-car.rear_axle_distance, -0.5, 0.0, car.rear_stiffness, car.rear_relaxation),
            ]
        ):
            slip = angle - np.arctan2(v + px * r, u - py * car.track * r)
            out.append(total / sigma * (dugoff(stiffness, slip, car.friction * fz[k]) - x[3 + k]))
        return out

    t = np.arange(0, seconds, PERIOD)
    x = solve_ivp(rate, (0, seconds), [speed, 0, 0, 0, 0, 0, 0], t_eval=t, rtol=1e-8, atol=1e-8).y
    acceleration = np.array([accelerations(tk, x[:, k]) for k, tk in enumerate(t)])
    return {
        "t": t,
        "steering": np.array([steer(tk) for tk in t]),
        "speed": np.hypot(x[0], x[1]),
        "sideslip": np.arctan2(x[1], x[0]),
        "yaw_rate": x[2],
        "forces": x[3:7].T,
        "loads": np.array([loads(u, r) for u, r in zip(x[0], x[2], strict=True)]),
        "ax": acceleration[:, 0],
        "ay": acceleration[:, 1],
    }


def single_track(
    steer: Callable[[float], float], speed: float, seconds: float, car: SingleTrack = AXLES, friction: float = 1e9
) -> dict[str, np.ndarray]:
    """Linear axles (saturating at `friction` times load by a tanh), constant speed, no drive force."""
    weight = car.mass * 9.81 / (car.front_axle_distance + car.rear_axle_distance)
    limits = friction * weight * np.array([car.rear_axle_distance, car.front_axle_distance])

    def forces(t: float, x: np.ndarray) -> tuple[float, float]:
        slips = steer(t) - x[0] - car.front_axle_distance * x[1] / speed, -x[0] + car.rear_axle_distance * x[1] / speed
        raw = car.front_stiffness * slips[0], car.rear_stiffness * slips[1]
        return tuple(limit * np.tanh(value / limit) for value, limit in zip(raw, limits, strict=True))  # type: ignore[return-value]

    def rate(t: float, x: np.ndarray) -> list[float]:
        front, rear = forces(t, x)
        lateral = front * np.cos(steer(t) - x[0]) + rear * np.cos(x[0])
        turn = (car.front_axle_distance * front * np.cos(steer(t)) - car.rear_axle_distance * rear) / car.yaw_inertia
        return [lateral / (car.mass * speed) - x[1], turn]

    t = np.arange(0, seconds, PERIOD)
    x = solve_ivp(rate, (0, seconds), [0, 0], t_eval=t, rtol=1e-9, atol=1e-10).y
    both = np.array([forces(tk, x[:, k]) for k, tk in enumerate(t)])
    angle = np.array([steer(tk) for tk in t])
    return {
        "t": t,
        "steering": angle,
        "sideslip": x[0],
        "yaw_rate": x[1],
        "forces": both,
        "ay": (both[:, 0] * np.cos(angle) + both[:, 1]) / car.mass,
        "speed": np.full(t.shape, speed),
    }
