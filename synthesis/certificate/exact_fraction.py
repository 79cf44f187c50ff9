"""Formulas in exact numbers: quotients of polynomials in the scaled parameters that refuse to grow without bound."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from estimators.schedule.check import HIGHEST_ORDER
from synthesis.errors import ModelError

MOST_TERMS, MOST_BITS, MOST_DEGREE = 2000, 20_000, 2 * HIGHEST_ORDER  # of what a formula multiplies out to on its way
MOST_WORK = 400_000  # products of terms, those of many digits counted by their length, in all formulas together
MOST_REDUCED, REDUCED_BITS = (
    100,
    2000,
)  # terms and digits of what is divided by its common factor, in several parameters


@dataclass
class Work:
    """What is left to be worked out for one file."""

    left: int

    def spend(self, amount: int) -> None:
        """Refuse what would take too long."""
        self.left -= amount
        if self.left < 0:
            raise ModelError("the formulas up to here multiply out to too much work")


@dataclass(frozen=True)
class ExactFraction:
    """`above` / `below` with rational coefficients; `below` None is one. Common factors stay until `reduced`."""

    above: Any  # fmpq_mpoly
    work: Work
    below: Any = None

    def __add__(self, other: ExactFraction) -> ExactFraction:
        if self._alike(other):
            return self._small(self.above + other.above, self.below)
        left, right = self._grown(self.above, other.below), self._grown(other.above, self.below)
        return self._small(left + right, self._grown(self.below, other.below))

    def __sub__(self, other: ExactFraction) -> ExactFraction:
        return self + ExactFraction(-other.above, other.work, other.below)

    def __mul__(self, other: ExactFraction) -> ExactFraction:
        return self._small(self._grown(self.above, other.above), self._grown(self.below, other.below))

    def __truediv__(self, other: ExactFraction) -> ExactFraction:
        if not len(other.above):
            raise ZeroDivisionError
        above = self._grown(self.above, other.below)
        if other.above.is_constant():
            return self._small(above * (1 / other.above.leading_coefficient()), self.below)
        return self._small(above, self._grown(self.below, other.above))

    @property
    def reduced(self) -> ExactFraction:
        """Without the common factor of numerator and denominator; `below` None if nothing of it is left."""
        if self.below is None:
            return self
        factor = self.common(self.above, self.below)
        return self._small(self.above / factor, self.below / factor)

    def common(self, first: Any, second: Any) -> Any:
        """The greatest common divisor of two polynomials."""
        size, bits = len(first) * len(second), max(_bits(first), _bits(second))
        if len(first.context().gens()) == 1:
            self.work.spend(4 * size * (1 + bits // 1000))
        else:
            if max(len(first), len(second)) > MOST_REDUCED or bits > REDUCED_BITS:
                raise ModelError("the formula divides by a polynomial of too many terms or digits")
            self.work.spend(4 * size * (1 + bits // 100))
        return first.gcd(second)

    def _alike(self, other: ExactFraction) -> bool:
        if self.below is None or other.below is None:
            return self.below is other.below
        return bool(self.below == other.below)

    def _grown(self, first: Any, second: Any) -> Any:
        """The product; None stands for one."""
        if first is None or second is None:
            return second if first is None else first
        products = len(first) * len(second)
        self.work.spend(products)
        found = first * second
        self.work.spend(products * (_bits(found) // 1000))
        return found

    def _small(self, above: Any, below: Any) -> ExactFraction:
        if below is not None and below.is_constant():
            above, below = above * (1 / below.leading_coefficient()), None
        for value in (above,) if below is None else (above, below):
            self.work.spend(1 + len(value))
            if len(value) > MOST_TERMS or _bits(value) > MOST_BITS or max(value.degrees(), default=0) > MOST_DEGREE:
                raise ModelError("the formula multiplies out to too many terms or digits")
        return ExactFraction(above, self.work, below)


def common_denominator(fractions: list[ExactFraction]) -> Any:
    """The least common multiple of the denominators of reduced fractions, one in the middle of the range; None if it is one.

    None of them vanishes there. Raises ModelError where it grows without bound.
    """
    found: Any = None
    for fraction in fractions:
        if fraction.below is None or (found is not None and fraction.below == found):
            continue
        if found is None:
            found = fraction.below
            continue
        rest = fraction.below / fraction.common(found, fraction.below)
        found = ExactFraction(found, fraction.work)._small(fraction._grown(found, rest), None).above
    if found is None:
        return None
    return found * (1 / found.to_dict()[(0,) * len(found.context().gens())])


def numerator(fraction: ExactFraction, common: Any) -> Any:
    """What stands above a common denominator."""
    if common is None:
        return fraction.above
    factor = common if fraction.below is None else common / fraction.below
    return fraction._small(fraction._grown(fraction.above, factor), None).above


def _bits(value: Any) -> int:
    return max((c.numer().bit_length() + c.denom().bit_length() for c in value.coeffs()), default=0)
