"""Constant gains in the plane of L1 and L2: what each pair does over the whole range of wheel speeds."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from studies.beyond.well_posed_design.achieved import COLUMNS, Achieved, achieved, printed_achieved, short
from studies.beyond.well_posed_design.cases import PACKAGE, Case, all_cases
from studies.papers.topic import Topic
from studies.plots import Axis, Box, Contours, Figure, Line, Map, Mark, Panel, dots
from studies.plots.colours import BLUE, GREEN, ORANGE, RED
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
WHEEL_SPEEDS = 8


def gain_plane(case: Case, points: int) -> tuple[FloatArray, FloatArray, Achieved]:
    """L1 (m,) in m/s and L2 (m,) in m/s^2 around the printed gains and ranges, and what the pairs do, fields (m, m).

    L2 runs over two decades.
    """
    (_, high), (low, top) = case.printed_range
    first = np.linspace(0.02, 1.35 * max(high, case.printed[0]), points)
    second = np.geomspace(0.2 * low, 4.0 * max(top, case.printed[1]), points)
    pairs = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1)
    gains = np.broadcast_to(pairs[:, :, None, :], (points, points, WHEEL_SPEEDS, 2))
    return first, second, achieved(case, gains, case.grid(WHEEL_SPEEDS))


@TOPIC.part("gain-plane", "Printed and shipped gains on the map", 6.0)
def planes(scope: Scope) -> PartResult:
    """Printed gains and shipped schedules by the same measures; decay, fastest pole and noise of constant gains."""
    rows, points = list[list[Cell]](), 15 if scope.quick else 57
    for case in all_cases():
        grid = case.grid(points)
        shipped = achieved(case, GainSchedule.shipped(case.name).gain(grid)[..., 0], grid)
        for what, found in (("printed gains", printed_achieved(case, points)), ("shipped schedule", shipped)):
            rows.append([case.title, what, *short([float(value) for value in found])])
    table = Table(
        "comparison",
        "Printed gains and shipped schedules by the same measures, at the worst constant wheel speed from 0 to 140 "
        "rad/s. Friction and force noise are at their static floors in nearly all rows; decay, fastest pole and "
        "broadband noise tell the gains apart.",
        ("case", "gains", *COLUMNS), rows,
    )  # fmt: skip
    panels = []
    for case in all_cases():
        x, y, fields = gain_plane(case, 21 if scope.quick else 61)
        darkest = 3.0 * float(printed_achieved(case).noise_density)
        decay, fastest = case.design.decay_rate, float(case.design.fastest_pole or 0.0)
        marks: list[Mark] = [Map(x, y, fields.noise_density.T, "H₂ gain, force noise [m/s·√Hz]", "Greys", 0.0, darkest)]
        first, second = GainSchedule.shipped(case.name).table[:, :, 0].T
        marks += [
            Contours(x, y, fields.slowest.T, [decay * f for f in (0.25, 0.5, 1.0, 2.0, 4.0)], BLUE, width=1.2),
            Contours(x, y, fields.fastest.T, [fastest * f for f in (0.5, 1.0, 2.0)], ORANGE, "dashed", 1.2),
            Contours(x, y, fields.friction.T, [1.001, 1.1], GREEN, "dotted", 1.2),
            Box(*case.printed_range, "printed range", RED, 1.2),
            dots(*case.printed, "printed gains", RED, "*", 12, edge="white"),
            Line(first, second, "shipped schedule", "black", marker="o", size=3, width=1.3),
            dots(first[:1], second[:1], "shipped, at standstill", "black", size=6, hollow=True),
        ]
        panels.append(Panel(marks, "$L_1$ [m/s]", Axis("$L_2$ [m/s²]", scale="log"), case.title, grid=False))
    figure = Figure(
        "gain-plane",
        "Constant gains and what they do at the worst constant wheel speed between 0 and 140 rad/s. Blue: slowest "
        "pole, the decay rate [1/s]; orange: fastest pole [1/s]; green: gain from friction to the velocity error, "
        "which has the floor 1; grey: H₂ gain from white force noise. L₂ sets the decay and the noise, L₁ the fast "
        "pole, and friction hardly tells gains apart: between the dotted lines it is at its floor. White: "
        "unstable. Star and box: printed gains and ranges; black: the shipped schedules.",
        "Four maps over L1 and L2 (logarithmic) with blue contours of the decay rate, nearly horizontal at low L2, orange "
        "contours of the fastest pole, a red star for the printed gains and a black curve for the shipped schedule.",
        [panels[:2], panels[2:]], (10.0, 7.8), "below",
    )  # fmt: skip
    return PartResult((), [table], [figure])
