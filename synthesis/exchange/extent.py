"""How large a formula grows when definitions are inserted and products multiplied out: read before anything is."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from synthesis.errors import ModelError

MOST_OPERATIONS = 5000
MOST_DEGREE = 200  # in all names and numbers together; a model of an engineer stays below 20


@dataclass(frozen=True)
class Extent:
    """Bounds from above: operations with everything inserted, and the degree."""

    operations: int
    degree: int

    def __add__(self, other: Extent) -> Extent:
        return self._small(other, max(self.degree, other.degree))

    __sub__ = __add__

    def __mul__(self, other: Extent) -> Extent:
        return self._small(other, self.degree + other.degree)

    def __truediv__(self, other: Extent) -> Extent:
        return self * other

    def _small(self, other: Extent, degree: int) -> Extent:
        operations = self.operations + other.operations + 1
        if operations > MOST_OPERATIONS or degree > MOST_DEGREE:
            raise ModelError(
                f"grows beyond {MOST_OPERATIONS} operations or the degree {MOST_DEGREE} with definitions inserted; simplify it"
            )
        return Extent(operations, degree)


NAME = Extent(1, 1)


def number(value: Fraction) -> Extent:
    """Of a literal: powers of ten grow, powers of one do not."""
    return Extent(1, 0 if abs(value) in (0, 1) else 1)
