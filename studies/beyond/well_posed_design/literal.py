r"""The literal problem of P1 (30)-(32): minimise the gain from friction and acceleration error to both state errors.

At DC no gain tells friction from slip velocity: it reaches the velocity error with -sigma0/(sigma0 + sigma2 a) and the
bristle with sigma2/(sigma0 + sigma2 a), whatever L is. At standstill (a = 0) that is a floor of sqrt(1 + (sigma2/sigma0)^2),
1 up to 1e-11. The gains L = [1/sigma1, L2] come as close to it as one likes, and only for L2 without bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy as sp

from analysis.norms.observer_error import error_hinf_norm
from analysis.norms.static_gain import static_gain
from estimators.arrays import FloatArray
from studies.beyond.well_posed_design.cases import PACKAGE, Case, p1_cases
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Words
from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE, RED
from studies.study import Cell, PartResult, Scope, Table
from synthesis.design.hinf_observer import Channel, ObserverDesign, ObserverGains, observer_problem, to_gamma
from synthesis.design.well_posedness import energy_problem
from synthesis.errors import ProblemError
from synthesis.lmi.scaling import observer_scale
from synthesis.lmi.solve import solve

TOPIC = Topic(PACKAGE)
DEGREES = (0, 1, 2, 3)
DISTURBANCES = ("friction", "acceleration_error")
ERRORS = ("bristle_deflection", "relative_velocity")
GROWTH = 2.0  # for each decade; bounded gains settle
BACKOFFS = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3)


def literal_design(degree: int) -> ObserverDesign:
    """One channel, no bound on poles or noise."""
    return ObserverDesign((Channel(DISTURBANCES, ERRORS),), degree)


def floor(case: Case) -> tuple[sp.Expr, bool]:
    """The least possible gamma in exact numbers, and whether the static gains behind it are free of L at every speed."""
    static = [static_gain(case.model, "friction", error) for error in ERRORS]
    values = {sp.Symbol(name): sp.Rational(str(constant.value)) for name, constant in case.model.constants.items()}
    standstill = {**values, sp.Symbol("wheel_speed"): 0}
    squared = sum(gain.expression.subs(standstill) ** 2 for gain in static)
    return sp.sqrt(squared), all(gain.free_of_gain for gain in static)


@dataclass(frozen=True)
class Approach:
    """Gains of least energy at (1 + backoff) times the infimum `gamma`: largest |L1| in m/s and |L2| in m/s^2, (n, 2)."""

    gamma: float
    backoffs: FloatArray
    gains: FloatArray

    @property
    def growth_per_decade(self) -> float:
        """Factor by which the largest |L2| grows for each decade of back-off, at the close end."""
        slope = np.log(self.gains[-1, 1] / self.gains[-3, 1]) / np.log(self.backoffs[-3] / self.backoffs[-1])
        return float(10.0**slope)

    @property
    def unbounded(self) -> bool:
        """Whether the least gains keep growing on the way to the infimum: then it has no gains of its own."""
        return self.growth_per_decade > GROWTH


def approach(case: Case, design: ObserverDesign) -> Approach:
    """Minimise gamma, then the gain energy L'PL at every back-off from it. Raises ProblemError where a solve fails."""
    scale = observer_scale(case.model.polynomial, case.model.parameters)
    optimum = solve(observer_problem(case.model, design, scale), design.settings)
    if optimum.objective is None:
        raise ProblemError(f"model '{case.model.name}': {optimum.message}")
    gamma, largest = to_gamma(case.model, design, scale, optimum.objective), []
    for backoff in BACKOFFS:
        level = gamma * (1.0 + backoff)
        found = solve(energy_problem(case.model, design, scale, level), design.settings)
        if found.objective is None:
            raise ProblemError(f"model '{case.model.name}', back-off {backoff:g}: {found.message}")
        gains = ObserverGains(design, case.model, None, level, found, optimum, scale).gain(case.grid(57))
        largest.append(np.abs(gains[..., 0]).max(axis=0))
    return Approach(gamma, np.array(BACKOFFS), np.array(largest))


def explicit_family(case: Case, second_gains: FloatArray) -> FloatArray:
    """gamma (n,) of the literal channel for L = [1/sigma1, L2], the worst of all constant wheel speeds."""
    gains = ([1.0 / case.model.constants["sigma1"].value, second] for second in second_gains)
    found = (error_hinf_norm(case.model, L, case.grid(29), DISTURBANCES, ERRORS, tolerance=1e-13) for L in gains)
    return np.array([each.norm.max() for each in found])


