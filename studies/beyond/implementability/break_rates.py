"""The sample rate at which a discretisation becomes unstable: exact, by root finding on Jury's conditions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from analysis.errors import AnalysisError
from studies.beyond.implementability.designs import Design
from studies.beyond.implementability.updates import UPDATES, Update, jury_margin
from synthesis.polynomials.matrix import FloatArray

BISECTIONS = 50
SAMPLE_TIMES = np.geomspace(1e-5, 1.0, 601)  # s, scanned for the first loss of stability


@dataclass(frozen=True)
class BreakCurve:
    """Smallest unstable sample time (g,) in s over wheel speeds (g,) in rad/s (inf: none up to 1 s) and the worst place.

    `worst_rate` in Hz: every wheel speed of the range is stable above it (0: at every rate from 1 Hz up). `connected`: no
    sample time above the first unstable one was found stable again.
    """

    wheel_speed: FloatArray
    sample_time: FloatArray
    worst_rate: float
    worst_wheel_speed: float
    connected: bool

    @property
    def rate(self) -> FloatArray:
        """Break rate in Hz over the wheel speeds; 0 where nothing breaks."""
        return np.asarray(1.0 / self.sample_time)


def first_breaks(design: Design, update: Update, wheel_speed: FloatArray) -> tuple[FloatArray, bool]:
    """The smallest unstable sample times (g,) in s at wheel speeds (g,) (inf: none up to 1 s), and whether all longer ones are.

    A scan brackets the first change of sign of the margin, bisection follows it to the last bit.
    """
    A, L, C = design.matrices(wheel_speed)
    stable = jury_margin(update(A[:, None], L[:, None], C[:, None], SAMPLE_TIMES)) > 0.0
    first = stable.argmin(axis=1)
    lasting = stable.all(axis=1)
    after = np.arange(len(SAMPLE_TIMES)) >= first[:, None]
    connected = not (stable & after)[~lasting].any()
    if (first[~lasting] == 0).any():
        raise AnalysisError(
            f"design '{design.name}' is unstable already at {SAMPLE_TIMES[0]:g} s; check the signs of its gains"
        )
    low, high = SAMPLE_TIMES[np.maximum(first - 1, 0)], SAMPLE_TIMES[first]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        good = jury_margin(update(A, L, C, middle)) > 0.0
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return np.where(lasting, np.inf, high), connected


def _break_nearby(design: Design, update: Update, wheel_speed: float, near: float) -> float:
    """The break at one wheel speed, given that at a neighbour [s]: a bracket by steps of 2 %, then Brent's method."""
    A, L, C = design.matrices(np.array([wheel_speed]))

    def margin(sample_time: float) -> float:
        return float(jury_margin(update(A, L, C, np.array([sample_time])))[0])

    low = high = near
    while margin(low) <= 0.0:
        low *= 0.98
    while margin(high) > 0.0 and high < SAMPLE_TIMES[-1]:
        high *= 1.02
    if margin(high) > 0.0:
        return float("inf")
    return low if low == high else float(brentq(margin, low, high, xtol=1e-15, rtol=1e-13))


def break_curve(design: Design, scheme: str, points: int = 141) -> BreakCurve:
    """The break over the whole range of wheel speeds, and the worst of it refined between the grid points."""
    update, grid = UPDATES[scheme], design.grid(points)
    times, connected = first_breaks(design, update, grid)
    k = int(times.argmin())
    if not np.isfinite(times[k]):
        return BreakCurve(grid, times, 0.0, float("nan"), connected)
    best, place = float(times[k]), float(grid[k])
    for low, high in ((k - 1, k), (k, k + 1)):
        if low >= 0 and high < len(grid) and np.isfinite(times[[low, high]]).all():
            inner = minimize_scalar(
                lambda speed: _break_nearby(design, update, float(speed), times[k]),
                bounds=(grid[low], grid[high]),
                method="bounded",
            )
            if inner.fun < best:
                best, place = float(inner.fun), float(inner.x)
    return BreakCurve(grid, times, 1.0 / best, place, connected)


def unstable_wheel_speeds(
    design: Design, scheme: str, sample_time: float, points: int = 561
) -> tuple[tuple[float, float], ...]:
    """Intervals of the wheel speed in rad/s on which the update is unstable at one sample time, edges by root finding."""
    update, grid = UPDATES[scheme], design.grid(points)

    def margin(speed: float) -> float:
        A, L, C = design.matrices(np.array([speed]))
        return float(jury_margin(update(A, L, C, np.array([sample_time])))[0])

    A, L, C = design.matrices(grid)
    bad = jury_margin(update(A, L, C, np.full(len(grid), sample_time))) <= 0.0
    edges = np.flatnonzero(np.diff(bad.astype(int)))
    roots = [float(brentq(margin, grid[k], grid[k + 1], xtol=1e-12)) for k in edges]
    bounds = ([float(grid[0])] if bad[0] else []) + roots + ([float(grid[-1])] if bad[-1] else [])
    return tuple(zip(bounds[::2], bounds[1::2], strict=True))
