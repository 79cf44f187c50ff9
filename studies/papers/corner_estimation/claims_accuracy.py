"""P1-tab3, P1-34: the text against Table III, and what the axle weights leave open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

from estimators.velocity.mapping import SlipWeights
from studies.claim import ClaimFunction, Finding, judged
from studies.papers.corner_estimation.inputs import printed_numbers, printed_value
from studies.papers.verdicts import under_specified

VX, VY = 2, 4  # columns of Table III that hold NRMS values


def velocity_table(rows: Sequence[Sequence[Any]] | None = None) -> Finding:
    """Every NRMS of Table III against the limit of the text."""
    table = printed_numbers()["table_3"]["rows"] if rows is None else rows
    limit = float(printed_value("P1-tab3"))
    above = [
        [row[0], row[1], name, row[k]] for row in table for name, k in (("V_x", VX), ("V_y", VY)) if row[k] > limit
    ]
    drives = sorted({row[0] for row in table})
    largest = {drive: max(max(row[VX], row[VY]) for row in table if row[0] == drive) for drive in drives}
    computed = {"above_the_limit": above, "largest_percent": largest, "values": 2 * len(table)}
    shown = ", ".join(f"{name} {value:g} % ({drive}, {manoeuvre})" for drive, manoeuvre, name, value in above) or "none"
    reading = (
        f"Of {2 * len(table)} printed velocity errors {len(above)} exceed {limit:g} %: {shown}. Largest by drive: "
        f"{', '.join(f'{drive} {value:g} %' for drive, value in largest.items())}."
    )
    return Finding(computed, judged(not above), reading)


def axle_weight(mean: sp.Expr, low: sp.Expr, high: sp.Expr, argument: sp.Expr) -> sp.Expr:
    """(34): W_s + (W_ub - W_lb)/pi atan(argument)."""
    return mean + (high - low) / sp.pi * sp.atan(argument)


def weight_readings(names_axle: bool = False) -> Finding:
    """Range of (34), what both axles need, and how far the readings of "axle i" lie apart."""
    mean, low, high = sp.symbols("W_s W_lb W_ub", real=True)
    x = sp.Symbol("x", real=True)
    weight = axle_weight(mean, low, high, x)
    ends = [sp.simplify(sp.limit(weight, x, where)) for where in (-sp.oo, sp.oo)]
    # W_i and 1 - W_i must both run over [W_lb, W_ub]:
    needed = sp.solve([ends[0] - low, ends[1] - high, (1 - ends[1]) - low], [mean, low], dict=True)[0]
    at_threshold = weight.subs(x, 0)
    shipped = SlipWeights()
    example = {mean: sp.Rational(1, 2), low: sp.Rational(str(shipped.lower)), high: sp.Rational(str(shipped.upper))}
    # lambda_am is the same for both axles, so i may be either: the front weight is then W or 1 - W.
    spread = 0 if names_axle else sp.limit(abs(2 * weight.subs(example) - 1), x, sp.oo)
    computed = {
        "lowest": str(ends[0]),
        "highest": str(ends[1]),
        "needed_for_both_axles": {str(key): str(value) for key, value in needed.items()},
        "weight_at_threshold": str(at_threshold),
        "spread_between_readings": float(spread),
        "example": {str(key): float(value) for key, value in example.items()},
    }
    reading = (
        f"(34) runs from {ends[0]} to {ends[1]} and is {at_threshold} at the threshold: both axles stay within "
        f"[W_lb, W_ub] and are equal there only if W_s = {needed[mean]} and W_lb = {needed[low]}. lambda_am is the "
        "same for both axles, so the formula does not say which of them gets W and which 1 - W: with W_lb = "
        f"{shipped.lower:g}, W_ub = {shipped.upper:g} the two readings differ by up to {float(spread):.2g}. No "
        "values are printed."
    )
    return Finding(computed, under_specified(float(spread), 1e-9, needed[mean] == sp.Rational(1, 2)), reading)


CLAIMS: dict[str, ClaimFunction] = {"P1-tab3": velocity_table, "P1-34": weight_readings}
