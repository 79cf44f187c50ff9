r"""Upper bounds of the joint spectral radius from a polytope: A_i v_j in lambda conv(+-v_k) for all i, j gives rho <= lambda.

The polytope is the hull of the orbit of the leading eigenvector of a product that is thought to grow fastest (Guglielmi,
Protasov 2013). If that product attains the radius, modes scaled by anything smaller than 1/rho contract, so the orbit is
finite. How the vertices were found does not matter: `proved_polytope_bound` looks at them and the modes only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import fmpq, fmpq_mat

from analysis.exact import absolute, as_float_up, rationals
from analysis.switching.jsr_gauge import corner_index, gauge_and_support
from estimators.arrays import FloatArray

LARGE = 1e6  # vertices this far out in units of the start: the modes do not contract
SMALL = 1e-3  # size of the axis vectors that make the polytope solid


@dataclass(frozen=True)
class Growth:
    """`vertices` (k, n); `complete` if the images of all of them fell inside."""

    vertices: FloatArray
    complete: bool
    rounds: int


def grow_polytope(modes: FloatArray, start: FloatArray, most: int) -> Growth:
    """Hull of the orbit of `start` (s, n) under modes (m, n, n) that should contract; stops at `most` vertices."""
    size = modes.shape[-1]
    vertices = start / np.linalg.norm(start, axis=1, keepdims=True)
    if np.linalg.matrix_rank(vertices, tol=0.1 * SMALL) < size:
        vertices = np.concatenate([vertices, SMALL * np.eye(size)])
    fresh = vertices
    for number in range(1, 10_000):
        images = np.einsum("aij,vj->vai", modes, fresh).reshape(-1, size)
        gauge, _ = gauge_and_support(vertices, images)
        fresh = _outer(images[gauge > 1.0 + 1e-12])
        if not len(fresh):
            return Growth(vertices, True, number)
        if np.abs(fresh).max() > LARGE or len(vertices) + len(fresh) > most:
            return Growth(vertices, False, number)
        vertices = np.concatenate([vertices, fresh])
        if (
            size == 2
        ):  # vertices inside the hull of the others are idle; their images are covered by those of the others
            vertices = _corners(vertices)
    return Growth(vertices, False, number)


def proved_polytope_bound(modes: FloatArray, vertices: FloatArray) -> float:
    """max over modes and vertices of |w|_1 with A_i v_j = sum_k w_k v_k, in exact rational arithmetic, rounded up.

    Any weights that reproduce the image prove a bound; those of its facet prove the best. inf if the vertices do not span.
    """
    if np.linalg.matrix_rank(vertices) < modes.shape[-1]:
        return float("inf")
    images = np.einsum("aij,vj->avi", modes, vertices)
    _, support = gauge_and_support(vertices, images.reshape(-1, modes.shape[-1]))
    exact = rationals(vertices)
    rows = [[exact[k, i] for i in range(exact.ncols())] for k in range(exact.nrows())]
    worst = fmpq(0)
    exact_modes = [rationals(mode) for mode in modes]
    count, size = len(vertices), modes.shape[-1]
    for place, chosen in enumerate(support):
        mode, j = divmod(place, count)
        image = exact_modes[mode] * fmpq_mat(size, 1, rows[j])
        columns = fmpq_mat([rows[int(k)] for k in chosen]).transpose()
        try:
            weights = columns.solve(image)
        except ZeroDivisionError:
            return float("inf")
        worst = max(worst, sum((absolute(weights[i, 0]) for i in range(size)), fmpq(0)))
    return as_float_up(worst)


def _corners(vertices: FloatArray) -> FloatArray:
    return vertices[corner_index(vertices)]


def _outer(points: FloatArray) -> FloatArray:
    """One of each pair +-x and of repeated points."""
    if not len(points):
        return points
    sign = np.sign(points[np.arange(len(points)), np.abs(points).argmax(axis=1)])
    return np.asarray(np.unique(np.round(points * sign[:, None], 13), axis=0))
