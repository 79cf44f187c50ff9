"""Cars on roads that lean and climb: rigid bodies in three dimensions, with tires of their own, as signals for the pipeline.

    f = v' + w x v + g R' e_z,   v = (V, v_y, 0),   w and R from angles of the road by numeric differentiation

The rear tires take the side force that v_y and w make them take, alpha = c (mu + mu^3); the driver steers so that the front ones
take theirs. Nothing of it comes from the estimators.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import FloatArray
from estimators.pipeline import EstimationPipeline, PipelineStep, VehicleSignals
from estimators.vehicle import GRAVITY, VehicleParameters

TIME = 0.005
CAR = VehicleParameters.published_suv()
_COMPLIANCE = 0.08  # rad


class Banked(NamedTuple):
    """Signals (n, cars, ...), and the truth."""

    signals: dict[str, FloatArray]
    vx: FloatArray  # (cars,)
    vy: FloatArray  # (n, cars)
    roll: FloatArray  # (n, cars) rad
    pitch: FloatArray


def banked(cases: FloatArray, seconds: float = 5.0) -> Banked:
    """`cases` (cars, 5): speed m/s, bank degrees (left side up), turn rad/s about the vertical, grade degrees (nose up), and
    the bias of the gyros for roll and pitch, rad/s.

    From 1.5 s on, within one; at constant speed, torques as it takes.
    """
    v, bank, turn, grade, spin = cases.T
    time = TIME * np.arange(round(seconds / TIME))
    rise = np.clip(time - 1.5, 0.0, 1.0)[:, None]
    rise = rise * rise * (3.0 - 2.0 * rise)
    roll, pitch = (np.radians(angle) * rise for angle in (bank, grade))
    heading = TIME * np.cumsum(turn * rise, axis=0)
    R = _about(2, heading) @ _about(1, -pitch) @ _about(0, roll)
    skew = np.swapaxes(R, -1, -2) @ np.gradient(R, TIME, axis=0)
    w = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
    up = GRAVITY * R[..., 2, :]
    vy, felt, angle = np.zeros_like(roll), np.zeros_like(w), np.zeros_like(roll)
    for k in range(time.size - 1):
        angle[k] = -(vy[k] - CAR.rear_axle_distance * w[k, :, 2]) / v
        mu = angle[k] / _COMPLIANCE
        for _ in range(8):
            mu -= (_COMPLIANCE * (mu + mu**3) - angle[k]) / (_COMPLIANCE * (1.0 + 3.0 * mu**2))
        turned = np.cross(w[k], np.stack([v, vy[k], 0.0 * v], axis=-1))
        felt[k] = up[k] + turned
        felt[k, :, 1] = mu * felt[k, :, 2]
        vy[k + 1] = vy[k] + TIME * (felt[k, :, 1] - up[k, :, 1] - turned[:, 1])
    felt[-1], angle[-1] = felt[-2], angle[-2]
    r, n = w[..., 2], roll.shape
    delta = (vy + r * CAR.front_axle_distance) / v + angle
    steer = np.stack([delta, delta, 0.0 * delta, 0.0 * delta], axis=-1)
    along = v[:, None] - r[..., None] * CAR.corner_y
    along = along * np.cos(steer) + (vy[..., None] + r[..., None] * CAR.corner_x) * np.sin(steer)
    along *= 1.0 + 0.03 * felt[..., :1] / GRAVITY
    rng = np.random.default_rng(0)
    felt, w = felt + 0.05 * rng.normal(size=felt.shape), w + 0.002 * rng.normal(size=w.shape)
    pull = np.broadcast_to((up[..., 0] * CAR.mass / 4.0)[..., None], (*n, 4))
    signals = {
        "wheel_speed": along / CAR.radius + 0.05 * rng.normal(size=(*n, 4)), "steer": steer, "torque": pull * CAR.radius,
        "ax": felt[..., 0], "ay": felt[..., 1], "az": felt[..., 2], "yaw_rate": w[..., 2], "roll_rate": w[..., 0] + spin,
        "pitch_rate": w[..., 1] + spin,
    }  # fmt: skip
    return Banked(signals, v, vy, roll, pitch)


def run(course: Banked, pipeline: EstimationPipeline) -> list[PipelineStep]:
    n = course.vy.shape[0]
    return [
        pipeline.step(VehicleSignals(**{name: value[k] for name, value in course.signals.items()})) for k in range(n)
    ]


def _about(axis: int, angle: FloatArray) -> FloatArray:
    """Right-handed rotations (..., 3, 3)."""
    out = np.zeros((*angle.shape, 3, 3))
    i, k = [(1, 2), (2, 0), (0, 1)][axis]
    out[..., axis, axis] = 1.0
    out[..., i, i] = out[..., k, k] = np.cos(angle)
    out[..., k, i] = np.sin(angle)
    out[..., i, k] = -np.sin(angle)
    return out
