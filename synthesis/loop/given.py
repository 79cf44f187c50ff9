"""A linear parameter-varying system as it is given, without a law: the loop of an analysis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from flint import fmpq, fmpq_mat

from synthesis.errors import ProblemError
from synthesis.loop.plant import Plant
from synthesis.loop.system import Region, System, Time
from synthesis.polynomials.enclosure import PolynomialMatrix


@dataclass(frozen=True)
class GivenLoop:
    """x' or x+ = A x + [B E] w, z = C x + [D F] w over the plant's parameters; w are all inputs, then all disturbances.

    In discrete time a sample is the unit of time: the rate bounds of the plant are per sample.
    """

    plant: Plant
    time: Time = "continuous"
    _systems: dict[Any, System] = field(default_factory=dict, repr=False, compare=False)

    @property
    def states(self) -> int:
        """Number of states."""
        return self.plant.states

    @property
    def sample_time(self) -> fmpq | None:
        """One sample; None in continuous time."""
        return fmpq(1) if self.time == "discrete" else None

    @property
    def breakpoints(self) -> tuple[tuple[fmpq, ...], ...]:
        """The ends of the ranges."""
        return tuple((axis.low, axis.high) for axis in self.plant.axes)

    def cells(self) -> Iterator[Region]:
        """The whole range, one cell."""
        ones = (fmpq(1),) * len(self.plant.axes)
        yield Region.between(tuple(-x for x in ones), ones)

    def system(self, region: Region, time: Time) -> System | None:
        """The system on a region. Raises ProblemError for the other time."""
        if time != self.time:
            raise ProblemError(f"a {self.time}-time system makes no claims about {time} time")
        box = (region.offset[: region.parameters], region.factor[: region.parameters])
        if box not in self._systems:
            plant = {key: region.local(matrix) for key, matrix in self.plant.matrices.items()}
            below = None if self.plant.is_polynomial else region.local(self.plant.denominator)
            self._systems[box] = System(
                time,
                A=plant["A"],
                B={"disturbances": beside(plant["B"], plant["E"])},
                C=plant["C"],
                D={"disturbances": beside(plant["D"], plant["F"])},
                denominator=below,
                shared=below is not None,
            )
        return self._systems[box]


def beside(left: PolynomialMatrix, right: PolynomialMatrix) -> PolynomialMatrix:
    """[left right]."""
    (rows, first), (_, second) = left.shape, right.shape
    widen = (_picking(first, first + second, 0), _picking(second, first + second, first))
    return PolynomialMatrix(
        _joined({k: m * widen[0] for k, m in left.terms.items()}, {k: m * widen[1] for k, m in right.terms.items()}),
        (rows, first + second),
        left.variables,
    )


def _picking(rows: int, columns: int, start: int) -> fmpq_mat:
    return fmpq_mat(rows, columns, [fmpq(int(j == start + i)) for i in range(rows) for j in range(columns)])


def _joined(left: dict[Any, Any], right: dict[Any, Any]) -> dict[Any, Any]:
    return left | {key: left[key] + matrix if key in left else matrix for key, matrix in right.items()}
