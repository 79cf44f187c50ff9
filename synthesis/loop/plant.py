"""The plant of a loop in exact numbers: scheduling parameters as axes, matrices as polynomials in u in [-1, 1]^p."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from flint import fmpq

from synthesis.polynomials.enclosure import PolynomialMatrix


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
    """x' = A x + B u + E d, y = C x + D u + F d; `matrices` by their letters, over one `denominator` (positive)."""

    axes: tuple[Axis, ...]
    matrices: Mapping[str, PolynomialMatrix]
    denominator: PolynomialMatrix

    @property
    def states(self) -> int:
        """Number of states."""
        return self.matrices["A"].shape[0]

    @property
    def dual(self) -> Plant:
        """A' and C = B': what no input moves here does not show in the output there."""
        return Plant(self.axes, {"A": self.matrices["A"].T, "C": self.matrices["B"].T}, self.denominator)

    @property
    def is_polynomial(self) -> bool:
        """Whether the denominator is one."""
        return not any(self.denominator.degrees)
