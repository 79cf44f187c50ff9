"""A symbolic model as an exact plant."""

from __future__ import annotations

import math

from synthesis.loop.plant import Axis, Plant
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
    return Plant(axes, model.exact.matrices, model.exact.denominator, model.half_spaces)
