"""A closed loop on one region of its parameters, as a linear system whose matrices are polynomials there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from flint import fmpq

from synthesis.polynomials.enclosure import PolynomialMatrix

Time = Literal["continuous", "discrete"]


@dataclass(frozen=True)
class System:
    """x' (continuous) or x+ (discrete) = (A x + sum of B_k w_k) / denominator,  z = C x + sum of D_k w_k.

    `B` and `D` hold one matrix for every group k of inputs ("disturbances", "motion"); `coasting` is A while no measurement
    comes in, None for a law that does not know of it. `denominator` is None where it is one; with `shared` z is over it, too.
    """

    time: Time
    A: Any
    B: Mapping[str, Any]
    C: Any
    D: Mapping[str, Any]
    coasting: Any = None
    denominator: Any = None
    shared: bool = False


@dataclass(frozen=True)
class Region:
    """A box of the variables (u_1..u_p, r_1..r_p), all in [-1, 1] at most: variable = offset + factor t, t in [-1, 1].

    u are the scaled parameters; r says where between its bounds a rate lies.
    """

    offset: tuple[fmpq, ...]
    factor: tuple[fmpq, ...]

    @classmethod
    def between(cls, low: tuple[fmpq, ...], high: tuple[fmpq, ...]) -> Region:
        """The cell of a table between two scaled corners, all rates."""
        zeros, ones = (fmpq(0),) * len(low), (fmpq(1),) * len(low)
        offset = tuple((a + b) / 2 for a, b in zip(low, high, strict=True))
        factor = tuple((b - a) / 2 for a, b in zip(low, high, strict=True))
        return cls((*offset, *zeros), (*factor, *ones))

    @property
    def parameters(self) -> int:
        """Number of scheduling parameters."""
        return len(self.offset) // 2

    def local(self, matrix: PolynomialMatrix) -> PolynomialMatrix:
        """A polynomial in u in the local variables (t, r), with balls."""
        count = self.parameters
        return matrix.affine(self.offset[:count], self.factor[:count]).balls().in_variables(2 * count)

    def halves(self, axis: int) -> tuple[Region, Region]:
        """Cut in the middle of one variable."""
        factor = (*self.factor[:axis], self.factor[axis] / 2, *self.factor[axis + 1 :])
        moved = [
            (*self.offset[:axis], self.offset[axis] + sign * factor[axis], *self.offset[axis + 1 :]) for sign in (-1, 1)
        ]
        return Region(moved[0], factor), Region(moved[1], factor)

    def point(self, local: tuple[int, ...]) -> tuple[fmpq, ...]:
        """(u, r) of a point in local coordinates."""
        return tuple(o + f * t for o, f, t in zip(self.offset, self.factor, local, strict=True))
