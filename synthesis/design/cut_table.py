"""Tables over a set of parameters that is no box: what stands at breakpoints outside the set.

The gain of a cell that the border cuts is interpolated from all its corners; those outside get the gains of the design there,
beyond the set that they were designed for, so that the gains inside stay what they are. Breakpoints of no such cell are used by
no claim; they get gains of the border, so that a runtime that goes on outside finds some that are finite and near.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.half_spaces import Faces, faces_of

NEAR = 0.1  # of a segment


def tabulated_places(model: LpvModel, lines: Sequence[FloatArray]) -> FloatArray:
    """Parameter values (g, p), one for every breakpoint in order, at which the gains are worked out."""
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    faces = faces_of(model.half_spaces)
    if faces is None:
        return points
    u = model.scaled(points)
    used = _used(faces, [np.unique(column) for column in u.T]).reshape(-1)
    return np.where(used[:, None], points, model.physical(faces.drawn_in(u)))


def with_borders(line: FloatArray, borders: Sequence[float]) -> FloatArray:
    """Breakpoints, and those of the plant's cells, where gains bend; of an equidistant one that is very near it stays alone."""
    inner = np.array(borders[1:-1])
    if not len(inner):
        return line
    near = np.abs(line[:, None] - inner).min(axis=1) < NEAR * (line[1] - line[0])
    near[[0, -1]] = False
    return np.union1d(line[~near], inner)


def _used(faces: Faces, lines: Sequence[FloatArray]) -> BoolArray:
    """Which breakpoints are corners of a cell that meets the set."""
    low, high = (
        np.stack(np.meshgrid(*(line[part] for line in lines), indexing="ij"), axis=-1)
        for part in (slice(None, -1), slice(1, None))
    )
    shape, count = low.shape[:-1], len(lines)
    met = ~faces.misses(0.5 * (low + high).reshape(-1, count), 0.5 * (high - low).reshape(-1, count)).reshape(shape)
    used: BoolArray = np.zeros([len(line) for line in lines], dtype=np.bool_)
    for corner in product((0, 1), repeat=count):
        used[tuple(slice(c, c + n) for c, n in zip(corner, shape, strict=True))] |= met
    return used
