"""Conic data: every row is checked against the matrices it stands for, at random decisions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from estimators.arrays import FloatArray
from synthesis.lmi.conic import assemble, gram_matrices, structural_zeros, triangle
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.relaxation import relax
from synthesis.lmi.settings import LmiSettings
from synthesis.polynomials.matrix import symmetric_block, variable
from tests.support.lmi_cases import gain_problem, parameter

A = np.array([[[-1.0, 2.0], [0.0, -3.0]], [[0.5, 0.0], [1.0, 0.25]]])
B = np.array([[[1.0], [0.5]]])
C = np.array([[[1.0, -1.0]]])


def svec(matrix: FloatArray) -> FloatArray:
    rows, columns, weights = triangle(len(matrix))
    return np.asarray(matrix[rows, columns] * weights)


def test_svec_keeps_inner_products() -> None:
    rng = np.random.default_rng(0)
    for size in range(1, 6):
        X, Y = (rng.standard_normal((size, size)) for _ in range(2))
        X, Y = X + X.T, Y + Y.T
        assert svec(X) @ svec(Y) == pytest.approx(np.trace(X @ Y))
    rows, columns, _ = triangle(3)  # the order of Clarabel: upper triangle, column by column
    assert list(zip(rows.tolist(), columns.tolist(), strict=True)) == [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]


@pytest.mark.parametrize("kind", ["grid", "vertex"])
def test_sampled_rows_are_the_matrices_at_their_places(kind: str) -> None:
    problem = gain_problem((parameter(),), A, B, C, 1)
    settings = LmiSettings(relaxation=kind, points=4, margin=1e-3)  # type: ignore[arg-type]
    relaxed = relax(problem, settings)
    data = assemble(relaxed)
    x = np.random.default_rng(1).standard_normal(problem.decisions)
    cone = (data.b - data.A @ x)[data.equalities :]
    start = 0
    for entry in relaxed.sampled:
        matrix = entry.values @ np.concatenate([[1.0], x])
        keep = np.setdiff1d(np.arange(matrix.shape[1]), structural_zeros(entry.values))
        for block in matrix[:, keep][:, :, keep]:
            expected = svec(block - entry.margin * np.eye(len(keep)))
            np.testing.assert_allclose(cone[start : start + len(expected)], expected, atol=1e-10)
            start += len(expected)
    assert start == len(cone) == sum(k * (k + 1) // 2 for k in data.semidefinite)
    np.testing.assert_allclose(
        (data.b + data.slack - data.A @ x)[data.equalities :] - cone, data.slack[data.equalities :]
    )
    assert set(np.unique(data.slack)) <= {0.0, 1e-3}
    assert isinstance(data.A, sparse.csc_array)


def test_structural_zeros_become_equalities() -> None:
    """A matrix [[x1, x2], [x2, 0]] is positive semidefinite only with x2 = 0: a cone alone would only approach it."""
    problem = LmiProblem((parameter(),))
    X = problem.matrix("x", 1, 2)
    first = X @ problem.constant(np.array([[1.0], [0.0]]))
    second = X @ problem.constant(np.array([[0.0], [1.0]]))
    zero = problem.constant(np.zeros((1, 1)))
    problem.require("singular", symmetric_block([[first, second], [None, zero]]), strict=False)
    relaxed = relax(problem, LmiSettings(relaxation="grid", points=2))
    assert structural_zeros(relaxed.sampled[0].values).tolist() == [1]
    data = assemble(relaxed)
    assert data.semidefinite == (1,)
    rows = np.hstack([data.A.toarray()[: data.equalities], data.b[: data.equalities, None]])
    assert data.equalities >= 1
    np.testing.assert_allclose(rows[:, [0, 2]], 0.0)  # the equality says x2 = 0 and nothing else
    assert np.abs(rows[:, 1]).max() > 0.0


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 4])
def test_gram_matrices_are_sums_of_squares_at_every_node(degree: int) -> None:
    """Any X_t >= 0 in the conic data gives M(u) = sum_t w_t(u) (b_t (x) I)' X_t (b_t (x) I), node by node."""
    problem = LmiProblem((parameter(),))
    u = variable(0, 2)
    power = problem.constant(np.eye(2))
    for _ in range(degree):
        power = power.scaled_by(u)
    problem.require("m", power + problem.constant(np.eye(2)).scaled_by(problem.scalar("t")))
    (sos,) = relax(problem, LmiSettings(relaxation="exact")).sos
    rng = np.random.default_rng(degree)
    rows, columns, _ = triangle(2)
    grams, parts = [], []
    for matching, basis in zip(gram_matrices(sos), sos.bases, strict=True):
        size = 2 * basis.shape[1]
        root = rng.standard_normal((size, size))
        grams.append(root @ root.T)
        parts.append(matching @ svec(grams[-1]))
    entries = np.sum(parts, axis=0).reshape(-1, len(rows))
    nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
    for k, node in enumerate(nodes):
        weights = (1.0 + node, 1.0 - node) if degree % 2 else (1.0, 1.0 - node**2)
        total = np.zeros((2, 2))
        for gram, basis, weight in zip(grams, sos.bases, weights, strict=False):
            lift = np.kron(np.polynomial.chebyshev.chebvander(np.array([node]), basis.shape[1] - 1), np.eye(2))
            total += weight * lift @ gram @ lift.T
        np.testing.assert_allclose(entries[k], total[rows, columns], rtol=1e-10, atol=1e-10)


def test_sums_of_squares_match_the_margin_and_the_cost() -> None:
    problem = gain_problem((parameter(),), A, B, C, 1)
    relaxed = relax(problem, LmiSettings(relaxation="exact", margin=1e-4))
    data = assemble(relaxed)
    assert data.q[: problem.decisions].tolist() == problem.cost.tolist()
    assert not data.q[problem.decisions :].any()
    # P > 0: degree 1, two Gram matrices of 2 x 2; the gain block, 4 x 4 of degree 2 with two rate vertices: 8 and 4
    assert data.semidefinite == (2, 2, 8, 4, 8, 4)
    assert data.equalities == 2 * 3 + 2 * 3 * 10
    assert np.count_nonzero(data.slack[: data.equalities] == 1e-4) == 2 * 2 + 2 * 3 * 4
    assert not data.slack[data.equalities :].any()
