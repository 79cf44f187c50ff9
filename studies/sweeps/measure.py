"""What a measure is: a name, a unit, which way is better, and one vectorised function."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray
from studies.sweeps.observer import Batch, Observer
from synthesis.errors import SpecError


def _anything_goes(_observer: Observer) -> None:
    pass


def _nothing_to_make() -> None:
    pass


@dataclass(frozen=True)
class Measure:
    """`function(batch)` returns (designs, grid), or (designs,) for a number that belongs to no place of the grid.

    The batch holds the designs' parameter values, the observer (model, gains, sample time) and the grid, with all matrices made.
    Infinite values are answers (an unstable design), NaN is an outcome of its own. A loss is measured relative to the distance
    from `limit`, at which the measure becomes worthless (a margin of 0, a radius of 1). `variance` says what Sobol indices
    speak of: the value, or its reciprocal for a measure that may be infinite. `definition` is what makes two measures the
    same; `check` refuses an observer that the measure does not fit (SpecError). `prepare` makes what all chunks share, once,
    before workers are started.
    A function that must travel to other processes is one that a module defines, or a `functools.partial` of one.
    """

    name: str
    unit: str
    better: Literal["larger", "smaller"]
    function: Callable[[Batch], ArrayLike]
    limit: float = 0.0
    variance: Literal["value", "reciprocal"] = "value"
    definition: Mapping[str, Any] = field(default_factory=dict)
    check: Callable[[Observer], None] = _anything_goes
    prepare: Callable[[], None] = _nothing_to_make

    def __call__(self, batch: Batch) -> FloatArray:
        """The values (n, g) or (n,). Raises SpecError for any other shape."""
        with np.errstate(all="ignore"):  # an unstable design overflows: that is an answer
            values = np.asarray(self.function(batch), float)
        if values.shape not in ((batch.count, len(batch.grid)), (batch.count,)):
            raise SpecError(
                f"measure '{self.name}' returned the shape {values.shape} for {batch.count} designs and {len(batch.grid)} "
                "grid points; return (designs, grid) or (designs,)"
            )
        return values

    @property
    def sign(self) -> float:
        """+1 where larger is worse: sign * value is to be kept small."""
        return 1.0 if self.better == "smaller" else -1.0

    def loss(self, before: float, after: float) -> float:
        """How much of the distance from the limit was lost (positive) or won; inf for a measure that became worthless."""
        if before == after:
            return 0.0
        if math.isnan(before) or math.isnan(after):
            return math.inf if math.isnan(after) else -math.inf
        if math.isinf(before) or math.isinf(after):
            return self.sign * (math.inf if after > before else -math.inf)
        distance = abs(before - self.limit)
        change = self.sign * (after - before)
        return change / distance if distance > 0.0 else math.copysign(math.inf, change)

    def spread(self, values: FloatArray) -> FloatArray:
        """What variance is taken of."""
        if self.variance == "value":
            return values
        with np.errstate(divide="ignore"):
            return 1.0 / values
