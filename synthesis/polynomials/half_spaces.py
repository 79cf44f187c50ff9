"""Linear inequalities between scaled parameters in exact numbers: what of a box they leave, corner by corner.

A set of scaled parameters is {u in [-1, 1]^p : a_k'u <= b_k for all k}. A box (middle, half widths) is missed, kept whole or cut.
Its corners are found by enumeration: some of the inequalities tight, the other coordinates at ends of the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import combinations, product

import numpy as np
from flint import fmpq, fmpq_mat

from estimators.arrays import BoolArray, FloatArray
from synthesis.polynomials.rational import as_float

Point = tuple[fmpq, ...]
NEAR = 1e-9  # of |a|_1, within which a float place counts as in the set


@dataclass(frozen=True)
class HalfSpace:
    """All u with normal'u <= bound; what lies beyond by no more than `slack` is proved, too."""

    normal: Point
    bound: fmpq
    slack: fmpq = field(default_factory=fmpq)

    def holds(self, point: Sequence[fmpq]) -> bool:
        """At a place; further coordinates (rates) are not looked at."""
        return bool(sum((a * u for a, u in zip(self.normal, point, strict=False)), fmpq(0)) <= self.bound)

    def misses(self, offset: Sequence[fmpq], factor: Sequence[fmpq]) -> bool:
        """Whether a box lies wholly beyond, slack included."""
        least = fmpq(0)
        for a, middle, half in zip(self.normal, offset, factor, strict=False):
            least += a * middle - abs(a) * half
        return bool(least > self.bound + self.slack)

    def contains(self, offset: Sequence[fmpq], factor: Sequence[fmpq]) -> bool:
        """Whether a whole box is inside."""
        most = fmpq(0)
        for a, middle, half in zip(self.normal, offset, factor, strict=False):
            most += a * middle + abs(a) * half
        return bool(most <= self.bound)

    @property
    def widened(self) -> HalfSpace:
        """With its slack."""
        return HalfSpace(self.normal, self.bound + self.slack)

    def among(self, count: int) -> HalfSpace:
        """The same inequality where further parameters follow, which it does not know."""
        return replace(self, normal=(*self.normal, *(fmpq(0),) * (count - len(self.normal))))


HalfSpaces = tuple[HalfSpace, ...]


def corners_of(offset: Sequence[fmpq], factor: Sequence[fmpq], half_spaces: HalfSpaces) -> list[Point]:
    """The corners of a box cut by half spaces, exact; none where nothing is left."""
    count = len(half_spaces[0].normal) if half_spaces else len(offset)
    low, high = ([offset[i] + sign * factor[i] for i in range(count)] for sign in (-1, 1))
    found: dict[Point, None] = {}
    for tight in range(min(count, len(half_spaces)) + 1):
        for chosen in combinations(half_spaces, tight):
            for free in combinations(range(count), tight):
                fixed = [i for i in range(count) if i not in free]
                for ends in product(*((low[i], high[i]) for i in fixed)):
                    point = _meeting(chosen, free, dict(zip(fixed, ends, strict=True)))
                    if (
                        point is not None
                        and all(a <= u <= b for a, u, b in zip(low, point, high, strict=True))
                        and all(half_space.holds(point) for half_space in half_spaces)
                    ):
                        found[point] = None
    return list(found)


def _meeting(chosen: Sequence[HalfSpace], free: Sequence[int], fixed: dict[int, fmpq]) -> Point | None:
    """Where the chosen inequalities are tight and the other coordinates fixed; None if that is no one place."""
    if free:
        matrix = fmpq_mat([[h.normal[i] for i in free] for h in chosen])
        rest = fmpq_mat([[h.bound - sum((h.normal[i] * u for i, u in fixed.items()), fmpq(0))] for h in chosen])
        try:
            solved = matrix.solve(rest)
        except ZeroDivisionError:
            return None
        fixed = fixed | {i: solved[k, 0] for k, i in enumerate(free)}
    return tuple(fixed[i] for i in range(len(fixed)))


