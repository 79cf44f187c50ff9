"""Enclosures in float64 on many boxes at once: they hold the exact values, and what they call positive is positive."""

from __future__ import annotations

import numpy as np
import pytest
from flint import arb_mat, fmpq, fmpq_mat
from scipy.linalg import expm

from synthesis.loop.on_boxes import gains, local
from synthesis.loop.plant import Axis
from synthesis.loop.system import Region
from synthesis.polynomials import box_exponential
from synthesis.polynomials.box_sign import positive
from synthesis.polynomials.boxes import Boxes, constants, orders
from synthesis.polynomials.enclosure import PolynomialMatrix

RNG = np.random.default_rng(11)


def rational(x: float) -> fmpq:
    return fmpq(*float(x).as_integer_ratio())


def polynomial(shape: tuple[int, int], degrees: tuple[int, ...], size: float = 1.0) -> PolynomialMatrix:
    terms = {
        k: fmpq_mat(*shape, [fmpq(int(x), 97) for x in RNG.integers(-99, 99, shape[0] * shape[1]) * size])
        for k in np.ndindex(*(d + 1 for d in degrees))
    }
    return PolynomialMatrix(terms, shape, len(degrees))


def cells(count: int) -> list[Region]:
    edges = [fmpq(-1), fmpq(-1, 3), fmpq(2, 7), fmpq(1)]
    pairs = [(edges[i], edges[i + 1]) for i in range(3)]
    if count == 1:
        return [Region.between((low,), (high,)) for low, high in pairs]
    return [Region.between((a[0], b[0]), (a[1], b[1])) for a in pairs for b in pairs]


def holds(found: Boxes, exact: list[fmpq_mat], point: tuple[fmpq, ...]) -> bool:
    """Whether the exact values lie in the enclosure at a point of the local variables, exactly compared."""
    table = orders(found.variables, found.highest).powers
    for g, matrix in enumerate(exact):
        for i in range(matrix.nrows()):
            for j in range(matrix.ncols()):
                value = fmpq(0)
                for number, powers in enumerate(table):
                    weight = rational(found.middle[g, number, i, j])
                    for t, k in zip(point, powers, strict=True):
                        weight *= t**k
                    value += weight
                if abs(value - matrix[i, j]) > rational(found.radius[g, i, j]):
                    return False
    return True


@pytest.mark.parametrize("count", [1, 2])
def test_sums_and_products_hold_the_exact_values(count: int) -> None:
    A, B = polynomial((2, 3), (2,) * count), polynomial((3, 2), (3,) * count)
    regions = cells(count)
    a, b = local(A, regions), local(B, regions)
    product = (a @ b) * fmpq(1, 3) - (b.T @ a.T)
    for _ in range(5):
        point = tuple(fmpq(int(k), 50) for k in RNG.integers(-50, 51, count))
        exact = []
        for region in regions:
            u = region.point((*point, *(0,) * count))[:count]  # type: ignore[arg-type]
            left, right = A.at(u), B.at(u)
            exact.append(left * right * fmpq(1, 3) - right.transpose() * left.transpose())
        assert holds(product, exact, point)
    narrow = Boxes(product.middle, product.radius * 1e-6, product.variables, product.highest)
    assert not holds(narrow, exact, point)  # rounding is really there, and the radius is not idle


def test_an_interpolated_table_holds_the_exact_multilinear_gain() -> None:
    table = {k: fmpq_mat(1, 1, [fmpq(int(RNG.integers(1, 1000)), 7)]) for k in np.ndindex(4, 4)}
    axes = [Axis(name, "1", fmpq(-1), fmpq(1), None, None) for name in "pq"]
    line = [fmpq(-1), fmpq(-1, 3), fmpq(2, 7), fmpq(1)]
    found = gains(table, [line, line], axes, cells(2), np.zeros((1, 1)))
    point = (fmpq(3, 11), fmpq(-5, 13))
    exact = []
    for i in range(3):
        for j in range(3):
            a, b = (point[0] + 1) / 2, (point[1] + 1) / 2
            value = (1 - a) * ((1 - b) * table[i, j][0, 0] + b * table[i, j + 1][0, 0])
            value += a * ((1 - b) * table[i + 1, j][0, 0] + b * table[i + 1, j + 1][0, 0])
            exact.append(fmpq_mat(1, 1, [value]))
    assert holds(found, exact, point)
    halves = [
        half for cell in cells(2) for half in cell.halves(1)
    ]  # parts of cells: s from the middle of the lower half
    parts = gains(table, [line, line], axes, halves[::2], np.zeros((1, 1)))
    assert holds(parts, exact, (point[0], 2 * point[1] + 1)) is (abs(2 * point[1] + 1) <= 1)


