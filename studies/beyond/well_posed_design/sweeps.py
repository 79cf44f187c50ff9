"""One demand of the design is varied, the others stay as shipped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from estimators.faults import BoolArray
from studies.beyond.well_posed_design.achieved import Achieved, achieved
from studies.beyond.well_posed_design.cases import VELOCITY, Case
from synthesis.errors import ProblemError
from synthesis.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.polynomials.matrix import FloatArray

Vary = Callable[[ObserverDesign, float], ObserverDesign]


@dataclass(frozen=True)
class Sweep:
    """Demands (n,); gains (n, g, 2) over `wheel_speed` (g,); proved bounds of the design's own objective, NaN: infeasible."""

    case: Case
    demand: FloatArray
    wheel_speed: FloatArray
    gains: FloatArray
    gamma_lower: FloatArray
    gamma: FloatArray
    achieved: Achieved

    @property
    def feasible(self) -> BoolArray:
        """Mask (n,) of the demands that some gains of this degree meet."""
        return np.asarray(np.isfinite(self.gamma))


def friction_bound(design: ObserverDesign, bound: float) -> ObserverDesign:
    """Bound of the friction channel (its floor is 1)."""
    return replace(
        design, channels=tuple(replace(c, bound=bound) if c.bound is not None else c for c in design.channels)
    )


def decay_rate(design: ObserverDesign, rate: float) -> ObserverDesign:
    """alpha in 1/s."""
    return replace(design, decay_rate=rate)


def pole_limit(design: ObserverDesign, limit: float) -> ObserverDesign:
    """r in 1/s."""
    return replace(design, fastest_pole=limit)


def noise_weight(design: ObserverDesign, weight: float) -> ObserverDesign:
    """Acceleration error joins the minimised channel, `weight` m/s^2 of it for one unit of normalised force noise."""
    both = Channel(("force_noise", "acceleration_error"), VELOCITY, None, (1.0, weight))
    return replace(design, channels=tuple(both if c.bound is None else c for c in design.channels))


def sweep(case: Case, vary: Vary, demands: Sequence[float], points: int = 29) -> Sweep:
    """Design for every demand; one that no gains of this degree meet leaves NaN. Raises ProblemError if none is met."""
    grid = case.grid(points)
    gains, lower, gamma = np.full((len(demands), points, 2), np.nan), [], []
    for k, demand in enumerate(demands):
        try:
            found = design_observer(case.model, vary(case.design, demand))
        except ProblemError:
            lower.append(np.nan)
            gamma.append(np.nan)
            continue
        gains[k] = found.gain(grid)[..., 0]
        lower.append(np.nan if found.gamma_lower is None else found.gamma_lower)
        gamma.append(found.gamma)
    if not np.isfinite(gamma).any():
        raise ProblemError(
            f"{case.title}: no gains of degree {case.design.degree} meet any of the demands {list(demands)}"
        )
    real = achieved(case, gains, grid)
    return Sweep(case, np.array(demands), grid, gains, np.array(lower), np.array(gamma), real)
