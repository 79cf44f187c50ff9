"""Nonlinear least squares with honest confidence intervals, and parameters held where a log says nothing of them.

All unknowns are fitted together, informed ones with their prior as one more measurement, weighed by the residual size and
its correlation time. The uninformed unknown whose interval is widest against its prior's is then held at the prior and the
rest fitted again, until the log says more than the prior of every one left; excited are those with narrow intervals. What
stays in the fit without being excited keeps its uncertainty in the intervals of the rest. What is held is not known
either: with its spread s it adds S s^2 S', S = -H^-1 J'J_held, to the covariance of the rest (consider analysis; Schmidt
1966).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from estimators.arrays import BoolArray, FloatArray
from studies.identify.autocorrelation import correlation_time, effective_stretches, long_run_covariance

Residual = Callable[[Mapping[str, float]], FloatArray]  # rows (n, k) of the values by name


@dataclass(frozen=True)
class Unknown:
    """A parameter p, fitted as x: p = prior*exp(x) if ``positive``, else p = x.

    ``spread`` is the standard deviation of the prior in x. With ``informed`` the prior takes part in the fit like a
    measurement (nuisances, and what the catalogue knows well: radii); without it the data alone decide, and where they
    say less than the prior, the parameter is held there: it then adds ``considered`` times its spread to the intervals of
    the others. ``width`` is the largest half width of the confidence interval in x (times |x| if ``relative``) at which it
    counts as identified; it is held as well where it is not ``apart`` half widths from the prior; x stays within ``bounds``;
    ``starts`` are further x to start from.
    """

    name: str
    prior: float
    spread: float
    width: float
    bounds: tuple[float, float]
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
    def prior_x(self) -> float:
        """The prior as x."""
        return 0.0 if self.positive else self.prior

    def at_bound(self, x: float) -> bool:
        """Whether x is at a bound."""
        low, high = self.bounds
        return min(x - low, high - x) < 1e-6 * (high - low)

    def narrow(self, x: float, half: float) -> bool:
        """Whether an interval of this half width counts as identified."""
        return not self.at_bound(x) and half <= self.width * (abs(x) if self.relative else 1.0)

    def width_over_prior(self, x: float, half: float) -> float:
        """Half width over that of the prior: above 1 the log says less than the prior; infinite at a bound."""
        if self.at_bound(x):
            return math.inf
        near = self.apart * half / max(abs(x - self.prior_x), 1e-12) if self.apart else 0.0
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


PASSES = 2  # the first weighs the priors by a guess of the residual, the second by the residual of the first
COMMON = 4.0  # stretches that the common residual size counts as, where the few that tell a parameter have residuals of their own

STOP: tuple[Any, ...] = ({"xtol": 1e-4, "ftol": 1e-3, "max_nfev": 40}, {"xtol": 1e-5, "ftol": 3e-5, "max_nfev": 40})
"""Of each pass. A few hundred independent rows: what is left below ``ftol`` is worth a hundredth of a standard deviation."""


@dataclass(frozen=True)
class Rules:
    """What an interval means.

    ``confidence`` of the intervals, ``floor`` of the residual in its unit (simulated logs have no noise of their own),
    ``correlation``: samples over which the prefilter alone makes the residual correlated, ``freedom``: independent stretches
    without which nothing counts as excited.
    """

    confidence: float
    floor: float
    correlation: int
    freedom: float


@dataclass(frozen=True)
class _Problem:
    residual: Residual
    mask: BoolArray
    unknowns: tuple[Unknown, ...]
    rules: Rules

    @property
    def prior_x(self) -> FloatArray:
        return np.array([u.prior_x for u in self.unknowns])

    @property
    def spread(self) -> FloatArray:
        return np.array([u.spread for u in self.unknowns])

    def all_rows(self, x: FloatArray) -> FloatArray:
        return self.residual({u.name: u.value(float(v)) for u, v in zip(self.unknowns, x, strict=True)})

    def rows(self, x: FloatArray) -> FloatArray:
        return self.all_rows(x)[self.mask]

    def thinned(self) -> BoolArray:
        """One row in half a correlation length of the prefilter: enough to come near."""
        out = np.zeros_like(self.mask)
        step = max(self.rules.correlation // 2, 1)
        out[::step] = self.mask[::step]
        return out if np.count_nonzero(out) > 20 * len(self.unknowns) else self.mask

    def size(self, x: FloatArray) -> tuple[float, float]:
        """Residual size, not below the floor, and its correlation time in samples."""
        e = np.zeros(self.mask.shape)
        e[self.mask] = self.rows(x)
        rms = float(np.sqrt(np.mean(e[self.mask] ** 2)))
        time = correlation_time(e, self.rules.correlation) if rms > 0 else 1.0
        return max(rms, self.rules.floor), max(time, float(self.rules.correlation) / 2)


def estimate(
    residual: Residual,
    mask: BoolArray,
    unknowns: Sequence[Unknown],
    rules: Rules,
    start: Mapping[str, float] | None = None,
) -> Estimate:
    """Fit the ``unknowns`` to the rows of ``residual`` (n, k) that ``mask`` (n, k) lets in, from ``start`` (x by name)."""
    problem = _Problem(residual, mask, tuple(unknowns), rules)
    if not mask.any():
        return _nothing(problem)
    active = np.ones(len(problem.unknowns), dtype=bool)
    x = np.array([(start or {}).get(u.name, u.prior_x) for u in problem.unknowns])
    refused: dict[str, float] = {}
    singular: tuple[float, ...] = ()
    while True:
        x = _fit(problem, active, np.where(active, x, problem.prior_x), many=not singular and start is None)
        found = _covariance(problem, active, x)
        singular = singular or found.singular_values
        half = found.half
        uncertain = {
            u.name: u.width_over_prior(float(v), half[u.name])
            for u, v, a in zip(problem.unknowns, x, active, strict=True)
            if a and not u.informed
        }
        worst = max(uncertain, key=lambda name: uncertain[name], default="")
        if not worst or uncertain[worst] <= 1.0:
            break
        refused[worst] = half[worst]
        active[found.index(worst)] = False
    enough = found.freedom >= rules.freedom
    excited = {
        u.name: enough and u.name not in refused and u.narrow(float(v), half[u.name])
        for u, v in zip(problem.unknowns, x, strict=True)
    }
    return replace(found, excited=excited, half={**half, **refused}, singular_values=singular)


def _fit(problem: _Problem, active: BoolArray, x: FloatArray, many: bool) -> FloatArray:
    free = np.flatnonzero(active)
    unknowns = [problem.unknowns[i] for i in free]
    low, high = (np.array([u.bounds[side] for u in unknowns]) for side in (0, 1))
    prior, spread = problem.prior_x[free], problem.spread[free]
    informed = np.array([u.informed for u in unknowns])
    margin = 1e-9 * (high - low)
    size, time = 10 * problem.rules.floor, float(problem.rules.correlation)
    for k in range(PASSES if free.size else 0):
        mask = problem.mask if k else problem.thinned()
        share = np.count_nonzero(mask) / np.count_nonzero(problem.mask)
        weight = np.where(informed, size * np.sqrt(time * share), 0.0) / spread

        def cost(
            part: FloatArray, weight: FloatArray = weight, held: FloatArray = x, mask: BoolArray = mask
        ) -> FloatArray:
            full = held.copy()
            full[free] = part
            return np.concatenate([problem.all_rows(full)[mask], (weight * (part - prior))[informed]])

        starts = [np.clip(x[free], low + margin, high - margin)]
        if many and k == 0:
            for place, u in enumerate(unknowns):
                starts += [np.concatenate([starts[0][:place], [s], starts[0][place + 1 :]]) for s in u.starts]
        fits = [least_squares(cost, s, bounds=(low, high), x_scale=spread, **STOP[k]) for s in starts]
        x = x.copy()
        x[free] = min(fits, key=lambda fit: float(fit.cost)).x
        size, time = problem.size(x)
    return x


def _covariance(problem: _Problem, active: BoolArray, x: FloatArray) -> Estimate:
    """Covariance of :mod:`.autocorrelation`, with the prior as one more measurement, and the consider part."""
    spread, mask = problem.spread, problem.mask
    e = problem.rows(x)
    jacobian = np.empty((e.size, x.size))  # times spread: d(residual)/d(x/spread)
    for i, s in enumerate(spread):
        side = np.zeros(x.size)
        side[i] = 1e-3 * s
        jacobian[:, i] = (problem.rows(x + side) - problem.rows(x - side)) / 2e-3
    size, time = problem.size(x)
    singular = np.linalg.svd(jacobian, compute_uv=False) / (size * np.sqrt(time))
    free, held = np.flatnonzero(active), np.flatnonzero(~active)
    covariance = np.eye(x.size)
    rows = np.nonzero(mask)[0]
    freedom = max(e.size / time - free.size, 2.0)
    factors = np.full(x.size, student.ppf(0.5 + problem.rules.confidence / 2, freedom))
    if free.size:
        J = jacobian[:, free]
        scores = np.zeros((mask.shape[0], free.size))
        np.add.at(scores, rows, J * e[:, None])
        omega, bandwidth = long_run_covariance(scores, problem.rules.correlation)
        informed = np.array([problem.unknowns[i].informed for i in free], dtype=float)
        prior = np.diag(informed * size**2 * time)
        weak = 1e-6 * size**2 * np.eye(free.size)  # a direction of which nothing is known gets a thousand spreads
        inverse = np.linalg.inv(J.T @ J + prior + weak)
        # as squares: their diagonals cannot turn negative by rounding where the problem is near singular
        certain = np.sqrt(np.diag(prior) * size**2 * time + 1e-6 * size**4)[:, None] * inverse
        influence = J @ inverse
        known, white = certain.T @ certain, size**2 * time * influence.T @ influence
        robust = inverse.T @ omega @ inverse
        considered = np.array([problem.unknowns[i].considered for i in held])
        pull = inverse @ J.T @ (jacobian[:, held] * considered)
        sure = np.diag(known) + np.sum(pull**2, axis=1)
        stretches = effective_stretches(influence, rows, max(bandwidth, problem.rules.correlation))

        def half_width(estimated: FloatArray, freedom: FloatArray | float) -> FloatArray:
            """Of variances that are in part estimated: the rest has no degrees of freedom to lose (Satterthwaite 1946)."""
            whole = np.maximum(estimated + sure, 1e-300)
            each = np.maximum(freedom / np.clip(estimated / whole, 1e-3, 1.0) ** 2, 1.0)
            return np.asarray(student.ppf(0.5 + problem.rules.confidence / 2, each) * np.sqrt(whole))

        plain, own = np.diag(white), np.diag(robust)
        pooled = plain + (own - plain) * stretches / (stretches + COMMON)
        wide = np.maximum(half_width(own, freedom), half_width(pooled, np.minimum(freedom, stretches + COMMON)))
        grown = np.sqrt(np.maximum(own / np.maximum(plain, 1e-300), 1.0))
        covariance[np.ix_(free, free)] = white * np.outer(grown, grown) + known + pull @ pull.T
        factors[free] = np.maximum(half_width(plain, freedom), wide) / np.sqrt(np.diag(covariance)[free])
    half = factors * np.sqrt(np.diag(covariance)) * spread
    covariance *= np.outer(spread, spread)
    out = np.full(mask.shape, np.nan)
    out[mask] = e
    names = [u.name for u in problem.unknowns]
    return Estimate(
        problem.unknowns, x, covariance, {}, dict(zip(names, map(float, half), strict=True)), out, samples=e.size,
        rms=float(np.sqrt(np.mean(e**2))), correlation=time, freedom=freedom,
        factors=dict(zip(names, map(float, factors), strict=True)), singular_values=tuple(map(float, singular)),
    )  # fmt: skip


def _nothing(problem: _Problem) -> Estimate:
    """No row is usable: everything is its prior, nothing is excited."""
    factor = float(student.ppf(0.5 + problem.rules.confidence / 2, 1e6))
    names = [u.name for u in problem.unknowns]
    half = {u.name: factor * u.spread for u in problem.unknowns}
    return Estimate(
        problem.unknowns, problem.prior_x, np.diag(problem.spread**2), dict.fromkeys(names, False), half,
        np.full(problem.mask.shape, np.nan), samples=0, rms=0.0, correlation=1.0, freedom=0.0,
        factors=dict.fromkeys(names, factor), singular_values=(0.0,) * len(names),
    )  # fmt: skip
