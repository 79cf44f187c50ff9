r"""P1-30-sign, P1-hinf-gamma, P1-hinf-figs: the H-infinity problem (30)-(32) as it stands: sign, optimum, gains.

It determines no gains. A steady Kalman filter, which (30) does not state, fits Figs 3 and 4. Noise intensities: friction
q_z, acceleration error q_a, force noise 1; friction enters the output as well, so process and measurement noise are
correlated. Spectral factorisation of the frozen filter, a = kappa R_e |omega|:

    L2 = sqrt(q_a/(1 + sigma1^2 q_z)) at every wheel speed,
    (1 + sigma1^2 q_z)(p1^2 - 2 p0) = q_z sigma0^2 + q_a (sigma1 + sigma2)^2 + a^2

with p1 = a + L1 (sigma0 - sigma1 a) + L2 (sigma1 + sigma2), p0 = L2 (sigma0 + sigma2 a). Two gains at one wheel speed
therefore determine both intensities.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Literal, NamedTuple

import numpy as np
import sympy as sp
from scipy.linalg import solve_continuous_are

from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from studies.claim import Finding, JsonValue
from studies.papers.corner_estimation.inputs import CORNERS, DESIGN_SPEED, POINTS, STATES, Corner, literal_design, topic
from studies.papers.verdicts import derived, erratum, under_specified
from studies.plots import Axis, Figure, Level, Line, Mark, Panel, Shade, colours, dots
from studies.study import PartResult, Scope, Table
from synthesis.design.hinf_observer import ObserverGains, observer_problem, to_gamma
from synthesis.design.well_posedness import well_posedness
from synthesis.errors import ProblemError
from synthesis.lmi.result import Verdict
from synthesis.lmi.scaling import observer_scale
from synthesis.lmi.solve import solve
from synthesis.models.catalogue.corner import Direction
from synthesis.models.lpv import LpvModel

TOPIC = topic()
Sign = Literal["printed", "corrected"]
SIGNS: tuple[Sign, ...] = ("printed", "corrected")
DEGREES = (0, 1, 2, 3)  # of P and chi; the paper's f is not printed
OUTPUTS = {"C_e = I": STATES, "C_e = [0 1]": STATES[1:], "C_e = [1 0]": STATES[:1]}
TREND_POINTS = 40  # grid of the energy trend: it asks how fast, not how much
FIT_SPEED = DESIGN_SPEED / 2  # rad/s: where the Kalman gains are made to equal the printed ones
OMEGA = np.linspace(0.0, DESIGN_SPEED, 71)  # rad/s, where the gains are looked at
LETTER = {"longitudinal": "x", "lateral": "y"}


def signed_model(corner: Corner, sign: Sign) -> LpvModel:
    """The corner model; `printed` reverses sigma1 of the friction column, so that the error sees I + L [sigma1 0]."""
    F = sp.Matrix(corner.design_model.F)
    F[0, 0] = -F[0, 0]
    return replace(corner.design_model, F=F) if sign == "printed" else corner.design_model


@cache
def least_gamma(corner: Corner, degree: int, sign: Sign, errors: tuple[str, ...], points: int) -> ObserverGains:
    """Minimise gamma over P and chi of this degree, with the gains that the solver returns. Raises ProblemError if none."""
    model, design = signed_model(corner, sign), literal_design(degree, errors, points)
    scale = observer_scale(model.polynomial, model.parameters)
    found = solve(observer_problem(model, design, scale), design.settings)
    if found.objective is None or not found.margins:
        raise ProblemError(f"model '{model.name}', degree {degree}: {found.message}")
    gamma = to_gamma(model, design, scale, found.objective)
    return ObserverGains(design, model, None, gamma, found, found, scale)


def optima(corner: Corner, points: int = POINTS) -> tuple[ObserverGains, ...]:
    """The least gamma for every degree, correct sign, C_e = I."""
    return tuple(least_gamma(corner, degree, "corrected", STATES, points) for degree in DEGREES)


def velocity_floor(corner: Corner, sign: Sign, omega: FloatArray) -> FloatArray:
    r"""|static gain| from friction to the velocity error, the same for every L with L2 != 0, at wheel speeds (g,).

    The second row of the error at rest says C e = -sigma1 d (correct sign) or + sigma1 d (printed one), the first
    e_v = a e_z - d. Hence sigma0/(sigma0 + sigma2 a), and |(2 sigma1 + sigma2) a/(sigma0 + sigma2 a) - 1| as printed.
    """
    s0, s1, s2, kappa, radius = corner.constants.values()
    a = kappa * radius * np.abs(omega)
    below = s0 + s2 * a
    return np.asarray(s0 / below if sign == "corrected" else np.abs((2.0 * s1 + s2) * a / below - 1.0))


def disturbance_matrix_error(sign: int) -> sp.Matrix:
    """I + sign L [sigma1 0] minus the disturbance matrix E - L F that follows from (22)-(24), symbolic."""
    model = CORNERS["longitudinal"].model
    L = sp.Matrix(sp.symbols("L1 L2"))
    derived_matrix = (model.E - L * model.F)[:, :2]
    return sp.Matrix(sp.expand(sp.eye(2) + sign * L * sp.Matrix([[sp.Symbol("sigma1"), 0]]) - derived_matrix))


@TOPIC.claim("P1-30-sign")
def sign_of_the_disturbance(printed_sign: int = 1) -> Finding:
    """(25) against the matrix in (30), and what the wrong sign does to gamma."""
    wrong, right = disturbance_matrix_error(printed_sign), disturbance_matrix_error(-1)
    omega = np.linspace(0.0, DESIGN_SPEED, POINTS)
    gamma = {s: {d: least_gamma(c, 1, s, STATES, POINTS).gamma for d, c in CORNERS.items()} for s in SIGNS}
    floor = {s: {d: float(velocity_floor(c, s, omega).max()) for d, c in CORNERS.items()} for s in SIGNS}
    attained = all(abs(gamma[s][d] - floor[s][d]) <= 1e-3 for s in SIGNS for d in CORNERS)
    computed = {"printed_minus_derived": [*map(str, wrong)], "corrected_minus_derived": [*map(str, right)],
                "gamma": gamma, "static_floor": floor}  # fmt: skip
    shown = ", ".join(f"{d} {gamma['printed'][d]:.4f} against {gamma['corrected'][d]:.4f}" for d in CORNERS)
    reading = (
        "By (25) the disturbance enters the error through I - L [sigma1 0], so block (1,2) of (30) is P - chi [sigma1 "
        f"0]. Least gamma with the printed and with the corrected sign: {shown}. The printed one is the static gain (2 "
        "sigma1 + sigma2) a/(sigma0 + sigma2 a) - 1, where that exceeds one, of a loop that is not the observer's."
    )
    return Finding(computed, erratum(wrong.is_zero_matrix, bool(right.is_zero_matrix and attained)), reading)


@TOPIC.claim("P1-hinf-gamma")
def least_gamma_by_degree(points: int = POINTS, tolerance: float = 2e-5) -> Finding:
    """gamma for f = 0..3 and both directions, against the static gain that no observer can lower."""
    found = {d: optima(c, points) for d, c in CORNERS.items()}
    floor = {d: float(velocity_floor(c, "corrected", np.array([0.0]))[0]) for d, c in CORNERS.items()}
    gamma = {d: [o.gamma for o in found[d]] for d in CORNERS}
    largest = {d: [float(np.abs(o.gain(OMEGA)[:, 1]).max()) for o in found[d]] for d in CORNERS}
    distance = max(abs(g - floor[d]) for d in CORNERS for g in gamma[d])
    proved = all(o.verdict is Verdict.CERTIFIED for d in CORNERS for o in found[d])
    computed = {"degrees": list(DEGREES), "gamma": gamma, "exact_infimum": floor, "largest_distance": distance,
                "proved_on_the_whole_range": proved, "largest_L2_returned": largest}  # fmt: skip
    returned = [value for row in largest.values() for value in row]
    reading = (
        "At standstill of the error friction cannot be told from slip velocity: their static gain is "
        "sigma0/(sigma0 + sigma2 a) for every L, 1 at rest, so gamma has the infimum 1. All degrees come within "
        f"{distance:.1e} of it; the degree buys nothing, and the gains returned on the way there are as large as "
        f"the solver's tolerance lets them be (L2 up to {min(returned):.2g} to {max(returned):.2g} m/s^2)."
    )
    return Finding(computed, derived(distance <= tolerance and proved), reading)


TOPIC.show("hinf-sign", "The sign in the H-infinity inequality", 2.0, ["P1-30-sign"])


@TOPIC.part("hinf-optimum", "The optimum of the H-infinity problem", 6.0)
def hinf_optimum(scope: Scope) -> PartResult:
    """The optimum of (30) by degree, and how its gains run away."""
    claims = TOPIC.found("P1-hinf-gamma")
    found = claims[0].finding.computed
    columns, rows = ["degree f"], [[degree] for degree in DEGREES]
    for d in CORNERS:
        columns += [f"{d} gamma [1]", f"{d} largest L2 returned [m/s^2]"]
        for row, *values in zip(rows, found["gamma"][d], found["largest_L2_returned"][d], strict=True):
            row.extend(values)
    caption = (
        "Least gamma of (30) (sign corrected, C_e = I, both disturbances) on 140 wheel speeds in [0, 140] rad/s at wheel "
        "accelerations of +-800 rad/s^2. The exact infimum is 1; the returned gains are the solver's, not the problem's."
    )
    backoffs = (1.0, 1e-1, 1e-2, 1e-3) if scope.quick else (1.0, 3e-1, 1e-1, 3e-2, 1e-2, 3e-3, 1e-3)
    design, lines = literal_design(1, points=TREND_POINTS), []
    for corner, colour, marker in zip(CORNERS.values(), (colours.BLUE, colours.RED), "os", strict=True):
        energy = well_posedness(corner.design_model, design, backoffs).energy
        lines.append(Line(backoffs, energy, corner.direction, colour, marker=marker))
    x = Axis("γ above its infimum, relative [1]", 1.4, 7e-4, "log")  # towards the optimum
    panel = Panel(lines, x, Axis("least gain energy, max over ω of LᵀPL [1]", scale="log"), legend="upper left")
    figure = Figure(
        "hinf-ill-posed",
        "The least energy LᵀPL that gains of degree 1 need, over the distance that gamma keeps from its infimum (1 "
        "in both directions). It grows without bound as the optimum is approached: minimising gamma alone "
        "determines no gains. P1 (30)-(32).",
        "Gain energy rises with every decade towards the optimum, for both directions.",
        panel, size=(4.8, 3.4),
    )  # fmt: skip
    return PartResult(claims, [Table("least-gamma", caption, columns, rows)], [figure])


class Intensities(NamedTuple):
    """Of friction and of the acceleration error, relative to that of the force noise (white, two-sided)."""

    friction: float
    acceleration: float


def fitted(corner: Corner, gains: tuple[float, ...], omega: float) -> Intensities:
    """The intensities whose steady filter has these gains at this wheel speed. Raises ProblemError if none does."""
    (s0, s1, s2, kappa, radius), (L1, L2) = corner.constants.values(), gains
    a = kappa * radius * omega
    p1 = a + L1 * (s0 - s1 * a) + L2 * (s1 + s2)
    p0 = L2 * (s0 + s2 * a)
    rest = p1 * p1 - 2.0 * p0 - (L2 * (s1 + s2)) ** 2
    friction = (rest - a * a) / (s0 * s0 - s1 * s1 * rest)
    if not friction > 0.0:
        where = f"{list(gains)} at {omega:g} rad/s"
        raise ProblemError(f"no steady filter of the {corner.direction} model has the gains {where}")
    return Intensities(friction, L2 * L2 * (1.0 + s1 * s1 * friction))


def schedule(corner: Corner, noise: Intensities, omega: FloatArray) -> FloatArray:
    """Steady gains (g, 2) of the frozen filters at wheel speeds (g,), by the algebraic Riccati equation."""
    model = corner.design_model.on(omega)
    weights = np.diag([*noise, 1.0])
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


def _summary(gains: FloatArray, direction: Direction) -> dict[str, JsonValue]:
    """L1 and L2 of (g, 2) at both ends of the range, and whether they stay on the axes of the figure."""
    axes = zip(printed_axes(direction), gains.T, strict=True)
    inside = [bool(low <= column.min() and column.max() <= high) for (low, high), column in axes]
    return {"L1": gains[[0, -1], 0].tolist(), "L2": gains[[0, -1], 1].tolist(), "on_the_axes": inside}


@TOPIC.claim("P1-hinf-figs")
def plotted_gains(degree: int = 1, outputs: Mapping[str, tuple[str, ...]] = OUTPUTS) -> Finding:
    """Gains of the readings of C_e, how they grow towards the optimum, and a Kalman filter through the printed gains."""
    computed: dict[str, JsonValue] = {}
    spread, open_gains = 0.0, []
    for direction, corner in CORNERS.items():
        found = {name: least_gamma(corner, degree, "corrected", errors, POINTS) for name, errors in outputs.items()}
        readings = {name: design.gain(OMEGA)[..., 0] for name, design in found.items()}
        largest = [float(np.abs(gains[:, 1]).max()) for gains in readings.values()]
        spread = max(spread, max(largest) / min(largest) - 1.0)
        noise = fitted(corner, corner.gains, FIT_SPEED)
        readings["Kalman filter"] = schedule(corner, noise, OMEGA)
        posed = well_posedness(corner.design_model, literal_design(degree, points=TREND_POINTS))
        open_gains.append(posed.ill_posed)
        computed[direction] = {
            "intensities_of_friction_and_acceleration": list(noise),
            "least_gain_energy_by_backoff": dict(zip(map(str, posed.backoffs), posed.energy, strict=True)),
            "gains_unbounded_towards_optimum": posed.ill_posed,
            **{name: _summary(gains, direction) for name, gains in readings.items()},
        }
    printed_problem = all(all(computed[direction]["C_e = I"]["on_the_axes"]) for direction in CORNERS)
    x, y = (computed[direction]["Kalman filter"] for direction in CORNERS)
    reading = (
        f"C_e is not printed: the L2 that minimising gamma returns for {', '.join(outputs)} differ by a factor of up to "
        f"{1.0 + spread:.2g}; for C_e = I the least gain energy grows without bound towards the optimum in {sum(open_gains)} "
        f"of {len(open_gains)} directions. A penalty on force noise, which the paper does not state, determines the gains: a "
        f"steady Kalman filter through the printed gains at {FIT_SPEED:g} rad/s has L1x {x['L1'][0]:.3f} to {x['L1'][1]:.3f}, "
        f"L2x {x['L2'][0]:.4g}, L1y {y['L1'][0]:.3f} to {y['L1'][1]:.3f}, L2y {y['L2'][0]:.3g}, all on the axes. The figures' "
        "titles name L/(1 + L1 sigma1), the form for an output with the observer's own derivative."
    )
    return Finding(computed, under_specified(spread, 0.01, printed_problem), reading)


@TOPIC.part("gain-curves", "Gains over wheel speed (Figs 3 and 4)", 6.0)
def gain_curves(scope: Scope) -> PartResult:
    """Figs 3 and 4."""
    claims = TOPIC.found("P1-hinf-figs")
    rows = []
    for direction, name in product(CORNERS, (*OUTPUTS, "Kalman filter")):
        entry = claims[0].finding.computed[direction][name]
        rows.append([direction, name, *entry["L1"], *entry["L2"], all(entry["on_the_axes"])])
    caption = (
        "Gains at 0 and 140 rad/s that minimising gamma returns for three readings of the unprinted performance "
        "output C_e, and those of the steady Kalman filter that passes through the printed gains at 70 rad/s; "
        "whether all stay on the axes of Figs 3 and 4."
    )
    ends = (f"L{i} at {w} [{unit}]" for i, unit in ((1, "m/s"), (2, "m/s^2")) for w in (0, 140))
    columns = ["direction", "problem", *ends, "on the axes"]
    return PartResult(claims, [Table("gains-by-reading", caption, columns, rows)], [gain_figure()])


def gain_figure() -> Figure:
    """Figs 3 and 4: gains over wheel speed against the printed axes."""
    omega = np.linspace(0.0, DESIGN_SPEED, 141)
    rows = []
    for direction, corner in CORNERS.items():
        gains, row = corner.gains, []
        filtered = schedule(corner, fitted(corner, gains, FIT_SPEED), omega)
        shipped = GainSchedule.shipped(f"corner-estimation-{direction}").gain(omega)[..., 0]
        for i, (low, high) in enumerate(printed_axes(direction)):
            marks: list[Mark] = [
                Shade(low, high, label="axis of the printed figure", color=colours.PRINTED_BAND, alpha=0.13),
                Level(gains[i], label="printed constant gain", color=colours.GREY, width=1.2, dash="dotted"),
                Line(omega, filtered[:, i], "Kalman filter through the printed gain", colours.ORANGE, "dashed"),
                Line(omega, shipped[:, i], "our proved schedule", colours.GREEN),
                dots([FIT_SPEED], [gains[i]], color=colours.RED, size=4.0),
            ]
            x = Axis("wheel speed [rad/s]" if direction == "lateral" else "", 0.0, DESIGN_SPEED)
            y = Axis(f"L{'₁₂'[i]}{LETTER[direction]} [{('m/s', 'm/s²')[i]}]", 0.0)
            row.append(Panel(marks, x, y))
        rows.append(row)
    return Figure(
        "gain-curves",
        "Observer gains over wheel speed, longitudinal above and lateral below (Figs 3 and 4 of P1, whose curves "
        "are not tabulated). The problem as printed determines no gains. Two that do: the steady Kalman filter "
        f"whose noise intensities make it pass through the printed gains at {FIT_SPEED:g} rad/s (dot), and our "
        "schedule with bounded friction gain, a pole band and least force noise.",
        "Four panels of gains over wheel speed; both designs run inside the ranges of the printed axes.",
        rows, size=(7.2, 5.2), legend="below", columns=2, share_x="all",
    )  # fmt: skip
