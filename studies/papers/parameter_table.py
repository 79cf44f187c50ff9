"""The vehicle and tire constants of a paper as a table, with the place where each is printed."""

from __future__ import annotations

from studies.study import Cell, PartResult, Scope, Table
from synthesis.models.parameter_set import load_parameter_set, quantities


def parameter_part(parameters: str, caption: str, scope: Scope) -> PartResult:
    """Table I: every constant of the shipped set ``parameters`` as the results of the study use it."""
    found = load_parameter_set(parameters)
    entries = {name.replace("_", " "): quantity for name, quantity in found.vehicle.items()}
    for direction, tire in found.tire.items():
        entries |= {f"{name}, {direction}": quantity for name, quantity in quantities(tire).items()}
    rows: list[tuple[Cell, ...]] = [(name, q.value, q.unit, q.source) for name, q in entries.items()]
    return PartResult(tables=[Table("table-1", caption, ("quantity", "value", "unit", "printed in"), rows)])
