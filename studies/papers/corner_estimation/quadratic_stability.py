"""P1-aqs-*: are the printed gains and gain boxes affinely quadratically stable, and does a solver find out?

Constant diagonal Lyapunov matrices are found and proved in closed form. For P = diag(w, 1) the inequality
A_e'P + P A_e < 0 with A_e = [[a, b], [c, d]] says a < 0, d < 0 and (b w + c)^2 < 4 a d w: an interval of w. A constant P proves
stability for any rate of the wheel speed, and A_e is affine in each of omega, L1 and L2 separately, so the corners of a box of
these three decide for the whole box. P1-aqs-scale: the units of the bristle deflection decide whether a solver finds a Lyapunov
matrix of (28); without scaling it misses certificates that exist and accepts false ones.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from studies.claim import Finding, JsonValue, reproduced
from studies.papers.corner_estimation.inputs import CORNERS, DESIGNS, SPEED_AXIS, STATED_SPEED, Corner, topic
from studies.papers.verdicts import derived
from studies.plots import ZERO, Axis, Contours, Dash, Figure, Line, Mark, Panel, colours, dots
from studies.plots import Box as Outline
from studies.study import PartResult, Scope, Table
from synthesis.design.stability import affine_quadratic_stability, physical
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings, Relaxation
from synthesis.lmi.solve import solve
from synthesis.models.catalogue.corner import Direction

TOPIC = topic()
# Affine P with multi-convexity at the vertices, affine P on the continuum, constant P: relaxation and degree.
LMI_FORMS: dict[str, tuple[Relaxation, int]] = {
    "with multi-convexity": ("vertex", 1), "without": ("exact", 1), "constant P": ("exact", 0),
}  # fmt: skip
Box = tuple[tuple[float, float], ...]
CAPS = (1e3, 1e4)  # condition numbers that a general-purpose scaling might allow
BALANCED = 2.0


def diagonal_proof(corner: Corner, box: Box, weight: int | None = None) -> dict[str, JsonValue]:
    """Stability of all gains of `box` ((low, high) of L1 and of L2) at all wheel speeds that are stated and any rate.

    The weights w for which diag(w, 1) proves it at every vertex, [low, high] (low >= high: none); a round one from the middle
    of them, or `weight`; and what exact arithmetic says of that one.
    """
    matrices = exact_matrices(corner, box)
    lows, highs = zip(*map(admissible, matrices), strict=True)
    low, high = max(lows), min(highs)
    if weight is None:
        weight = round(float(f"{np.sqrt(low * high):.2g}")) if 0.0 < low < high else 1
    proved = all(decreases(matrix, weight) for matrix in matrices)
    return {"weights_of_diag_w_1": [low, high], "weight": weight, "proved_exactly": proved}


def exact_matrices(corner: Corner, box: Box) -> list[sp.Matrix]:
    """A_e at every vertex of wheel speed and gains, in rational numbers read from the printed decimals."""
    model, values = corner.model, corner.exact_constants
    A, C = (sp.Matrix(matrix.subs(values)) for matrix in (model.A, model.C))
    ends = [sorted({sp.Rational(str(end)) for end in span}) for span in ((0.0, STATED_SPEED), *box)]
    return [(A - sp.Matrix([first, second]) * C).subs("wheel_speed", w) for w, first, second in product(*ends)]


def admissible(A_e: sp.Matrix) -> tuple[float, float]:
    """All w with diag(w, 1) A_e + A_e' diag(w, 1) < 0: roots of b^2 w^2 + (2 b c - 4 a d) w + c^2; (inf, -inf) if none."""
    a, b, c, d = (float(x) for x in A_e)
    if a < 0.0 and d < 0.0 and b == 0.0:
        return c * c / (4.0 * a * d), np.inf
    middle = 2.0 * a * d - b * c
    inside = middle * middle - (b * c) ** 2
    if not (a < 0.0 and d < 0.0 and inside > 0.0 and middle > 0.0):
        return np.inf, -np.inf
    larger = (middle + np.sqrt(inside)) / (b * b)
    return float(c * c / (b * b * larger)), float(larger)


def decreases(A_e: sp.Matrix, weight: int) -> bool:
    """Whether diag(weight, 1) proves stability of A_e: signs of rational minors, no rounding."""
    P = sp.diag(weight, 1)
    total = -(A_e.T * P + P * A_e)
    return bool(total[0, 0] > 0 and total.det() > 0)


