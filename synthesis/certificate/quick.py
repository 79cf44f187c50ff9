"""The cells of a table on which a claim is proved at once, in float64 with bounds of all rounding; the others are left to balls.

The inequalities are affine in dP/dt and in P one sample later, and those in the rates (where P is affine in what moves): so
they hold for all rates if they hold at the vertices of the rates, which are proved side by side.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from estimators.arrays import BoolArray
from synthesis.certificate.inequalities import Question, inequalities
from synthesis.loop.on_boxes import HIGHEST, local
from synthesis.loop.system import System, Time
from synthesis.polynomials.boxes import BoxArithmetic, Boxes, positive
from synthesis.polynomials.enclosure import PolynomialMatrix

MOST_VERTICES = 8


def quickly_proved(
    loop: Any,
    question: Question,
    time: Time,
    P: PolynomialMatrix,
    speeds: Sequence[PolynomialMatrix | None],
    dual: bool,
    known: dict[str, System | None],
) -> BoolArray:
    """For every cell whether all inequalities are proved there; `known` keeps the loop's systems from claim to claim."""
    cells, axes = list(loop.cells()), loop.plant.axes
    nothing: BoolArray = np.zeros(len(cells), dtype=np.bool_)
    if not hasattr(loop, "on_boxes") or not 1 <= len(axes) <= max(HIGHEST):
        return nothing
    count = len(axes)
    own = PolynomialMatrix({k[:count]: m for k, m in P.terms.items()}, P.shape, count)
    if time == "discrete" and any(d > 1 for d in own.degrees):
        return nothing
    if time not in known:
        known[time] = loop.on_boxes(time)
    system = known[time]
    if system is None:
        return nothing
    slopes = [
        None if speed is None else (own.derivative(i), *_ends(speed, count + i)) for i, speed in enumerate(speeds)
    ]
    vertices = list(product(*[(0, 1) if s is not None and s[1] != s[2] else (0,) for s in slopes]))
    if len(vertices) > MOST_VERTICES:
        return nothing
    later = []
    for vertex in vertices:
        moved = own * 0 if time == "continuous" else own
        for slope, end in zip(slopes, vertex, strict=True):
            if slope is not None:
                moved = moved + slope[0] * (slope[1 + end] * (1 if time == "continuous" else loop.sample_time))
        later.append(local(-moved if dual else moved, cells))
    times = len(vertices)
    stacked = Boxes(
        np.concatenate([part.middle for part in later]), np.concatenate([part.radius for part in later]),
        count, HIGHEST[count],
    )  # fmt: skip
    acting = _tiled(replace(system, A=system.A.T) if dual else system, times, len(cells))
    with np.errstate(all="ignore"):  # what overflows is not finite, and not finite proves nothing
        named = inequalities(question, acting, local(own, cells).tiled(times), stacked, BoxArithmetic())
        good = np.ones(times * len(cells), dtype=np.bool_)
        for _, matrix in named:
            good &= positive(matrix)
    return np.asarray(good.reshape(times, len(cells)).all(axis=0))


def _ends(speed: PolynomialMatrix, rate: int) -> tuple[Any, Any]:
    """The speed at both ends of its rate."""
    constant = sum((m[0, 0] for k, m in speed.terms.items() if not any(k)), 0)
    slope = sum((m[0, 0] for k, m in speed.terms.items() if k[rate]), 0)
    return constant - slope, constant + slope


def _tiled(system: System, times: int, cells: int) -> System:
    def more(matrix: Any) -> Any:
        return matrix.tiled(times) if matrix is not None and len(matrix.middle) == cells > 1 else matrix

    return System(
        system.time,
        more(system.A),
        {name: more(matrix) for name, matrix in system.B.items()},
        system.C,
        {name: more(matrix) for name, matrix in system.D.items()},
        more(system.coasting),
        more(system.denominator),
    )
