"""Ranges, rate bounds and constraints of scheduling parameters as arrays, whoever declares them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from analysis.errors import AnalysisError
from estimators.arrays import FloatArray, IndexArray
from estimators.schedule import GainSchedule
from estimators.schedule.constraints import ParameterSet, parameter_set
from synthesis.design.export import constraints_of
from synthesis.models.lpv import LpvModel

KEPT = 1.0 - 1e-9  # of a rate bound: sample times and rates are rounded decimals
EPS = 2.0**-52


class ParameterBox(NamedTuple):
    """Arrays (p,); rates per second, infinite where the parameter may jump; `constraints` None where the set is the box."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    low: FloatArray
    high: FloatArray
    rate_low: FloatArray
    rate_high: FloatArray
    constraints: ParameterSet | None = None

    def limited(self, wanted: FloatArray, sample_time: float) -> FloatArray:
        """The nearest admissible trajectories (runs, samples, p), sample after sample; the first values are kept.

        Every value lies in the range and satisfies all constraints, and every difference of neighbours lies between sample_time
        times the rate bounds, as real numbers: what float64 can round in a sum is taken off the bounds. First values outside the
        constraints are drawn into their set; a step that would leave it ends at the border, or goes on along it.
        """
        rounding = 2.0 * EPS * np.maximum(np.abs(self.low), np.abs(self.high))
        most = np.maximum(0.0, self.rate_high * (sample_time * KEPT) - rounding)
        least = np.minimum(0.0, self.rate_low * (sample_time * KEPT) + rounding)
        kept = np.clip(wanted, self.low, self.high)
        if self.constraints is not None:
            return self._within(kept, least, most)
        for k in range(1, kept.shape[1]):
            before = kept[:, k - 1]
            kept[:, k] = np.clip(np.clip(kept[:, k], before + least, before + most), self.low, self.high)
        return kept

    def _within(self, wanted: FloatArray, least: FloatArray, most: FloatArray) -> FloatArray:
        assert self.constraints is not None
        normals = self.constraints.normals
        size = np.abs(normals) @ np.maximum(np.abs(self.low), np.abs(self.high)) + np.abs(self.constraints.bounds)
        tighter = self.constraints._replace(bounds=self.constraints.bounds - 64.0 * EPS * size)
        wanted[:, 0] = np.clip(tighter.drawn_in(wanted[:, 0]), self.low, self.high)
        for k in range(1, wanted.shape[1]):
            before = wanted[:, k - 1]
            step = np.clip(np.clip(wanted[:, k], before + least, before + most), self.low, self.high) - before
            room = np.maximum(tighter.bounds - before @ normals.T, 0.0)
            first, face = _share(step @ normals.T, room)
            along = step * (1.0 - first[:, None])  # what is left of the step, without its part across the border
            across = normals[face]
            along = along - across * ((along * across).sum(axis=1) / (across * across).sum(axis=1))[:, None]
            step = step * first[:, None]
            after = before + step
            high, low = np.minimum(before + most, self.high), np.maximum(before + least, self.low)
            left = np.where(along > 0.0, high, low) - after
            fits = np.divide(left, along, out=np.ones_like(along), where=along != 0.0)
            second, _ = _share(along @ normals.T, np.maximum(tighter.bounds - after @ normals.T, 0.0))
            share = np.clip(np.minimum(fits.min(axis=1), second), 0.0, 1.0) * (first < 1.0)
            wanted[:, k] = np.clip(after + along * share[:, None], low, high)
        return wanted


def _share(reach: FloatArray, room: FloatArray) -> tuple[FloatArray, IndexArray]:
    """The largest part (runs,) of a step that satisfies all constraints, at most one, and which of them (runs,) ends it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where(reach > room, room / reach, 1.0)
    return parts.min(axis=1), parts.argmin(axis=1)


def box_of(system: GainSchedule | LpvModel) -> ParameterBox:
    """The box and constraints of a schedule or a model.

    Raises AnalysisError for anything else, and where nothing is scheduled.
    """
    if isinstance(system, GainSchedule):
        rows = [(p.name, p.unit, p.min, p.max, p.rate_min, p.rate_max) for p in system.parameters]
        constraints = system.constraints
    elif isinstance(system, LpvModel):
        rows = [
            (p.name, p.unit, p.minimum, p.maximum, p.rate_minimum, p.rate_maximum) for p in system.parameters
        ]  # fmt: skip
        constraints = parameter_set(constraints_of(system).get("constraints"), [p.name for p in system.parameters])
    else:
        raise AnalysisError(f"parameters of a {type(system).__name__}; give a GainSchedule or an LpvModel")
    if not rows:
        raise AnalysisError(f"'{system.name}' follows no parameter; there are no trajectories")
    names, units, *numbers = zip(*rows, strict=True)
    low, high, rate_low, rate_high = (np.array(column, float) for column in numbers)
    return ParameterBox(names, units, low, high, rate_low, rate_high, constraints)
