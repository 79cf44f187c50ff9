"""Ranges and rate bounds of scheduling parameters as arrays, whoever declares them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from synthesis.models.lpv import LpvModel

KEPT = 1.0 - 1e-9  # of a rate bound: sample times and rates are rounded decimals
EPS = 2.0**-52


class ParameterBox(NamedTuple):
    """Arrays (p,); rates per second, infinite where the parameter may jump."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    rate_low: FloatArray
    rate_high: FloatArray

    def limited(self, wanted: FloatArray, sample_time: float) -> FloatArray:
        """The nearest admissible trajectories (runs, samples, p), sample after sample; the first values are kept.

        Every value lies in the range, and every difference of neighbours between sample_time times the rate bounds, as real
        numbers: what float64 can round in a sum is taken off the bounds.
        """
        rounding = 2.0 * EPS * np.maximum(np.abs(self.low), np.abs(self.high))
        most = np.maximum(0.0, self.rate_high * (sample_time * KEPT) - rounding)
        least = np.minimum(0.0, self.rate_low * (sample_time * KEPT) + rounding)
        kept = np.clip(wanted, self.low, self.high)
        for k in range(1, kept.shape[1]):
            before = kept[:, k - 1]
            kept[:, k] = np.clip(np.clip(kept[:, k], before + least, before + most), self.low, self.high)
        return kept


def box_of(system: GainSchedule | LpvModel) -> ParameterBox:
    """The box of a schedule or a model. Raises AnalysisError for anything else, and where nothing is scheduled."""
    if isinstance(system, GainSchedule):
        rows = [(p.name, p.unit, p.min, p.max, p.rate_min, p.rate_max) for p in system.parameters]
    elif isinstance(system, LpvModel):
        rows = [
            (p.name, p.unit, p.minimum, p.maximum, p.rate_minimum, p.rate_maximum) for p in system.parameters
        ]  # fmt: skip
    else:
        raise AnalysisError(f"parameters of a {type(system).__name__}; give a GainSchedule or an LpvModel")
    if not rows:
        raise AnalysisError(f"'{system.name}' follows no parameter; there are no trajectories")
    names, units, *numbers = zip(*rows, strict=True)
    return ParameterBox(names, units, *(np.array(column, float) for column in numbers))
