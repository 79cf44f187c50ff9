"""The Kalman filter (20)-(22) in steady state: P2-A, the appendix's recursions of its covariance, and readings of its Q.

Each recursion is shown to fail as printed and to hold corrected, for one measurement at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are, solve_discrete_lyapunov

from estimators.arrays import FloatArray
from studies.claim import Finding
from studies.papers.longitudinal_speed.inputs import SAMPLE_TIME, constant, noise, structures, topic
from studies.papers.longitudinal_speed.stochastic_observability import STRUCTURES, both_tests
from studies.papers.verdicts import erratum
from studies.plots import DASHES, Axis, Figure, Line, Panel, colours
from studies.study import PartResult, Scope, Table

TOPIC = topic()
SPEED = 40.0  # rad/s
READINGS = [(structure, mode) for structure in STRUCTURES for mode in ("normal", "high_slip")]
EXACT, CLOSE = 1e-9, 1e-4  # relative; the latter for a first-order formula at a remainder of 1e-6


class SteadyFilter(NamedTuple):
    """The three-state model sampled at a constant speed, and the predicted covariance P of its steady filter."""

    A: FloatArray
    C: FloatArray
    Q: FloatArray
    R: FloatArray
    P: FloatArray


def steady_filter(speed: float = SPEED, structure: str = "I", mode: str = "normal") -> SteadyFilter:
    """At a wheel speed in rad/s, with Q = q S, from the Riccati equation of (21), (22)."""
    sequence = constant(speed, 1).sequence
    q, R = noise(mode)
    A, C, Q = sequence.A[0], sequence.C[0], q * structures(sequence)[structure][0]
    return SteadyFilter(A, C, Q, R, solve_discrete_are(A.T, C.T, Q, R))


def fixed_gain(s: SteadyFilter, noise_share: float = 1.0, steps: int = 1500) -> tuple[FloatArray, list[float]]:
    """Traces (3, steps) of (A4) as printed, of (A4) with `noise_share` Q and of the sum (A5), and where both (A4) end.

    K* is the gain of the steady filter, the start four times its covariance.
    """
    K = s.A @ s.P @ s.C.T / (s.C @ s.P @ s.C.T + s.R)
    closed, measured = s.A - K @ s.C, K @ s.R @ K.T
    added = np.stack([0.0 * s.Q, noise_share * s.Q])
    P = start = 4.0 * s.P
    powers, total = np.eye(3), np.zeros((3, 3))
    traces = np.empty((3, steps))
    for k in range(steps):
        P = closed @ P @ closed.T + measured + added
        total = total + powers @ (measured + s.Q) @ powers.T
        powers = closed @ powers
        traces[:, k] = [np.trace(m) for m in (*P, powers @ start @ powers.T + total)]
    return traces, [float(np.trace(solve_discrete_lyapunov(closed, measured + Q))) for Q in added]


def first_split(s: SteadyFilter) -> dict[str, float]:
    """How far M_1, N_1 of (A6), and M_1 of (A7) with phi_{0,0} as printed and phi_{1,0}, are from the exact recursion."""
    found = both_tests(constant(SPEED, 3))
    Sigma = s.C.T / np.sqrt(s.R[0, 0])
    W = 1.0 / (Sigma.T @ Sigma)
    unseen = np.eye(3) - Sigma @ W @ Sigma.T
    M1, N1 = s.A @ unseen @ s.A.T, s.Q + s.A @ Sigma @ W @ W @ Sigma.T @ s.A.T
    M1_error = _distance(M1, found.M[1])
    return {"M1_of_A6": M1_error, "N1_of_A6": _distance(N1, found.N[1]), "M1_of_A7_as_printed": _distance(unseen, found.M[1]),
            "M1_of_A7_with_later_transition": M1_error}  # fmt: skip


def remainder(s: SteadyFilter, N: FloatArray, S: FloatArray, sign: float) -> FloatArray:
    """(A8) to first order in S: `sign` of T in the first bracket, -1 corrected, +1 as printed."""
    Xi = np.sqrt(s.R + s.C @ N @ s.C.T)  # one output
    known, unknown = s.A @ N @ s.C.T / Xi, s.A @ S @ s.C.T / Xi
    T = s.C @ S @ s.C.T / (Xi @ Xi)
    crossed, small = known @ (1.0 - T) @ unknown.T, unknown @ (1.0 - T) @ unknown.T
    return np.asarray(s.A @ S @ s.A.T - known @ (sign * T) @ known.T - crossed - crossed.T - small)


def remainder_errors(s: SteadyFilter, sizes: tuple[float, ...] = (1e-6,)) -> list[list[float]]:
    """Relative error of (A8) with the printed and with the corrected sign, for remainders of these sizes."""
    N = both_tests(constant(SPEED, 12)).N[-1]
    exact = {size: _riccati(s, N + size * s.P) - _riccati(s, N) for size in sizes}
    signs = (1.0, -1.0)
    return [[_distance(remainder(s, N, size * s.P, sign), step) for size, step in exact.items()] for sign in signs]


def _riccati(s: SteadyFilter, P: FloatArray) -> FloatArray:
    gain = s.A @ P @ s.C.T / (s.C @ P @ s.C.T + s.R)
    return np.asarray(s.A @ P @ s.A.T - gain @ s.C @ P @ s.A.T + s.Q)


def _distance(found: FloatArray, exact: FloatArray) -> float:
    return float(np.abs(found - exact).max() / np.abs(exact).max())


@TOPIC.claim("P2-A")
def appendix(noise_share: float = 1.0) -> Finding:
    """(A4) without Q and with `noise_share` Q, (A6), (A7) with both transitions, (A8) with both signs."""
    s = steady_filter()
    (_, corrected, summed), ends = fixed_gain(s, noise_share)
    missing, complete = (end / float(np.trace(s.P)) for end in ends)
    sums_agree = float(np.abs(corrected / summed - 1.0).max())
    split, ((plus,), (minus,)) = first_split(s), remainder_errors(s)
    computed = {"A4_printed_over_filter_covariance": missing, "A4_with_Q_over_filter_covariance": complete,
                "A4_with_Q_against_A5": sums_agree, **split, "A8_error_with_printed_sign": plus,
                "A8_error_with_corrected_sign": minus}  # fmt: skip
    reading = (
        f"(A4) lacks + Q: as printed it ends at {missing:.3g} of the covariance of the very filter that it bounds, with Q at "
        f"{complete:.6f}, and it then equals (A5). (A6) holds. (A7) needs phi_(k+1,0) in M_(k+1): with phi_(k,0) M_1 is off "
        f"by {100 * split['M1_of_A7_as_printed']:.0f} %. The first bracket of (A8) needs - T/psi: the printed plus is off by "
        f"{100 * plus:.0f} %, the minus by {minus:.0e}."
    )
    printed_holds = abs(missing - 1.0) <= EXACT and split["M1_of_A7_as_printed"] <= EXACT and plus <= CLOSE
    exact = max(sums_agree, abs(complete - 1.0), split["M1_of_A6"], split["N1_of_A6"]) <= EXACT
    return Finding(computed, erratum(printed_holds, exact and minus <= CLOSE), reading)


@TOPIC.part("appendix", "Recursions of the appendix")
def recursions(scope: Scope) -> PartResult:
    """(A4) with and without Q, and the error of (A8) with both signs."""
    s, sizes = steady_filter(), (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    printed, corrected, summed = fixed_gain(s)[0] / np.trace(s.P)
    time, (plus, minus) = SAMPLE_TIME * np.arange(1, len(printed) + 1), remainder_errors(s, sizes)
    traces = [
        Line(time, corrected, "(A4) with + Q", colours.BLUE), Line(time, summed, "(A5)", colours.ORANGE, "dotted", 2.2),
        Line(time, printed, "(A4) as printed", colours.RED, "dashed"),
    ]  # fmt: skip
    wrong = Line(sizes, plus, "+ T/ψ, as printed", colours.RED, "dashed", marker="s")
    errors = [wrong, Line(sizes, minus, "− T/ψ", colours.BLUE, marker="o")]
    labels = "trace over that of the filter [1]", "size of the remainder S over N [1]", "relative error of (A8) [1]"
    trace, size, error = (Axis(label, scale="log") for label in labels)
    figure = Figure(
        "appendix",
        "Left: trace of the fixed-gain covariance at 40 rad/s, started at four times that of the filter. Without + Q, (A4) "
        "falls below the covariance that it is meant to bound; with it, it is (A5). Right: first-order remainder (A8) "
        "against the exact difference of two Riccati steps: with the printed sign it does not converge.",
        "Left: two lines end at one, the printed one keeps falling. Right: one error falls with the size, the other stays "
        "near one.",
        [Panel(traces, "time [s]", trace, legend="best"), Panel(errors, size, error, legend="best")], (7.2, 3.4),
    )  # fmt: skip
    return PartResult(TOPIC.found(), figures=[figure])


def filter_response(speed: float, structure: str, mode: str) -> tuple[float, float]:
    """Gain of the velocity (filtered form, m/s per unit of normalised force) and slowest time constant in s.

    At a constant wheel speed in rad/s, with Q = q S; the redundant mode, which no gain moves, is left out.
    """
    A, C, _, R, P = steady_filter(speed, structure, mode)
    gain = P @ C.T / (C @ P @ C.T + R)
    poles = np.linalg.eigvals(A - A @ gain @ C)
    fixed = np.abs(poles - np.linalg.eigvals(A).real.min()).argmin()  # the hidden mode exp(-a T) of A itself
    slowest = float(np.abs(np.delete(poles, fixed)).max())
    return float(gain[1, 0]), -SAMPLE_TIME / float(np.log(slowest))


@TOPIC.part("covariances", "What the printed covariances can mean", 2.0)
def covariances(scope: Scope) -> PartResult:
    """Velocity gain and time constant at 40 rad/s as a table, over the wheel speed as a figure."""
    rows = [
        (structure, mode.replace("_", " "), *filter_response(SPEED, structure, mode)) for structure, mode in READINGS
    ]
    caption = f"Steady Kalman filter at {SPEED:g} rad/s and 200 Hz for the readings of the printed scalar covariances, Q = q S."
    columns = ["S", "mode", "velocity gain [m/s]", "slowest time constant [s]"]
    table = Table("covariance-readings", caption, columns, rows)
    speeds = np.linspace(5.0, 140.0, 10 if scope.quick else 28)
    found = [np.array([filter_response(float(w), *reading) for w in speeds]) for reading in READINGS]
    names = [f"S = {structure}, {mode.replace('_', ' ')}" for structure, mode in READINGS]
    looks = [(name, colours.CURVES[k // 2], DASHES[k % 2]) for k, name in enumerate(names)]
    labels = "velocity gain [m/s per unit of μ]", "slowest time constant [s]"
    panels = [
        Panel([Line(speeds, values[:, i], *look) for values, look in zip(found, looks, strict=True)],
              "wheel speed [rad/s]", Axis(label, scale="log"))
        for i, label in enumerate(labels)
    ]  # fmt: skip
    figure = Figure(
        "covariance-readings",
        "Steady Kalman filter of the three-state model for three readings of the printed scalar Q = q S (normal: q = 2.5e-3, "
        "R = 1e-3; high slip: q = 3.3e-4, R = 0.21): gain from the innovation to the velocity, and slowest time constant "
        "without the hidden mode. For S = I both modes coincide. Only S = B B' corrects the velocity by the force within "
        "milliseconds and can be switched down. P2 (20)-(22).",
        "Gains near 1e-3 for the unit matrix, about 0.5 for B B' in the normal mode.",
        panels, (7.2, 3.8), legend="below", columns=3,
    )  # fmt: skip
    return PartResult(tables=[table], figures=[figure])
