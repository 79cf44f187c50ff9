"""The cells of a table on which a claim is proved at once, in float64 with bounds of all rounding; the others are left to balls.

The inequalities are affine in dP/dt and in P one sample later, and those in the rates (where P is affine in what moves): so
they hold for all rates if they hold at the vertices of the rates, which are proved side by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np
from flint import fmpq

from estimators.arrays import BoolArray
from synthesis.certificate.inequalities import Question, inequalities
from synthesis.loop.on_boxes import HIGHEST, local
from synthesis.loop.system import Region, System, Time
from synthesis.polynomials.box_sign import positive
from synthesis.polynomials.boxes import BoxArithmetic, Boxes
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.multiplier import borders, lessened

MOST_VERTICES = 8
DEPTH, MOST_PIECES = 3, 300  # halvings along every parameter, and pieces that are tried at once
CUT_DEPTH, MOST_CUT = 5, {2: 1200, 3: 200}  # where the set of the parameters is no box: pieces outside are left out


def quickly_proved(
    loop: Any,
    question: Question,
    time: Time,
    P: PolynomialMatrix,
    speeds: Sequence[PolynomialMatrix | None],
    dual: bool,
    known: dict[str, System | None],
) -> tuple[BoolArray, dict[int, list[Region]]]:
    """For every cell whether all inequalities are proved there, cut in pieces where that helps.

    With it, where the set of the parameters is no box, the pieces that are left of a cell by its number. `known` keeps the
    loop's systems from claim to claim.
    """
    cells, axes = list(loop.cells()), loop.plant.axes
    nothing: BoolArray = np.zeros(len(cells), dtype=np.bool_)
    if not hasattr(loop, "on_boxes") or not 1 <= len(axes) <= max(HIGHEST):
        return nothing, {}
    count = len(axes)
    own = PolynomialMatrix({k[:count]: m for k, m in P.terms.items()}, P.shape, count)
    if time == "discrete" and any(d > 1 for d in own.degrees):
        return nothing, {}
    if any(speed is not None and any(speed.degrees[:count]) for speed in speeds):
        return nothing, {}  # a parameter that jumps to a place of its own: not the same motion everywhere
    if time not in known:
        known[time] = loop.on_boxes(time, cells)
    system = known[time]
    if system is None:
        return nothing, {}
    form = _Form(loop, question, time, own, speeds, dual)
    proved = form.holds(system, cells)
    parents, pieces = np.flatnonzero(~proved), [cell for cell, good in zip(cells, proved, strict=True) if not good]
    good = proved.copy()
    good[parents] = True  # until one of its pieces fails
    plant = loop.plant
    halvings, most = (CUT_DEPTH, MOST_CUT[count]) if plant.half_spaces else (DEPTH, MOST_PIECES)
    helped = False
    for depth in range(halvings * count):
        if not 0 < len(pieces) <= most:
            break
        halves = [cell.halves(depth % count) for cell in pieces]
        pieces, parents = [half for pair in halves for half in pair], np.repeat(parents, 2)
        kept = np.array([not plant.misses(half.offset, half.factor) for half in pieces])
        pieces, parents = [half for half, keep in zip(pieces, kept, strict=True) if keep], parents[kept]
        if not pieces:
            break
        smaller = loop.on_boxes(time, pieces)
        done = np.zeros(len(pieces), dtype=np.bool_) if smaller is None else form.holds(smaller, pieces)
        helped |= bool(done.any())
        if depth >= count and not (helped if plant.half_spaces else done.any()):
            break
        pieces, parents = [half for half, ok in zip(pieces, done, strict=True) if not ok], parents[~done]
    good[parents] = False
    left: dict[int, list[Region]] = {}
    for parent, piece in zip(parents if plant.half_spaces and helped else (), pieces, strict=False):
        left.setdefault(int(parent), []).append(piece)
    return good, left


@dataclass(frozen=True)
class _Form:
    """A claim in the shape that is proved on boxes."""

    loop: Any
    question: Question
    time: Time
    own: PolynomialMatrix
    speeds: Sequence[PolynomialMatrix | None]
    dual: bool

    def holds(self, system: System, cells: Sequence[Region]) -> BoolArray:
        """On which regions all inequalities certainly hold."""
        count = self.own.variables
        nothing: BoolArray = np.zeros(len(cells), dtype=np.bool_)
        ends = [None if speed is None else _ends(speed, count + i) for i, speed in enumerate(self.speeds)]
        vertices = list(product(*[pair if pair is not None and pair[0] != pair[1] else (pair,) for pair in ends]))
        if len(vertices) > MOST_VERTICES:
            return nothing
        later = []
        for vertex in vertices:
            speeds = [fmpq(0) if v is None else v[0] if isinstance(v, tuple) else v for v in vertex]
            later.append(local(self._later(speeds), cells))
        times = len(vertices)
        stacked = Boxes(
            np.concatenate([part.middle for part in later]), np.concatenate([part.radius for part in later]),
            count, HIGHEST[count],
        )  # fmt: skip
        acting = _tiled(replace(system, A=system.A.T) if self.dual else system, times, len(cells))
        with np.errstate(all="ignore"):  # what overflows is not finite, and not finite proves nothing
            named = inequalities(self.question, acting, local(self.own, cells).tiled(times), stacked, BoxArithmetic())
            good = np.ones(times * len(cells), dtype=np.bool_)
            for _, matrix in named:
                good &= self._positive(matrix, cells, times)
        return np.asarray(good.reshape(times, len(cells)).all(axis=0))

    def _positive(self, matrix: Boxes, cells: Sequence[Region], times: int) -> BoolArray:
        """Also where only the part of a cell in the set of the parameters is certain to be so."""
        good, half_spaces = positive(matrix), self.loop.plant.half_spaces
        if not half_spaces or good.all() or len(matrix.middle) != times * len(cells):
            return good
        cut, start, slopes = borders(half_spaces, [c.offset for c in cells], [c.factor for c in cells])
        left = np.flatnonzero(~good & np.tile(cut, times))
        if len(left):
            part = replace(matrix, middle=matrix.middle[left], radius=matrix.radius[left])
            good[left] = positive(lessened(part, np.tile(start, times)[left], np.tile(slopes, (times, 1))[left]))
        return good

    def _later(self, speeds: Sequence[Any]) -> PolynomialMatrix:
        """dP/dt, or P one sample later, at these speeds du/dt: exact, products of motions included."""
        if self.time == "continuous":
            moved = self.own * 0
            for i, speed in enumerate(speeds):
                moved = moved + self.own.derivative(i) * speed
        else:
            moved = self.own.affine([speed * self.loop.sample_time for speed in speeds], [fmpq(1)] * len(speeds))
        return -moved if self.dual else moved


def _ends(speed: PolynomialMatrix, rate: int) -> tuple[fmpq, fmpq]:
    """The speed at both ends of its rate."""
    constant = sum((m[0, 0] for k, m in speed.terms.items() if not any(k)), fmpq(0))
    slope = sum((m[0, 0] for k, m in speed.terms.items() if k[rate]), fmpq(0))
    return constant - slope, constant + slope


def _tiled(system: System, times: int, cells: int) -> System:
    def more(matrix: Any) -> Any:
        return matrix.tiled(times) if matrix is not None and len(matrix.middle) == cells > 1 else matrix

    return System(
        system.time,
        more(system.A),
        {name: more(matrix) for name, matrix in system.B.items()},
        more(system.C),
        {name: more(matrix) for name, matrix in system.D.items()},
        more(system.coasting),
        more(system.denominator),
        system.shared,
    )
