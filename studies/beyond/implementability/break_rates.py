"""The sample rate at which a discretisation becomes unstable: exact, by root finding on Jury's conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from studies.beyond.implementability.designs import PAPER_RATE, WHEEL_SPEED, Design, printed_designs, shipped_designs
from studies.beyond.implementability.updates import BREAKABLE, LASTING, UPDATES, Update, jury_margin
from studies.papers.topic import Topic
from studies.plots import DASHES, Axis, Figure, Level, Line, Mark, Panel, Words
from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE, RED
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic("studies.beyond.implementability")
BISECTIONS = 50
SAMPLE_TIMES = np.geomspace(1e-5, 1.0, 601)  # s, scanned for the first loss of stability


@dataclass(frozen=True)
class BreakCurve:
    """Smallest unstable sample time (g,) in s over wheel speeds (g,) in rad/s (inf: none up to 1 s) and the worst place.

    `worst_rate` in Hz: every wheel speed of the range is stable above it (0: at every rate from 1 Hz up). `connected`: no
    sample time above the first unstable one was found stable again.
    """

    wheel_speed: FloatArray
    sample_time: FloatArray
    worst_rate: float
    worst_wheel_speed: float
    connected: bool

    @property
    def rate(self) -> FloatArray:
        """Break rate in Hz over the wheel speeds; 0 where nothing breaks."""
        return np.asarray(1.0 / self.sample_time)


def first_breaks(design: Design, update: Update, wheel_speed: FloatArray) -> tuple[FloatArray, bool]:
    """The smallest unstable sample times (g,) in s at wheel speeds (g,) (inf: none up to 1 s), and whether all longer ones are.

    A scan brackets the first change of sign of the margin, bisection follows it to the last bit.
    """
    A, L, C = design.matrices(wheel_speed)
    stable = jury_margin(update(A[:, None], L[:, None], C[:, None], SAMPLE_TIMES)) > 0.0
    first, lasting = stable.argmin(axis=1), stable.all(axis=1)
    after = np.arange(len(SAMPLE_TIMES)) >= first[:, None]
    connected = not (stable & after)[~lasting].any()
    if (first[~lasting] == 0).any():
        remedy = "check the signs of its gains"
        raise AnalysisError(f"design '{design.name}' is unstable already at {SAMPLE_TIMES[0]:g} s; {remedy}")
    low, high = SAMPLE_TIMES[np.maximum(first - 1, 0)], SAMPLE_TIMES[first]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        good = jury_margin(update(A, L, C, middle)) > 0.0
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return np.where(lasting, np.inf, high), connected


def _margin(design: Design, update: Update, wheel_speed: float, sample_time: float) -> float:
    A, L, C = design.matrices(np.array([wheel_speed]))
    return float(jury_margin(update(A, L, C, np.array([sample_time])))[0])


def _break_nearby(design: Design, update: Update, wheel_speed: float, near: float) -> float:
    """The break at one wheel speed, given that at a neighbour [s]: a bracket by steps of 2 %, then Brent's method."""
    margin = partial(_margin, design, update, wheel_speed)
    low = high = near
    while margin(low) <= 0.0:
        low *= 0.98
    while margin(high) > 0.0 and high < SAMPLE_TIMES[-1]:
        high *= 1.02
    if margin(high) > 0.0:
        return float("inf")
    return low if low == high else float(brentq(margin, low, high, xtol=1e-15, rtol=1e-13))


def break_curve(design: Design, scheme: str, points: int = 141) -> BreakCurve:
    """The break over the whole range of wheel speeds, and the worst of it refined between the grid points."""
    update, grid = UPDATES[scheme], design.grid(points)
    times, connected = first_breaks(design, update, grid)
    k = int(times.argmin())
    if not np.isfinite(times[k]):
        return BreakCurve(grid, times, 0.0, float("nan"), connected)
    best, place = float(times[k]), float(grid[k])
    for low, high in ((k - 1, k), (k, k + 1)):
        if low >= 0 and high < len(grid) and np.isfinite(times[[low, high]]).all():
            nearby = partial(_break_nearby, design, update, near=times[k])
            inner = minimize_scalar(nearby, bounds=(grid[low], grid[high]), method="bounded")
            if inner.fun < best:
                best, place = float(inner.fun), float(inner.x)
    return BreakCurve(grid, times, 1.0 / best, place, connected)


