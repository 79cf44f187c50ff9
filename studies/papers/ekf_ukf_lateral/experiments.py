"""Table I and Figs. 6 to 9, driven on the truth vehicle."""

from __future__ import annotations

from functools import partial

from studies.experiments.four_wheel_report import four_wheel_part
from studies.papers.ekf_ukf_lateral.published_table import table_1
from studies.study import Part, PartResult, Scope

MANOEUVRE = "p4-bends-dry"


def _table_1(name: str, tire: str | None, scope: Scope) -> PartResult:
    return four_wheel_part(name, MANOEUVRE, table_1(), scope, tire)


PARTS = (
    Part("table-1-driven", "Table I on the truth vehicle", partial(_table_1, "bends", None), cost=60.0),
    Part(
        "table-1-other-tire",
        "Table I on a tire with another shape: Magic Formula with slip lag",
        partial(_table_1, "bends-other-tire", "magic-formula"),
        cost=65.0,
    ),
)
