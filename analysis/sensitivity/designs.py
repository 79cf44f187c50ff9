"""Designs: which points of a box are looked at, each of them by its index, so that any worker can make any part."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from analysis.errors import AnalysisError
from analysis.sensitivity.box import Box
from analysis.sensitivity.points import BITS, latin_points, sobol_points
from estimators.arrays import FloatArray, IndexArray
from estimators.errors import unknown

MOST_CORNERS = 20  # parameters


class Design(BaseModel):
    """Points of one kind. `random` ones fill the box evenly: quantiles are taken over them."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)
    kind: str
    random: ClassVar[bool] = False

    def count(self, box: Box) -> int:
        """How many points."""
        raise NotImplementedError

    def block(self, box: Box) -> int:
        """How many consecutive points belong together."""
        return 1

    def points(self, indices: IndexArray, box: Box) -> FloatArray:
        """The points (m, d) of these indices (m,)."""
        raise NotImplementedError

    def check(self, box: Box) -> None:
        """Raises AnalysisError if the design cannot be laid into this box."""

    def everywhere(self, box: Box) -> FloatArray:
        """All points (n, d). Raises AnalysisError as `check`."""
        self.check(box)
        return self.points(np.arange(self.count(box)), box)


class Nominal(Design):
    """The one point with every parameter at its nominal value."""

    kind: Literal["nominal"] = "nominal"

    def count(self, box: Box) -> int:
        """One."""
        return 1

    def points(self, indices: IndexArray, box: Box) -> FloatArray:
        """The nominal values."""
        return np.tile(box.nominal, (len(indices), 1))


class OneAtATimeDesign(Design):
    """Each parameter over `levels` values of its range, the others nominal (P3 Figs 3-5).

    >>> import numpy as np
    >>> box = Box.of(around({"mass": 10.0, "damping": 2.0}, 0.2))
    >>> OneAtATimeDesign(levels=3).points(np.arange(4), box).shape  # four designs of two parameters
    (4, 2)
    """

    kind: Literal["one at a time"] = "one at a time"
    levels: int = Field(default=2, ge=2)

    def count(self, box: Box) -> int:
        """levels d."""
        return self.levels * len(box.names)

    def points(self, indices: IndexArray, box: Box) -> FloatArray:
        """Parameter by parameter, each from the lower end up."""
        out = np.tile(box.nominal, (len(indices), 1))
        which, level = np.divmod(indices, self.levels)
        out[np.arange(len(indices)), which] = box.low[which] + level / (self.levels - 1) * (box.high - box.low)[which]
        return out


class FullGrid(Design):
    """Every combination of `levels` values of each parameter: one number, or one for each by name.

    >>> FullGrid(levels=3).count(Box.of(around({"mass": 10.0, "damping": 2.0}, 0.2)))
    9
    """

    kind: Literal["grid"] = "grid"
    levels: int | dict[str, int]

    def count(self, box: Box) -> int:
        """The product of all levels."""
        return int(np.prod([int(n) for n in self._levels(box)], dtype=object))

    def points(self, indices: IndexArray, box: Box) -> FloatArray:
        """The last parameter runs fastest."""
        out, rest = np.empty((len(indices), len(box.names))), indices
        for column, count in reversed(list(enumerate(self._levels(box)))):
            rest, level = np.divmod(rest, count)
            out[:, column] = box.low[column] + level / (count - 1) * (box.high[column] - box.low[column])
        return out

    def check(self, box: Box) -> None:
        """Every parameter needs two or more levels."""
        for name in self.levels if isinstance(self.levels, dict) else ():
            if name not in box.names:
                raise AnalysisError(f"levels: {unknown('parameter', name, box.names)}")
        if min(self._levels(box), default=2) < 2:
            raise AnalysisError("levels: a grid needs two or more levels of every parameter")

    def _levels(self, box: Box) -> list[int]:
        if isinstance(self.levels, int):
            return [self.levels] * len(box.names)
        missing = [name for name in box.names if name not in self.levels]
        if missing:
            raise AnalysisError(f"levels: none given for {', '.join(missing)}")
        return [self.levels[name] for name in box.names]


