"""From chunks to figures in six passes over the rows: counts, worst cases and variance in the first, quantiles in the others."""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.sensitivity.designs import Saltelli
from analysis.sensitivity.quantiles import PASSES, RadixSearch, rank_of
from studies.sweeps.figures import UNPROVED, Figure, Summary
from studies.sweeps.measure import Measure
from studies.sweeps.rows import Rows
from studies.sweeps.store import SweepFolder
from studies.sweeps.variance import Variance

QUANTILES = {"median": 0.5, "quantile 95 %": 0.95, "quantile 99 %": 0.99}


class _First:
    """What the first pass gathers of one measure: nominal, worst (the earliest design wins a tie), and its random values."""

    def __init__(self, measure: Measure) -> None:
        self.measure = measure
        self.nominal: Figure | None = None
        self.worst: Figure | None = None
        self.count = 0


def summarise(folder: SweepFolder) -> Summary:
    """All figures of a complete sweep. Memory does not grow with the number of designs."""
    figures: list[Figure] = []
    notes: list[str] = []
    for index in range(len(folder.sweep.subjects)):
        rows = Rows(folder, index)
        figures += _counts(rows)
        variances = [Variance(rows, m, s) for m in rows.measures for s in rows.stages if isinstance(s, Saltelli)]
        firsts = _first_pass(rows, variances)
        quantiles = _quantiles(rows, firsts)
        for first in firsts:
            extremes = (first.nominal, first.worst)
            figures += [figure for figure in extremes if figure is not None and not np.isnan(figure.value)]
            figures += quantiles[first.measure.name].values()
            for variance in variances:
                if variance.measure is first.measure:
                    found, note = variance.figures()
                    figures += found
                    notes += note
    return Summary(folder.sweep.name, folder.sweep.form, tuple(figures), tuple(notes))


def _counts(rows: Rows) -> list[Figure]:
    total = invalid = without = 0
    for _, _, columns in rows.columns(["outcome"]):
        outcome = columns["outcome"]
        total += len(outcome)
        invalid += outcome.count("invalid")
        without += outcome.count("not a number")
    counted = {"designs": total, "invalid designs": invalid, "designs without a number": without}
    if rows.subject.proved_for is not None:
        counted[UNPROVED] = len(rows.subject.unproved())
    return [Figure(rows.subject.name, "", key, float(count), kind="count") for key, count in counted.items()]


def _first_pass(rows: Rows, variances: list[Variance]) -> list[_First]:
    firsts = [_First(measure) for measure in rows.measures]
    for stage, design, columns in rows.all_columns():
        for first in firsts:
            signed = first.measure.sign * columns[first.measure.name]
            missing = np.isnan(signed)
            if first.nominal is None:  # the first row of the first chunk
                first.nominal = _figure(rows, first.measure, columns, design, "nominal", 0)
            if stage.random:
                first.count += int((~missing).sum())
            if not missing.all():
                row = int(np.nanargmax(signed))
                if first.worst is None or signed[row] > first.measure.sign * first.worst.value:
                    first.worst = _figure(rows, first.measure, columns, design, "worst", row)
        for variance in variances:
            variance.show(stage, columns)
    return firsts


def _quantiles(rows: Rows, firsts: list[_First]) -> dict[str, dict[str, Figure]]:
    """'quantile 95 %' is the value that 95 % of the random designs are at least as good as, and the first design that has it."""
    found: dict[str, dict[str, Figure]] = {first.measure.name: {} for first in firsts}
    measures = [first.measure for first in firsts if first.count]
    searches = [RadixSearch([rank_of(s, first.count) for s in QUANTILES.values()]) for first in firsts if first.count]
    if not measures:
        return found
    for _ in range(PASSES):
        for _, _, columns in rows.columns([m.name for m in measures], random=True):
            for measure, search in zip(measures, searches, strict=True):
                signed = measure.sign * columns[measure.name]
                search.show(signed[~np.isnan(signed)])
        for search in searches:
            search.end_pass()
    values = [dict(zip(QUANTILES, search.found(), strict=True)) for search in searches]
    for stage, design, columns in rows.all_columns():
        for measure, wanted in zip(measures, values, strict=True):
            own = found[measure.name]
            for name, value in wanted.items() if stage.random and len(own) < len(QUANTILES) else ():
                hits = np.flatnonzero(measure.sign * columns[measure.name] == value)
                if name not in own and len(hits):
                    own[name] = _figure(rows, measure, columns, design, name, int(hits[0]))
    return {name: {key: own[key] for key in QUANTILES if key in own} for name, own in found.items()}


def _figure(rows: Rows, measure: Measure, columns: dict[str, Any], design: int, name: str, row: int) -> Figure:
    value = float(columns[measure.name][row])
    at = rows.place(columns, row, measure)
    return Figure(rows.subject.name, measure.name, name, value, measure.unit, "value", at, None, design + row)
