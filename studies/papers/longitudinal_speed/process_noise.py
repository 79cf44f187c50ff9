"""The Kalman filter of P2 (20)-(22) in the readings of its printed scalar process covariance."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_discrete_are

from studies.papers.longitudinal_speed.inputs import PACKAGE, SAMPLE_TIME, constant, noise, structures
from studies.papers.longitudinal_speed.stochastic_observability import STRUCTURES
from studies.papers.topic import Topic
from studies.plots import DASHES, Axis, Figure, Line, Panel
from studies.plots.colours import CURVES
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
SPEED = 40.0  # rad/s
READINGS = [(structure, mode) for structure in STRUCTURES for mode in ("normal", "high_slip")]


def filter_response(speed: float, structure: str, mode: str) -> tuple[float, float]:
    """Gain of the velocity (filtered form, m/s per unit of normalised force) and slowest time constant in s.

    At a constant wheel speed in rad/s, with Q = q S; the redundant mode, which no gain moves, is left out.
    """
    sequence = constant(speed, 1).sequence
    A, C = sequence.A[0], sequence.C[0]
    q, R = noise(mode)
    P = solve_discrete_are(A.T, C.T, q * structures(sequence)[structure][0], R)
    gain = P @ C.T / (C @ P @ C.T + R)
    poles = np.linalg.eigvals(A - A @ gain @ C)
    fixed = np.abs(poles - np.linalg.eigvals(A).real.min()).argmin()  # the hidden mode exp(-a T) of A itself
    slowest = float(np.abs(np.delete(poles, fixed)).max())
    return float(gain[1, 0]), -SAMPLE_TIME / float(np.log(slowest))


@TOPIC.part("covariances", "What the printed covariances can mean", 2.0)
def covariances(scope: Scope) -> PartResult:
    """Velocity gain and time constant at 40 rad/s as a table, over the wheel speed as a figure."""
    rows: list[list[Cell]] = []
    for structure, mode in READINGS:
        rows.append([structure, mode.replace("_", " "), *filter_response(SPEED, structure, mode)])
    caption = f"Steady Kalman filter at {SPEED:g} rad/s and 200 Hz for the readings of the printed scalar covariances, Q = q S."
    columns = ["S", "mode", "velocity gain [m/s]", "slowest time constant [s]"]
    table = Table("covariance-readings", caption, columns, rows)
    return PartResult(tables=[table], drawings=[response_figure(10 if scope.quick else 28)])


def response_figure(points: int = 28) -> Figure:
    """Velocity gain and slowest time constant over wheel speed for each reading of Q, both modes."""
    speeds = np.linspace(5.0, 140.0, points)
    gains, constants = [], []
    for k, (structure, mode) in enumerate(READINGS):
        found = np.array([filter_response(float(w), structure, mode) for w in speeds])
        name, color, dash = f"S = {structure}, {mode.replace('_', ' ')}", CURVES[k // 2], DASHES[k % 2]
        gains.append(Line(speeds, found[:, 0], name, color, dash))
        constants.append(Line(speeds, found[:, 1], name, color, dash))
    panels = [
        Panel(lines, "wheel speed [rad/s]", Axis(what, scale="log"))
        for lines, what in ((gains, "velocity gain [m/s per unit of μ]"), (constants, "slowest time constant [s]"))
    ]
    return Figure(
        "covariance-readings",
        "Steady Kalman filter of the three-state model for three readings of the printed scalar Q = q S (normal: q = 2.5e-3, "
        "R = 1e-3; high slip: q = 3.3e-4, R = 0.21): gain from the innovation to the velocity, and slowest time constant "
        "without the hidden mode. For S = I both modes coincide. Only S = B B' corrects the velocity by the force within "
        "milliseconds and can be switched down. P2 (20)-(22).",
        "Gains near 1e-3 for the unit matrix, about 0.5 for B B' in the normal mode.",
        panels, (7.2, 3.8), legend="below", columns=3,
    )  # fmt: skip
