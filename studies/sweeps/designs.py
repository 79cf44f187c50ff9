"""The designs of a sweep, stage by stage: which rows there are, and the parameter values of any of them by index."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from analysis.errors import AnalysisError
from analysis.sensitivity_designs import power_of_two
from estimators.arrays import FloatArray
from estimators.errors import unknown
from studies.sweeps.skip_ahead import BITS, latin_points, sobol_points
from studies.sweeps.vary import Varied
from synthesis.errors import SpecError
from synthesis.toml_file import StrictTable

Indices = NDArray[np.int64]
MOST_CORNERS = 20  # parameters


class Stage(StrictTable):
    """A set of designs of one kind. `random` ones fill the box evenly: quantiles are taken over them.

    `rows` and `block` (rows that stay together) depend on the number of parameters d and of measures.
    """

    kind: str
    random: ClassVar[bool] = False
    most: ClassVar[int] = 1 << 62  # rows in one chunk

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """How many designs."""
        raise NotImplementedError

    def block(self, varied: tuple[Varied, ...]) -> int:
        """How many rows belong together."""
        return 1

    def step(self, chunk: int, varied: tuple[Varied, ...]) -> int:
        """Rows of a chunk of about `chunk`: whole blocks."""
        block = self.block(varied)
        return max(min(chunk, self.most) // block, 1) * block

    def values(self, indices: Indices, varied: tuple[Varied, ...]) -> FloatArray:
        """Parameter values (m, d) of some rows."""
        raise NotImplementedError

    def check(self, varied: tuple[Varied, ...]) -> None:
        """Raises SpecError if the stage cannot be laid over these parameters."""


class Nominal(Stage):
    """The one design with every parameter at its nominal value; every sweep begins with it."""

    kind: Literal["nominal"] = "nominal"

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """One."""
        return 1

    def values(self, indices: Indices, varied: tuple[Varied, ...]) -> FloatArray:
        """The nominal values."""
        return np.tile([v.nominal for v in varied], (len(indices), 1))


class OneAtATime(Stage):
    """Each parameter over `levels` values of its range, the others nominal (P3 Figs 3-5)."""

    kind: Literal["one at a time"]
    levels: int = Field(default=2, ge=2)

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """levels d."""
        return self.levels * len(varied)

    def values(self, indices: Indices, varied: tuple[Varied, ...]) -> FloatArray:
        """Parameter by parameter, each from the lower end up."""
        out = np.tile([v.nominal for v in varied], (len(indices), 1))
        which, level = indices // self.levels, indices % self.levels
        low, high = _edges(varied)
        out[np.arange(len(indices)), which] = low[which] + level / (self.levels - 1) * (high - low)[which]
        return out


class FullGrid(Stage):
    """Every combination of `levels` values of each parameter: one number, or one for each by name."""

    kind: Literal["grid"]
    levels: int | dict[str, int]

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """The product of all levels."""
        return int(np.prod([int(n) for n in self._levels(varied)], dtype=object))

    def values(self, indices: Indices, varied: tuple[Varied, ...]) -> FloatArray:
        """The last parameter runs fastest."""
        out, rest = np.empty((len(indices), len(varied))), indices.copy()
        low, high = _edges(varied)
        for column, count in reversed(list(enumerate(self._levels(varied)))):
            rest, level = np.divmod(rest, count)
            out[:, column] = low[column] + level / (count - 1) * (high[column] - low[column])
        return out

    def check(self, varied: tuple[Varied, ...]) -> None:
        """Every parameter needs two or more levels."""
        known = [v.name for v in varied]
        for name in self.levels if isinstance(self.levels, dict) else ():
            if name not in known:
                raise SpecError(f"levels: {unknown('parameter', name, known)}")
        if min(self._levels(varied), default=2) < 2:
            raise SpecError("levels: a grid needs two or more levels of every parameter")

    def _levels(self, varied: tuple[Varied, ...]) -> list[int]:
        if isinstance(self.levels, int):
            return [self.levels] * len(varied)
        missing = [v.name for v in varied if v.name not in self.levels]
        if missing:
            raise SpecError(f"levels: none given for {', '.join(missing)}")
        return [self.levels[v.name] for v in varied]


class Corners(Stage):
    """All 2^d corners of the box."""

    kind: Literal["corners"]

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """2^d."""
        return int(1 << len(varied))

    def values(self, indices: Indices, varied: tuple[Varied, ...]) -> FloatArray:
        """Bit k of the index says whether parameter k is at its upper end."""
        low, high = _edges(varied)
        return np.where((indices[:, None] >> np.arange(len(varied))) & 1 == 1, high, low)

    def check(self, varied: tuple[Varied, ...]) -> None:
        """At most 20 parameters."""
        if len(varied) > MOST_CORNERS:
            raise SpecError(f"corners: {len(varied)} parameters have more than 2^{MOST_CORNERS} corners; vary fewer")


class LatinHypercube(Stage):
    """`samples` points, one in each of as many slices of every parameter (McKay, Beckman, Conover 1979)."""

    kind: Literal["latin hypercube"]
    samples: int = Field(ge=1)
    seed: int = Field(default=0, ge=0)
    random: ClassVar[bool] = True

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """As asked."""
        return self.samples

    def values(self, indices: Indices, varied: tuple[Varied, ...]) -> FloatArray:
        """By index, without the permutations."""
        return _scaled(latin_points(indices, len(varied), self.samples, self.seed), varied)


class Sobol(Stage):
    """`samples` scrambled Sobol points (Owen 1998), a power of two, on which their balance rests."""

    kind: Literal["sobol"]
    samples: int = Field(ge=1)
    seed: int = Field(default=0, ge=0)
    random: ClassVar[bool] = True

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """As asked."""
        return self.samples

    def values(self, indices: Indices, varied: tuple[Varied, ...]) -> FloatArray:
        """The points of `analysis.sensitivity_designs.sobol`."""
        return _scaled(sobol_points(indices, len(varied), self.seed), varied)

    def check(self, varied: tuple[Varied, ...]) -> None:
        """A power of two, at most 2^30."""
        _require_power("samples", self.samples)


class Saltelli(Stage):
    """`blocks` times d + 2 designs A, B and A with one column of B, from Sobol points: gives Sobol indices as well."""

    kind: Literal["saltelli"]
    blocks: int = Field(ge=2)
    seed: int = Field(default=0, ge=0)
    random: ClassVar[bool] = True

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """blocks (d + 2)."""
        return self.blocks * self.block(varied)

    def block(self, varied: tuple[Varied, ...]) -> int:
        """d + 2."""
        return len(varied) + 2

    def values(self, indices: Indices, varied: tuple[Varied, ...]) -> FloatArray:
        """Row 0 of a block is A, row 1 is B, row 2 + i is A with column i of B."""
        d = len(varied)
        block, row = np.divmod(indices, d + 2)
        points = sobol_points(block, 2 * d, self.seed)
        from_b = (row[:, None] == 1) | (row[:, None] - 2 == np.arange(d))
        return _scaled(np.where(from_b, points[:, d:], points[:, :d]), varied)

    def check(self, varied: tuple[Varied, ...]) -> None:
        """A power of two, at most 2^30."""
        _require_power("blocks", self.blocks)


class WorstCase(Stage):
    """For every measure the worst design that a search finds (`analysis.sensitivity_worst`): one row a measure."""

    kind: Literal["worst case"]
    samples: int = Field(default=256, ge=2)
    generations: int = Field(default=30, ge=0)
    seed: int = Field(default=0, ge=0)
    most: ClassVar[int] = 1  # a search is work enough

    def rows(self, varied: tuple[Varied, ...], measures: int) -> int:
        """One for each measure."""
        return measures

    def check(self, varied: tuple[Varied, ...]) -> None:
        """Its samples are Sobol points."""
        _require_power("samples", self.samples)


STAGES: Mapping[str, type[Stage]] = {
    "one at a time": OneAtATime, "grid": FullGrid, "corners": Corners, "latin hypercube": LatinHypercube,
    "sobol": Sobol, "saltelli": Saltelli, "worst case": WorstCase,
}  # fmt: skip


def _edges(varied: tuple[Varied, ...]) -> tuple[FloatArray, FloatArray]:
    return np.array([v.low for v in varied]), np.array([v.high for v in varied])


def _scaled(points: FloatArray, varied: tuple[Varied, ...]) -> FloatArray:
    low, high = _edges(varied)
    return np.asarray(low + points * (high - low))


def _require_power(name: str, count: int) -> None:
    try:
        power = power_of_two(count)
    except AnalysisError as error:
        raise SpecError(f"{name}: {error}") from None
    if power > BITS:
        raise SpecError(f"{name} = {count} is above 2^{BITS}, where the generator ends; use a Latin hypercube")
