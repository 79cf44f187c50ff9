"""A symbolic model as an exact plant."""

from __future__ import annotations

import math

from synthesis.loop.plant import Axis, Plant, by_cells
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.rational import decimal


def plant_of(model: LpvModel) -> Plant:
    """A symbolic model as an exact plant."""
    axes = tuple(
        Axis(p.name, p.unit, decimal(p.minimum), decimal(p.maximum), *(
            decimal(rate) if math.isfinite(rate) else None for rate in (p.rate_minimum, p.rate_maximum)
        ))
        for p in model.parameters
    )  # fmt: skip
    if not model.tables:
        return Plant(axes, model.exact.matrices, model.exact.denominator, model.half_spaces)
    lines = tuple(tuple(decimal(x) for x in line) for line in model.cells.lines)
    return by_cells(axes, lines, [piece.exact.matrices for piece in model.pieces], model.half_spaces)
