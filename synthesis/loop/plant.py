"""The plant of a loop in exact numbers: scheduling parameters as axes, matrices as polynomials in u in [-1, 1]^p."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from flint import fmpq

from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.half_spaces import HalfSpaces, Point, centre_of, corners_of


@dataclass(frozen=True)
class Axis:
    """One scheduling parameter: p = middle + half u. A rate of None has no bound: the parameter may jump."""

    name: str
    unit: str
    low: fmpq
    high: fmpq
    rate_low: fmpq | None
    rate_high: fmpq | None

    @property
    def middle(self) -> fmpq:
        """Middle of the range."""
        return (self.low + self.high) / 2

    @property
    def half(self) -> fmpq:
        """Half the width of the range."""
        return (self.high - self.low) / 2

    @property
    def may_jump(self) -> bool:
        """Whether a rate has no bound."""
        return self.rate_low is None or self.rate_high is None

    def scaled(self, value: fmpq) -> fmpq:
        """u of a parameter value."""
        return (value - self.middle) / self.half


@dataclass(frozen=True)
class Plant:
    """x' = A x + B u + E d, y = C x + D u + F d; `matrices` by their letters, over one `denominator` (positive).

    The parameters stay in the ranges of the axes and in all `half_spaces`, inequalities between the scaled u.
    """

    axes: tuple[Axis, ...]
    matrices: Mapping[str, PolynomialMatrix]
    denominator: PolynomialMatrix
    half_spaces: HalfSpaces = ()

    def admits(self, point: Sequence[fmpq]) -> bool:
        """Whether scaled parameters (in their ranges) are in the set; further coordinates are not looked at."""
        return all(half_space.holds(point) for half_space in self.half_spaces)

    def misses(self, offset: Sequence[fmpq], factor: Sequence[fmpq]) -> bool:
        """Whether a box of them lies wholly outside one inequality."""
        return any(half_space.misses(offset, factor) for half_space in self.half_spaces)

    def place_in(self, offset: Sequence[fmpq], factor: Sequence[fmpq]) -> Point | None:
        """The mean of the corners of that part of a box which is in the set; None if there is none."""
        count = len(self.axes)
        if not self.half_spaces:
            return tuple(offset[:count])
        box = tuple(offset[:count]), tuple(factor[:count])
        corners = corners_of(*box, self.half_spaces) or corners_of(*box, tuple(h.widened for h in self.half_spaces))
        return centre_of(corners) if corners else None

    @property
    def states(self) -> int:
        """Number of states."""
        return self.matrices["A"].shape[0]

    @property
    def dual(self) -> Plant:
        """A' and C = B': what no input moves here does not show in the output there."""
        return replace(self, matrices={"A": self.matrices["A"].T, "C": self.matrices["B"].T})

    @property
    def is_polynomial(self) -> bool:
        """Whether the denominator is one."""
        return not any(self.denominator.degrees)
