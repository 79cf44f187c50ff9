"""P1-tab3, P1-34: the text against Table III, and what the axle weights leave open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from estimators.velocity.mapping import SlipWeights
from studies.claim import Finding, reproduced
from studies.papers.corner_estimation.inputs import PACKAGE, topic
from studies.papers.published import printed_numbers
from studies.papers.verdicts import under_specified
from studies.plots import Axis, Bars, Figure, Level, Line, Mark, Panel, colours
from studies.study import Table

TOPIC = topic()
TABLE_3 = printed_numbers(PACKAGE)["table_3"]
NRMS = {"V_x": 2, "V_y": 4}  # columns of Table III
LIMIT = float(TOPIC.printed("P1-tab3"))  # %, of the text


@TOPIC.claim("P1-tab3")
def velocity_table(rows: Sequence[Sequence[Any]] = TABLE_3["rows"]) -> Finding:
    """Every NRMS of Table III against the limit of the text."""
    above = [[row[0], row[1], name, row[k]] for row in rows for name, k in NRMS.items() if row[k] > LIMIT]
    drives = sorted({row[0] for row in rows})
    largest = {drive: max(row[k] for row in rows if row[0] == drive for k in NRMS.values()) for drive in drives}
    computed = {"above_the_limit": above, "largest_percent": largest, "values": 2 * len(rows)}
    shown = ", ".join(f"{name} {value:g} % ({drive}, {manoeuvre})" for drive, manoeuvre, name, value in above) or "none"
    reading = (
        f"Of {2 * len(rows)} printed velocity errors {len(above)} exceed {LIMIT:g} %: {shown}. Largest by drive: "
        f"{', '.join(f'{drive} {value:g} %' for drive, value in largest.items())}."
    )
    return Finding(computed, reproduced(not above), reading)


@TOPIC.claim("P1-34")
def weight_readings(names_axle: bool = False) -> Finding:
    """Range of (34), what both axles need, and how far the readings of "axle i" lie apart."""
    mean, low, high = sp.symbols("W_s W_lb W_ub", real=True)
    x = sp.Symbol("x", real=True)
    weight = mean + (high - low) / sp.pi * sp.atan(x)
    least, most = (sp.simplify(sp.limit(weight, x, where)) for where in (-sp.oo, sp.oo))
    # W_i and 1 - W_i must both run over [W_lb, W_ub]:
    needed = sp.solve([least - low, most - high, (1 - most) - low], [mean, low], dict=True)[0]
    at_threshold, shipped = weight.subs(x, 0), SlipWeights()
    example = {mean: sp.Rational(1, 2), low: sp.Rational(str(shipped.lower)), high: sp.Rational(str(shipped.upper))}
    # lambda_am is the same for both axles, so i may be either: the front weight is then W or 1 - W.
    spread = 0.0 if names_axle else float(sp.limit(abs(2 * weight.subs(example) - 1), x, sp.oo))
    computed = {
        "lowest": str(least), "highest": str(most), "weight_at_threshold": str(at_threshold), "spread_between_readings": spread,
        "needed_for_both_axles": {str(key): str(value) for key, value in needed.items()},
        "example": {str(key): float(value) for key, value in example.items()},
    }  # fmt: skip
    reading = (
        f"(34) runs from {least} to {most} and is {at_threshold} at the threshold: both axles stay within [W_lb, "
        f"W_ub] and are equal there only if W_s = {needed[mean]} and W_lb = {needed[low]}. lambda_am is the same for "
        f"both axles, so the formula does not say which of them gets W and which 1 - W: with W_lb = {shipped.lower:g}, "
        f"W_ub = {shipped.upper:g} the two readings differ by up to {spread:.2g}. No values are printed."
    )
    return Finding(computed, under_specified(spread, 1e-9, needed[mean] == sp.Rational(1, 2)), reading)


def table_figure() -> Figure:
    """Table III beside the limit that the text states."""
    rows = TABLE_3["rows"]
    places = np.arange(len(rows))[::-1]
    looks = zip(("Vₓ", "Vᵧ"), NRMS.values(), (colours.BLUE, colours.ORANGE), (0.2, -0.2), strict=True)
    marks: list[Mark] = [
        *(Bars(places + shift, [row[k] for row in rows], name, colour, 0.38, flat=True, numbers="%g")
          for name, k, colour, shift in looks),
        Level(x=LIMIT, label=f"{LIMIT:g} %, the text", color=colours.RED, dash="dashed", width=1.2),
    ]  # fmt: skip
    names = {float(place): f"{row[0]}: {row[1]}" for place, row in zip(places, rows, strict=True)}
    return Figure(
        "table-3",
        "Velocity errors of Table III as the paper prints them (NRMS (46), eight drives on the road), beside the "
        "limit that its text states for all of them. Two lateral values of the rear-driven car exceed it.",
        "Bars per drive; two lateral bars, 7.6 and 7.15 percent, pass the line at 6.3 percent.",
        Panel(marks, "normalised error as printed [%]", Axis("drive [as in Table III]", ticks=names)), legend="below",
    )  # fmt: skip


def axle_weight_figure() -> Figure:
    """The axle weight (34) in both readings, and with the difference of the slips as argument."""
    shipped, threshold, slip = SlipWeights(), 0.1, np.linspace(0.0, 0.3, 301)
    weight = 0.5 + (shipped.upper - shipped.lower) / np.pi * np.arctan(shipped.sharpness * (slip - threshold))
    ours = shipped.front(np.outer(slip, [0.0, 0.0, 1.0, 0.0]))  # all of it at the rear
    marks: list[Mark] = [
        Line(slip, weight, "W, if i is the front axle"),
        Line(slip, 1.0 - weight, "1 − W, if i is the rear axle", colours.RED, "dashed"),
        Line(slip, ours, "argument Σr − Σf instead (ours)", colours.ORANGE, "dash-dot"),
        Level(x=threshold, color=colours.GREY, dash="dotted"),
    ]
    x = "slip of the rear axle Σr, front without slip [1]"
    return Figure(
        "axle-weights",
        "Weight of the front axle over the slip of the rear one, as (34) prints it, for both meanings of axle i "
        f"(threshold 0.1, dotted; W between {shipped.lower:g} and {shipped.upper:g}, sharpness "
        f"{shipped.sharpness:g}; the paper prints no values). The printed argument is the same for both axles, so "
        "the formula does not say which of them loses. P1 (34), (35).",
        "Two curves that cross at one half at the threshold, and one that starts at one half without slip.",
        Panel(marks, x, Axis("weight of the front axle [1]", 0.0, 1.0), legend="center right"), size=(4.8, 3.4),
    )  # fmt: skip


CAPTION = "Table III of P1 as printed: velocity errors at the centre of gravity, measured on the road by its authors."
PRINTED = Table("table-3", CAPTION, TABLE_3["columns"], TABLE_3["rows"])
SHOWN = [table_figure, axle_weight_figure]
TOPIC.show("accuracy", "Accuracy claims and axle weights", 2.0, tables=[lambda: PRINTED], figures=SHOWN)
