"""P1-29-*, P1-41-* and P1-mc: what the printed Lyapunov matrices prove, judged in exact arithmetic."""

from __future__ import annotations

from functools import partial

import numpy as np
import sympy as sp

from studies.claim import ClaimFunction, Finding, JsonValue, judged
from studies.papers.corner_estimation.inputs import DESIGN_SPEED, DIRECTIONS, STATED_SPEED, corner_model, printed_gains
from studies.papers.corner_estimation.lyapunov import (
    READINGS,
    Coefficients,
    Reading,
    certificate,
    multi_convexity,
    printed_matrix,
)
from studies.papers.verdicts import partly
from synthesis.models.catalogue.corner import Direction

NUMBERS = {"longitudinal": "(29)", "lateral": "(41)"}
BEYOND = 400.0  # rad/s, to see where a matrix that fails in the stated range would hold


def primal(direction: Direction, matrix: Coefficients | None = None) -> Finding:
    """The matrix as printed, P of V = e'Pe: does (28) or (40) hold on 0..180 rad/s?"""
    offered = certificate(direction, "primal", matrix)
    inside, wide = offered.judgement(), offered.judgement((0.0, BEYOND))
    ends = offered.eigenvalues(np.array([0.0, STATED_SPEED])).max(axis=1)
    computed = {
        "holds_everywhere": inside.everywhere,
        "holds_on_rad_s": _listed(inside.intervals),
        f"holds_on_up_to_{BEYOND:g}_rad_s": _listed(wide.intervals),
        "largest_eigenvalue_at_0_rad_s": float(ends[0]),
        "largest_eigenvalue_at_180_rad_s": float(ends[1]),
    }
    reading = (
        f"As P of V = e'Pe the printed {NUMBERS[direction]} satisfies its inequality on {_words(wide.intervals)} "
        f"rad/s (searched up to {BEYOND:g} rad/s). The largest eigenvalue, to be negative, is {ends[0]:.4g} at "
        f"standstill and {ends[1]:.4g} at {STATED_SPEED:g} rad/s."
    )
    if not inside.everywhere:
        reading += (
            " The large entry weighs the velocity, where a P of these dynamics must weigh the bristle deflection."
        )
    return Finding(computed, judged(inside.everywhere), reading)


def dual(direction: Direction, matrix: Coefficients | None = None) -> Finding:
    """The printed matrix as Q of V = e'Q^-1 e on the stated range, or on the range that the gains are designed for."""
    offered = certificate(direction, "dual", matrix)
    found = offered.judgement()
    designed = offered.judgement((0.0, DESIGN_SPEED)).everywhere
    growth = offered.growth(np.linspace(0.0, STATED_SPEED, 1801))
    computed = {
        "holds_everywhere": found.everywhere,
        "holds_on_design_range": designed,
        "holds_on_rad_s": _listed(found.intervals),
        "largest_relative_eigenvalue_1_s": float(growth.max()),
        "at_wheel_speed_rad_s": float(np.linspace(0.0, STATED_SPEED, 1801)[growth.argmax()]),
    }
    reading = (
        f"Read as Q of V = e'Q^-1 e, {NUMBERS[direction]} proves stability on {_words(found.intervals)} of the "
        f"stated 0 to {STATED_SPEED:g} rad/s, at both bounds of the rate; relative to Q the largest eigenvalue is "
        f"{growth.max():.4g} 1/s. The design range of the gains, 0 to {DESIGN_SPEED:g} rad/s, is "
        f"{'covered' if designed else 'not covered'}."
    )
    return Finding(computed, partly(found.everywhere, designed), reading)


def printed_slopes_are_multi_convex(slopes: dict[Direction, list[list[str]]] | None = None) -> Finding:
    """Sign of A1'P1 + P1 A1 in exact arithmetic, and its eigenvalues in every reading of the matrices."""
    holds: dict[str, bool] = {}
    computed: dict[str, JsonValue] = {}
    for direction in DIRECTIONS:
        matrix = printed_matrix(direction)
        if slopes:
            matrix[1] = slopes[direction]
        exact = exact_multi_convexity(direction, matrix[1])
        holds[direction] = bool(exact[0, 0] >= 0 and exact[1, 1] >= 0 and exact.det() >= 0)
        spread = {r: np.linalg.eigvalsh(multi_convexity(certificate(direction, r, matrix))).tolist() for r in READINGS}
        computed[direction] = {"eigenvalues": spread, "determinant_as_printed": float(exact.det())}
    met = [f"{d}, {r}" for d in DIRECTIONS for r in READINGS if computed[d]["eigenvalues"][r][0] >= 0.0]
    shown = "; ".join("{} {:.3g}, {:.3g}".format(d, *computed[d]["eigenvalues"]["primal"]) for d in DIRECTIONS)
    reading = (
        "Column 2 of A1 is zero, so entry (2,2) of the condition is zero and its determinant is minus the square "
        "of entry (1,2): it can hold only if that entry vanishes. Eigenvalues of the condition as printed: "
        f"{shown}. Of {2 * len(READINGS)} readings (two matrices, as printed, exchanged, dual, adjugate) {len(met)} "
        "meet it."
    )
    return Finding(computed, judged(all(holds.values())), reading)


def exact_multi_convexity(direction: Direction, slope: list[list[str]]) -> sp.Matrix:
    """A1'P1 + P1 A1 in rational numbers, from the printed decimals."""
    model = corner_model(direction)
    values = {name: sp.Rational(str(constant.value)) for name, constant in model.constants.items()}
    gain = sp.Matrix([sp.Rational(str(g)) for g in printed_gains(direction)])
    A1 = (model.A - gain * model.C).diff("wheel_speed").subs(values)
    P1 = sp.Matrix([[sp.Rational(entry) for entry in row] for row in slope])
    return A1.T * P1 + P1 * A1


def reading_table() -> list[list[str | float | bool | None]]:
    """Every reading of both matrices: where it holds, and its largest growth rate on the stated range."""
    rows: list[list[str | float | bool | None]] = []
    names: dict[Reading, str] = {
        "primal": "as printed, V = e'P e", "swapped": "states exchanged", "dual": "V = e'Q^-1 e", "adjugate": "adjugate",
    }  # fmt: skip
    for direction in DIRECTIONS:
        for reading in READINGS:
            offered = certificate(direction, reading)
            found = offered.judgement()
            where = "; ".join(f"{low:.2f} to {high:.2f}" for low, high in found.intervals) or "nowhere"
            worst = float(np.nanmax(offered.growth(np.linspace(0.0, STATED_SPEED, 361))))
            rows.append([NUMBERS[direction], direction, names[reading], found.everywhere, where, worst])
    return rows


def _words(intervals: tuple[tuple[float, float], ...]) -> str:
    return " and ".join(f"({low:.7g}, {high:.7g})" for low, high in intervals) or "no part"


def _listed(intervals: tuple[tuple[float, float], ...]) -> list[list[float]]:
    return [list(interval) for interval in intervals]


CLAIMS: dict[str, ClaimFunction] = {
    "P1-29-primal": partial(primal, "longitudinal"),
    "P1-29-dual": partial(dual, "longitudinal"),
    "P1-41-primal": partial(primal, "lateral"),
    "P1-41-dual": partial(dual, "lateral"),
    "P1-mc": printed_slopes_are_multi_convex,
}
