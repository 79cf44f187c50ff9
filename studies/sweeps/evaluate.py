"""One chunk of a sweep: its designs, the values of every measure, and what became of each design."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.sensitivity.worst import WorstCaseSearch, worst_case
from estimators.arrays import FlagArray, FloatArray, IntArray
from studies.sweeps.measures import Measure
from studies.sweeps.observer import Batch, Observer
from studies.sweeps.plant import Grid
from studies.sweeps.sweep import Chunk, Sweep
from synthesis.errors import ModelError, ProblemError

VALID, INVALID, NOT_A_NUMBER = "valid", "invalid", "not a number"
POINTS = 8192  # designs x grid points treated at once: small enough to stay in a processor's cache
TIE = 1e-9  # relative
REFUSALS = (AnalysisError, ModelError, ProblemError, np.linalg.LinAlgError)

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class Evaluated:
    """`columns` (m,) of the designs; for each measure the `worst` value over the grid (m,), its `place` (m,; -1: none) and
    the envelope over the designs; `outcome` and `reason` (m,) of each design."""

    columns: dict[str, FloatArray]
    worst: dict[str, FloatArray]
    place: dict[str, FlagArray]
    envelopes: dict[str, Envelope]
    outcome: NDArray[np.str_]
    reason: list[str]


@dataclass(frozen=True)
class Envelope:
    """At every grid point (g,) the worst and the best value of some designs, and the row that has the worst."""

    worst: FloatArray
    row: IntArray
    best: FloatArray


def evaluate_chunk(sweep: Sweep, chunk: Chunk) -> Evaluated:
    """All measures at all designs of one chunk."""
    observer, stage = sweep.observers[chunk.observer], sweep.stages[chunk.stage]
    box, grid = sweep.boxes[observer.name], sweep.grid(observer)
    indices = np.arange(chunk.start, chunk.stop)
    if isinstance(stage, WorstCaseSearch):
        values = np.stack([searched(sweep, observer, grid, stage, sweep.measures[int(i)]) for i in indices])
    else:
        values = stage.points(indices, box)
    return evaluate(observer, sweep.measures, grid, box.columns(values))


def evaluate(
    observer: Observer, measures: Sequence[Measure], grid: Grid, columns: Mapping[str, FloatArray]
) -> Evaluated:
    """All measures at the given designs; a design that cannot be computed keeps the reason, the others are not touched."""
    count = len(next(iter(columns.values())))
    outcome, reason = np.full(count, VALID, dtype="U12"), [""] * count
    found = {m.name: np.full((count, len(grid)), np.nan) for m in measures}
    flat: set[str] = set()

    def batch_of(rows: IntArray) -> Batch:
        return observer.at({name: column[rows] for name, column in columns.items()}, grid)

    def fill(measure: Measure, rows: IntArray, batch: Batch) -> None:
        """One measure of some rows, NaN and the reason where it has no value."""
        out = found[measure.name]
        for part, values in _separate(lambda some: measure(batch if len(some) == len(rows) else batch_of(some)), rows):
            if isinstance(values, str):
                bad, why = part, f"{measure.name}: {values}"
            else:
                if values.ndim == 1:
                    flat.add(measure.name)
                out[part] = values.reshape(len(part), -1)
                bad, why = part[np.isnan(out[part]).any(axis=1)], f"{measure.name} is not a number"
            for row in bad:
                outcome[row] = NOT_A_NUMBER
                reason[row] = f"{reason[row]}; {why}" if reason[row] else why

    step = max(1, POINTS // len(grid))
    for start in range(0, count, step):
        for part, batch in _separate(batch_of, np.arange(start, min(start + step, count))):
            if isinstance(batch, str):
                outcome[part], reason[part[0]] = INVALID, batch
                continue
            for measure in measures:
                fill(measure, part, batch)
    worst, place, envelopes = {}, {}, {}
    for measure in measures:
        name, values = measure.name, found[measure.name]
        worst[name], place[name] = _worst(measure, values)
        if name in flat:
            place[name][:] = -1
        else:
            envelopes[name] = _envelope(measure, values)
    return Evaluated(dict(columns), worst, place, envelopes, outcome, reason)


def _separate(function: Callable[[IntArray], Answer], rows: IntArray) -> list[tuple[IntArray, Answer | str]]:
    """function(rows) if it can be had at once; else in halves, down to single rows whose refusal is returned as text."""
    try:
        return [(rows, function(rows))]
    except REFUSALS as error:
        if len(rows) == 1:
            return [(rows, str(error))]
    middle = len(rows) // 2
    return _separate(function, rows[:middle]) + _separate(function, rows[middle:])


def _worst(measure: Measure, values: FloatArray) -> tuple[FloatArray, FlagArray]:
    """The worst over the grid and where; NaN wins, so that it is never hidden behind a number."""
    place = np.argmax(np.where(np.isnan(values), np.inf, measure.sign * values), axis=1)
    chosen = np.take_along_axis(values, place[:, None], axis=1)[:, 0]
    return np.where(np.isnan(values).any(axis=1), np.nan, chosen), place.astype(np.int32)


def _envelope(measure: Measure, values: FloatArray) -> Envelope:
    """Over the designs, those without a value left out; of designs that differ by rounding alone the first is taken."""
    signed = np.where(np.isnan(values), -np.inf, measure.sign * values)
    top = signed.max(axis=0)
    with np.errstate(invalid="ignore"):
        row = np.argmax((signed >= top - TIE * np.abs(top)) | (signed == top), axis=0)
    worst = np.where(np.isnan(values).all(axis=0), np.nan, measure.sign * top)
    best = np.where(np.isnan(values), np.inf, measure.sign * values).min(axis=0) * measure.sign
    return Envelope(worst, row.astype(np.int64), best)


def searched(sweep: Sweep, observer: Observer, grid: Grid, stage: WorstCaseSearch, measure: Measure) -> FloatArray:
    """The parameters (d,) of the worst design that a search finds for one measure."""
    box = sweep.boxes[observer.name]
    if np.isnan(evaluate(observer, [measure], grid, box.columns(box.nominal[None])).worst[measure.name]).any():
        return box.nominal  # not a number already there: nothing to search

    def scalar(columns: Mapping[str, FloatArray]) -> FloatArray:
        worst = evaluate(observer, [measure], grid, columns).worst[measure.name]
        return np.where(np.isnan(worst), -measure.sign * np.inf, worst)  # designs without a value are no answer

    found = worst_case(
        scalar, dict(zip(box.names, zip(box.low, box.high, strict=True), strict=True)), measure.better == "smaller",
        stage.samples, stage.generations, stage.seed,
    )  # fmt: skip
    return np.array([found.parameters[name] for name in box.names])
