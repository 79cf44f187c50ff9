"""A sweep, complete: observers, what is varied, measures, designs and grid. Built in Python, or read from a file (`spec`)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from analysis.errors import AnalysisError
from analysis.sensitivity.box import Box
from analysis.sensitivity.designs import Design, Nominal
from analysis.sensitivity.worst import WorstCaseSearch
from estimators.display import Display
from studies.sweeps.measures import Measure
from studies.sweeps.observer import Observer
from studies.sweeps.plant import Grid
from studies.sweeps.ranges import ParameterRange, RangeSpec, box_of, parameter_ranges
from synthesis.errors import SpecError

SCHEMA = "gainsmith.sweep/1"
RESERVED = {"design", "stage", "outcome", "reason"}


@dataclass(frozen=True)
class Chunk:
    """Rows `start` .. `stop` of a stage of an observer; `number` counts chunks and `design` is the index of the first row."""

    observer: int
    number: int
    stage: int
    start: int
    stop: int
    design: int


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Display):
    """Everything a worker must know. Raises SpecError for names that do not exist, ranges that are empty, and repeated names.

    `vary` is one table for all observers, or a table for each by observer name. `points` of every scheduling parameter make the
    grid, over the whole range or over `bounds`. `chunk` designs are computed and stored at once.

    >>> load_sweep("gain-box", quick=True).form
    'quick'
    """

    name: str
    observers: Sequence[Observer]
    measures: Sequence[Measure]
    stages: Sequence[Design]
    vary: Mapping[str, Mapping[str, RangeSpec]] | Mapping[str, RangeSpec]
    points: int = 141
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    chunk: int = 1000
    tolerance: float = 0.01
    tolerances: Mapping[str, float] = field(default_factory=dict)
    form: str = "full"

    def __post_init__(self) -> None:
        object.__setattr__(self, "stages", (Nominal(), *(s for s in self.stages if not isinstance(s, Nominal))))
        where, measures = f"sweep '{self.name}'", [m.name for m in self.measures]
        for what, names in (("subject", [s.name for s in self.observers]), ("measure", measures)):
            repeated = sorted({name for name in names if names.count(name) > 1})
            if not names or repeated:
                raise SpecError(f"{where}: give at least one {what}, each with a name of its own; {repeated}")
        if self.chunk < 1 or self.points < 2:
            raise SpecError(f"{where}: chunk = {self.chunk} and points = {self.points} must be at least 1 and 2")
        for observer in self.observers:
            for measure in self.measures:
                measure.check(observer)
                if measure.name in observer.parameters or measure.name in RESERVED:
                    raise SpecError(f"{where}: measure '{measure.name}' has the name of a column; rename it")
            try:
                for stage in self.stages:
                    stage.check(self.boxes[observer.name])
            except AnalysisError as error:
                raise SpecError(str(error)) from None
            self.grid(observer)
        for name in self.tolerances:
            if name not in measures:
                raise SpecError(f"{where}: tolerance for '{name}', which is no measure of it")

    @cached_property
    def ranges(self) -> dict[str, tuple[ParameterRange, ...]]:
        """What is varied of each observer."""
        return {observer.name: parameter_ranges(observer, self._table(observer.name)) for observer in self.observers}

    @cached_property
    def boxes(self) -> dict[str, Box]:
        """The box in which each observer's designs lie."""
        return {name: box_of(own) for name, own in self.ranges.items()}

    def _table(self, observer: str) -> Mapping[str, RangeSpec]:
        plain = {name: entry for name, entry in self.vary.items() if isinstance(entry, RangeSpec)}
        own = self.vary.get(observer)
        return own if own is not None and not isinstance(own, RangeSpec) else plain

    def grid(self, observer: Observer) -> Grid:
        """The grid of one observer."""
        return observer.grid(self.points, self.bounds)

    def rows(self, observer: Observer, stage: Design) -> int:
        """Designs of one stage."""
        return len(self.measures) if isinstance(stage, WorstCaseSearch) else stage.count(self.boxes[observer.name])

    def designs(self, observer: Observer) -> int:
        """Designs of an observer."""
        return sum(self.rows(observer, stage) for stage in self.stages)

    def chunks(self) -> Iterator[Chunk]:
        """All chunks in order; none crosses a stage or cuts a block. A search is work enough for one."""
        for s, observer in enumerate(self.observers):
            number = design = 0
            for k, stage in enumerate(self.stages):
                rows, block = self.rows(observer, stage), stage.block(self.boxes[observer.name])
                step = 1 if isinstance(stage, WorstCaseSearch) else max(self.chunk // block, 1) * block
                for start in range(0, rows, step):
                    stop = min(start + step, rows)
                    yield Chunk(s, number, k, start, stop, design + start)
                    number += 1
                design += rows

    def chunk_count(self) -> int:
        """How many chunks there are."""
        return sum(1 for _ in self.chunks())

    @cached_property
    def definition(self) -> dict[str, Any]:
        """What was asked, without today's values of constants and gains: these are what a baseline is to notice."""
        return {
            "schema": SCHEMA, "name": self.name, "form": self.form,
            "subjects": {observer.name: self._asked(observer) for observer in self.observers},
            "measures": [{"name": m.name, "unit": m.unit, "better": m.better, **m.definition} for m in self.measures],
            "designs": [stage.model_dump(mode="json") for stage in self.stages], "chunk": self.chunk,
        }  # fmt: skip

    def _asked(self, observer: Observer) -> dict[str, Any]:
        """Sample time, ranges (relative ones as such) and grid of one observer."""
        ranges = {}
        for v in self.ranges[observer.name]:
            share = round(0.5 * abs((v.high - v.low) / v.nominal), 12) if v.relative else None
            ranges[v.name] = {"range": [v.low, v.high]} if share is None else {"relative": share}
        edges = {p.name: self.bounds.get(p.name, (p.minimum, p.maximum)) for p in observer.plant.box}
        grid = [[p.name, p.unit, *edges[p.name], self.points] for p in observer.plant.box]
        return {"sample_time": observer.sample_time, "vary": ranges, "grid": grid}

    @property
    def digest(self) -> str:
        """SHA-256 of the definition."""
        return hashlib.sha256(canonical(self.definition)).hexdigest()

    @cached_property
    def nominal(self) -> dict[str, Any]:
        """Today's constants, gains and units of each observer: what the sweep was run around."""
        return {observer.name: nominal_of(observer) for observer in self.observers}


def nominal_of(observer: Observer) -> dict[str, Any]:
    """Constants with units, and the gain table, of one observer as plain data."""
    return {
        "constants": {p.name: {"value": p.nominal, "unit": p.unit} for p in observer.plant.parameters.values()},
        "breakpoints": observer.gains.breakpoints.tolist(),
        "gains": observer.gains.table.tolist(),
    }


def canonical(content: Any) -> bytes:
    """One byte string for one content."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
