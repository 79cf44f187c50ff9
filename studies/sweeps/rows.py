"""The rows of one observer of a finished sweep, chunk by chunk, any number of times."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from analysis.sensitivity.designs import Design
from studies.sweeps.measure import Measure
from studies.sweeps.observer import Observer
from studies.sweeps.plant import Grid
from studies.sweeps.store import SweepFolder
from studies.sweeps.tables import PLACE, columns_of

HELD = 1 << 22  # numbers kept in memory so that small sweeps are read once; larger ones are read anew for every pass


class Rows:
    """Columns by name; memory does not grow with the number of designs."""

    def __init__(self, folder: SweepFolder, observer: int) -> None:
        sweep = folder.sweep
        self.observer: Observer = sweep.observers[observer]
        self.grid: Grid = sweep.grid(self.observer)
        self.ranges = [v.name for v in sweep.ranges[self.observer.name]]
        self.measures: list[Measure] = list(sweep.measures)
        self.stages: list[Design] = list(sweep.stages)
        self._chunks = [(self.stages[c.stage], folder.rows(c), c.design) for c in folder.of(observer)]
        values = [m.name for m in self.measures]
        names = ["outcome", *self.ranges, *values, *(name + PLACE for name in values)]
        small = sweep.designs(self.observer) * len(names) <= HELD
        self._held = [columns_of(path, names) for _, path, _ in self._chunks] if small else None

    def columns(self, names: Sequence[str], random: bool = False) -> Iterator[tuple[Design, int, dict[str, Any]]]:
        """Stage, index of the first design, and the named columns of every chunk; `random`: of those that fill the box evenly."""
        for i, (stage, path, design) in enumerate(self._chunks):
            if not random or stage.random:
                yield stage, design, columns_of(path, names) if self._held is None else self._held[i]

    def all_columns(self) -> Iterator[tuple[Design, int, dict[str, Any]]]:
        """Parameters, values and places of every chunk."""
        values = [m.name for m in self.measures]
        return self.columns([*self.ranges, *values, *(name + PLACE for name in values)])

    def place(self, columns: dict[str, Any], row: int, measure: Measure) -> dict[str, float]:
        """Parameters and grid point of one row."""
        at = {name: float(columns[name][row]) for name in self.ranges}
        return at | self.grid.place(int(columns[measure.name + PLACE][row]))
