r"""Upper bounds of the joint spectral radius from a polytope: A_i v_j in lambda conv(+-v_k) for all i, j gives rho <= lambda.

The polytope is the hull of the orbit of the leading eigenvector of a product that is thought to grow fastest (Guglielmi,
Protasov 2013). If that product attains the radius, modes scaled by anything smaller than 1/rho contract, so the orbit is
finite. How the vertices were found does not matter: `proved_polytope_bound` looks at them and the modes only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import fmpq, fmpq_mat
from scipy.linalg import qr
from scipy.optimize import linprog

from analysis.exact import absolute, as_float_up, rationals
from estimators.arrays import FloatArray, IndexArray

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


def gauge_and_support(vertices: FloatArray, points: FloatArray) -> tuple[FloatArray, IndexArray]:
    """min |w|_1 with sum_k w_k v_k = x for each point (g, n), and n independent vertices that carry it: (g,), (g, n)."""
    if vertices.shape[1] == 2:
        return _planar_gauge(vertices, points)
    gauge, support = np.empty(len(points)), np.empty((len(points), vertices.shape[1]), dtype=np.intp)
    both = np.concatenate([vertices, -vertices]).T
    for i, point in enumerate(points):
        scale = np.abs(point).max() or 1.0
        found = linprog(np.ones(both.shape[1]), A_eq=both, b_eq=point / scale, method="highs-ds")
        solved = found.status == 0
        weights = np.asarray(found.x, float) if solved else np.zeros(both.shape[1])
        gauge[i] = weights.sum() * scale if solved else np.inf
        support[i] = _basis(vertices, weights[: len(vertices)] + weights[len(vertices) :])
    return gauge, support


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


def _planar_gauge(vertices: FloatArray, points: FloatArray) -> tuple[FloatArray, IndexArray]:
    """In the plane a point lies in the cone of two neighbouring corners of the polygon."""
    order = _corner_index(vertices)
    ring = _upper(vertices[order])
    angle = np.arctan2(ring[:, 1], ring[:, 0])
    turn = np.argsort(angle, kind="stable")
    order, ring, angle = order[turn], ring[turn], angle[turn]
    seen = _upper(points)
    place = np.searchsorted(angle, np.arctan2(seen[:, 1], seen[:, 0]), side="right")
    after = place % len(order)
    before = (place - 1) % len(order)
    first = ring[before] * np.where(place == 0, -1.0, 1.0)[:, None]
    second = ring[after] * np.where(place == len(order), -1.0, 1.0)[:, None]
    det = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        one = (seen[:, 0] * second[:, 1] - seen[:, 1] * second[:, 0]) / det
        two = (first[:, 0] * seen[:, 1] - first[:, 1] * seen[:, 0]) / det
    return np.abs(one) + np.abs(two), np.stack([order[before], order[after]], axis=1)


def _upper(points: FloatArray) -> FloatArray:
    """x or -x in the half-plane of angles [0, pi)."""
    flip = (points[:, 1] < 0.0) | ((points[:, 1] == 0.0) & (points[:, 0] < 0.0))
    return np.where(flip[:, None], -points, points)


def _corner_index(vertices: FloatArray) -> IndexArray:
    """Indices of the corners of conv(+-v), by a monotone chain on the doubled set."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(np.concatenate([vertices, -vertices])).vertices
    except QhullError:
        return np.arange(len(vertices))
    return np.unique(hull % len(vertices))


def _corners(vertices: FloatArray) -> FloatArray:
    return vertices[_corner_index(vertices)]


def _outer(points: FloatArray) -> FloatArray:
    """One of each pair +-x and of repeated points."""
    if not len(points):
        return points
    sign = np.sign(points[np.arange(len(points)), np.abs(points).argmax(axis=1)])
    return np.asarray(np.unique(np.round(points * sign[:, None], 13), axis=0))


def _basis(vertices: FloatArray, weights: FloatArray) -> IndexArray:
    """n independent vertices, those with weight first."""
    size = vertices.shape[1]
    carrying = np.flatnonzero(np.abs(weights) > 1e-12)
    if len(carrying) == size:
        return carrying
    _, _, pivots = qr(
        (vertices * np.where(np.abs(weights) > 1e-12, 1e6, 1.0)[:, None]).T, mode="economic", pivoting=True
    )
    return np.asarray(pivots[:size])
