"""P4-tab1: the text against Table I."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.claim import Finding, reproduced
from studies.papers.ekf_ukf_lateral.inputs import PACKAGE
from studies.papers.published import printed_numbers
from studies.papers.topic import Topic
from studies.plots import Axis, Bars, Figure, Level, Mark, Panel, Words
from studies.plots.colours import EXTENDED, RED, UNSCENTED
from studies.study import Cell, PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
LIMIT = 8.0  # %


@dataclass(frozen=True)
class Row:
    """One row of Table I: largest measured value, and mean and standard deviation of the error (13) in % by filter."""

    quantity: str
    largest: float
    unit: str
    mean: dict[str, float]
    deviation: dict[str, float]


TABLE_1 = tuple(
    Row(quantity, largest, unit, {"ekf": mean[0], "ukf": mean[1]}, {"ekf": deviation[0], "ukf": deviation[1]})
    for quantity, largest, unit, mean, deviation in printed_numbers(PACKAGE)["table_1"]
)


@TOPIC.claim("P4-tab1")
def below_eight_percent(table: Sequence[Row] = TABLE_1) -> Finding:
    """How many means of the unscented filter exceed 8 %, their average, and where it beats the extended one."""
    ukf, ekf = ([row.mean[kind] for row in table] for kind in ("ukf", "ekf"))
    above = [row.quantity for row in table if not row.mean["ukf"] < LIMIT]
    computed = {
        "ukf_means_percent": ukf, "ukf_average_percent": sum(ukf) / len(ukf),
        "ekf_average_percent": sum(ekf) / len(ekf), "rows_above_limit": above,
        "ukf_better_means": sum(row.mean["ukf"] < row.mean["ekf"] for row in table),
        "ukf_better_deviations": sum(row.deviation["ukf"] < row.deviation["ekf"] for row in table),
        "rows": len(table)}  # fmt: skip
    named = f" ({', '.join(above)})" if above else ""
    return Finding(computed, reproduced(not above), (
        f"{len(above)} of {len(table)} printed means of the unscented filter are at or above {LIMIT:g} %{named}; their average "
        f"is {computed['ukf_average_percent']:.2f} %, which is the only reading of 'globally' under which the statement could "
        f"hold. The unscented filter is better in {computed['ukf_better_means']} means and "
        f"{computed['ukf_better_deviations']} standard deviations of {len(table)}."))  # fmt: skip


@TOPIC.part("table-1", "Table I against the text", 0.2)
def errors(scope: Scope) -> PartResult:
    """Table I, its averages, and the comparison with the text; means and deviations of both filters as bars."""
    columns = ("quantity", "max", "unit", "mean EKF [%]", "mean UKF [%]", "std EKF [%]", "std UKF [%]",
               f"UKF mean below {LIMIT:g} %", "UKF mean better", "UKF std better")  # fmt: skip
    values = [[*row.mean.values(), *row.deviation.values()] for row in TABLE_1]
    values.append([round(float(value), 3) for value in np.mean(values, axis=0)])
    heads = [(row.quantity, row.largest, row.unit) for row in TABLE_1]
    rows: list[list[Cell]] = [list(head) for head in (*heads, ("average", None, None))]
    for row, (ekf, ukf, ekf_spread, ukf_spread) in zip(rows, values, strict=True):
        row += [ekf, ukf, ekf_spread, ukf_spread, ukf < LIMIT, ukf < ekf, ukf_spread < ekf_spread]
    table = Table("table-1",
        "Table I of P4 as printed (road test of a Peugeot 307, errors (13) in percent of the maximum), with its averages and "
        "whether the statement 'globally less than 8 %' holds.", columns, rows)  # fmt: skip
    bars: dict[str, list[Mark]] = {"mean": [], "deviation": []}
    for what, marks in bars.items():
        for kind, color, label, aside in (("ekf", EXTENDED, "extended", -0.2), ("ukf", UNSCENTED, "unscented", 0.2)):
            places, found = np.arange(len(TABLE_1)) + aside, [getattr(row, what)[kind] for row in TABLE_1]
            marks.append(Bars(places, found, f"{label} Kalman filter", color, 0.38, numbers="%.4g"))
    average = float(np.mean([row.mean["ukf"] for row in TABLE_1]))
    limits: list[Mark] = [
        Level(y=LIMIT, color=RED, width=1.2),
        Words(-0.5, LIMIT + 0.15, f"{LIMIT:g} % of the text", RED),
        Level(y=average, color=UNSCENTED, dash="dotted", width=1.0),
        Words(-0.5, average - 0.75, f"unscented,\naverage {average:.2f} %", UNSCENTED, vertical="center")]  # fmt: skip
    share = Axis("error, share of the largest value [%]", 0, 16.5)
    quantities = Axis(ticks={float(k): row.quantity.replace(" ", "\n", 1) for k, row in enumerate(TABLE_1)})
    figure = Figure("table-1",
        "Table I of P4 as printed: errors (13) of the two filters in the road test. Two of the five means of the unscented "
        "filter exceed the 8 % that the text calls a global bound; their average does not. The unscented filter is worse in "
        "the mean of F_y11 and in the deviation of F_y12.",
        "Grouped bars of the printed errors of both filters for four tire forces and sideslip, with a red line at 8 percent.",
        [Panel([*bars["mean"], *limits], quantities, share, "mean"),
         Panel(bars["deviation"], quantities, "", "standard deviation", legend="upper left")],
        (9.2, 3.5), share_y="all")  # fmt: skip
    return PartResult(TOPIC.found(), [table], [figure])
