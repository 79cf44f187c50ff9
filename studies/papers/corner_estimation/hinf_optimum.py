"""P1-30-sign, P1-hinf-gamma: the H-infinity problem (30)-(32) as it stands: its sign, its optimum, what it leaves open."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np
import sympy as sp

from studies.claim import Finding
from studies.papers.corner_estimation.inputs import DESIGN_SPEED, DIRECTIONS, PACKAGE, constants, corner_model
from studies.papers.topic import Topic
from studies.papers.verdicts import derived, erratum
from studies.plots import Axis, Figure, Line, Panel
from studies.plots.colours import BLUE, RED
from studies.study import PartResult, Scope, Table
from synthesis.errors import ProblemError
from synthesis.hinf_observer import Channel, ObserverDesign, ObserverGains, observer_problem, to_gamma
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.scaling import observer_scale
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.models.catalogue.corner import Direction
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import FloatArray
from synthesis.well_posedness import well_posedness

TOPIC = Topic(PACKAGE)
Sign = Literal["printed", "corrected"]
SIGNS: tuple[Sign, ...] = ("printed", "corrected")
POINTS = 140  # wheel speeds in [0, 140] rad/s, text after (32)
DEGREES = (0, 1, 2, 3)  # of P and chi; the paper's f is not printed
STATES = ("bristle_deflection", "relative_velocity")
DISTURBANCES = ("friction", "acceleration_error")
SIGN_TOLERANCE = 1e-3  # of gamma
GAMMA_TOLERANCE = 2e-5  # from the infimum


@dataclass(frozen=True)
class Optimum:
    """The least gamma of (30), with the gains that the solver happened to return, (g, 2) at `omega`."""

    gamma: float
    result: LmiResult
    omega: FloatArray
    gains: FloatArray


def signed_model(direction: Direction, sign: Sign) -> LpvModel:
    """The corner model; `printed` reverses sigma1 of the friction column, so that the error sees I + L [sigma1 0]."""
    model = corner_model(direction, DESIGN_SPEED)
    if sign == "corrected":
        return model
    F = sp.Matrix(model.F)
    F[0, 0] = -F[0, 0]
    return replace(model, F=F)


def literal_design(degree: int, errors: tuple[str, ...] = STATES, points: int = POINTS) -> ObserverDesign:
    """(30)-(32) and nothing else: one channel from all disturbances to the errors C_e, minimised."""
    channel = Channel(DISTURBANCES, errors)
    return ObserverDesign((channel,), degree, settings=LmiSettings(relaxation="grid", points=points))


@cache
def least_gamma(direction: Direction, degree: int, sign: Sign, errors: tuple[str, ...], points: int) -> Optimum:
    """Minimise gamma over P and chi of this degree. Raises ProblemError if the solver finds nothing."""
    model, design = signed_model(direction, sign), literal_design(degree, errors, points)
    scale = observer_scale(model.polynomial, model.parameters)
    found = solve(observer_problem(model, design, scale), design.settings)
    if found.objective is None or not found.margins:
        raise ProblemError(f"model '{model.name}', degree {degree}: {found.message}")
    gamma = to_gamma(model, design, scale, found.objective)
    omega = np.linspace(0.0, DESIGN_SPEED, 71)
    gains = ObserverGains(design, model, None, gamma, found, found, scale).gain(omega)[..., 0]
    return Optimum(gamma, found, omega, gains)


def optima(direction: Direction, points: int = POINTS) -> tuple[Optimum, ...]:
    """The least gamma for every degree, correct sign, C_e = I."""
    return tuple(least_gamma(direction, degree, "corrected", STATES, points) for degree in DEGREES)


def velocity_floor(direction: Direction, sign: Sign, omega: FloatArray) -> FloatArray:
    r"""|static gain| from friction to the velocity error, the same for every L with L2 != 0, at wheel speeds (g,).

    The second row of the error at rest says C e = -sigma1 d (correct sign) or + sigma1 d (printed one), the first
    e_v = a e_z - d. Hence sigma0/(sigma0 + sigma2 a), and |(2 sigma1 + sigma2) a/(sigma0 + sigma2 a) - 1| as printed.
    """
    values = constants(direction)
    a = values["kappa"] * values["effective_radius"] * np.abs(omega)
    below = values["sigma0"] + values["sigma2"] * a
    if sign == "corrected":
        return np.asarray(values["sigma0"] / below)
    return np.asarray(np.abs((2.0 * values["sigma1"] + values["sigma2"]) * a / below - 1.0))


def disturbance_matrix_error(sign: int) -> sp.Matrix:
    """I + sign L [sigma1 0] minus the disturbance matrix E - L F that follows from (22)-(24), symbolic."""
    model = corner_model("longitudinal")
    L = sp.Matrix(sp.symbols("L1 L2"))
    derived_matrix = (model.E - L * model.F)[:, :2]
    return sp.Matrix(sp.expand(sp.eye(2) + sign * L * sp.Matrix([[sp.Symbol("sigma1"), 0]]) - derived_matrix))


@TOPIC.claim("P1-30-sign")
def sign_of_the_disturbance(printed_sign: int = 1) -> Finding:
    """(25) against the matrix in (30), and what the wrong sign does to gamma."""
    wrong, right = disturbance_matrix_error(printed_sign), disturbance_matrix_error(-1)
    omega = np.linspace(0.0, DESIGN_SPEED, POINTS)
    gamma = {s: {d: least_gamma(d, 1, s, STATES, POINTS).gamma for d in DIRECTIONS} for s in SIGNS}
    floor = {s: {d: float(velocity_floor(d, s, omega).max()) for d in DIRECTIONS} for s in SIGNS}
    attained = all(abs(gamma[s][d] - floor[s][d]) <= SIGN_TOLERANCE for s in SIGNS for d in DIRECTIONS)
    computed = {
        "printed_minus_derived": [str(entry) for entry in wrong],
        "corrected_minus_derived": [str(entry) for entry in right],
        "gamma": gamma, "static_floor": floor,
    }  # fmt: skip
    shown = ", ".join(f"{d} {gamma['printed'][d]:.4f} against {gamma['corrected'][d]:.4f}" for d in DIRECTIONS)
    reading = (
        "By (25) the disturbance enters the error through I - L [sigma1 0], so block (1,2) of (30) is P - chi "
        f"[sigma1 0]. Least gamma with the printed and with the corrected sign: {shown}. The printed one is the "
        "static gain (2 sigma1 + sigma2) a/(sigma0 + sigma2 a) - 1, where that exceeds one, of a loop that is not "
        "the observer's."
    )
    return Finding(computed, erratum(wrong.is_zero_matrix, bool(right.is_zero_matrix and attained)), reading)


@TOPIC.claim("P1-hinf-gamma")
def least_gamma_by_degree(points: int = POINTS, tolerance: float = GAMMA_TOLERANCE) -> Finding:
    """gamma for f = 0..3 and both directions, against the static gain that no observer can lower."""
    found = {d: optima(d, points) for d in DIRECTIONS}
    floor = {d: float(velocity_floor(d, "corrected", np.array([0.0]))[0]) for d in DIRECTIONS}
    gamma = {d: [o.gamma for o in found[d]] for d in DIRECTIONS}
    largest = {d: [float(np.abs(o.gains[:, 1]).max()) for o in found[d]] for d in DIRECTIONS}
    distance = max(abs(g - floor[d]) for d in DIRECTIONS for g in gamma[d])
    proved = all(o.result.verdict is Verdict.CERTIFIED for d in DIRECTIONS for o in found[d])
    computed = {
        "degrees": list(DEGREES), "gamma": gamma, "exact_infimum": floor, "largest_distance": distance,
        "proved_on_the_whole_range": proved, "largest_L2_returned": largest,
    }  # fmt: skip
    low, high = (pick(value for row in largest.values() for value in row) for pick in (min, max))
    reading = (
        "At standstill of the error friction cannot be told from slip velocity: their static gain is "
        "sigma0/(sigma0 + sigma2 a) for every L, 1 at rest, so gamma has the infimum 1. All degrees come within "
        f"{distance:.1e} of it; the degree buys nothing, and the gains returned on the way there are as large as "
        f"the solver's tolerance lets them be (L2 up to {low:.2g} to {high:.2g} m/s^2)."
    )
    return Finding(computed, derived(distance <= tolerance and proved), reading)


@TOPIC.part("hinf-sign", "The sign in the H-infinity inequality", 2.0)
def hinf_sign(scope: Scope) -> PartResult:
    """The sign in (30)."""
    return PartResult(TOPIC.found("P1-30-sign"))


@TOPIC.part("hinf-optimum", "The optimum of the H-infinity problem", 6.0)
def hinf_optimum(scope: Scope) -> PartResult:
    """The optimum of (30) by degree, and how its gains run away."""
    claims = TOPIC.found("P1-hinf-gamma")
    return PartResult(claims, [gamma_table(claims[0].finding)], [optimum_figure(scope.quick)])


def gamma_table(finding: Finding) -> Table:
    """Least gamma and largest returned gain by degree."""
    found = finding.computed
    rows = [
        [degree, *(found[key][d][k] for d in DIRECTIONS for key in ("gamma", "largest_L2_returned"))]
        for k, degree in enumerate(found["degrees"])
    ]
    columns = [f"{d} {what}" for d in DIRECTIONS for what in ("gamma [1]", "largest L2 returned [m/s^2]")]
    caption = (
        "Least gamma of (30) (sign corrected, C_e = I, both disturbances) on 140 wheel speeds in [0, 140] rad/s at "
        "wheel accelerations of +-800 rad/s^2. The exact infimum is 1; the returned gains are the solver's, not "
        "the problem's."
    )
    return Table("least-gamma", caption, ["degree f", *columns], rows)


def optimum_figure(quick: bool = False, points: int = 40) -> Figure:
    """Least gain energy over the distance from the optimum of (30)."""
    design = literal_design(1, points=points)
    backoffs = (1.0, 1e-1, 1e-2, 1e-3) if quick else (1.0, 3e-1, 1e-1, 3e-2, 1e-2, 3e-3, 1e-3)
    lines = []
    for direction, colour, marker in zip(DIRECTIONS, (BLUE, RED), "os", strict=True):
        energy = well_posedness(corner_model(direction, DESIGN_SPEED), design, backoffs).energy
        lines.append(Line(backoffs, energy, direction, colour, marker=marker))
    x = Axis("γ above its infimum, relative [1]", 1.4, 7e-4, "log")  # towards the optimum
    panel = Panel(lines, x, Axis("least gain energy, max over ω of LᵀPL [1]", scale="log"), legend="upper left")
    return Figure(
        "hinf-ill-posed",
        "The least energy LᵀPL that gains of degree 1 need, over the distance that gamma keeps from its infimum (1 "
        "in both directions). It grows without bound as the optimum is approached: minimising gamma alone "
        "determines no gains. P1 (30)-(32).",
        "Gain energy rises with every decade towards the optimum, for both directions.",
        panel,
        size=(4.8, 3.4),
    )
