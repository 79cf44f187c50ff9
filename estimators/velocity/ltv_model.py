"""The bristle model of a corner, sampled exactly: P2 (19)-(20), and the same without its redundant state.

    A(t) = [-a 1 0; 0 0 0; -a' 0 -a],  B = [0 1 1]',  C = [s0 s2 s1],   a = kappa R_e |w|,  a' = da/dt      x = [z V_r z']
    A(t) = [-a 1; 0 0],                B = [0 1]',    C = [s0 - s1 a, s1 + s2]                              x = [z V_r]

The third state of P2 is z' = V_r - a z written once more; at constant w it makes the pair unobservable, for both modes
decay at a (P2 notes 6), where the two-state form is observable unless a = s0/s1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from estimators.arguments import positive_fields
from estimators.arithmetic import Arithmetic, ManyCars, Number
from estimators.arrays import FloatArray

_SERIES_BELOW = 0.5  # a T below which the quotients lose digits and the series has converged
_TERMS = [(1.0 / math.factorial(n + 2), (n + 1.0) / math.factorial(n + 3)) for n in reversed(range(16))]


@dataclass(frozen=True)
class BristleTire:
    """LuGre constants of one direction, for normalised forces; the defaults are P2 section IV.

    Raises:
        EstimatorError: names every value that is not finite and above zero.
    """

    sigma0: float = 612.0  # 1/m
    sigma1: float = 0.87  # s/m
    sigma2: float = 0.0016  # s/m
    kappa: float = 8.0  # 1/m
    radius: float = 0.33  # R_e, m: Table I (the text has 0.35)

    def __post_init__(self) -> None:
        positive_fields(self, "tire constants")

    def row(self, wheel_speed: Number, states: int) -> tuple[Number, float, float]:
        """C, with a zero behind that of two states."""
        if states == 3:
            return self.sigma0, self.sigma2, self.sigma1
        return self.sigma0 - self.sigma1 * (self.kappa * self.radius * abs(wheel_speed)), self.sigma1 + self.sigma2, 0.0

    def output(self, wheel_speed: FloatArray, states: int) -> FloatArray:
        """C (..., 1, states), normalised force per state."""
        row = np.broadcast_arrays(*self.row(wheel_speed, states)[:states], wheel_speed)[:states]
        return np.stack(row, axis=-1)[..., None, :]


def sampled(
    tire: BristleTire, wheel_speed: FloatArray, wheel_acceleration: FloatArray, time: float, states: int
) -> tuple[FloatArray, FloatArray]:
    """A_k = e^(A T) (..., states, states) and B_k = int_0^T e^(A s) B ds (..., states), w and w' held: (20).

    With E = e^(-a T), p_k = int_0^T e^(-a (T - s)) s^k/k! ds:  z gains p_0 V_r + p_1 u;  z' gains, beside E z' + p_0 u,
    -a' (T E z + q_1 V_r + q_2 u) with q_k the same integral of the bristle's own response.
    """
    kit = ManyCars(wheel_speed.shape)
    E, p0, p1, d1, d2, b3 = sampled_entries(kit, tire, wheel_speed, wheel_acceleration, time)
    A = np.zeros((*wheel_speed.shape, states, states))
    B = np.empty((*wheel_speed.shape, states))
    A[..., 0, 0], A[..., 0, 1], A[..., 1, 1] = E, p0, 1.0
    B[..., 0], B[..., 1] = p1, time
    if states == 3:
        A[..., 2, 0], A[..., 2, 1], A[..., 2, 2] = d1, d2, E
        B[..., 2] = b3
    return A, B


def sampled_entries(
    kit: Arithmetic, tire: BristleTire, wheel_speed: Number, wheel_acceleration: Number, time: float
) -> tuple[Number, Number, Number, Number, Number, Number]:
    """A11 (= A33), A12, B1, A31, A32 and B3 of `sampled`; the others are 0, 1 and T."""
    x = tire.kappa * tire.radius * abs(wheel_speed) * time
    p0, p1, q1, q2 = integrals(x)
    E, once = kit.exp(-x), time * p0
    rise = tire.kappa * tire.radius * kit.sign(wheel_speed) * wheel_acceleration
    return E, once, time * time * p1, -rise * time * E, -rise * time * time * q1, once - rise * time**3 * q2


def integrals(x: Number) -> tuple[Number, Number, Number, Number]:
    """For x = a T >= 0, per unit of T:

    p_0 = (1 - e^-x)/x,    p_1 = (1 - p_0)/x = sum (-x)^n/(n+2)!,
    q_1 = (p_0 - e^-x)/x,    q_2 = (p_1 - q_1)/x = sum (n+1) (-x)^n/(n+3)!.
    """
    if not isinstance(x, np.ndarray):
        return _series(x) if x < _SERIES_BELOW else _quotients(x, math.exp(-x), math.expm1(-x))
    near = x < _SERIES_BELOW
    far = np.where(near, 1.0, x)
    small, large = _series(np.where(near, x, 0.0)), _quotients(far, np.exp(-far), np.expm1(-far))
    p0, p1, q1, q2 = (np.where(near, first, second) for first, second in zip(small, large, strict=True))
    return p0, p1, q1, q2


def _quotients(x: Number, decayed: Number, change: Number) -> tuple[Number, Number, Number, Number]:
    """With e^-x and e^-x - 1."""
    p0 = -change / x
    p1, q1 = (1.0 - p0) / x, (p0 - decayed) / x
    return p0, p1, q1, (p1 - q1) / x


def _series(x: Number) -> tuple[Number, Number, Number, Number]:
    """By Horner; p_0 and q_1 follow without loss of digits."""
    p1 = q2 = 0.0 * x
    for first, second in _TERMS:
        p1, q2 = first - x * p1, second - x * q2
    return 1.0 - x * p1, p1, p1 - x * q2, q2
