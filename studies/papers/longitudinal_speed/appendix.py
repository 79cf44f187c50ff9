"""The recursions of P2's appendix, as printed and corrected, for one measurement at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov

from studies.papers.longitudinal_speed.inputs import constant, noise
from studies.papers.longitudinal_speed.unknown_start import both_tests
from synthesis.polynomials.matrix import FloatArray

SPEED = 40.0  # rad/s


@dataclass(frozen=True)
class Setting:
    """One sampled model at constant speed with Q = q I and its steady filter."""

    A: FloatArray
    C: FloatArray
    Q: FloatArray
    R: FloatArray
    steady: FloatArray
    gain: FloatArray


def setting(speed: float = SPEED) -> Setting:
    """The three-state model at this wheel speed."""
    sequence = constant(speed, 1).sequence
    q, R = noise()
    A, C, Q = sequence.A[0], sequence.C[0], q * np.eye(3)
    steady = solve_discrete_are(A.T, C.T, Q, R)
    return Setting(A, C, Q, R, steady, A @ steady @ C.T / (C @ steady @ C.T + R))


@dataclass(frozen=True)
class FixedGain:
    """Traces over steps of (A4) printed and with + Q, and of the closed sum (A5), from the same start; where (A4) ends."""

    printed: FloatArray
    corrected: FloatArray
    summed: FloatArray
    filter: float
    printed_limit: float
    corrected_limit: float


def fixed_gain(s: Setting, steps: int = 1500, corrected_noise: float = 1.0) -> FixedGain:
    """(A4) and (A5) with K* the gain of the steady filter, from four times its covariance."""
    closed = s.A - s.gain @ s.C
    noise_term = s.gain @ s.R @ s.gain.T
    start = 4.0 * s.steady
    printed = corrected = start
    powers, total = np.eye(3), np.zeros((3, 3))
    traces = np.empty((3, steps))
    for k in range(steps):
        printed = closed @ printed @ closed.T + noise_term
        corrected = closed @ corrected @ closed.T + noise_term + corrected_noise * s.Q
        total = total + powers @ (noise_term + s.Q) @ powers.T
        powers = closed @ powers
        traces[:, k] = [np.trace(m) for m in (printed, corrected, powers @ start @ powers.T + total)]
    ends = [solve_discrete_lyapunov(closed, noise_term + share * s.Q) for share in (0.0, corrected_noise)]
    return FixedGain(
        traces[0], traces[1], traces[2], float(np.trace(s.steady)), float(np.trace(ends[0])), float(np.trace(ends[1]))
    )


def first_split(s: Setting) -> dict[str, float]:
    """How far M_1, N_1 of (A6), and M_1 of (A7) with phi_{0,0} as printed and phi_{1,0}, are from the exact recursion."""
    found = both_tests(constant(SPEED, 3))
    root = np.sqrt(s.R[0, 0])
    Sigma = s.C.T / root
    W = 1.0 / (Sigma.T @ Sigma)
    unseen = np.eye(3) - Sigma @ W @ Sigma.T
    N1 = s.Q + s.A @ Sigma @ W @ W @ Sigma.T @ s.A.T
    M1 = s.A @ unseen @ s.A.T
    return {
        "M1_of_A6": _distance(M1, found.M[1]),
        "N1_of_A6": _distance(N1, found.N[1]),
        "M1_of_A7_as_printed": _distance(unseen, found.M[1]),
        "M1_of_A7_with_later_transition": _distance(M1, found.M[1]),
    }


def remainder(s: Setting, N: FloatArray, S: FloatArray, sign: float) -> FloatArray:
    """(A8) to first order in S: `sign` of T in the first bracket, -1 corrected, +1 as printed."""
    Xi = np.sqrt(s.R + s.C @ N @ s.C.T)  # one output
    known, unknown = s.A @ N @ s.C.T / Xi, s.A @ S @ s.C.T / Xi
    T = s.C @ S @ s.C.T / (Xi @ Xi)
    inner = np.eye(1) - T
    return np.asarray(
        s.A @ S @ s.A.T
        - known @ (sign * T) @ known.T
        - known @ inner @ unknown.T
        - unknown @ inner @ known.T
        - unknown @ inner @ unknown.T
    )


def remainder_errors(s: Setting, sizes: tuple[float, ...] = (1e-2, 1e-4, 1e-6)) -> dict[float, tuple[float, float]]:
    """Relative error of (A8) with the printed and with the corrected sign, for remainders of these sizes."""
    N = both_tests(constant(SPEED, 12)).N[-1]
    out = {}
    for size in sizes:
        S = size * s.steady
        exact = _riccati(s, N + S) - _riccati(s, N)
        printed, corrected = (_distance(remainder(s, N, S, sign), exact) for sign in (1.0, -1.0))
        out[size] = (printed, corrected)
    return out


def _riccati(s: Setting, P: FloatArray) -> FloatArray:
    gain = s.A @ P @ s.C.T / (s.C @ P @ s.C.T + s.R)
    return np.asarray(s.A @ P @ s.A.T - gain @ s.C @ P @ s.A.T + s.Q)


def _distance(found: FloatArray, exact: FloatArray) -> float:
    return float(np.abs(found - exact).max() / np.abs(exact).max())
