"""The Kalman filter of P2 in the readings of its scalar process covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are

from studies.papers.longitudinal_speed.inputs import constant, noise, sample_time, structures

MODES = ("normal", "high_slip")


@dataclass(frozen=True)
class SteadyFilter:
    """Gain of the velocity (filtered form, m/s per unit of normalised force), slowest time constant in s."""

    velocity_gain: float
    time_constant: float


def steady_filter(speed: float, structure: str, mode: str) -> SteadyFilter:
    """At a constant wheel speed in rad/s, with Q = q S; the redundant mode, which no gain moves, is left out."""
    sequence = constant(speed, 1).sequence
    A, C = sequence.A[0], sequence.C[0]
    q, R = noise(mode)
    P = solve_discrete_are(A.T, C.T, q * structures(sequence)[structure][0], R)
    gain = P @ C.T / (C @ P @ C.T + R)
    poles = np.linalg.eigvals(A - A @ gain @ C)
    fixed = np.abs(poles - np.linalg.eigvals(A).real.min()).argmin()  # the hidden mode exp(-a T) of A itself
    slowest = float(np.abs(np.delete(poles, fixed)).max())
    return SteadyFilter(float(gain[1, 0]), -sample_time() / float(np.log(slowest)))
