"""The kinds of designs that a sweep file can name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from pydantic import Field

from analysis.sensitivity.box import Box
from analysis.sensitivity.designs import (
    Corners,
    Design,
    FullGrid,
    LatinHypercube,
    OneAtATimeDesign,
    Saltelli,
    Sobol,
    require_power,
)


class WorstCaseSearch(Design):
    """For every measure the worst design that a search finds (`analysis.sensitivity.worst`): one row a measure."""

    kind: Literal["worst case"]
    samples: int = Field(default=256, ge=2)
    generations: int = Field(default=30, ge=0)
    seed: int = Field(default=0, ge=0)

    def check(self, box: Box) -> None:
        """Its samples are Sobol points."""
        require_power("samples", self.samples)


DESIGNS: Mapping[str, type[Design]] = {
    "one at a time": OneAtATimeDesign, "grid": FullGrid, "corners": Corners, "latin hypercube": LatinHypercube,
    "sobol": Sobol, "saltelli": Saltelli, "worst case": WorstCaseSearch,
}  # fmt: skip