@TOPIC.part("literal", "The literal problem has infimum 1 and unbounded gains", 5.0)
def literal(scope: Scope) -> PartResult:
    """Infimum 1, approached with unbounded gains, beside the well-posed problem; and the explicit family."""
    degrees, measures = DEGREES[:2] if scope.quick else DEGREES, dict[str, float]()
    rows, panels, explicit, second = list[list[Cell]](), list[Panel](), list[Mark](), np.geomspace(1.0, 1e7, 43)
    for case, colour in zip(p1_cases(), (BLUE, RED), strict=True):
        found = {f"literal, degree {degree}": approach(case, literal_design(degree)) for degree in degrees}
        exact, free = floor(case)
        for (problem, each), degree in zip(found.items(), degrees, strict=True):
            rows.append([case.title, problem, float(exact), free, *_growth(each)])
            measures[f"growth per decade, {case.name}, degree {degree}"] = each.growth_per_decade
        well = approach(case, case.design)
        rows.append([case.title, "well-posed, degree 1", None, None, *_growth(well)])
        marks: list[Mark] = [
            Level(case.printed[1], color=RED, dash="dotted", width=1.0),
            Words(0.11, case.printed[1] * 1.06, "printed", RED),
        ]
        for (problem, each), shade in zip(found.items(), (BLUE, ORANGE, GREEN, PURPLE), strict=False):
            marks.append(Line(each.backoffs, each.gains[:, 1], problem, shade, marker="o"))
        marks.append(Line(well.backoffs, well.gains[:, 1], "well-posed, degree 1", "black", "dashed", marker="s"))
        most = max(case.printed[1], *(each.gains[:, 1].max() for each in found.values()))
        x = Axis("distance from the infimum, γ/γ* − 1 [1]", 0.13, 8e-4, "log")
        y = Axis("largest $|L_2|$ that is needed [m/s²]", high=18.0 * most, scale="log")
        panels.append(Panel(marks, x, y, case.title, "upper left"))
        ratio = case.model.constants["sigma2"].value / case.model.constants["sigma0"].value
        explicit += [
            Line(second, explicit_family(case, second) - 1.0, case.title, colour),
            Level(0.5 * ratio**2, color=colour, dash="dotted", width=0.9),
        ]
    note = (
        "The floor is exact: for every L the static gains from friction are -sigma0/(sigma0 + sigma2 a) to the "
        "velocity and sigma2/(sigma0 + sigma2 a) to the bristle, at standstill together sqrt(1 + "
        "(sigma2/sigma0)^2), 1 + 3e-12 for the longitudinal tire of P1."
    )
    table = Table(
        "ill-posed",
        "The literal problem (minimise the gain from friction and acceleration error to both errors) beside the well-posed one. "
        "The exact floor follows from static gains that no L changes; gamma is what the solver finds; then the largest |L2| "
        "needed at a back-off of 10 % and of 0.1 %, and its growth for each decade of back-off. More than 2 counts as "
        "unbounded.",
        ("case", "problem", "exact floor of gamma [1]", "floor free of L", "gamma found [1 or m/s]", "|L2| at 10 % [m/s^2]",
         "|L2| at 0.1 % [m/s^2]", "growth per decade [1]", "unbounded"), rows,
    )  # fmt: skip
    x, y = Axis("$L_2$ with $L_1 = 1/σ_1$ [m/s²]", scale="log"), Axis("γ − 1 at constant wheel speed [1]", scale="log")
    figure = Figure(
        "ill-posed",
        "Minimising the gain of (30) to (32) alone does not determine gains. Left and middle: the least gains that come within a "
        "given distance of the infimum γ* = 1 grow without bound as the distance shrinks, for every degree of P and L; with the "
        "pole band and the channel bounds of the shipped design (black, distance from its own optimum) they settle. Right: the "
        "gains L = [1/σ₁, L₂] come as close to 1 as one likes (dotted: the exact floor), so at any γ above 1 all large L₂ are "
        "equally good.",
        "Two panels with rising curves for the literal problem and a flat black curve for the well-posed one; a third with two "
        "curves falling over ten decades to a floor.",
        [*panels, Panel(explicit, x, y, "explicit gains", "upper right")], (10.0, 3.9),
    )  # fmt: skip
    return PartResult((), [table], [figure], [note], measures)


def _growth(found: Approach) -> list[Cell]:
    ends = (round(float(value), 3) for value in found.gains[[0, -1], 1])
    return [found.gamma, *ends, round(found.growth_per_decade, 2), found.unbounded]