def centre_of(corners: Sequence[Point]) -> Point:
    """Their mean: inside whatever they span, and off every face if they span a body."""
    return tuple(sum(column, fmpq(0)) / len(corners) for column in zip(*corners, strict=True))


@dataclass(frozen=True)
class Faces:
    """The same in floats, for what is looked at and not proved: `normals` (m, p), `bounds` (m,), `corners` (g, p) of the set."""

    normals: FloatArray
    bounds: FloatArray
    corners: FloatArray

    @classmethod
    @lru_cache(maxsize=64)
    def of(cls, half_spaces: HalfSpaces) -> Faces:
        """Of the range [-1, 1]^p and these inequalities."""
        count = len(half_spaces[0].normal)
        corners = corners_of((fmpq(0),) * count, (fmpq(1),) * count, half_spaces)
        return cls(
            np.array([[as_float(a) for a in h.normal] for h in half_spaces]),
            np.array([as_float(h.bound) for h in half_spaces]),
            np.array([[as_float(u) for u in corner] for corner in corners]).reshape(len(corners), count),
        )

    @property
    def slack(self) -> FloatArray:
        """What counts as rounding, for each inequality."""
        return np.asarray(NEAR * np.abs(self.normals).sum(axis=1))

    def inside(self, points: FloatArray) -> BoolArray:
        """Which places (.., p) are in the set; more coordinates than p are not looked at."""
        own = np.asarray(points)[..., : self.normals.shape[1]]
        return np.asarray((own @ self.normals.T <= self.bounds + self.slack).all(axis=-1))

    def misses(self, offset: FloatArray, factor: FloatArray) -> BoolArray:
        """Which boxes (g, p) lie wholly outside one inequality, by more than rounding."""
        count = self.normals.shape[1]
        least = offset[:, :count] @ self.normals.T - factor[:, :count] @ np.abs(self.normals).T
        return np.asarray((least > self.bounds + self.slack).any(axis=-1))

    def drawn_in(self, points: FloatArray) -> FloatArray:
        """Places (.., p) outside moved straight towards the middle of the set, up to its border (and within by rounding)."""
        centre = self.corners.mean(axis=0)
        step = points - centre
        return np.asarray(centre + self._shares(step, centre).min(axis=-1)[..., None] * step, np.float64)

    def _shares(self, step: FloatArray, centre: FloatArray) -> FloatArray:
        """The part (.., m) of every way from the centre that each inequality leaves, one at most."""
        reach, room = step @ self.normals.T, (self.bounds - self.normals @ centre) * (1.0 - NEAR)
        return np.asarray(np.where(reach > room, room / np.where(reach > room, reach, 1.0), 1.0), np.float64)

    def together(self, points: FloatArray) -> FloatArray:
        """Places (g, p), all moved towards the middle of the set by the same part of their way, until none is outside."""
        centre = self.corners.mean(axis=0)
        step = points - centre
        return np.asarray(centre + self._shares(step, centre).min() * step)

    def on_lines(self, lines: Sequence[FloatArray]) -> FloatArray:
        """Places (g, p) of a rectilinear grid that are in the set, where its lines leave the set, and the corners of the set."""
        grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
        found = [grid[self.inside(grid)]]
        for axis, column in enumerate(self.normals.T):
            others = [line if i != axis else np.zeros(1) for i, line in enumerate(lines)]
            base = np.stack(np.meshgrid(*others, indexing="ij"), axis=-1).reshape(-1, len(lines))
            for number in np.flatnonzero(column):
                places = base.copy()
                places[:, axis] = (self.bounds[number] - base @ self.normals[number]) / column[number]
                found.append(places[(np.abs(places[:, axis]) <= 1.0) & self.inside(places)])
        points = np.round(np.concatenate([*found, self.corners]), 12)
        _, first = np.unique(points, axis=0, return_index=True)
        return np.asarray(points[np.sort(first)])


def faces_of(half_spaces: HalfSpaces) -> Faces | None:
    """The set in floats; None for a box."""
    return Faces.of(half_spaces) if half_spaces else None
