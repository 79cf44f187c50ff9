"""How gains become a table that is run once a sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from estimators.display import Display
from synthesis.errors import ProblemError


@dataclass(frozen=True, repr=False)
class DeploySettings(Display):
    """How gains become a table.

    >>> DeploySettings(sample_time=0.01, dtype="float32").dtype
    'float32'
    """

    sample_time: float = 0.005  # s
    dtype: Literal["float32", "float64"] = "float64"
    interpolation_cost: float = 0.01  # largest loss of any gain against a table four times as fine
    settle: float = 0.005  # certified bounds are this much above their infimum, which buys margin for the proof
    limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Of inputs of a feedback law: least and largest."""

    def __post_init__(self) -> None:
        if not 0.0 < self.sample_time < 1.0:
            raise ProblemError(f"sample time {self.sample_time} s must lie between 0 and 1 s")
        if self.dtype not in ("float32", "float64"):
            raise ProblemError(f"dtype '{self.dtype}' of the table must be float32 or float64")
        if not 0.0 < self.interpolation_cost < 1.0:
            raise ProblemError(f"interpolation cost {self.interpolation_cost} must lie between 0 and 1")
        for name, (low, high) in self.limits.items():
            if not (np.isfinite(low) and np.isfinite(high) and low < high):
                raise ProblemError(f"limits of '{name}': [{low}, {high}] is empty, reversed or not finite")