@TOPIC.claim("P1-aqs-feas")
def printed_gains_are_stable(gains: dict[Corner, tuple[float, ...]] | None = None) -> Finding:
    """(28), (40) by three LMIs, and a constant diagonal P in exact arithmetic, for the gains of P1 and of P3."""
    holds, computed = [], dict[str, JsonValue]()
    for corner in DESIGNS:
        given = corner.gains if gains is None else gains[corner]
        model, column = corner.model, np.array(given)[:, None]
        verdicts = {
            form: affine_quadratic_stability(model, column, degree, settings=LmiSettings(relaxation=relaxation)).verdict
            for form, (relaxation, degree) in LMI_FORMS.items()
        }
        proof = diagonal_proof(corner, tuple((gain, gain) for gain in given))
        holds.append(proof["proved_exactly"] and all(verdict is Verdict.CERTIFIED for verdict in verdicts.values()))
        lmi = {form: str(verdict) for form, verdict in verdicts.items()}
        computed[str(corner)] = {"gains": list(given), "lmi": lmi, **proof}
    weights = ", ".join(f"{entry['weight']:,}" for entry in computed.values())
    reading = (
        f"{sum(holds)} of {len(holds)} sets of printed gains (P1 and P3, both directions) are stable with P = diag(w, 1) "
        f"that does not depend on the wheel speed, w = {weights}, proved in rational numbers on 0 to {STATED_SPEED:g} rad/s "
        "for any rate: plain quadratic stability holds already, the affine form and multi-convexity are not needed."
    )
    return Finding(computed, reproduced(all(holds)), reading)


@TOPIC.claim("P1-aqs-box")
def printed_boxes_are_stable(boxes: dict[Direction, Box] | None = None) -> Finding:
    """One constant P for all gains of each printed box, exact at the eight vertices of (omega, L1, L2)."""
    computed: dict[str, JsonValue] = {}
    for direction, corner in CORNERS.items():
        box = corner.box if boxes is None else boxes[direction]
        computed[direction] = {
            "L1": list(box[0]), "L2": list(box[1]), "vertices": len(exact_matrices(corner, box)),
            **diagonal_proof(corner, box),
            "slowest_pole_1_s": float(slowest_poles(corner, box, 21, speeds=91)[-1].max()),
        }  # fmt: skip
    x, y = computed.values()
    proved = bool(x["proved_exactly"] and y["proved_exactly"])
    found = (
        f"P = diag({x['weight']:,}, 1) longitudinally and diag({y['weight']:,}, 1) laterally prove every gain of both "
        f"boxes on 0 to {STATED_SPEED:g} rad/s, for any rate, in rational numbers."
    )
    reading = (
        "A_e is affine in omega, L1 and L2 one at a time, so a constant P decides at the eight vertices. "
        f"{found if proved else 'No constant diagonal P proves both boxes.'} "
        f"The slowest pole on a grid is {x['slowest_pole_1_s']:.3g} and {y['slowest_pole_1_s']:.3g} 1/s."
    )
    return Finding(computed, reproduced(proved), reading)


