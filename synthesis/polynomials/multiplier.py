r"""Positive definite where g >= 0: the term that is taken off on boxes which the border g = 0 of a set cuts.

M - g N > 0 on a whole box, N >= 0, proves M > 0 on the part of it with g >= 0 (the S-procedure). N need not be the best: where M
falls across the border, it takes the fall away. With M = M0 + g G + .. near a place of the border, M0 = L L' and W = L^-1 G L^-T,
N = L W+ L', W+ the positive part of W. Then no piece of a cut box need be smaller than those of a box inside.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from flint import fmpq

from estimators.arrays import BoolArray, FloatArray
from synthesis.polynomials.boxes import EPS, INFLATE, Boxes, orders
from synthesis.polynomials.half_spaces import HalfSpaces
from synthesis.polynomials.rational import as_float

ABOVE = 2.0**-46  # of the terms of g: so much it is taken too large, which covers its rounding


def root(M0: FloatArray, G: FloatArray) -> FloatArray:
    """V (.., n, n) with N = V V'; zero where M0 is not positive definite (then nothing helps)."""
    values, vectors = np.linalg.eigh(M0)
    good = values[..., 0] > 1e-12 * values[..., -1]
    scale = np.sqrt(np.where(good[..., None], values, 1.0))
    W = np.swapaxes(vectors, -1, -2) @ G @ vectors / scale[..., :, None] / scale[..., None, :]
    rises, turned = np.linalg.eigh(np.where(good[..., None, None], W, 0.0))
    V = (vectors * scale[..., None, :]) @ (turned * np.sqrt(np.maximum(rises, 0.0))[..., None, :])
    return np.asarray(np.where(np.isfinite(V).all(axis=(-2, -1), keepdims=True), V, 0.0))


def borders(
    half_spaces: HalfSpaces, offsets: Sequence[Sequence[fmpq]], factors: Sequence[Sequence[fmpq]]
) -> tuple[BoolArray, FloatArray, FloatArray]:
    """For every box (g,): whether a border cuts it, and of the one that cuts most g = start - slopes't in local variables.

    `start` (g,) is rounded up: what is in the set, or beyond it within its slack, has g >= 0.
    """
    count = len(half_spaces[0].normal)
    u, f = (
        np.array([[as_float(x) for x in row[:count]] for row in rows]).reshape(-1, count) for rows in (offsets, factors)
    )
    normals = np.array([[as_float(a) for a in h.normal] for h in half_spaces])
    bounds = np.array([as_float(h.bound + h.slack) for h in half_spaces])
    start = bounds - u @ normals.T
    start = start + ABOVE * (np.abs(bounds) + np.abs(u) @ np.abs(normals).T + f @ np.abs(normals).T)
    slopes = normals * f[:, None]
    reach = np.abs(slopes).sum(axis=-1)
    depth = np.where(reach > 0.0, (reach - start) / np.where(reach > 0.0, reach, 1.0), -np.inf)
    which, rows = depth.argmax(axis=1), np.arange(len(u))
    return np.asarray(depth[rows, which] > 0.0), start[rows, which], slopes[rows, which]


def lessened(matrix: Boxes, start: FloatArray, slopes: FloatArray) -> Boxes:
    """M - g N on boxes (g,), N >= 0 chosen for each."""
    table = orders(matrix.variables, matrix.highest)
    powers = np.array(table.powers)
    unit = [int(np.flatnonzero((powers == row).all(axis=1))[0]) for row in np.eye(matrix.variables, dtype=int)]
    length = (slopes**2).sum(axis=1)
    place = np.clip(slopes * (start / length)[:, None], -1.0, 1.0)
    monomials = (place[:, None] ** powers).prod(axis=-1)
    M0 = np.einsum("gk,gkij->gij", monomials, matrix.middle)
    G = -np.einsum("gv,gvij->gij", slopes / length[:, None], matrix.middle[:, unit])
    V = root(0.5 * (M0 + np.swapaxes(M0, 1, 2)), 0.5 * (G + np.swapaxes(G, 1, 2)))
    N, size = V @ np.swapaxes(V, 1, 2), np.abs(V) @ np.swapaxes(np.abs(V), 1, 2)
    middle = np.zeros_like(matrix.middle)
    middle[:, 0] = start[:, None, None] * N
    for axis, index in enumerate(unit):
        middle[:, index] = -slopes[:, axis, None, None] * N
    most = (np.abs(start) + np.abs(slopes).sum(axis=1))[:, None, None]
    taken = Boxes(middle, INFLATE * EPS * (len(V[0]) + 4) * most * size, matrix.variables, matrix.highest)
    return matrix - taken
