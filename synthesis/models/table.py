"""Tables over scheduling parameters: quantities of a model that are known at breakpoints and multilinear between them.

A formula uses a table by its name, like a constant. On a box between breakpoints a table is a polynomial of the parameters, and
so is then every entry that uses it: the plant is a polynomial on each cell of the grid of all breakpoints, with kinks between.
A breakpoint that stands twice is a jump: the table ends at the first value and goes on from the second; at it the plant may be
either.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from estimators.display import Display, counted
from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.param import SchedulingParameter, check_unit


@dataclass(frozen=True, eq=False, repr=False)
class LookupTable(Display):
    """Values (b_1, .., b_k) at the breakpoints (b_i,) of the parameters `over`, multilinear between them.

    Raises ModelError for breakpoints that do not rise or stand more than twice, and for values that do not fit them.

    >>> LookupTable("1/s", "measured", ("speed",), ((0.0, 10.0, 10.0, 40.0),), [1.0, 3.0, 3.5, 4.0]).jumps
    {'speed': (10.0,)}
    """

    unit: str
    source: str
    over: tuple[str, ...]
    breakpoints: tuple[tuple[float, ...], ...]
    values: Any

    def __post_init__(self) -> None:
        check_unit(self.unit, "table")
        if not self.source.strip():
            raise ModelError("table has no source; say where its numbers come from")
        if not self.over or len(set(self.over)) < len(self.over) or len(self.breakpoints) != len(self.over):
            raise ModelError(
                f"table over {', '.join(self.over) or 'nothing'}: needs one or more parameters, each once, and a list of "
                f"breakpoints for each; there are {len(self.breakpoints)}"
            )
        try:
            lines = tuple(tuple(float(x) for x in line) for line in self.breakpoints)
            values = np.array(self.values, float)
        except (TypeError, ValueError):
            raise ModelError("table: breakpoints and values must be numbers, a value for every breakpoint") from None
        for name, line in zip(self.over, lines, strict=True):
            _check_line(name, line)
        if values.shape != tuple(map(len, lines)):
            raise ModelError(
                f"table: values of the shape {values.shape} do not fit {' x '.join(str(len(line)) for line in lines)} "
                f"breakpoints of {', '.join(self.over)}"
            )
        if not np.isfinite(values).all():
            raise ModelError("table: a value is not finite; give finite numbers")
        values.setflags(write=False)
        object.__setattr__(self, "breakpoints", lines)
        object.__setattr__(self, "values", values)

    def summary(self) -> tuple[str, ...]:
        """Range of the values over those of the breakpoints, and jumps."""
        spans = [
            f"{name} {line[0]:g} to {line[-1]:g}, {len(line)} points"
            for name, line in zip(self.over, self.breakpoints, strict=True)
        ]
        jumps = [f"{name} = {place:g}" for name, places in self.jumps.items() for place in places]
        return (
            f"LookupTable ({self.source})",
            f"values: {self.values.min():.6g} to {self.values.max():.6g} {self.unit}",
            f"over: {'; '.join(spans)}",
            f"jumps: {', '.join(jumps) or 'none'}",
        )

    @property
    def jumps(self) -> dict[str, tuple[float, ...]]:
        """Breakpoints that stand twice, by parameter."""
        found = {
            name: tuple(low for low, high in pairwise(line) if low == high)
            for name, line in zip(self.over, self.breakpoints, strict=True)
        }
        return {name: places for name, places in found.items() if places}

    @property
    def plain(self) -> dict[str, Any]:
        """As schedule files have it."""
        lines = [list(line) for line in self.breakpoints]
        return {
            "unit": self.unit, "source": self.source, "over": list(self.over), "breakpoints": lines,
            "values": self.values.tolist(),
        }  # fmt: skip


def _check_line(name: str, line: Sequence[float]) -> None:
    if not np.isfinite(line).all():
        raise ModelError(f"table: a breakpoint of {name} is not finite")
    steps = np.diff(line)
    if len(line) < 2 or (steps < 0.0).any():
        raise ModelError(f"table: the breakpoints of {name} must rise, and be two at least; {list(line)[:8]} do not")
    twice = np.flatnonzero(steps == 0.0)
    if (np.diff(twice) == 1).any():
        raise ModelError(f"table: a breakpoint of {name} stands three times; twice is a jump")
    if len(twice) and (twice[0] == 0 or twice[-1] == len(steps) - 1):
        raise ModelError(f"table: jumps at an end of the breakpoints of {name}; give one value there")


def check_table(table: LookupTable, parameters: Sequence[SchedulingParameter], where: str) -> None:
    """Raise ModelError for a table over parameters that there are not, or that does not cover a range."""
    known = {p.name: p for p in parameters}
    for name, line in zip(table.over, table.breakpoints, strict=True):
        if name not in known:
            raise ModelError(f"{where}: {unknown('parameter', name, list(known))}")
        p = known[name]
        if line[0] > p.minimum or line[-1] < p.maximum:
            raise ModelError(
                f"{where}: covers {name} from {line[0]:g} to {line[-1]:g} {p.unit}, its range is [{p.minimum:g}, "
                f"{p.maximum:g}] {p.unit}; nothing is extrapolated, so shrink the range or add breakpoints"
            )


def table_words(
    tables: Mapping[str, LookupTable], parameters: Sequence[SchedulingParameter], cells: int
) -> tuple[str, ...]:
    """One line on the tables and their jumps; none without tables."""
    if not tables:
        return ()
    units = {p.name: p.unit for p in parameters}
    listed = [f"{key} [{table.unit}] over {', '.join(table.over)}" for key, table in tables.items()]
    jumps = [
        f"{key} at {name} = {place:g} {units[name]}"
        for key, table in tables.items()
        for name, places in table.jumps.items()
        for place in places
    ]
    words = f"{counted(len(listed), 'table')}, {counted(cells, 'cell')}: {', '.join(listed)}"
    return (f"{words}; jumps: {', '.join(jumps)}" if jumps else words,)
