"""Periodic parameter trajectories: piecewise linear, inside range and rate bounds to the last bit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.loop.plant import Axis
from synthesis.polynomials.half_spaces import Faces, HalfSpaces
from synthesis.polynomials.rational import as_float, rational


@dataclass(frozen=True, repr=False)
class Trajectory(Display):
    """Parameters that run through `start[k]` -> `end[k]` (K, p), linearly in `durations[k]` (K,), and then again.

    Durations are seconds, or whole samples in discrete time, where a parameter has the values at the beginning of each. A
    parameter that may jump has start = end. `frequency` (rad/s or rad/sample) is that of the worst input's carrier.

    >>> import numpy as np
    >>> Trajectory(("p",), np.array([1.0]), np.array([[1.0]]), np.array([[2.0]])).period  # s
    1.0
    """

    parameters: tuple[str, ...]
    durations: FloatArray
    start: FloatArray
    end: FloatArray
    frequency: float = 0.0

    @property
    def period(self) -> float:
        """Seconds or samples."""
        return float(self.durations.sum())

    @property
    def constant(self) -> bool:
        """Whether the parameters stand still."""
        return bool((self.start == self.start[0]).all() and (self.end == self.start[0]).all())


@dataclass(frozen=True)
class Path:
    """The same in scaled parameters u in [-1, 1]: `knots` (K, p), each the beginning of a piece of `durations` (K,)."""

    knots: FloatArray
    durations: FloatArray
    jumps: tuple[bool, ...]

    @property
    def period(self) -> float:
        """Sum of the durations."""
        return float(self.durations.sum())

    @property
    def start(self) -> FloatArray:
        """u at the beginning of every piece."""
        return self.knots

    @property
    def end(self) -> FloatArray:
        """u at its end: that of the next piece, or its own where the parameter jumps."""
        return np.where(self.jumps, self.knots, np.roll(self.knots, -1, axis=0))

    def trajectory(self, axes: tuple[Axis, ...], frequency: float) -> Trajectory:
        """In physical numbers."""
        middle, half = (np.array([as_float(getattr(a, key)) for a in axes]) for key in ("middle", "half"))
        names = tuple(axis.name for axis in axes)
        return Trajectory(names, self.durations, middle + half * self.start, middle + half * self.end, frequency)


def admissible(knots: FloatArray, durations: FloatArray, axes: tuple[Axis, ...], half_spaces: HalfSpaces = ()) -> Path:
    """The nearest path of this kind: inside the range, and drawn together about its mean until every rate is kept.

    Where half spaces cut the range, it is drawn together about the middle of what they leave, until every knot is in them.
    """
    knots = np.clip(knots, -1.0, 1.0)
    jumps = tuple(axis.may_jump for axis in axes)
    for i, axis in enumerate(axes):
        if jumps[i]:
            continue
        low, high = (as_float(rate / axis.half) * durations for rate in (axis.rate_low, axis.rate_high))
        move = np.roll(knots[:, i], -1) - knots[:, i]
        allowed = np.where(move < 0.0, -low, high)
        share = np.divide(np.abs(move), allowed, out=np.where(move == 0.0, 0.0, np.inf), where=allowed > 0.0).max()
        if share > 1.0:  # a little less than allowed, so that rounding breaks no bound
            mean = knots[:, i].mean()
            knots[:, i] = mean + (knots[:, i] - mean) * ((1.0 - 1e-9) / share)
    if half_spaces:
        knots = Faces.of(half_spaces).together(knots)
    return Path(knots, durations, jumps)


def check_admissible(path: Path, axes: tuple[Axis, ...], half_spaces: HalfSpaces = ()) -> None:
    """Range and rate bounds in rationals. Raises AnalysisError: a path that breaks them bounds nothing."""
    for i, axis in enumerate(axes):
        for first, last, duration in zip(path.start[:, i], path.end[:, i], path.durations, strict=True):
            a, b = rational(float(first)), rational(float(last))
            rate = (b - a) * axis.half / rational(float(duration))
            if not (abs(a) <= 1 and abs(b) <= 1):
                raise AnalysisError(f"the trajectory leaves the range of '{axis.name}'")
            if not axis.may_jump and not (axis.rate_low <= rate <= axis.rate_high):
                raise AnalysisError(f"the trajectory breaks a rate bound of '{axis.name}'")
    for half_space in half_spaces:
        for u in (*path.start, *path.end):
            if not half_space.holds([rational(float(x)) for x in u]):
                raise AnalysisError("the trajectory leaves the set of the parameters")
