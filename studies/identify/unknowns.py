"""What is fitted, and the solution object that a fit returns."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray


@dataclass(frozen=True)
class Unknown:
    """A parameter p, fitted as x: p = prior*exp(x) if ``positive``, else p = x.

    ``spread`` is the standard deviation of the prior in x. With ``informed`` the prior takes part in the fit like a
    measurement (nuisances, and what the catalogue knows well: radii); without it the data alone decide, and where they
    say less than the prior, the parameter is held there: it then adds ``considered`` times its spread to the intervals of
    the others. ``width`` is the largest half width of the confidence interval in x (times |x| if ``relative``) at which it
    counts as identified; it is held as well where it is not ``apart`` half widths from the prior; ``reach`` bounds x;
    ``starts`` are further x to start from.
    """

    name: str
    prior: float
    spread: float
    width: float
    reach: tuple[float, float]
    positive: bool = True
    informed: bool = True
    relative: bool = False
    considered: float = 1.0
    apart: float = 0.0
    starts: tuple[float, ...] = ()

    def value(self, x: float) -> float:
        """p from x."""
        return float(self.prior * math.exp(min(x, 300.0))) if self.positive else float(x)

    @property
    def home(self) -> float:
        """The prior as x."""
        return 0.0 if self.positive else self.prior

    def stuck(self, x: float) -> bool:
        """Whether x is at a bound."""
        low, high = self.reach
        return min(x - low, high - x) < 1e-6 * (high - low)

    def narrow(self, x: float, half: float) -> bool:
        """Whether an interval of this half width counts as identified."""
        return not self.stuck(x) and half <= self.width * (abs(x) if self.relative else 1.0)

    def silence(self, x: float, half: float) -> float:
        """Half width over that of the prior: above 1 the log says less than the prior; infinite at a bound."""
        if self.stuck(x):
            return math.inf
        near = self.apart * half / max(abs(x - self.home), 1e-12) if self.apart else 0.0
        return max(half / (2.0 * self.spread), near)


@dataclass(frozen=True)
class Estimate:
    """``x`` and ``covariance`` of all unknowns (held ones: prior and spread), and which of them the log ``excited``.

    ``half`` are the half widths of the confidence intervals in x: for a held unknown the one at which it was refused.
    ``factors`` are half widths over standard deviations. ``residual`` (n, k) is NaN where nothing was used, ``rms`` its size,
    ``correlation`` its correlation time in samples, ``freedom`` the degrees of freedom left. ``singular_values`` are those of
    the Jacobian of all unknowns at the first fit, each column times its spread, over the residual size times the root of the
    correlation time: below 1 the log says less in that direction than the prior.
    """

    unknowns: tuple[Unknown, ...]
    x: FloatArray
    covariance: FloatArray
    excited: dict[str, bool]
    half: dict[str, float]
    residual: FloatArray
    samples: int
    rms: float
    correlation: float
    freedom: float
    factors: dict[str, float]
    singular_values: tuple[float, ...]

    def index(self, name: str) -> int:
        """Place of an unknown."""
        return [u.name for u in self.unknowns].index(name)

    def value(self, name: str) -> float:
        """Fitted value, or the prior of one that is held."""
        i = self.index(name)
        return self.unknowns[i].value(float(self.x[i]))

    def values(self) -> dict[str, float]:
        """All values by name."""
        return {u.name: u.value(float(x)) for u, x in zip(self.unknowns, self.x, strict=True)}

    def deviation(self, **weights: float) -> float:
        """Standard deviation of a weighted sum of the x of the named unknowns."""
        w = np.zeros(len(self.unknowns))
        for name, weight in weights.items():
            w[self.index(name)] = weight
        return float(math.sqrt(max(float(w @ self.covariance @ w), 0.0)))

    def interval(self, name: str) -> tuple[float, float]:
        """Confidence interval of the value."""
        i, half = self.index(name), self.half[name]
        return self.unknowns[i].value(float(self.x[i]) - half), self.unknowns[i].value(float(self.x[i]) + half)
