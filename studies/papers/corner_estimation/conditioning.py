"""P1-aqs-scale: the units of the bristle deflection decide whether a solver finds a Lyapunov matrix of (28).

Without scaling it misses certificates that exist and accepts false ones.
"""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from studies.claim import Finding, JsonValue
from studies.papers.corner_estimation.inputs import DESIGNS, SPEED_AXIS, STATED_SPEED, Corner, topic
from studies.papers.verdicts import derived
from studies.plots import ZERO, Axis, Dash, Figure, Line, Mark, Panel, colours
from studies.study import PartResult, Scope, Table
from synthesis.design.stability import physical
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve

TOPIC = topic()
CAPS = (1e3, 1e4)  # condition numbers that a general-purpose scaling might allow
BALANCED = 2.0
LOOSE = ("solver", "largest_growth_1_s", "at_rad_s")  # of the vertices alone, in the table


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
    claims = TOPIC.found()
    rows = []
    for name, entry in claims[0].finding.computed.items():
        scale, condition, unscaled, scaled, loose = entry.values()
        rows.append([name, scale, condition, *unscaled.values(), scaled, *(loose[key] for key in LOOSE)])
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