def slowest_poles(corner: Corner, box: Box, points: int, speeds: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """L1 and L2 over a box, and the largest real part of the frozen poles in 1/s over all wheel speeds: (points, points) each."""
    numeric = corner.model.on(np.linspace(0.0, STATED_SPEED, speeds))
    L1, L2 = np.meshgrid(*(np.linspace(*span, points) for span in box))
    gains = np.stack([L1, L2], axis=-1)[..., None, :, None]
    return L1, L2, np.asarray(np.linalg.eigvals(numeric.A - gains @ numeric.C).real.max(axis=(-2, -1)))


@TOPIC.part("quadratic-stability", "Stability of the printed gains and gain boxes", 3.0)
def quadratic_stability(scope: Scope) -> PartResult:
    """Both claims, every proof in a table, and the boxes over the plane of gains."""
    claims = TOPIC.found("P1-aqs-feas", "P1-aqs-box")
    gains, boxes = (claim.finding.computed for claim in claims)
    proofs = {**gains, **{f"box of P1, {direction}": entry for direction, entry in boxes.items()}}
    rows = [
        [name, *map(float, e["weights_of_diag_w_1"]), e["weight"], e["proved_exactly"]] for name, e in proofs.items()
    ]
    caption = (
        "Constant Lyapunov matrices diag(w, 1) that prove stability for every wheel speed from 0 to 180 rad/s and any rate: "
        "the interval of admissible weights w in closed form, and a round one that was checked in rational numbers."
    )
    columns = ["gains", "least w [1/s^2]", "greatest w [1/s^2]", "w checked [1/s^2]", "proved exactly"]
    panels = []
    steps = ([-200.0, -100.0, -50.0, -25.0, 0.0], [-10.0, -5.0, -2.5, -1.0, 0.0])
    for (direction, corner), levels in zip(CORNERS.items(), steps, strict=True):
        box, (L1, L2) = corner.box, corner.gains
        wide = tuple((low - 0.6 * (high - low), high + 0.6 * (high - low)) for low, high in box)
        poles = slowest_poles(corner, wide, 41 if scope.quick else 81, speeds=46)
        marks: list[Mark] = [
            Contours(*poles, [0.0, max(1.0, poles[-1].max())], colours.FORBIDDEN, filled=True),
            Contours(*poles, levels), Outline(box[0], box[1], "printed box", colours.BLUE, 1.8),
            dots(L1, L2, "printed gains", colours.RED),
        ]  # fmt: skip
        panels.append(Panel(marks, "L₁ [m/s]", "L₂ [m/s²]", direction, grid=False))
    figure = Figure(
        "gain-boxes",
        f"Slowest pole in 1/s (largest real part over wheel speeds from 0 to {STATED_SPEED:g} rad/s) over the plane "
        "of constant gains; shaded: unstable at some wheel speed. The printed boxes lie well inside the stable "
        "region; one constant Lyapunov matrix proves each of them, exactly. P1, text after (28) and (40).",
        "Contour maps of the slowest pole with the printed gain boxes inside the stable region.",
        panels, legend="below",
    )  # fmt: skip
    return PartResult(claims, [Table("diagonal-proofs", caption, columns, rows)], [figure])


def natural_scale(corner: Corner) -> float:
    """g = sqrt|c/b| of A_e = [[a, b], [c, d]] at mid-range: z multiplied by g balances the two couplings, 1/s."""
    ((_, b), (c, _)) = corner.error_matrices([STATED_SPEED / 2])[0]
    return float(np.sqrt(abs(c / b)))


def best_margin(corner: Corner, scale: float, condition: float) -> float:
    """Largest t with A_e'P + P A_e < -t I for a constant P, I <= P <= condition I, in the states (scale z, v_r).

    Affine in the wheel speed, so both ends of the range decide; t < 0: no such P proves stability.
    """
    problem = _problem(corner, np.array([scale, 1.0]), degree=0, margin=True)
    P = problem.unknowns["P"]
    problem.require("P >= I", P - problem.constant(np.eye(2)), strict=False)
    problem.require("P <= condition I", problem.constant(condition * np.eye(2)) - P, strict=False)
    found = solve(problem, LmiSettings(relaxation="vertex"))
    return float("nan") if found.objective is None else found.objective


def vertices_only(corner: Corner) -> tuple[LmiResult, FloatArray, FloatArray]:
    """An affine P, asked of a solver at the four vertices of (omega, rate) alone, without multi-convexity and scaling.

    Its answer; wheel speeds (g,) and the largest growth rate of V there, 1/s (g,): above zero the certificate is false.
    """
    problem = _problem(corner, np.ones(2), degree=1, margin=False)
    problem.require("P > 0", problem.unknowns["P"])
    found = solve(problem, LmiSettings(relaxation="grid", points=2))
    constant, slope = physical(corner.model, found, "P")
    omega = np.linspace(0.0, STATED_SPEED, 361)
    P = constant + omega[:, None, None] * slope
    product = P @ corner.error_matrices(omega)
    total = product + np.swapaxes(product, 1, 2)
    growth = (np.linalg.eigvals(np.linalg.solve(P, total + rate * slope)).real.max(axis=1) for rate in (-800.0, 800.0))
    return found, omega, np.maximum(*growth)


def _problem(corner: Corner, scale: FloatArray, degree: int, margin: bool) -> LmiProblem:
    """V' < 0 for the printed gains, with the unknown P of this degree."""
    model, gain = corner.model, np.array(corner.gains)[:, None]
    problem = LmiProblem(model.parameters, maximise_margin=margin)
    scaled = model.polynomial.with_states_scaled(scale)
    A, C = problem.scaled(scaled.A), problem.scaled(scaled.C)
    P = problem.symmetric("P", 2, degree)
    product = P @ (A - problem.constant(scale[:, None] * gain) @ C)
    problem.require("dV/dt < 0", -(product + product.T + problem.time_derivative(P)))
    return problem


@TOPIC.claim("P1-aqs-scale")
def scaling(scaled: bool = True) -> Finding:
    """Margins with a cap on cond(P), in the units of the model and with z scaled; and what vertices alone prove."""
    computed: dict[str, JsonValue] = {}
    for corner in DESIGNS:
        g = natural_scale(corner)
        loose, omega, growth = vertices_only(corner)
        computed[str(corner)] = {
            "scale_of_z": g, "natural_condition_number": g * g,
            "margin_unscaled": {f"{cap:g}": best_margin(corner, 1.0, cap) for cap in CAPS},
            f"margin_scaled_condition_{BALANCED:g}": best_margin(corner, g if scaled else 1.0, BALANCED),
            "vertices_only": {
                "solver": loose.report.status, "verdict": str(loose.verdict), "largest_growth_1_s": float(growth.max()),
                "at_rad_s": float(omega[growth.argmax()]), "certified": loose.verdict is Verdict.CERTIFIED,
            },
        }  # fmt: skip
    rows = list(computed.values())
    missed = sum(row["margin_unscaled"][f"{CAPS[0]:g}"] < 0.0 for row in rows)
    helped = sum(row[f"margin_scaled_condition_{BALANCED:g}"] > 0.0 for row in rows)
    false = sum(row["vertices_only"]["largest_growth_1_s"] > 0.0 for row in rows)
    low, high = (pick(row["natural_condition_number"] for row in rows) for pick in (min, max))
    reading = (
        f"In metres and metres per second the natural condition number of P is g^2 = |c/b|, {low:.2g} to "
        f"{high:.2g}. Capped at {CAPS[0]:g}, {missed} of {len(rows)} printed designs have no constant P at all; "
        f"with z multiplied by g, {helped} of {len(rows)} have one with condition number {BALANCED:g}. Asked at the "
        f"vertices alone the solver says '{rows[0]['vertices_only']['solver']}', and {false} of {len(rows)} answers "
        "let V grow between the vertices. Scale, then re-evaluate on the whole range."
    )
    return Finding(computed, derived(missed == helped == false == len(rows)), reading)


@TOPIC.part("conditioning", "Units decide whether a certificate is found", 2.0)
def conditioning(scope: Scope) -> PartResult:
    """Natural scale, margins with and without it, and what vertices alone prove."""
    claims = TOPIC.found("P1-aqs-scale")
    rows = []
    for name, entry in claims[0].finding.computed.items():
        scale, condition, unscaled, scaled, loose = entry.values()
        shown = (loose[key] for key in ("solver", "largest_growth_1_s", "at_rad_s"))
        rows.append([name, scale, condition, *unscaled.values(), scaled, *shown])
    caption = (
        "Search for a constant P with I <= P <= kappa I (margin: largest t with A_e'P + P A_e < -t I), with z in "
        "metres and with z multiplied by g; and an affine P from the vertices alone: what the solver says, and how "
        "fast V really grows in between."
    )
    columns = ["design", "g [1/s]", "g^2 [1/s^2]", "margin, kappa 1e3", "margin, kappa 1e4", "margin with g, kappa 2",
               "solver at the vertices", "largest growth rate [1/s]", "at [rad/s]"]  # fmt: skip
    table = Table("conditioning", caption, columns, rows)
    return PartResult(claims, [table], [conditioning_figure(np.geomspace(1.0, 1e6, 7 if scope.quick else 13))])


def conditioning_figure(conditions: FloatArray) -> Figure:
    """Best Lyapunov margin over the allowed condition number, and false certificates between the vertices."""
    growth: list[Mark] = [ZERO]
    grey = colours.GREY
    margins: list[Mark] = [ZERO, Line([], [], "z scaled by g", grey), Line([], [], "z in metres", grey, "dashed")]
    for corner, colour in zip(DESIGNS, colours.CURVES, strict=False):
        _, omega, rate = vertices_only(corner)
        growth.append(Line(omega, rate, str(corner), colour))
        dashes: dict[Dash, float] = {"dashed": 1.0, "solid": natural_scale(corner)}
        for dash, scale in dashes.items():
            # Relative to the trivial growth of the margin with P itself, so that the sign is what one sees.
            margin = [best_margin(corner, scale, cap) / cap for cap in conditions]
            margins.append(Line(conditions, margin, color=colour, dash=dash, marker="."))
    ticks = {-1e4: "−10⁴", -1e2: "−10²", -1.0: "−1", 0.0: "0", 1.0: "1", 1e2: "10²"}
    x = Axis("allowed condition number κ of P [1]", scale="log")
    y = Axis("best margin / κ [1/s]", scale="symlog", ticks=ticks, linear=1e-3)
    right = Panel(growth, SPEED_AXIS, "growth rate of V [1/s]", "affine P, vertices only, z in metres")
    return Figure(
        "conditioning",
        "Left: the largest margin of the Lyapunov inequality that a constant P with I ≤ P ≤ κ I reaches, over the allowed "
        "condition number κ, with the bristle deflection in metres (dashed) and multiplied by its natural scale g (solid); "
        "below zero there is no certificate (logarithmic beyond ±0.001). Right: an affine P(ω) that a solver accepts at the "
        "four vertices of wheel speed and acceleration lets V grow between them. Printed gains of P1 and P3.",
        "Left: unscaled margins become positive only at condition numbers of 1e4 to 1e5, scaled ones at once. "
        "Right: growth rates below zero at both ends and up to 280 per second in between.",
        [Panel(margins, x, y, "constant P"), right], legend="below",
    )  # fmt: skip