def unstable_wheel_speeds(design: Design, scheme: str, sample_time: float) -> tuple[tuple[float, float], ...]:
    """Intervals of the wheel speed in rad/s on which the update is unstable at one sample time, edges by root finding."""
    update, grid = UPDATES[scheme], design.grid(561)
    A, L, C = design.matrices(grid)
    bad = jury_margin(update(A, L, C, np.full(len(grid), sample_time))) <= 0.0
    roots = [
        float(brentq(lambda speed: _margin(design, update, speed, sample_time), grid[k], grid[k + 1], xtol=1e-12))
        for k in np.flatnonzero(np.diff(bad.astype(int)))
    ]
    bounds = ([float(grid[0])] if bad[0] else []) + roots + ([float(grid[-1])] if bad[-1] else [])
    return tuple(zip(bounds[::2], bounds[1::2], strict=True))


def break_curves(designs: Sequence[Design], points: int) -> dict[tuple[str, str], BreakCurve]:
    """Of every breakable scheme, by the names of design and scheme."""
    return {(d.name, s): break_curve(d, s, points) for s in BREAKABLE for d in designs}


@TOPIC.part("break-rates", "Sample rates at which each discretisation breaks", 6.0)
def rates(scope: Scope) -> PartResult:
    """Exact break rates over the wheel speeds; the worst of each design and scheme, and where it breaks."""
    designs = (*printed_designs(), *shipped_designs())
    curves = break_curves(designs, 36 if scope.quick else 141)
    measures = {f"break rate {name}, {scheme} [Hz]": curve.worst_rate for (name, scheme), curve in curves.items()}
    if not all(curve.connected for curve in curves.values()):
        raise AnalysisError("a discretisation becomes stable again at a lower rate: its break rate says too little")
    note = (
        "Each scheme is unstable at every rate below its break rate (down to 1 Hz) and stable at every rate above "
        "it: no second window was found. The wheel speed is held constant; what a moving wheel speed may do is "
        "proved for the shipped schedules with the exact update alone."
    )
    rows: list[list[Cell]] = []
    for design in designs:
        worst = [(c.worst_rate, c.worst_wheel_speed) for c in (curves[design.name, scheme] for scheme in BREAKABLE)]
        rows.append([design.name, *(round(value, 2) for pair in worst for value in pair)])
    columns = [text for scheme in BREAKABLE for text in (f"{scheme}: needs [Hz]", f"{scheme}: worst at [rad/s]")]
    table = Table(
        "break-rates",
        "Sample rate that each discretisation needs to be stable at every constant wheel speed from 0 to 140 "
        f"rad/s, and the wheel speed at which it breaks first, by root finding. {', '.join(LASTING)} are stable at "
        "every rate, as the continuous observers are.",
        ["design", *columns], rows,
    )  # fmt: skip
    return PartResult((), [table], [rate_figure(curves)], [note], measures)


def rate_figure(curves: Mapping[tuple[str, str], BreakCurve]) -> Figure:
    """Break rate over the wheel speed, one panel for each scheme."""
    panels, ticks = [], (20, 50, 100, 200, 500, 1000)
    for k, scheme in enumerate(BREAKABLE):
        marks: list[Mark] = [Level(PAPER_RATE, color="black", dash="dotted", width=0.9)]
        for designs in (printed_designs(), shipped_designs()):
            for design, colour in zip(designs, (BLUE, RED, ORANGE, GREEN, PURPLE), strict=True):
                curve, own = curves[design.name, scheme], design.kind == "shipped"
                marks.append(Line(curve.wheel_speed, curve.rate, design.name, colour, DASHES[own], 1.1 if own else 1.8))
        if k == 1:
            marks.append(Words(2.0, 0.97 * PAPER_RATE, "200 Hz", vertical="top"))
        y = Axis("" if k else "sample rate below which it is unstable [Hz]", 20.0, 1200.0, "log", ticks)
        panels.append(Panel(marks, Axis("wheel speed [rad/s]", *WHEEL_SPEED), y, scheme))
    return Figure(
        "break-rates",
        "Sample rate below which the error of the observer grows, over the wheel speed (held constant), for the gains "
        "printed by P1 and P3 (solid) and the five shipped schedules (dashed). Forward Euler is limited by the fastest "
        "pole; a sampled innovation breaks at low speed, where the tire force is stiffest; predicting and then adding T·L "
        "breaks at high speed. Above the dotted line a curve means unstable at the 200 Hz of the papers. Tustin, backward "
        "Euler and the exact closed-loop update of the runtime have no curve: they never break.",
        "Three panels of break rate over wheel speed on a logarithmic scale; longitudinal gains lie between 100 and "
        "900 Hz, lateral ones mostly below 200 Hz except for the third scheme.",
        panels, (10.0, 5.0), "below", share_y="all",
    )  # fmt: skip
