r"""The gauge of a symmetric polytope: the least factor by which conv(+-v_k) must grow to hold a point.

gauge(x) = min |w|_1 with sum_k w_k v_k = x, a linear program for each point. In the plane a point lies in the cone of two
neighbouring corners; above, the simplex method runs on all points at once, each with its own basis of n signed vertices: any n
independent ones, with the signs of their weights, are a feasible start. Nothing is believed of the answer but the basis, from
which the caller computes exact weights.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr

from estimators.arrays import FloatArray, IndexArray

PIVOTS = 400  # of the simplex method; a point that needs more keeps the feasible weights it has
OPTIMAL = 1e-11  # excess of a vertex over the facet of a basis that counts as none
PIVOT = 1e-10  # smallest pivot, relative to the largest entry of its column


def gauge_and_support(vertices: FloatArray, points: FloatArray) -> tuple[FloatArray, IndexArray]:
    """Gauges (g,) of points (g, n), and n independent vertices (g, n) whose weights carry each; inf if the vertices do not
    span.
    """
    if vertices.shape[1] == 2:
        return _planar_gauge(vertices, points)
    size = vertices.shape[1]
    _, triangle, order = qr(vertices.T, mode="economic", pivoting=True)
    diagonal = np.abs(np.diagonal(triangle))
    if len(vertices) < size or diagonal[-1] <= 1e-13 * diagonal[0]:
        return np.full(len(points), np.inf), np.zeros((len(points), size), dtype=np.intp)
    basis = np.tile(order[:size].astype(np.intp), (len(points), 1))
    gauge = np.empty(len(points))
    _simplex(vertices, points, basis, gauge)
    return gauge, basis


def _simplex(vertices: FloatArray, points: FloatArray, basis: IndexArray, gauge: FloatArray) -> None:
    """Pivots until no vertex lies beyond the facet of any basis; `basis` (g, n) and `gauge` (g,) are written."""
    size = np.maximum(np.abs(points).max(axis=1), np.finfo(float).tiny)
    running, right = np.arange(len(points)), points / size[:, None]
    for pivot in range(PIVOTS):
        columns = np.swapaxes(vertices[basis[running]], -1, -2)
        try:
            inverse = np.linalg.inv(columns)
        except np.linalg.LinAlgError:  # vertices too close to tell apart: the weights of the last round stand
            return
        weights = (inverse @ right[running][..., None])[..., 0]
        signs = np.where(weights < 0.0, -1.0, 1.0)  # the signed vertex carries a weight that is not negative
        weights = np.abs(weights)
        gauge[running] = weights.sum(axis=1) * size[running]
        facet = (signs[:, None, :] @ inverse)[:, 0]  # y with y' v = sign on the basis
        beyond = facet @ vertices.T
        row = np.arange(len(running))
        # Dantzig's rule, and after many pivots Bland's: the first candidate, which cannot cycle.
        candidate = np.abs(beyond) > 1.0 + OPTIMAL
        enter = np.abs(beyond).argmax(axis=1) if pivot < PIVOTS // 2 else candidate.argmax(axis=1)
        open_ = candidate.any(axis=1)
        if not open_.any():
            return
        row, running, enter = row[open_], running[open_], enter[open_]
        direction = (inverse[row] @ vertices[enter][..., None])[..., 0]
        direction = direction * signs[row] * np.sign(beyond[row, enter])[:, None]
        usable = direction > PIVOT * np.abs(direction).max(axis=1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(usable, weights[row] / direction, np.inf)
        basis[running, step.argmin(axis=1)] = enter


def _planar_gauge(vertices: FloatArray, points: FloatArray) -> tuple[FloatArray, IndexArray]:
    """In the plane a point lies in the cone of two neighbouring corners of the polygon."""
    order = corner_index(vertices)
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


def corner_index(vertices: FloatArray) -> IndexArray:
    """Indices of the corners of conv(+-v), by a monotone chain on the doubled set."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        hull = ConvexHull(np.concatenate([vertices, -vertices])).vertices
    except QhullError:
        return np.arange(len(vertices))
    return np.unique(hull % len(vertices))
