"""The form of tables over parameters, and of a plant that is a polynomial on each cell of their grid.

    model.tables  {name: {"unit", "source", "over": [names], "breakpoints": [[..], ..], "values": nested alike}}
    plant         {"breakpoints": [[..] for every parameter], "cells": [{"A": .., .., "F": ..}, ..]}

Cells stand in the order of their breakpoints, those of the last parameter fastest. The argument of the Chebyshev polynomials of a
cell is -1 and 1 at its ends. A breakpoint that stands twice in a table is a jump.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import prod
from typing import Any

from estimators.schedule.checker import Checker, quoted, shown

MOST_TABLES, MOST_CELLS = 256, 4096
MOST_NUMBERS = 10_000_000  # of all matrices on all cells
BY_CELLS = ("breakpoints", "cells")


def check_tables(check: Checker, tables: Any, scheduling: Sequence[Mapping[str, Any]], most: int) -> None:
    """Names, units, breakpoints that cover the ranges, a value for each; raises ScheduleError."""
    check.mapping(tables, "model.tables", MOST_TABLES)
    ranges = {entry["name"]: (entry["min"], entry["max"]) for entry in scheduling}
    for name, table in tables.items():
        check.name(name, f"model.tables.{shown(name, 40)}")
        place = f"model.tables.{name}"
        check.keys(table, place, ("unit", "source", "over", "breakpoints", "values"))
        check.unit(table["unit"], f"{place}.unit")
        check.text(table["source"], f"{place}.source")
        over = check.items(table["over"], f"{place}.over", most=len(ranges))
        for one in over:
            if not isinstance(one, str) or one not in ranges or over.count(one) > 1:
                check.fail(f"{place}.over", f"{quoted(one)} is not a scheduling parameter, or stands twice")
        if not over:
            check.fail(f"{place}.over", "is empty; a table needs a parameter")
        shape = []
        for i, line in enumerate(check.items(table["breakpoints"], f"{place}.breakpoints", len(over))):
            spot = f"{place}.breakpoints[{i}]"
            numbers = [check.number(x, spot) for x in check.items(line, spot, most=most)]
            _rising(check, numbers, spot)
            if not numbers[0] <= ranges[over[i]][0] < ranges[over[i]][1] <= numbers[-1]:
                check.fail(spot, f"do not cover the range of {over[i]}")
            shape.append(len(numbers))
        check.array(table["values"], f"{place}.values", tuple(shape))


def _rising(check: Checker, numbers: Sequence[float], place: str) -> None:
    """None falls, none stands three times, the first and the last once."""
    steps = [b - a for a, b in pairwise(numbers)]
    if not steps or min(steps) < 0.0 or steps[0] == 0.0 or steps[-1] == 0.0:
        check.fail(place, "must rise from the first to the last, which stand once")
    if any(a == b == 0.0 for a, b in pairwise(steps)):
        check.fail(place, "one stands three times; twice is a jump")


def check_cells(
    check: Checker, plant: Mapping[str, Any], scheduling: Sequence[Mapping[str, Any]], shapes: Mapping[str, tuple[int, int]],
    order: int, closest: float,
) -> None:  # fmt: skip
    """A plant by cells; raises ScheduleError."""
    check.keys(plant, "plant", BY_CELLS)
    counts = []
    for i, line in enumerate(check.items(plant["breakpoints"], "plant.breakpoints", len(scheduling))):
        place, entry = f"plant.breakpoints[{i}]", scheduling[i]
        numbers = [check.number(x, place) for x in check.items(line, place, most=MOST_CELLS + 1)]
        if len(numbers) < 2 or numbers[0] != entry["min"] or numbers[-1] != entry["max"]:
            check.fail(
                place, f"must start at min = {entry['min']} and end at max = {entry['max']} {shown(entry['unit'], 30)}"
            )
        if any(not b - a > closest * (entry["max"] - entry["min"]) for a, b in pairwise(numbers)):
            check.fail(place, "must rise clearly from one to the next")
        counts.append(len(numbers) - 1)
    if prod(counts) > MOST_CELLS:
        check.fail("plant.breakpoints", f"make {prod(counts)} cells; at most {MOST_CELLS} are read")
    highest = [0] * len(counts)
    for k, cell in enumerate(check.items(plant["cells"], "plant.cells", prod(counts))):
        check.keys(cell, f"plant.cells[{k}]", tuple(shapes))
        for key, shape in shapes.items():
            check.polynomial(cell[key], f"plant.cells[{k}].{key}", len(counts), shape, order)
            highest = [max(column) for column in zip(highest, *cell[key]["orders"], strict=True)]
    # A runtime keeps all orders up to the highest, of all matrices on all cells.
    kept = prod(counts) * prod(n + 1 for n in highest) * sum(map(prod, shapes.values()))
    if kept > MOST_NUMBERS:
        check.fail("plant.cells", f"make {kept} numbers; at most {MOST_NUMBERS} are kept")
