"""Where the least eigenvalue of a matrix over a grid of places is locally least, and where it is so between the places."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from estimators.arrays import FloatArray, IndexArray

STARTS = 24  # local minima of a grid that are followed, the least ones
HALVINGS = 6  # of the spacing of the grid
MOVES = 16  # of all that are followed, at one step size
APART = 0.05  # what ends nearer to each other is one minimum

Least = Callable[[FloatArray], FloatArray]  # least eigenvalues (g,) at places (g, v)


def grid_minima(least: FloatArray, shape: tuple[int, ...], below: float = np.inf) -> IndexArray:
    """Indices into `least` (g,), values at the places of a grid, that no neighbour along an axis undercuts, least first.

    `shape` has one number for every axis, and the number of samples that stand at every place of it in the end. Those from
    which no descent leads `below` are left out: between the places values fall by no more than they differ by there.
    """
    values = least.reshape(shape)
    lowest, depth = np.ones(shape, bool), np.zeros(shape)
    for axis in range(len(shape) - 1):
        step = np.diff(values, axis=axis)
        edge = np.zeros_like(np.take(values, [0], axis))
        before, after = np.concatenate([edge, step], axis), np.concatenate([step, edge], axis)
        lowest &= (before <= 0.0) & (after >= 0.0)
        depth += np.maximum(-before, after)
    found = np.flatnonzero((lowest & (values - depth < below)).reshape(-1))
    return found[np.argsort(least[found], kind="stable")]


def followed(least: Least, starts: FloatArray, spacing: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Local minima (m, v) in [-1, 1]^v between the places of a grid, and their values (m,), least first.

    `spacing` (v,) of the grid; zero along variables that stay as they are. Every start (g, v) moves to the least of its
    neighbours at half the spacing, as long as there is one, then at a quarter, and so on (all starts at once).
    """
    if not len(starts):
        return starts, np.zeros(0)
    places, values = starts.copy(), least(starts)
    axes = np.flatnonzero(spacing)
    stencil = np.zeros((3 ** len(axes) - 1, starts.shape[1]))
    stencil[:, axes] = [moves for moves in product((-1.0, 0.0, 1.0), repeat=len(axes)) if any(moves)]
    for halving in range(1, HALVINGS + 1 if len(axes) else 1):
        moving = np.arange(len(places))
        for _ in range(MOVES):
            around = np.clip(places[moving, None] + stencil * spacing / 2.0**halving, -1.0, 1.0)
            found = least(around.reshape(-1, starts.shape[1])).reshape(len(moving), -1)
            best = found.argmin(axis=1)
            deeper = found[np.arange(len(moving)), best] < values[moving]
            moving, best, around, found = moving[deeper], best[deeper], around[deeper], found[deeper]
            if not len(moving):
                break
            rows = np.arange(len(moving))
            places[moving], values[moving] = around[rows, best], found[rows, best]
    return _different(places, values)


def _different(places: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of places near each other the least one."""
    chosen: list[int] = []
    for index in np.argsort(values, kind="stable"):
        if not chosen or np.abs(places[chosen] - places[index]).max(axis=1).min() > APART:
            chosen.append(int(index))
    return places[chosen], values[chosen]
