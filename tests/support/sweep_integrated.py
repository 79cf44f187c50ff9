"""Corner observers of any constants, integrated plainly: the independent check of the drives of many designs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from estimators import GainSchedule
from estimators.pipeline import CornerSample

SCHEDULE = GainSchedule.shipped("corner-estimation-longitudinal")


class Step(NamedTuple):
    relative_velocity: np.ndarray
    innovation: np.ndarray
    flags: np.ndarray


class Integrated:
    """Four corners of one design with other constants: the error model's exponential, corner by corner, sample by sample."""

    def __init__(self, constants: Mapping[str, float]) -> None:
        self.constants = constants
        self.x, self.u, self.w = np.zeros((4, 2)), np.zeros(4), np.zeros(4)

    def step(self, sample: CornerSample) -> Step:
        s0, s1, s2, kappa, radius = (
            self.constants[name] for name in ("sigma0", "sigma1", "sigma2", "kappa", "effective_radius")
        )
        T = SCHEDULE.sample_time
        for i in range(4):
            if np.isfinite(sample.relative_acceleration[i]):
                self.u[i] = sample.relative_acceleration[i]
            if np.isfinite(sample.wheel_speed[i]):
                self.w[i] = min(abs(sample.wheel_speed[i]), SCHEDULE.parameter.max)
            a = kappa * radius * self.w[i]
            A, C = np.array([[-a, 1.0], [0.0, 0.0]]), np.array([s0 - s1 * a, s1 + s2])
            L, y = SCHEDULE.gain(np.array([self.w[i]]))[0, :, 0], sample.normalised_force[i]
            if not np.isfinite(y):
                L, y = np.zeros(2), 0.0
            block = np.zeros((3, 3))  # the state and a constant 1
            block[:2, :2], block[:2, 2] = A - np.outer(L, C), np.array([0.0, self.u[i]]) + L * y
            self.x[i] = (expm(T * block) @ np.append(self.x[i], 1.0))[:2]
        return Step(self.x[:, 1].copy(), np.zeros(4), np.zeros(4, np.int64))
