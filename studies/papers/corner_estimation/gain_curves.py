r"""P1-hinf-figs: which problems have the plotted gains of Figs 3 and 4 as their answer.

A steady Kalman filter, which (30) does not state, fits the figures. Noise intensities: friction q_z, acceleration error
q_a, force noise 1; friction enters the output as well, so process and measurement noise are correlated. Spectral
factorisation of the frozen filter, a = kappa R_e |omega|:

    L2 = sqrt(q_a/(1 + sigma1^2 q_z)) at every wheel speed,
    (1 + sigma1^2 q_z)(p1^2 - 2 p0) = q_z sigma0^2 + q_a (sigma1 + sigma2)^2 + a^2

with p1 = a + L1 (sigma0 - sigma1 a) + L2 (sigma1 + sigma2), p0 = L2 (sigma0 + sigma2 a). Two gains at one wheel speed
therefore determine both intensities.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_continuous_are

from estimators.schedule import GainSchedule
from studies.claim import Finding, JsonValue
from studies.papers.corner_estimation.hinf_optimum import POINTS, STATES, least_gamma, literal_design
from studies.papers.corner_estimation.inputs import (
    DESIGN_SPEED,
    DIRECTIONS,
    PACKAGE,
    SPEED,
    constants,
    corner_model,
    printed_gains,
)
from studies.papers.topic import Topic
from studies.papers.verdicts import under_specified
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Shade, dots
from studies.plots.colours import GREEN, GREY, ORANGE, PRINTED_BAND, RED
from studies.study import PartResult, Scope, Table
from synthesis.errors import ProblemError
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray
from synthesis.well_posedness import well_posedness

TOPIC = Topic(PACKAGE)
LETTER = {"longitudinal": "x", "lateral": "y"}
OUTPUTS = {"C_e = I": STATES, "C_e = [0 1]": STATES[1:], "C_e = [1 0]": STATES[:1]}
TREND_POINTS = 40  # grid of the energy trend: it asks how fast, not how much
FIT_SPEED = DESIGN_SPEED / 2  # rad/s: where the Kalman gains are made to equal the printed ones


@dataclass(frozen=True)
class Intensities:
    """Of friction and of the acceleration error, relative to that of the force noise (white, two-sided)."""

    friction: float
    acceleration: float


def fitted(direction: Direction, gains: tuple[float, ...], omega: float) -> Intensities:
    """The intensities whose steady filter has these gains at this wheel speed. Raises ProblemError if none does."""
    values = constants(direction)
    s0, s1, s2 = (values[f"sigma{i}"] for i in range(3))
    a = values["kappa"] * values["effective_radius"] * omega
    L1, L2 = gains
    p1 = a + L1 * (s0 - s1 * a) + L2 * (s1 + s2)
    p0 = L2 * (s0 + s2 * a)
    rest = p1 * p1 - 2.0 * p0 - (L2 * (s1 + s2)) ** 2
    friction = (rest - a * a) / (s0 * s0 - s1 * s1 * rest)
    if not friction > 0.0:
        raise ProblemError(f"no steady filter of the {direction} model has the gains {list(gains)} at {omega:g} rad/s")
    return Intensities(friction, L2 * L2 * (1.0 + s1 * s1 * friction))


def schedule(direction: Direction, noise: Intensities, omega: FloatArray) -> FloatArray:
    """Steady gains (g, 2) of the frozen filters at wheel speeds (g,), by the algebraic Riccati equation."""
    model = corner_model(direction, DESIGN_SPEED).on(omega)
    weights = np.diag([noise.friction, noise.acceleration, 1.0])
    out = np.empty((len(omega), 2))
    for k, (A, C, E, F) in enumerate(zip(model.A, model.C, model.E, model.F, strict=True)):
        sensor, cross = F @ weights @ F.T, E @ weights @ F.T
        P = solve_continuous_are(A.T, C.T, E @ weights @ E.T, sensor, s=cross)
        out[k] = ((P @ C.T + cross) / sensor)[:, 0]
    return out


def printed_axes(direction: Direction) -> list[tuple[float, float]]:
    """What the axes of Figs 3, 4 span: L1 in m/s and L2 in m/s^2."""
    ranges = TOPIC.printed("P1-hinf-figs")
    return [tuple(ranges[f"L{i}{LETTER[direction]}"]) for i in (1, 2)]


def _on_the_axes(gains: FloatArray, direction: Direction) -> dict[str, JsonValue]:
    """L1 and L2 of (g, 2) at both ends of the range, and whether they stay on the axes of the figure."""
    inside = [
        bool(low <= column.min() and column.max() <= high)
        for (low, high), column in zip(printed_axes(direction), gains.T, strict=True)
    ]
    return {"L1": gains[[0, -1], 0].tolist(), "L2": gains[[0, -1], 1].tolist(), "on_the_axes": inside}


@TOPIC.claim("P1-hinf-figs")
def plotted_gains(degree: int = 1, outputs: Mapping[str, tuple[str, ...]] = OUTPUTS) -> Finding:
    """Gains of the readings of C_e, how they grow towards the optimum, and a Kalman filter through the printed gains."""
    computed: dict[str, JsonValue] = {}
    spread, open_gains = 0.0, []
    for direction in DIRECTIONS:
        readings = {
            name: least_gamma(direction, degree, "corrected", errors, POINTS).gains for name, errors in outputs.items()
        }
        largest = [float(np.abs(gains[:, 1]).max()) for gains in readings.values()]
        spread = max(spread, max(largest) / min(largest) - 1.0)
        noise = fitted(direction, printed_gains(direction), FIT_SPEED)
        readings["Kalman filter"] = schedule(direction, noise, np.linspace(0.0, DESIGN_SPEED, 71))
        posed = well_posedness(corner_model(direction, DESIGN_SPEED), literal_design(degree, points=TREND_POINTS))
        open_gains.append(posed.ill_posed)
        computed[direction] = {
            "intensities_of_friction_and_acceleration": [noise.friction, noise.acceleration],
            "least_gain_energy_by_backoff": dict(zip(map(str, posed.backoffs), posed.energy, strict=True)),
            "gains_unbounded_towards_optimum": posed.ill_posed,
            **{name: _on_the_axes(gains, direction) for name, gains in readings.items()},
        }
    printed_problem = all(all(computed[direction]["C_e = I"]["on_the_axes"]) for direction in DIRECTIONS)
    x, y = (computed[direction]["Kalman filter"] for direction in DIRECTIONS)
    reading = (
        f"C_e is not printed: the L2 that minimising gamma returns for {', '.join(outputs)} differ by a factor of "
        f"up to {1.0 + spread:.2g}; for C_e = I the least gain energy grows without bound towards the optimum in "
        f"{sum(open_gains)} of {len(open_gains)} directions. A penalty on force noise, which the paper does not "
        f"state, determines the gains: a steady Kalman filter through the printed gains at {FIT_SPEED:g} rad/s has "
        f"L1x {x['L1'][0]:.3f} to {x['L1'][1]:.3f}, L2x {x['L2'][0]:.4g}, L1y {y['L1'][0]:.3f} to {y['L1'][1]:.3f}, "
        f"L2y {y['L2'][0]:.3g}, all on the axes. The figures' titles name L/(1 + L1 sigma1), the form for an output "
        "with the observer's own derivative."
    )
    return Finding(computed, under_specified(spread, 0.01, printed_problem), reading)


@TOPIC.part("gain-curves", "Gains over wheel speed (Figs 3 and 4)", 6.0)
def gain_curves(scope: Scope) -> PartResult:
    """Figs 3 and 4."""
    claims = TOPIC.found()
    return PartResult(claims, [gain_table(claims[0].finding)], [gain_figure()])


def gain_table(finding: Finding) -> Table:
    """Gains at both ends of the range for every reading of C_e, and for the Kalman filter."""
    rows = [
        [direction, name, *entry["L1"], *entry["L2"], all(entry["on_the_axes"])]
        for direction in DIRECTIONS
        for name, entry in finding.computed[direction].items()
        if name in (*OUTPUTS, "Kalman filter")
    ]
    caption = (
        "Gains at 0 and 140 rad/s that minimising gamma returns for three readings of the unprinted performance "
        "output C_e, and those of the steady Kalman filter that passes through the printed gains at 70 rad/s; "
        "whether all stay on the axes of Figs 3 and 4."
    )
    columns = ["direction", "problem", "L1 at 0 [m/s]", "L1 at 140 [m/s]", "L2 at 0 [m/s^2]", "L2 at 140 [m/s^2]",
               "on the axes"]  # fmt: skip
    return Table("gains-by-reading", caption, columns, rows)


def gain_figure() -> Figure:
    """Figs 3 and 4: gains over wheel speed against the printed axes."""
    omega = np.linspace(0.0, DESIGN_SPEED, 141)
    rows: list[list[Panel]] = []
    for direction in DIRECTIONS:
        gains = printed_gains(direction)
        filtered = schedule(direction, fitted(direction, gains, FIT_SPEED), omega)
        shipped = GainSchedule.shipped(f"corner-estimation-{direction}").gain(omega)[..., 0]
        rows.append([])
        for i, (low, high) in enumerate(printed_axes(direction)):
            marks: list[Mark] = [
                Shade(low, high, label="axis of the printed figure", color=PRINTED_BAND, alpha=0.13),
                Level(gains[i], label="printed constant gain", color=GREY, width=1.2, dash="dotted"),
                Line(omega, filtered[:, i], "Kalman filter through the printed gain", ORANGE, "dashed"),
                Line(omega, shipped[:, i], "our proved schedule", GREEN),
                dots([FIT_SPEED], [gains[i]], color=RED, size=4.0),
            ]
            x = Axis(SPEED if direction == DIRECTIONS[-1] else "", 0.0, DESIGN_SPEED)
            y = Axis(f"L{'₁₂'[i]}{LETTER[direction]} [{('m/s', 'm/s²')[i]}]", 0.0)
            rows[-1].append(Panel(marks, x, y))
    return Figure(
        "gain-curves",
        "Observer gains over wheel speed, longitudinal above and lateral below (Figs 3 and 4 of P1, whose curves "
        "are not tabulated). The problem as printed determines no gains. Two that do: the steady Kalman filter "
        f"whose noise intensities make it pass through the printed gains at {FIT_SPEED:g} rad/s (dot), and our "
        "schedule with bounded friction gain, a pole band and least force noise.",
        "Four panels of gains over wheel speed; both designs run inside the ranges of the printed axes.",
        rows,
        size=(7.2, 5.2),
        legend="below",
        columns=2,
        share_x="all",
    )
