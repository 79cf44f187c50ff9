"""Algebra of matrix polynomials at random: evaluation commutes with every operation."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from synthesis.lmi.basis import chebyshev_basis
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block

SMALL = settings(deadline=None, max_examples=60)
seeds = st.integers(0, 2**32 - 1)
variables = st.integers(1, 3)
sizes = st.integers(1, 3)


def random_matrix(rng: np.random.Generator, v: int, rows: int, columns: int, decisions: int) -> MatrixPolynomial:
    degrees = rng.integers(1, 5 - v, size=v)
    return MatrixPolynomial(rng.standard_normal((*degrees, rows, columns, decisions + 1)))


def values(M: MatrixPolynomial, points: np.ndarray, decisions: np.ndarray) -> np.ndarray:
    """M at points and decisions, by its definition: sum over all powers, one by one."""
    weights = np.concatenate([[1.0], decisions[: M.decisions]])
    out = np.zeros((len(points), *M.shape))
    for powers in np.ndindex(*M.coefficients.shape[: M.variables]):
        out += np.prod(points ** np.array(powers), axis=1)[:, None, None] * (M.coefficients[powers] @ weights)
    return out


def setting(seed: int, v: int) -> tuple[np.random.Generator, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng, rng.uniform(-1.5, 1.5, (4, v)), rng.standard_normal(6)


@SMALL
@given(seeds, variables, sizes)
def test_evaluation_follows_the_definition(seed: int, v: int, n: int) -> None:
    rng, points, x = setting(seed, v)
    M = random_matrix(rng, v, n, n + 1, 4)
    np.testing.assert_allclose(M.substitute(x).at(points)[..., 0], values(M, points, x), rtol=1e-10, atol=1e-10)
    affine = M.at(points) @ np.concatenate([[1.0], x[:4]])
    np.testing.assert_allclose(affine, values(M, points, x), rtol=1e-10, atol=1e-10)


@SMALL
@given(seeds, variables, sizes)
def test_evaluation_commutes_with_sums_products_and_transposes(seed: int, v: int, n: int) -> None:
    rng, points, x = setting(seed, v)
    M, N = random_matrix(rng, v, n, n, 3), random_matrix(rng, v, n, n, 5)
    K = random_matrix(rng, v, n, n, 0)
    at_m, at_n, at_k = (values(matrix, points, x) for matrix in (M, N, K))
    for found, expected in (
        (M + N, at_m + at_n),
        (M - N, at_m - at_n),
        (2.5 * M, 2.5 * at_m),
        (K @ N, at_k @ at_n),
        (N @ K, at_n @ at_k),
        ((M @ K).T, np.swapaxes(at_m @ at_k, 1, 2)),
    ):
        np.testing.assert_allclose(values(found, points, x), expected, rtol=1e-9, atol=1e-9)


@SMALL
@given(seeds, variables, sizes)
def test_scalar_factors_known_or_unknown(seed: int, v: int, n: int) -> None:
    rng, points, x = setting(seed, v)
    known, unknown = random_matrix(rng, v, 1, 1, 0), random_matrix(rng, v, 1, 1, 6)
    M, K = random_matrix(rng, v, n, n, 4), random_matrix(rng, v, n, n, 0)
    for matrix, scalar in ((M, known), (K, unknown), (K, known)):
        expected = values(matrix, points, x) * values(scalar, points, x)
        np.testing.assert_allclose(values(matrix.scaled_by(scalar), points, x), expected, rtol=1e-9, atol=1e-9)


@SMALL
@given(seeds, variables)
def test_derivatives_are_the_limits_of_differences(seed: int, v: int) -> None:
    rng, points, x = setting(seed, v)
    M = random_matrix(rng, v, 2, 2, 2)
    for index in range(v):
        step = np.zeros(v)
        step[index] = 1e-5
        slope = (values(M, points + step, x) - values(M, points - step, x)) / 2e-5
        np.testing.assert_allclose(values(M.derivative(index), points, x), slope, rtol=1e-6, atol=1e-6)


@SMALL
@given(seeds, variables)
def test_affine_substitution_and_back(seed: int, v: int) -> None:
    rng, points, x = setting(seed, v)
    M = random_matrix(rng, v, 2, 1, 3)
    offsets, factors = rng.uniform(-2.0, 2.0, v), rng.uniform(0.3, 2.0, v)
    moved = M.affine(offsets, factors)
    np.testing.assert_allclose(values(moved, points, x), values(M, offsets + factors * points, x), rtol=1e-9, atol=1e-8)
    back = moved.affine(-offsets / factors, 1.0 / factors)
    np.testing.assert_allclose(back.coefficients, M.coefficients, rtol=1e-8, atol=1e-7)


@SMALL
@given(seeds, variables)
def test_block_matrices_are_symmetric_and_hold_their_blocks(seed: int, v: int) -> None:
    rng, points, x = setting(seed, v)
    a, b, c = random_matrix(rng, v, 2, 2, 2), random_matrix(rng, v, 2, 1, 3), random_matrix(rng, v, 1, 1, 0)
    a = a + a.T
    full = values(symmetric_block([[a, b], [None, c]]), points, x)
    np.testing.assert_allclose(full, np.swapaxes(full, 1, 2), atol=1e-12)
    np.testing.assert_allclose(full[:, :2, 2:], values(b, points, x), rtol=1e-10, atol=1e-10)


@SMALL
@given(st.integers(1, 3), st.integers(0, 4), seeds)
def test_the_basis_spans_all_polynomials_of_its_degree(v: int, degree: int, seed: int) -> None:
    """As many independent functions as monomials, each bounded by one on the box."""
    basis = chebyshev_basis(v, degree)
    monomials = [powers for powers in np.ndindex(*(degree + 1,) * v) if sum(powers) <= degree]
    assert len(basis) == len(monomials)
    columns = np.array([[function[powers] for powers in monomials] for function in basis])
    assert np.linalg.matrix_rank(columns) == len(monomials)
    assert np.count_nonzero(basis) == np.count_nonzero(columns)  # nothing beyond the total degree
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, (50, v))
    at = np.array([MatrixPolynomial(function[..., None, None, None]).at(points)[:, 0, 0, 0] for function in basis])
    assert np.abs(at).max() <= 1.0 + 1e-12
