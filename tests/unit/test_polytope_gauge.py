"""The gauge of a polytope for many points at once, against one linear program for each."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from analysis import joint_spectral_radius
from analysis.switching.jsr_gauge import gauge_and_support
from analysis.switching.jsr_polytope import proved_polytope_bound


def by_program(vertices: np.ndarray, point: np.ndarray) -> float:
    both = np.concatenate([vertices, -vertices]).T
    return float(linprog(np.ones(both.shape[1]), A_eq=both, b_eq=point, method="highs").fun)


@pytest.mark.parametrize("size", [2, 3, 5])
def test_gauges_are_those_of_a_linear_program(size: int) -> None:
    draw = np.random.default_rng(size)
    vertices, points = draw.normal(size=(40, size)), draw.normal(size=(25, size)) * draw.uniform(1e-3, 1e3, (25, 1))
    gauge, support = gauge_and_support(vertices, points)
    np.testing.assert_allclose(gauge, [by_program(vertices, point) for point in points], rtol=1e-9)
    for point, value, chosen in zip(points, gauge, support, strict=True):
        weights = np.linalg.solve(vertices[chosen].T, point)  # the vertices named carry the point at that price
        assert np.abs(weights).sum() == pytest.approx(value, rel=1e-9)


def test_corners_and_repeated_vertices() -> None:
    """In the cube's dual |x|_1 is the gauge; a vertex that stands there twice, or inside, changes nothing."""
    draw = np.random.default_rng(0)
    points = np.concatenate([draw.normal(size=(10, 4)), np.eye(4), np.zeros((1, 4))])
    for vertices in (np.eye(4), np.concatenate([np.eye(4), -np.eye(4), np.eye(4), 0.1 * draw.normal(size=(5, 4))])):
        gauge, _ = gauge_and_support(vertices, points)
        np.testing.assert_allclose(gauge, np.abs(points).sum(axis=1), atol=1e-12)
    flat = np.concatenate([np.eye(3)[:2], [[1.0, 1.0, 0.0]]])
    assert np.isinf(gauge_and_support(flat, points[:, :3])[0]).all()


def test_a_bound_from_a_polytope_is_never_below_the_radius() -> None:
    """Rotations by 120 degrees about two axes keep no norm but the Euclidean one: each has radius 1, so no bound is below."""
    turn = np.roll(np.eye(3), 1, axis=0)
    other = np.diag([1.0, -1.0, -1.0])
    assert proved_polytope_bound(np.stack([turn, other]), np.eye(3)) == 1.0
    vertices = np.random.default_rng(1).normal(size=(30, 3))
    assert proved_polytope_bound(np.stack([turn, other]), vertices) > 1.0
    assert proved_polytope_bound(np.stack([turn, other]), np.eye(3)[:2]) == np.inf


def test_five_states_and_four_modes_close() -> None:
    family = np.random.default_rng(7).normal(size=(4, 5, 5))
    found = joint_spectral_radius(family)
    assert found.closed and found.proof == "polytope" and found.product == (1, 3)
    rate = np.abs(np.linalg.eigvals(family[1] @ family[3])).max() ** 0.5
    assert rate * (1.0 - 1e-12) <= found.upper <= rate * (1.0 + 1.1e-4)
    assert found.vertices is not None
    gauge, _ = gauge_and_support(found.vertices, np.einsum("aij,vj->avi", family, found.vertices).reshape(-1, 5))
    assert gauge.max() == pytest.approx(found.upper, rel=1e-9)
