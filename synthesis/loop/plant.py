"""The plant of a loop in exact numbers: scheduling parameters as axes, matrices as polynomials in u in [-1, 1]^p."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import NoReturn

from flint import fmpq, fmpq_mat

from synthesis.errors import ProblemError
from synthesis.polynomials.enclosure import PolynomialMatrix, constant
from synthesis.polynomials.half_spaces import HalfSpaces, Point, centre_of, corners_of
from synthesis.polynomials.multilinear import boxes


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

    The parameters stay in the ranges of the axes and in all `half_spaces`, inequalities between the scaled u. A plant by cells
    (`by_cells`) has `lines`, the borders of its cells in every parameter, its ends among them, and a plant in `pieces` for each.
    """

    axes: tuple[Axis, ...]
    matrices: Mapping[str, PolynomialMatrix]
    denominator: PolynomialMatrix
    half_spaces: HalfSpaces = ()
    lines: tuple[tuple[fmpq, ...], ...] = ()
    pieces: tuple[Plant, ...] = ()

    @cached_property
    def cells(self) -> list[tuple[Point, Point, Plant]]:
        """Middle, half width (both in u) and plant of every cell: of one polynomial the whole range."""
        count = len(self.axes)
        if not self.pieces:
            return [((fmpq(0),) * count, (fmpq(1),) * count, self)]
        lines = [[axis.scaled(x) for x in line] for axis, line in zip(self.axes, self.lines, strict=True)]
        return [(*box, piece) for box, piece in zip(boxes(lines), self.pieces, strict=True)]

    def number(self, point: Sequence[fmpq]) -> int:
        """Which of the cells holds a point in u: on a border the one below it."""
        if not self.pieces:
            return 0
        found = 0
        for axis, line, u in zip(self.axes, self.lines, point, strict=False):
            value = axis.middle + axis.half * u
            found = found * (len(line) - 1) + next(k for k in range(len(line) - 1) if value <= line[k + 1])
        return found

    @cached_property
    def is_continuous(self) -> bool:
        """Whether neighbouring cells agree on their border."""
        if not self.pieces:
            return True
        counts, count = [len(line) - 1 for line in self.lines], len(self.axes)
        for number, (offset, factor, here) in enumerate(self.cells):
            for i in range(count):
                step = prod(counts[i + 1 :])
                if number // step % counts[i] == counts[i] - 1:
                    continue
                there, border = self.pieces[number + step], [fmpq(0)] * count
                border[i] = offset[i] + factor[i]
                free = [fmpq(int(k != i)) for k in range(count)]
                for key, matrix in here.matrices.items():
                    gap = (matrix - there.matrices[key]).affine(border, free)
                    if any(x != 0 for m in gap.terms.values() for x in m.entries()):
                        return False
        return True

    def shape(self, letter: str) -> tuple[int, int]:
        """Rows and columns of one of the matrices."""
        return self.cells[0][2].matrices[letter].shape

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
        return self.shape("A")[0]

    @property
    def dual(self) -> Plant:
        """A' and C = B': what no input moves here does not show in the output there."""
        pieces = tuple(piece.dual for piece in self.pieces)
        matrices = self.matrices if pieces else {"A": self.matrices["A"].T, "C": self.matrices["B"].T}
        return replace(self, matrices=matrices, pieces=pieces)

    @property
    def is_polynomial(self) -> bool:
        """Whether the denominator is one."""
        return not any(self.denominator.degrees)


class ByCells(Mapping[str, PolynomialMatrix]):
    """Stands for the matrices of a plant by cells, which are others on every cell: whoever reads it is refused."""

    def __getitem__(self, key: str) -> NoReturn:
        raise ProblemError(
            "this takes one polynomial plant for the whole range; a plant by cells (tables) is not supported here"
        )

    def __iter__(self) -> Iterator[str]:
        return self[""]

    def __len__(self) -> int:
        return self[""]


def by_cells(
    axes: tuple[Axis, ...],
    lines: tuple[tuple[fmpq, ...], ...],
    matrices: Sequence[Mapping[str, PolynomialMatrix]],
    half_spaces: HalfSpaces = (),
) -> Plant:
    """A plant that is a polynomial on each cell of a grid, the last parameter's cells running fastest."""
    one = constant(fmpq_mat([[1]]), len(axes))
    pieces = tuple(Plant(axes, found, one) for found in matrices)
    if len(pieces) == 1:
        return replace(pieces[0], half_spaces=half_spaces)
    return Plant(axes, ByCells(), one, half_spaces, lines, pieces)
