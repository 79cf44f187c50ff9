"""Tables of matrices on rectilinear grids: read, put in order, or refused where they are none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray, IndexArray
from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.param import SchedulingParameter

SAME = 1e-9  # of the span: coordinates that are closer are one


def grid_lines(
    points: Mapping[str, ArrayLike] | ArrayLike,
    parameters: Sequence[SchedulingParameter],
    where: str,
    jumps: bool = False,
) -> tuple[tuple[FloatArray, ...], IndexArray | None]:
    """The lines of the grid and, for points in any order, the place of each (g,) in the flattened grid.

    With `jumps` a value of a line may stand twice (`synthesis.models.table`).
    `points` maps each parameter to its line, or lists all points (g, p). Raises ModelError for lines that do not rise, points
    that are no full grid (naming one that is missing or twice), and a range that the grid does not cover.
    """
    order = None
    if isinstance(points, Mapping):
        names = [p.name for p in parameters]
        for name in points:
            if name not in names:
                raise ModelError(f"{where}: points: {unknown('parameter', name, names)}")
        missing = next((name for name in names if name not in points), None)
        if missing is not None:
            raise ModelError(f"{where}: points: the grid line of '{missing}' is missing; give its values")
        lines = tuple(_line(points[p.name], p, where, jumps) for p in parameters)
    else:
        lines, order = _from_list(_numbers(points, where), parameters, where)
    for p, line in zip(parameters, lines, strict=True):
        slack = SAME * (p.maximum - p.minimum)
        if line[0] > p.minimum + slack or line[-1] < p.maximum - slack:
            raise ModelError(
                f"{where}: the grid covers {p.name} from {line[0]:g} to {line[-1]:g} {p.unit}, its range is [{p.minimum:g}, "
                f"{p.maximum:g}] {p.unit}; nothing is extrapolated, so shrink the range or add points"
            )
    return lines, order


def table(values: Any, name: str, lines: Sequence[FloatArray], order: IndexArray | None, where: str) -> FloatArray:
    """A matrix on the grid, (g_1, .., g_p, rows, columns), from values in the order of the points."""
    found = _numbers(values, f"{where}: {name}")
    sizes = tuple(map(len, lines))
    leading = sizes if order is None else (int(np.prod(sizes)),)
    if found.ndim == 2:  # the same everywhere
        return np.broadcast_to(found, (*sizes, *found.shape)).copy()
    if found.ndim != len(leading) + 2 or found.shape[: len(leading)] != leading:
        words = f"{where}: {name} has the shape {found.shape}; a grid of {' x '.join(map(str, sizes))} points needs"
        raise ModelError(f"{words} {(*leading, 'rows', 'columns')}".replace("'", ""))
    if order is None:
        return found
    placed = np.empty_like(found)
    placed[order] = found
    return placed.reshape(*sizes, *found.shape[1:])


def _numbers(values: Any, where: str) -> FloatArray:
    try:
        found = np.asarray(values, float)
    except (TypeError, ValueError):
        raise ModelError(f"{where}: is not an array of numbers") from None
    if not np.isfinite(found).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(found))[0])
        raise ModelError(f"{where}: not finite at {list(place)}; give finite numbers")
    return found


def _line(values: ArrayLike, p: SchedulingParameter, where: str, jumps: bool = False) -> FloatArray:
    line = _numbers(values, f"{where}: grid line of {p.name}")
    if line.ndim != 1 or len(line) < 2:
        raise ModelError(f"{where}: the grid line of {p.name} needs at least two values in one row")
    steps = np.diff(line)
    bad = np.flatnonzero(steps < 0.0 if jumps else steps <= 0.0)
    if len(bad):
        k = int(bad[0])
        raise ModelError(
            f"{where}: the grid line of {p.name} does not rise: {line[k]:g}, then {line[k + 1]:g} {p.unit}; sort it"
        )
    return line


def _from_list(
    points: FloatArray, parameters: Sequence[SchedulingParameter], where: str
) -> tuple[tuple[FloatArray, ...], IndexArray]:
    points = points[:, None] if points.ndim == 1 and len(parameters) == 1 else points
    if points.ndim != 2 or points.shape[1] != len(parameters):
        raise ModelError(
            f"{where}: points of the shape {points.shape} do not fit {len(parameters)} parameters; give (points, parameters)"
        )
    lines, places = [], []
    for p, column in zip(parameters, points.T, strict=True):
        values = np.sort(column)
        line = values[np.concatenate([[True], np.diff(values) > SAME * max(np.ptp(values), 1e-300)])]
        lines.append(_line(line, p, where))
        places.append(np.argmin(np.abs(column[:, None] - line), axis=1))
    sizes = tuple(map(len, lines))
    order = np.ravel_multi_index(tuple(places), sizes)
    counts = np.bincount(order, minlength=int(np.prod(sizes)))
    for wrong, words in ((np.flatnonzero(counts > 1), "stands twice"), (np.flatnonzero(counts == 0), "is missing")):
        if len(wrong):
            place = np.unravel_index(int(wrong[0]), sizes)
            at = ", ".join(
                f"{p.name} = {line[k]:g} {p.unit}" for p, line, k in zip(parameters, lines, place, strict=True)
            )
            raise ModelError(
                f"{where}: the points are no grid of {' x '.join(map(str, sizes))}: {at} {words}; give every point once"
            )
    return tuple(lines), order
