"""Matrix polynomials by hand-made examples; their algebra at large is in tests/property/test_polynomials.py."""

from __future__ import annotations

import numpy as np
import pytest

from synthesis.polynomials.matrix import MatrixPolynomial, constant, padded, symmetric_block, variable


def unknown(entries: np.ndarray, variables: int, position: int) -> MatrixPolynomial:
    """x_position times a constant matrix."""
    out = np.zeros((*(1,) * variables, *entries.shape, position + 2))
    out[..., position + 1] = entries
    return MatrixPolynomial(out)


def test_shapes_and_degrees_are_read_from_the_coefficients() -> None:
    M = MatrixPolynomial(np.zeros((3, 1, 2, 5, 4)))
    assert (M.variables, M.degrees, M.shape, M.decisions) == (2, (2, 0), (2, 5), 3)
    assert M.T.shape == (5, 2)


def test_a_variable_is_itself() -> None:
    points = np.array([[0.3, -2.0, 5.0]])
    for index in range(3):
        assert variable(index, 3).at(points)[0, 0, 0, 0] == points[0, index]


def test_product_with_an_unknown_is_the_product_of_matrices() -> None:
    A, X = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([[0.0, 1.0], [1.0, 0.0]])
    p = variable(0, 1)
    product = (constant(A, 1).scaled_by(p) @ unknown(X, 1, 2)).substitute(np.array([9.0, 9.0, 0.5]))
    np.testing.assert_allclose(product.at(np.array([[3.0]]))[0, ..., 0], 1.5 * A @ X)
    mirrored = (unknown(X, 1, 2) @ constant(A, 1)).substitute(np.array([9.0, 9.0, 0.5]))
    np.testing.assert_allclose(mirrored.at(np.zeros((1, 1)))[0, ..., 0], 0.5 * X @ A)


def test_products_of_two_unknowns_are_refused() -> None:
    x, y = unknown(np.eye(2), 1, 0), unknown(np.eye(2), 1, 1)
    with pytest.raises(ValueError, match="two unknown matrices is not affine"):
        x @ y
    with pytest.raises(ValueError, match="two unknown matrices is not affine"):
        x.scaled_by(unknown(np.eye(1), 1, 1))


def test_shapes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match=r"cannot add a \(2, 2\) and a \(3, 3\)"):
        constant(np.eye(2), 1) + constant(np.eye(3), 1)
    with pytest.raises(ValueError, match=r"cannot multiply a \(2, 2\) by a \(3, 3\)"):
        constant(np.eye(2), 1) @ constant(np.eye(3), 1)


def test_derivative_of_a_cubic() -> None:
    p, q = variable(0, 2), variable(1, 2)
    cubic = p.scaled_by(p).scaled_by(p) * 2.0 + p.scaled_by(q) - q * 5.0  # 2 p^3 + p q - 5 q
    points = np.array([[0.7, -1.3], [0.0, 2.0]])
    np.testing.assert_allclose(cubic.derivative(0).at(points)[:, 0, 0, 0], 6 * points[:, 0] ** 2 + points[:, 1])
    np.testing.assert_allclose(cubic.derivative(1).at(points)[:, 0, 0, 0], points[:, 0] - 5.0)
    assert not constant(np.eye(2), 2).derivative(1).coefficients.any()


def test_decisions_enter_affinely_and_shorter_vectors_of_other_unknowns_do_not_matter() -> None:
    M = unknown(np.eye(1), 1, 0) + unknown(np.eye(1), 1, 2) * 10.0 + constant(np.array([[0.5]]), 1)
    value = M.substitute(np.array([1.0, 100.0, 2.0, 7.0])).at(np.zeros((1, 1)))  # unknown 3 is not part of M
    assert value[0, 0, 0, 0] == 0.5 + 1.0 + 20.0


def test_symmetric_block_mirrors_and_leaves_gaps_zero() -> None:
    a, b = constant(np.array([[1.0]]), 1), constant(np.array([[2.0, 3.0]]), 1).scaled_by(variable(0, 1))
    c = constant(np.diag([4.0, 5.0]), 1)
    full = symmetric_block([[a, b], [None, c]]).at(np.array([[2.0]]))[0, ..., 0]
    np.testing.assert_allclose(full, [[1, 4, 6], [4, 4, 0], [6, 0, 5]])
    gap = symmetric_block([[a, None], [None, c]]).at(np.array([[2.0]]))[0, ..., 0]
    np.testing.assert_allclose(gap, np.diag([1.0, 4.0, 5.0]))


def test_padding_appends_zero_coefficients_only() -> None:
    array = np.ones((2, 1, 1, 1))
    wide = padded(array, (3, 1, 1, 4))
    assert wide.shape == (3, 1, 1, 4)
    assert wide.sum() == array.sum()
    assert padded(array, array.shape) is array