def test_phi_and_exponential_are_those_of_scipy_at_random_places() -> None:
    M = polynomial((3, 3), (1, 1), 0.3)
    regions = cells(2)
    enclosed = local(M, regions)
    integral = box_exponential.phi(enclosed)
    assert integral is not None
    whole = box_exponential.exponential(enclosed, integral)
    monomials = np.array(orders(2, whole.highest).powers)
    for _ in range(4):
        t = RNG.uniform(-1.0, 1.0, 2)
        for g, region in enumerate(regions):
            u = [
                float(o.p) / float(o.q) + float(f.p) / float(f.q) * x
                for o, f, x in zip(region.offset, region.factor, t, strict=False)
            ]
            exact = M.at([rational(x) for x in u])
            matrix = np.array([float(x.p) / float(x.q) for x in exact.entries()]).reshape(3, 3)
            value = np.einsum("k,kij->ij", (t**monomials).prod(axis=1), whole.middle[g])
            assert (np.abs(value - expm(matrix)) <= whole.radius[g] + 1e-12 * np.abs(value)).all()
    assert box_exponential.phi(local(M * 1000, regions)) is None  # too large for anything useful


@pytest.mark.parametrize(("least", "expected"), [(1e-6, True), (1e-12, True), (0.0, False), (-1e-12, False)])
def test_positive_definite_up_to_rounding_and_no_further(least: float, expected: bool) -> None:
    """(u - 1/8)^2 Q + least I in badly scaled states: positive for least > 0, and never called so for least <= 0."""
    scale = np.diag([1e-6, 1.0, 1e5])
    Q = scale @ np.array([[2.0, 1.0, 0.0], [1.0, 3.0, 1.0], [0.0, 1.0, 4.0]]) @ scale
    floor = least * scale @ scale

    def rows(matrix: np.ndarray) -> fmpq_mat:
        return fmpq_mat(3, 3, [rational(x) for x in matrix.ravel()])

    eighth = fmpq(1, 8)
    terms = {(0,): rows(Q) * eighth**2 + rows(floor), (1,): rows(Q) * (-2 * eighth), (2,): rows(Q)}
    around = [Region.between((eighth,), (eighth + fmpq(1, 2**20),))]
    found = positive(local(PolynomialMatrix(terms, (3, 3), 1), around))
    assert bool(found[0]) is expected or (expected and least < 1e-9)


def test_an_enclosure_that_is_too_wide_is_not_called_positive() -> None:
    unit = constants(np.eye(2), 1, 8)
    assert positive(unit).all()
    assert not positive(unit.widened(np.full((1, 2, 2), 0.6))).any()  # I +- 0.6 holds singular matrices
    assert positive(unit.widened(np.full((1, 2, 2), 0.1))).all()
    assert not positive(constants(np.array([[1.0, 1.0], [1.0, 1.0]]), 1, 8)).any()
    assert not positive(unit * float("nan")).any()


def test_a_number_that_is_a_ball_is_enclosed() -> None:
    ball = arb_mat([[1]])[0, 0] / 3
    found = constants(np.eye(1), 1, 8) * ball
    assert abs(rational(found.middle[0, 0, 0, 0]) - fmpq(1, 3)) <= rational(found.radius[0, 0, 0])


@pytest.mark.parametrize("rounding", [0.0, 1e-250])
def test_a_triangular_matrix_is_enclosed_as_closely_as_another(rounding: float) -> None:
    """Opposite an entry that is zero but for rounding: e^A of [[0.5, 1], [0, -1]], whose (1, 0) is not even a zero in balls."""
    A = np.array([[[0.5, 1.0], [0.0, -1.0]]])
    matrix = Boxes(A[:, None], np.array([[[0.0, 0.0], [rounding, 0.0]]]), 1, 0)
    integral = box_exponential.phi(matrix)
    assert integral is not None
    found = box_exponential.exponential(matrix, integral)
    assert np.abs(found.middle[0, 0] - expm(A[0])).max() < 1e-14
    assert found.radius.max() < 2e-13
