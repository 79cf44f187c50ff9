"""The smallest critical drop probability over the range of a gain schedule, the parameter frozen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from analysis.drops.frozen import critical_drop_probability
from analysis.drops.modes import DropPolicy, schedule_drop_modes
from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.schedule import GainSchedule


@dataclass(frozen=True, repr=False)
class FrozenDropProbability(Display):
    """`smallest` critical drop probability and the parameter `place` where it is taken; (g,) samples of the whole range.

    Frozen: the parameter stands still. It bounds from above what holds while the parameter moves
    (`analysis.drops.mean_square`), and proves nothing about motion.
    """

    smallest: float
    place: float
    parameter: str
    unit: str
    points: FloatArray
    values: FloatArray
    policy: DropPolicy

    @property
    def message(self) -> str:
        """One line for a report."""
        where = f"{self.parameter} = {self.place:.6g} {self.unit}"
        return f"critical drop probability {self.smallest:.6g} at {where} (frozen, {self.policy})"


def frozen_critical_probability(
    schedule: GainSchedule, policy: DropPolicy = "coast", points: int = 401
) -> FrozenDropProbability:
    """Sample range and breakpoints, then search the two cells beside the lowest sample.

    Raises AnalysisError for fewer than 2 points or an unknown policy.

    >>> found = frozen_critical_probability(GainSchedule.shipped("longitudinal-speed"), points=21)
    >>> 0.0 < found.smallest < 1.0
    True
    """
    if points < 2:
        raise AnalysisError(f"points = {points} must be at least 2")
    p = schedule.parameter
    grid = np.union1d(np.linspace(p.min, p.max, points), schedule.breakpoints)

    def critical(at: FloatArray) -> FloatArray:
        modes = schedule_drop_modes(schedule, at, policy)
        return critical_drop_probability(modes.dropped, modes.received)

    values = critical(grid)
    best = int(values.argmin())
    smallest, place = float(values[best]), float(grid[best])
    for low, high in ((best - 1, best), (best, best + 1)):
        if low >= 0 and high < len(grid) and 0.0 < smallest < 1.0:
            found = minimize_scalar(
                lambda at: float(critical(np.asarray(at))), bounds=(grid[low], grid[high]), method="bounded"
            )
            if found.fun < smallest:
                smallest, place = float(found.fun), float(found.x)
    return FrozenDropProbability(smallest, place, p.name, p.unit, grid, values, policy)
