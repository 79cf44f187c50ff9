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
from synthesis.polynomials.half_spaces import Faces


def faces_of(model: LpvModel) -> Faces | None:
    """The set of the parameters in scaled floats; None for a box."""
    return Faces.of(model.half_spaces) if model.half_spaces else None


def tabulated_places(model: LpvModel, lines: Sequence[FloatArray]) -> FloatArray:
    """Parameter values (g, p), one for every breakpoint in order, at which the gains are worked out."""
    points, faces = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines)), faces_of(model)
    if faces is None:
        return points
    middle, half, low, high = (
        np.array([getattr(p, key) for p in model.parameters]) for key in ("middle", "half_width", "minimum", "maximum")
    )
    far = ~_used(faces, [(line - m) / h for line, m, h in zip(lines, middle, half, strict=True)]).reshape(-1)
    drawn = middle + half * faces.drawn_in((points - middle) / half)
    return np.where(far[:, None], np.clip(drawn, low, high), points)


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
