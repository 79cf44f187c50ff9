"""The statistics of a sweep: from chunks in six passes over the rows: counts, worst cases and variance first, then quantiles."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from analysis.errors import AnalysisError
from analysis.sensitivity.designs import Design, Saltelli
from analysis.sensitivity.indices import GROUPS, SaltelliSums
from analysis.sensitivity.quantiles import PASSES, RadixSearch, rank_of
from studies.execution.files import plain
from studies.sweeps.measures import Measure
from studies.sweeps.store import Rows, SweepFolder
from synthesis.errors import SpecError

UNPROVED = "constants outside the certificate"  # today's constants that are not those the schedule was proved for
Kind = Literal["value", "index", "count"]

QUANTILES = {"median": 0.5, "quantile 95 %": 0.95, "quantile 99 %": 0.99}


@dataclass(frozen=True)
class Statistic:
    """One number. Those of kind `value` belong to a measure and have parameters `at` which they are taken, an `index` is a share
    of variance with a `confidence` half-width (95 %), a `count` is a number of designs."""

    observer: str
    measure: str
    name: str
    value: float
    unit: str = "1"
    kind: Kind = "value"
    at: Mapping[str, float] = field(default_factory=dict)
    confidence: float | None = None
    design: int | None = None

    @property
    def key(self) -> tuple[str, str, str]:
        """Observer, measure and name: what makes two statistics the same."""
        return self.observer, self.measure, self.name

    def where(self, digits: int = 4) -> str:
        """The parameters at which it is taken, in words."""
        return ", ".join(f"{name} = {number(value, digits)}" for name, value in self.at.items())


@dataclass(frozen=True)
class Summary:
    """All statistics of a sweep, and `notes`: what could not be said, and why."""

    sweep: str
    form: str
    statistics: tuple[Statistic, ...]
    notes: tuple[str, ...]

    def of(self, observer: str, measure: str, name: str) -> Statistic | None:
        """One statistic, if there is one."""
        return next((f for f in self.statistics if f.key == (observer, measure, name)), None)

    def content(self) -> Any:
        """Plain data for a strict JSON file; infinite numbers as words."""
        rows = [{"subject": s.observer, **asdict(s)} for s in self.statistics]
        for row in rows:
            del row["observer"]  # the word of the files is another
        return plain({"sweep": self.sweep, "form": self.form, "figures": rows, "notes": self.notes}, "summary")

    @classmethod
    def of_content(cls, content: Mapping[str, Any]) -> Summary:
        """Back from plain data."""
        found = []
        for row in content["figures"]:
            others = {key: value for key, value in row.items() if key != "subject"}
            found.append(Statistic(row["subject"], **{**others, "value": float(row["value"])}))
        return cls(content["sweep"], content["form"], tuple(found), tuple(content["notes"]))


def read_summary(path: Path) -> Summary:
    """What a sweep left. Raises SpecError for a file that no sweep wrote."""
    try:
        return Summary.of_content(json.loads(path.read_bytes()))
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        raise SpecError(f"{path}: is no summary of a sweep; remove it, and --resume writes it again") from None


def number(value: float, digits: int = 6) -> str:
    """A number for people: six significant digits."""
    return f"{value:.{digits}g}"


def summarise(folder: SweepFolder) -> Summary:
    """All statistics of a complete sweep. Memory does not grow with the number of designs."""
    statistics: list[Statistic] = []
    notes: list[str] = []
    for index in range(len(folder.sweep.observers)):
        rows = Rows(folder, index)
        statistics += _counts(rows)
        measures = [_OfMeasure(rows, measure) for measure in rows.measures]
        for stage, design, columns in rows.all_columns():
            for measure in measures:
                measure.show(stage, design, columns)
        _find_quantiles(rows, [measure for measure in measures if measure.count])
        for measure in measures:
            statistics += measure.statistics()
            notes += measure.notes
    return Summary(folder.sweep.name, folder.sweep.form, tuple(statistics), tuple(notes))


def _counts(rows: Rows) -> list[Statistic]:
    counted = dict.fromkeys(("designs", "invalid designs", "designs without a number"), 0)
    for _, _, columns in rows.columns(["outcome"]):
        outcome = columns["outcome"]
        for name, found in zip(counted, (len(outcome), *map(outcome.count, ("invalid", "not a number"))), strict=True):
            counted[name] += found
    if rows.observer.proved_for is not None:
        counted[UNPROVED] = len(rows.observer.unproved())
    return [Statistic(rows.observer.name, "", key, float(count), kind="count") for key, count in counted.items()]


class _OfMeasure:
    """What is gathered of one measure: nominal, worst (the earliest design wins a tie), quantiles, Sobol indices."""

    def __init__(self, rows: Rows, measure: Measure) -> None:
        self.rows, self.measure = rows, measure
        self.nominal: Statistic | None = None
        self.worst: Statistic | None = None
        self.count = 0  # of random designs with a value
        self.quantiles: dict[str, Statistic] = {}
        self.notes: list[str] = []
        self.indices = [_Indices(rows, measure, stage) for stage in rows.stages if isinstance(stage, Saltelli)]

    def signed(self, columns: dict[str, Any]) -> Any:
        """The values of one chunk so that larger is worse."""
        return self.measure.sign * columns[self.measure.name]

    def at(self, columns: dict[str, Any], design: int, name: str, row: int) -> Statistic:
        """One row of a chunk as a statistic."""
        value, place = float(columns[self.measure.name][row]), self.rows.place(columns, row, self.measure)
        return Statistic(
            self.rows.observer.name, self.measure.name, name, value, self.measure.unit, "value", place, None, design + row
        )  # fmt: skip

    def show(self, stage: Design, design: int, columns: dict[str, Any]) -> None:
        """One chunk of the first pass, in order."""
        signed = self.signed(columns)
        missing = np.isnan(signed)
        if self.nominal is None:  # the first row of the first chunk
            self.nominal = self.at(columns, design, "nominal", 0)
        if stage.random:
            self.count += int((~missing).sum())
        if not missing.all():
            row = int(np.nanargmax(signed))
            if self.worst is None or signed[row] > self.measure.sign * self.worst.value:
                self.worst = self.at(columns, design, "worst", row)
        for indices in self.indices:
            indices.show(stage, self.measure.spread(columns[self.measure.name]))

    def statistics(self) -> Iterator[Statistic]:
        """All of them; why there are no indices goes to the notes."""
        yield from (s for s in (self.nominal, self.worst) if s is not None and not np.isnan(s.value))
        yield from (self.quantiles[name] for name in QUANTILES if name in self.quantiles)
        for indices in self.indices:
            found = indices.statistics()
            if isinstance(found, str):
                self.notes.append(f"{self.rows.observer.name}, {self.measure.name}: no Sobol indices: {found}")
            else:
                yield from found


def _find_quantiles(rows: Rows, measures: list[_OfMeasure]) -> None:
    """'quantile 95 %' is the value that 95 % of the random designs are at least as good as, and the first design that has it."""
    if not measures:
        return
    searches = [RadixSearch([rank_of(share, m.count) for share in QUANTILES.values()]) for m in measures]
    for _ in range(PASSES):
        for _, _, columns in rows.columns([m.measure.name for m in measures], random=True):
            for measure, search in zip(measures, searches, strict=True):
                signed = measure.signed(columns)
                search.show(signed[~np.isnan(signed)])
        for search in searches:
            search.end_pass()
    values = [search.found() for search in searches]
    for stage, design, columns in rows.all_columns():
        for measure, wanted in zip(measures, values, strict=True):
            for name, value in zip(QUANTILES, wanted, strict=True):
                if stage.random and name not in measure.quantiles:
                    hits = np.flatnonzero(measure.signed(columns) == value)
                    if len(hits):
                        measure.quantiles[name] = measure.at(columns, design, name, int(hits[0]))


class _Indices:
    """First-order and total index of every parameter on the worst value over the grid, from sums over a Saltelli stage."""

    def __init__(self, rows: Rows, measure: Measure, stage: Saltelli) -> None:
        self.rows, self.measure, self.stage = rows, measure, stage
        self.sums = SaltelliSums(len(rows.ranges), min(GROUPS, stage.blocks))
        self.centre: float | None = None
        self.block = 0
        self.refusal = ""

    def show(self, stage: Design, values: Any) -> None:
        """One chunk of any stage; the first holds the nominal design, to which values are taken relative."""
        if self.centre is None:
            self.centre = float(values[0]) if np.isfinite(values[0]) else 0.0
        if stage is not self.stage or self.refusal:
            return
        blocks = values.reshape(-1, len(self.rows.ranges) + 2) - self.centre
        group = (self.block + np.arange(len(blocks))) * len(self.sums.count) // self.stage.blocks
        self.block += len(blocks)
        try:
            self.sums.add(blocks, group)
        except AnalysisError as error:
            self.refusal = str(error)

    def statistics(self) -> list[Statistic] | str:
        """The indices with their confidence, or why there are none."""
        if self.refusal:
            return self.refusal
        shares = self.sums.shares()
        if np.isnan(shares.total).any():
            return "the measure does not vary over the box"
        return [
            Statistic(
                self.rows.observer.name, self.measure.name, f"{name} {parameter}", float(value), "1", "index",
                confidence=float(width),
            )
            for name, values, widths in (
                ("first-order index", shares.first_order, shares.first_order_confidence),
                ("total index", shares.total, shares.total_confidence),
            )
            for parameter, value, width in zip(self.rows.ranges, values, widths, strict=True)
        ]  # fmt: skip
