"""What the pictures of a sweep are drawn from: small arrays taken out of its chunks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from analysis.sensitivity.designs import OneAtATimeDesign
from estimators.arrays import FloatArray
from studies.sweeps.evaluate import TIE
from studies.sweeps.measure import Measure
from studies.sweeps.rows import Rows
from studies.sweeps.store import SweepFolder
from studies.sweeps.tables import columns_of

MOST_POINTS = 3000


@dataclass(frozen=True)
class Bar:
    """One parameter alone: its relative `levels` and the measure (worst over the grid) there; `nominal` in the middle."""

    parameter: str
    levels: FloatArray
    values: FloatArray
    nominal: float

    @property
    def reach(self) -> float:
        """The largest deviation; infinite ones count most."""
        return float(np.abs(self.values - self.nominal).max())


@dataclass(frozen=True)
class Map:
    """Over the grid `points` (g,): the measure of the nominal design, of the worst and of the best.

    `position` (d, g) is where in its range the worst design has each parameter, from 0 (lower end) to 1.
    """

    points: FloatArray
    nominal: FloatArray
    worst: FloatArray
    best: FloatArray
    position: FloatArray


@dataclass(frozen=True)
class Cloud:
    """Random designs: two parameters (k, 2) and the measure (k,)."""

    names: tuple[str, str]
    at: FloatArray
    values: FloatArray


def tornado(rows: Rows, measure: Measure) -> list[Bar]:
    """One bar a parameter, the longest first; empty without a one-at-a-time stage."""
    nominal: float | None = None
    values, at = [], []
    alone = next((stage for stage in rows.stages if isinstance(stage, OneAtATimeDesign)), None)
    for stage, _, columns in rows.columns([*rows.ranges, measure.name]):
        if nominal is None:
            nominal = float(columns[measure.name][0])
            centre = np.array([float(columns[name][0]) for name in rows.ranges])
        if stage is alone:
            values.append(columns[measure.name])
            at.append(np.stack([columns[name] for name in rows.ranges], axis=1))
    if nominal is None or not values:
        return []
    found, where = np.concatenate(values).reshape(len(rows.ranges), -1), np.concatenate(at)
    where = where.reshape(len(rows.ranges), -1, len(rows.ranges))
    bars = [
        Bar(name, where[i, :, i] / centre[i] - 1.0 if centre[i] else where[i, :, i], found[i], nominal)
        for i, name in enumerate(rows.ranges)
        if not np.isnan(found[i]).any()
    ]
    return sorted(bars, key=lambda bar: -bar.reach)


def worst_map(folder: SweepFolder, rows: Rows, observer: int, measure: Measure) -> Map | None:
    """None for a measure without place on the grid, or a grid of more than one parameter."""
    grid = folder.sweep.grid(rows.observer)
    if len(grid.names) != 1:
        return None
    worst = np.full(len(grid), -np.inf)
    best = np.full(len(grid), np.inf)
    design = np.zeros(len(grid), np.int64)
    nominal: FloatArray | None = None
    for chunk in folder.of(observer):
        columns = columns_of(folder.envelope(chunk), ("measure", "worst", "design", "best"))
        own = np.array([name == measure.name for name in columns["measure"]], bool)
        if not own.any():
            return None
        signed = np.nan_to_num(measure.sign * columns["worst"][own], nan=-np.inf, posinf=np.inf, neginf=-np.inf)
        if nominal is None:
            nominal = columns["worst"][own]
        with np.errstate(invalid="ignore"):
            worse = (signed > worst + TIE * np.abs(worst)) | (np.isneginf(worst) & (signed > worst))
        worst[worse], design[worse] = signed[worse], columns["design"][own][worse]
        best = np.fmin(best, measure.sign * columns["best"][own])
    if nominal is None:
        return None
    position = _positions(folder, rows, design)
    return Map(grid.points[:, 0], nominal, measure.sign * worst, measure.sign * best, position)


def _positions(folder: SweepFolder, rows: Rows, designs: Any) -> FloatArray:
    """Where in their ranges the parameters of some designs are, (d, g)."""
    ranges = folder.sweep.ranges[rows.observer.name]
    out = np.full((len(ranges), len(designs)), np.nan)
    for _, first, columns in rows.columns(rows.ranges):
        count = len(columns[rows.ranges[0]])
        inside = (designs >= first) & (designs < first + count)
        for i, v in enumerate(ranges):
            out[i, inside] = (columns[v.name][designs[inside] - first] - v.low) / (v.high - v.low)
    return out


def cloud(rows: Rows, measure: Measure, names: tuple[str, str]) -> Cloud | None:
    """Evenly thinned; None without random designs or for designs that all have no value."""
    total = sum(len(columns[measure.name]) for _, _, columns in rows.columns([measure.name], random=True))
    step = max(1, -(-total // MOST_POINTS))
    at, values, seen = [], [], 0
    for _, _, columns in rows.columns([*names, measure.name], random=True):
        kept = np.flatnonzero((np.arange(len(columns[measure.name])) + seen) % step == 0)
        seen += len(columns[measure.name])
        at.append(np.stack([columns[name][kept] for name in names], axis=1))
        values.append(columns[measure.name][kept])
    if not values:
        return None
    found, where = np.concatenate(values), np.concatenate(at)
    finite = np.isfinite(found)
    return Cloud(names, where[finite], found[finite]) if finite.any() else None
