"""Sobol indices of a finished sweep, from sums over its Saltelli stage."""

from __future__ import annotations

from typing import Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.sensitivity.designs import Design, Saltelli
from analysis.sensitivity.indices import GROUPS, SaltelliSums
from studies.sweeps.figures import Figure
from studies.sweeps.measure import Measure
from studies.sweeps.rows import Rows


class Variance:
    """First-order and total index of every parameter on the worst value over the grid, gathered chunk by chunk in order."""

    def __init__(self, rows: Rows, measure: Measure, stage: Saltelli) -> None:
        self.rows, self.measure, self.stage = rows, measure, stage
        self.sums = SaltelliSums(len(rows.varied), min(GROUPS, stage.blocks))
        self.centre: float | None = None
        self.block = 0
        self.refusal = ""

    def show(self, stage: Design, columns: dict[str, Any]) -> None:
        """One chunk of any stage; the first holds the nominal design, to which values are taken relative."""
        values = columns[self.measure.name]
        if self.centre is None:
            centre = float(self.measure.spread(values[:1])[0])
            self.centre = centre if np.isfinite(centre) else 0.0
        if stage is not self.stage or self.refusal:
            return
        blocks = self.measure.spread(values).reshape(-1, len(self.rows.varied) + 2) - self.centre
        group = (self.block + np.arange(len(blocks))) * len(self.sums.count) // self.stage.blocks
        self.block += len(blocks)
        try:
            self.sums.add(blocks, group)
        except AnalysisError as error:
            self.refusal = str(error)

    def figures(self) -> tuple[list[Figure], list[str]]:
        """The indices with their confidence, and why there are none if so."""
        shares = None if self.refusal else self.sums.shares()
        if shares is None or np.isnan(shares.total).any():
            why = self.refusal or "the measure does not vary over the box"
            return [], [f"{self.rows.subject.name}, {self.measure.name}: no Sobol indices: {why}"]
        found = []
        for name, values, widths in (
            ("first-order index", shares.first_order, shares.first_order_confidence),
            ("total index", shares.total, shares.total_confidence),
        ):
            for parameter, value, width in zip(self.rows.varied, values, widths, strict=True):
                found.append(
                    Figure(
                        self.rows.subject.name, self.measure.name, f"{name} {parameter}", float(value), "1", "index",
                        confidence=float(width),
                    )
                )  # fmt: skip
        return found, []