class Corners(Design):
    """All 2^d corners of the box.

    >>> import numpy as np
    >>> box = Box.of(around({"mass": 10.0, "damping": 2.0}, 0.2))
    >>> Corners().points(np.arange(4), box).shape  # four designs of two parameters
    (4, 2)
    """

    kind: Literal["corners"] = "corners"

    def count(self, box: Box) -> int:
        """2^d."""
        return int(1 << len(box.names))

    def points(self, indices: IndexArray, box: Box) -> FloatArray:
        """Bit k of the index says whether parameter k is at its upper end."""
        return np.where((indices[:, None] >> np.arange(len(box.names))) & 1 == 1, box.high, box.low)

    def check(self, box: Box) -> None:
        """At most 20 parameters."""
        if len(box.names) > MOST_CORNERS:
            raise AnalysisError(
                f"corners: {len(box.names)} parameters have more than 2^{MOST_CORNERS} corners; vary fewer"
            )


class _Samples(Design):
    samples: int = Field(ge=1)
    seed: int = Field(default=0, ge=0)
    random: ClassVar[bool] = True

    def count(self, box: Box) -> int:
        return self.samples


class LatinHypercube(_Samples):
    """`samples` points, one in each of as many slices of every parameter (McKay, Beckman, Conover 1979).

    >>> import numpy as np
    >>> box = Box.of(around({"mass": 10.0, "damping": 2.0}, 0.2))
    >>> LatinHypercube(samples=5).points(np.arange(4), box).shape  # four designs of two parameters
    (4, 2)
    """

    kind: Literal["latin hypercube"] = "latin hypercube"

    def points(self, indices: IndexArray, box: Box) -> FloatArray:
        """Without holding the permutations."""
        return box.scaled(latin_points(indices, len(box.names), self.samples, self.seed))


class Sobol(_Samples):
    """`samples` scrambled Sobol points (Owen 1998), a power of two, on which their balance rests.

    >>> import numpy as np
    >>> box = Box.of(around({"mass": 10.0, "damping": 2.0}, 0.2))
    >>> Sobol(samples=8).points(np.arange(4), box).shape  # four designs of two parameters
    (4, 2)
    """

    kind: Literal["sobol"] = "sobol"

    def points(self, indices: IndexArray, box: Box) -> FloatArray:
        """Those of `scipy.stats.qmc.Sobol`."""
        return box.scaled(sobol_points(indices, len(box.names), self.seed))

    def check(self, box: Box) -> None:
        """A power of two, at most 2^30."""
        require_power("samples", self.samples)


class Saltelli(Design):
    """`blocks` times d + 2 points A, B and A with one column of B, from Sobol points: gives Sobol indices as well.

    >>> Saltelli(blocks=8).count(Box.of(around({"mass": 10.0, "damping": 2.0}, 0.2)))  # 8 (2 + 2)
    32
    """

    kind: Literal["saltelli"] = "saltelli"
    blocks: int = Field(ge=2)
    seed: int = Field(default=0, ge=0)
    random: ClassVar[bool] = True

    def count(self, box: Box) -> int:
        """blocks (d + 2)."""
        return self.blocks * self.block(box)

    def block(self, box: Box) -> int:
        """d + 2."""
        return len(box.names) + 2

    def points(self, indices: IndexArray, box: Box) -> FloatArray:
        """Row 0 of a block is A, row 1 is B, row 2 + i is A with column i of B."""
        d = len(box.names)
        block, row = np.divmod(indices, d + 2)
        points = sobol_points(block, 2 * d, self.seed)
        from_b = (row[:, None] == 1) | (row[:, None] - 2 == np.arange(d))
        return box.scaled(np.where(from_b, points[:, d:], points[:, :d]))

    def check(self, box: Box) -> None:
        """A power of two, at most 2^30."""
        require_power("blocks", self.blocks)


def require_power(name: str, count: int) -> None:
    """Raises AnalysisError with the nearest powers of two unless `count` is one of those that a Sobol sequence has."""
    power = max(count.bit_length() - 1, 0)
    if 1 << power != count:
        raise AnalysisError(
            f"{name}: {count} samples: a Sobol design needs a power of two, {1 << power} or {1 << (power + 1)}"
        )
    if power > BITS:
        raise AnalysisError(f"{name} = {count} is above 2^{BITS}, where the generator ends; use a Latin hypercube")
