r"""The literal problem of P1 (30)-(32): minimise the gain from friction and acceleration error to both state errors.

At DC no gain tells friction from slip velocity: it reaches the velocity error with -sigma0/(sigma0 + sigma2 a) and the
bristle with sigma2/(sigma0 + sigma2 a), whatever L is. At standstill (a = 0) that is a floor of sqrt(1 + (sigma2/sigma0)^2),
1 up to 1e-11. The gains L = [1/sigma1, L2] come as close to it as one likes, and only for L2 without bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy as sp

from analysis.dc_floor import static_gain
from analysis.error_norms import error_hinf_norm
from studies.beyond.well_posed_design.cases import Case
from synthesis.errors import ProblemError
from synthesis.hinf_observer import Channel, ObserverDesign, ObserverGains, observer_problem, to_gamma
from synthesis.lmi.scaling import observer_scale
from synthesis.lmi.solve import solve
from synthesis.polynomials.matrix import FloatArray
from synthesis.well_posedness import energy_problem

DISTURBANCES = ("friction", "acceleration_error")
ERRORS = ("bristle_deflection", "relative_velocity")
GROWTH = 2.0  # for each decade; bounded gains settle
BACKOFFS = (1e-1, 3e-2, 1e-2, 3e-3, 1e-3)


def literal_design(degree: int) -> ObserverDesign:
    """One channel, no bound on poles or noise."""
    return ObserverDesign((Channel(DISTURBANCES, ERRORS),), degree)


def floor(case: Case) -> tuple[sp.Expr, bool]:
    """The least possible gamma in exact numbers, and whether the static gains behind it are free of L at every speed."""
    static = [static_gain(case.model, "friction", error) for error in ERRORS]
    values = {sp.Symbol(name): sp.Rational(str(constant.value)) for name, constant in case.model.constants.items()}
    standstill = {**values, sp.Symbol("wheel_speed"): 0}
    squared = sum(gain.expression.subs(standstill) ** 2 for gain in static)
    return sp.sqrt(squared), all(gain.free_of_gain for gain in static)


@dataclass(frozen=True)
class Approach:
    """Gains of least energy at (1 + backoff) times the infimum `gamma`: largest |L1| in m/s and |L2| in m/s^2, (n, 2)."""

    gamma: float
    backoffs: FloatArray
    gains: FloatArray

    @property
    def growth_per_decade(self) -> float:
        """Factor by which the largest |L2| grows for each decade of back-off, at the close end."""
        slope = np.log(self.gains[-1, 1] / self.gains[-3, 1]) / np.log(self.backoffs[-3] / self.backoffs[-1])
        return float(10.0**slope)

    @property
    def unbounded(self) -> bool:
        """Whether the least gains keep growing on the way to the infimum: then it has no gains of its own."""
        return self.growth_per_decade > GROWTH


def approach(case: Case, design: ObserverDesign, backoffs: tuple[float, ...] = BACKOFFS) -> Approach:
    """Minimise gamma, then the gain energy L'PL at every back-off from it. Raises ProblemError where a solve fails."""
    scale = observer_scale(case.model.polynomial, case.model.parameters)
    optimum = solve(observer_problem(case.model, design, scale), design.settings)
    if optimum.objective is None:
        raise ProblemError(f"model '{case.model.name}': {optimum.message}")
    gamma, largest = to_gamma(case.model, design, scale, optimum.objective), []
    for backoff in backoffs:
        level = gamma * (1.0 + backoff)
        found = solve(energy_problem(case.model, design, scale, level), design.settings)
        if found.objective is None:
            raise ProblemError(f"model '{case.model.name}', back-off {backoff:g}: {found.message}")
        gains = ObserverGains(design, case.model, None, level, found, optimum, scale).gain(case.grid(57))
        largest.append(np.abs(gains[..., 0]).max(axis=0))
    return Approach(gamma, np.array(backoffs), np.array(largest))


def explicit_family(case: Case, second_gains: FloatArray) -> FloatArray:
    """gamma (n,) of the literal channel for L = [1/sigma1, L2], the worst of all constant wheel speeds."""
    first = 1.0 / case.model.constants["sigma1"].value
    grid = case.grid(29)
    return np.array(
        [
            error_hinf_norm(case.model, [first, second], grid, DISTURBANCES, ERRORS, tolerance=1e-13).norm.max()
            for second in second_gains
        ]
    )
