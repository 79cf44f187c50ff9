"""Spectral radius of one sample of the observer error over wheel speed and sample rate, and what the lasting schemes cost."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from studies.beyond.implementability.break_rates import unstable_wheel_speeds
from studies.beyond.implementability.designs import PAPER_RATE, WHEEL_SPEED, Design, printed_designs, shipped_designs
from studies.beyond.implementability.updates import BREAKABLE, LASTING, UPDATES, exact_closed_loop, spectral_radius
from studies.papers.topic import Topic
from studies.plots import Axis, Contours, Figure, Level, Line, Map, Mark, Panel
from studies.plots.colours import BLUE, DIVERGING, ORANGE, RED
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic("studies.beyond.implementability")
RATES = (50.0, 100.0, 200.0, 500.0, 1000.0)  # Hz
RATE_TICKS = (20, 50, 100, 200, 500, 1000, 2000)


@TOPIC.part("printed", "Spectral radius of the printed gains", 1.5)
def printed(scope: Scope) -> PartResult:
    """Spectral radius of the printed gains."""
    return PartResult(
        (), [radius_table(printed_designs())], [map_figure(printed_designs(), 41 if scope.quick else 141)]
    )


@TOPIC.part("shipped", "Spectral radius of the shipped schedules", 1.5, quick=False)
def shipped(scope: Scope) -> PartResult:
    """Spectral radius of the shipped schedules."""
    designs = shipped_designs()
    note = (
        "The shipped schedules are designed and proved for the exact closed-loop update at 200 Hz, with a pole "
        "limit of 600 1/s (longitudinal) and 300 1/s (lateral). They are not meant for, and longitudinally not "
        "stable in, the simpler updates at that rate."
    )
    return PartResult((), [radius_table(designs)], [map_figure(designs, 41 if scope.quick else 141)], [note])


def radius_table(designs: Sequence[Design]) -> Table:
    """Largest spectral radius over the wheel speeds, and the unstable wheel speeds at 200 Hz."""
    rows: list[list[Cell]] = []
    for design in designs:
        A, L, C = design.matrices(design.grid())
        for scheme, update in UPDATES.items():
            largest = [float(spectral_radius(update(A, L, C, np.full(len(A), 1.0 / rate))).max()) for rate in RATES]
            unstable = unstable_wheel_speeds(design, scheme, 0.005)
            text = "; ".join(f"{low:.2f} to {high:.2f}" for low, high in unstable) or "none"
            rows.append([design.name, scheme, *(round(value, 4) for value in largest), text])
    return Table(
        f"spectral-radius-{designs[0].kind}",
        "Largest spectral radius over the wheel speeds 0 to 140 rad/s at five sample rates (above 1 the error grows "
        "by this factor in every sample), and the wheel speeds that are unstable at the 200 Hz of the papers.",
        ("design", "discretisation", *(f"radius at {rate:g} Hz [1]" for rate in RATES), "unstable at 200 Hz [rad/s]"), rows,
    )  # fmt: skip


def map_figure(designs: Sequence[Design], points: int) -> Figure:
    """Spectral radius over wheel speed and sample rate: one row for each design, one column for each scheme."""
    speed, rate = np.linspace(*WHEEL_SPEED, points), np.geomspace(20.0, 2000.0, points)
    rows: list[list[Panel]] = []
    for design in designs:
        (A, L, C), row = design.matrices(speed), []
        for k, (scheme, update) in enumerate(BREAKABLE.items()):
            radius = spectral_radius(update(A[:, None], L[:, None], C[:, None], 1.0 / rate)).T
            marks: list[Mark] = [
                Map(speed, rate, np.log10(np.clip(radius, 0.1, 10.0)), colors=DIVERGING, low=-1.0, high=1.0),
                Contours(speed, rate, radius, [1.0], "black", width=1.3, numbers=""),
                Level(PAPER_RATE, color="black", dash="dotted", width=0.9),
            ]
            label = "" if k else f"{design.name.removeprefix('schedule ')}\nsample rate [Hz]"
            x, y = "wheel speed [rad/s]" if design is designs[-1] else "", Axis(label, scale="log", ticks=RATE_TICKS)
            row.append(Panel(marks, x, y, "" if rows else scheme, grid=False))
        rows.append(row)
    kind = "printed gains" if designs[0].kind == "printed" else "shipped schedules"
    return Figure(
        f"map-{designs[0].kind}",
        f"Spectral radius of one sample of the observer error for {kind}, over wheel speed and sample rate, in "
        "three discretisations. Red: the error grows; blue: it shrinks; black line: radius 1; dotted: the 200 Hz "
        "of the papers. The wheel speed is held constant.",
        "Grid of colour maps, red below a black line at low sample rates and blue above it; the line rises or "
        "falls with wheel speed depending on the scheme.",
        rows, (9.6, 1.0 + 1.95 * len(designs)), share_x="all", share_y="all", bar="log₁₀ of the spectral radius [1]",
    )  # fmt: skip


@TOPIC.part("lasting-schemes", "What the schemes that never break cost", 0.3)
def lasting(scope: Scope) -> PartResult:
    """What the schemes that never break do to the slowest pole."""
    rate, panels = np.geomspace(20.0, 2000.0, 41 if scope.quick else 121), []
    for k, design in enumerate((*printed_designs()[:3], shipped_designs()[0])):
        A, L, C = design.matrices(design.grid(29))
        slowest = (-np.log(spectral_radius(exact_closed_loop(A, L, C, 1e-4)))).min() / 1e-4
        marks: list[Mark] = [Level(x=PAPER_RATE, color="black", dash="dotted", width=0.9)]
        for (scheme, update), colour in zip(LASTING.items(), (BLUE, RED, ORANGE), strict=True):
            radius = spectral_radius(update(A[:, None], L[:, None], C[:, None], 1.0 / rate)).max(axis=0)
            marks.append(Line(rate, -np.log(radius) * rate / slowest, scheme, colour))
        x = Axis("sample rate [Hz]", scale="log", ticks=(20, 100, 500, 2000))
        y = Axis("" if k else "worst decay rate / continuous one [1]", 0.0, 1.6)
        panels.append(Panel(marks, x, y, design.name.removeprefix("schedule "), "" if k else "upper left"))
    figure = Figure(
        "lasting-schemes",
        "Discretisations that are stable at every sample rate, and what they keep of the designed convergence: "
        "slowest decay rate over all wheel speeds, divided by that of the continuous observer. The exact "
        "closed-loop update keeps it by construction; backward Euler is slower; Tustin maps poles faster than two "
        "samples close to minus one, so the error rings and decays more slowly. Dotted: 200 Hz.",
        "One panel for each design with three curves over the sample rate; the exact one is constant at one, the "
        "others fall towards zero at low rates.",
        panels, (9.6, 3.7), share_y="all",
    )  # fmt: skip
    return PartResult(figures=[figure])
