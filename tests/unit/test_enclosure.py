"""The ring of enclosures: exact where it says exact, and containing where it gives digits away."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from flint import arb, arb_mat, ctx, fmpq, fmpq_mat

from synthesis.polynomials.chebyshev import from_chebyshev, to_chebyshev
from synthesis.polynomials.enclosure import (
    PolynomialMatrix,
    block,
    constant,
    from_coefficients,
    identity,
    row_sum,
    variable,
)
from synthesis.polynomials.exponential import LARGEST, balance, exponential, phi, rescaled


def random_rational(rng: np.random.Generator, size: float = 1.0) -> fmpq:
    return fmpq(int(rng.integers(-10_000, 10_001)), 10_000) * fmpq(*float(size).as_integer_ratio())


def random_matrix(
    rng: np.random.Generator, shape: tuple[int, int], variables: int, degree: int, size: float = 1.0
) -> PolynomialMatrix:
    """Random terms with powers up to `degree` in every variable; some are left out."""
    terms = {}
    for powers in np.ndindex(*(degree + 1,) * variables):
        if rng.random() < 0.75:
            entries = [random_rational(rng, size) for _ in range(shape[0] * shape[1])]
            terms[tuple(int(k) for k in powers)] = fmpq_mat(*shape, entries)
    return PolynomialMatrix(terms, shape, variables)


def random_point(rng: np.random.Generator, variables: int) -> tuple[fmpq, ...]:
    ends = rng.random() < 0.2
    return tuple(fmpq(int(rng.choice([-1, 1]))) if ends else random_rational(rng) for _ in range(variables))


def value(matrix: PolynomialMatrix, point: tuple[fmpq, ...]) -> list[list[fmpq]]:
    """By hand, term by term."""
    rows, columns = matrix.shape
    total = [[fmpq(0)] * columns for _ in range(rows)]
    for powers, entries in matrix.terms.items():
        weight = fmpq(1)
        for x, k in zip(point, powers, strict=True):
            for _ in range(k):
                weight *= x
        for i in range(rows):
            for j in range(columns):
                total[i][j] += weight * entries[i, j]
    return total


def product(a: list[list[fmpq]], b: list[list[fmpq]]) -> list[list[fmpq]]:
    return [
        [sum((x * y for x, y in zip(row, column, strict=True)), fmpq(0)) for column in zip(*b, strict=True)]
        for row in a
    ]


def contains(ball: PolynomialMatrix, point: tuple[fmpq, ...], exact: list[list[fmpq]]) -> bool:
    enclosed = arb_mat(ball.at(point)).tolist()
    return all(
        x.contains(arb(y)) or x.overlaps(arb(y)) for row, wanted in zip(enclosed, exact, strict=True)
        for x, y in zip(row, wanted, strict=True)
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("variables", [1, 2, 3])
def test_the_ring_is_exact_over_rationals(seed: int, variables: int) -> None:
    rng = np.random.default_rng([seed, variables])
    a, b = (random_matrix(rng, (2, 3), variables, 2) for _ in range(2))
    c, scalar = random_matrix(rng, (3, 2), variables, 2), random_matrix(rng, (1, 1), variables, 2)
    for _ in range(3):
        t = random_point(rng, variables)
        A, B, C, s = (value(m, t) for m in (a, b, c, scalar))
        assert value(a + b, t) == [[x + y for x, y in zip(*rows, strict=True)] for rows in zip(A, B, strict=True)]
        assert value(a - b, t) == [[x - y for x, y in zip(*rows, strict=True)] for rows in zip(A, B, strict=True)]
        assert value(a @ c, t) == product(A, C)
        assert value(a.T, t) == [list(column) for column in zip(*A, strict=True)]
        assert value(a * fmpq(3, 7), t) == [[x * fmpq(3, 7) for x in row] for row in A]
        assert value(-a, t) == [[-x for x in row] for row in A]
        assert value(a.scaled_by(scalar), t) == [[x * s[0][0] for x in row] for row in A]
        offset, factor = random_point(rng, variables), random_point(rng, variables)
        moved = tuple(o + f * x for o, f, x in zip(offset, factor, t, strict=True))
        assert value(a.affine(offset, factor), t) == value(a, moved)
        assert a.at(t).tolist() == A
        assert value(a.in_variables(variables + 2), (*t, fmpq(5), fmpq(7))) == A


@pytest.mark.parametrize("seed", range(6))
def test_derivatives_are_difference_quotients(seed: int) -> None:
    """Exact on polynomials of degree two: the symmetric quotient of any step is the derivative."""
    rng = np.random.default_rng(seed)
    a = random_matrix(rng, (2, 2), 2, 2)
    for i in range(2):
        t, h = random_point(rng, 2), fmpq(1, 3)
        up, down = (tuple(x + s * h * (k == i) for k, x in enumerate(t)) for s in (1, -1))
        quotient = [
            [(x - y) / (2 * h) for x, y in zip(*rows, strict=True)]
            for rows in zip(value(a, up), value(a, down), strict=True)
        ]
        assert value(a.derivative(i), t) == quotient


@pytest.mark.parametrize("seed", range(12))
def test_what_is_cut_off_stays_inside(seed: int) -> None:
    """`truncated` and `shortened` contain the polynomial everywhere on the box; products of balls contain the product."""
    rng = np.random.default_rng(seed)
    a, b = random_matrix(rng, (2, 2), 2, 5, 10.0), random_matrix(rng, (2, 2), 2, 4)
    for order in (0, 1, 3, 6):
        cut = a.balls().truncated(order)
        assert all(sum(powers) <= order for powers in cut.terms)
        short = a.balls().shortened(0.3)
        both = (a.balls().truncated(order) @ b.balls()).truncated(order)
        for _ in range(8):
            t = random_point(rng, 2)
            assert contains(cut, t, value(a, t)) and contains(short, t, value(a, t))
            assert contains(both, t, product(value(a, t), value(b, t)))


def test_what_is_cut_off_is_no_more_than_it_must_be() -> None:
    """Negative control: the term 1/2 t^3 widens by 1/2 exactly, and a polynomial of that order is left alone."""
    m = from_coefficients([((0,), [[fmpq(1)]]), ((3,), [[fmpq(1, 2)]])], (1, 1), 1).balls()
    ball = m.truncated(2).terms[(0,)][0, 0]
    assert ball.contains(arb("0.5")) and ball.contains(arb("1.5"))
    assert not ball.contains(arb("0.499999")) and not ball.contains(arb("1.500001"))
    assert m.truncated(3).terms.keys() == m.terms.keys()
    assert m.shortened(0.1).terms.keys() == m.terms.keys()
    assert set(m.shortened(0.4).terms) == {(0,)}


def test_blurring_is_what_it_says() -> None:
    ball = constant(fmpq_mat([[1, 2], [3, 4]]), 1).inflated(lambda i, j: arb(i + 2 * j)).terms[(0,)]
    for i in range(2):
        for j in range(2):
            middle = 1 + 2 * i + j
            assert ball[i, j].contains(arb(middle + i + 2 * j)) and ball[i, j].contains(arb(middle - i - 2 * j))
            assert not ball[i, j].contains(arb(middle + i + 2 * j) + arb("1e-6"))


@pytest.mark.parametrize("seed", range(6))
def test_blocks_are_symmetric_and_in_their_places(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a, b, c = random_matrix(rng, (2, 2), 1, 2), random_matrix(rng, (2, 1), 1, 1), random_matrix(rng, (1, 1), 1, 3)
    top = a + a.T
    whole = block([[top, b], [None, c]])
    t = random_point(rng, 1)
    A, B, C = (value(m, t) for m in (top, b, c))
    wanted = [[*A[0], B[0][0]], [*A[1], B[1][0]], [B[0][0], B[1][0], C[0][0]]]
    assert contains(whole, t, wanted)
    assert all(m.tolist()[2][i].overlaps(m.tolist()[i][2]) for m in whole.terms.values() for i in range(2))
    assert contains(
        block([[a, None], [None, c]]), t, [[*value(a, t)[0], fmpq(0)], [*value(a, t)[1], fmpq(0)], [fmpq(0)] * 2 + C[0]]
    )


def test_shapes_that_do_not_fit_are_refused() -> None:
    a, b = constant(fmpq_mat([[1, 2]]), 1), constant(fmpq_mat([[1], [2]]), 1)
    with pytest.raises(ValueError, match="cannot add"):
        a + b
    with pytest.raises(ValueError, match="cannot multiply"):
        a @ a
    with pytest.raises(ValueError, match="cannot add"):
        a + constant(fmpq_mat([[1, 2]]), 2)


def test_row_sums_are_upper_bounds() -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        entries = fmpq_mat(3, 3, [random_rational(rng, 10.0 ** rng.uniform(-9, 9)) for _ in range(9)])
        exact = max(sum((abs(x) for x in row), fmpq(0)) for row in entries.tolist())
        found = row_sum(entries)
        assert fmpq(*found.as_integer_ratio()) >= exact
        assert found <= float(exact.p) / float(exact.q) * (1.0 + 1e-8)


# Chebyshev polynomials


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("variables", [1, 2])
def test_chebyshev_coefficients_are_exact(seed: int, variables: int) -> None:
    """There and back, and the value by the recursion of T_k."""
    rng = np.random.default_rng([seed, variables])
    matrix = random_matrix(rng, (2, 2), variables, 9 if variables == 1 else 4)
    series = to_chebyshev(matrix)
    t = random_point(rng, variables)
    assert value(from_chebyshev(series), t) == value(matrix, t)
    assert value(to_chebyshev(from_chebyshev(matrix)), t) == value(matrix, t)
    total = [[fmpq(0)] * 2 for _ in range(2)]
    for orders, entries in series.terms.items():
        weight = fmpq(1)
        for x, k in zip(t, orders, strict=True):
            before, here = fmpq(1), x
            for _ in range(k):
                before, here = here, 2 * x * here - before
            weight *= before
        total = [[total[i][j] + weight * entries[i, j] for j in range(2)] for i in range(2)]
    assert total == value(matrix, t)


def test_chebyshev_coefficients_of_powers_add_up_to_one() -> None:
    """u^k = sum of c_j T_j with c_j >= 0: what is stored is never larger than what was multiplied out."""
    for k in range(17):
        terms = to_chebyshev(PolynomialMatrix({(k,): fmpq_mat([[1]])}, (1, 1), 1)).terms
        numbers = [m[0, 0] for m in terms.values()]
        assert all(x >= 0 for x in numbers) and sum(numbers, fmpq(0)) == 1


# Matrix exponentials


def by_mpmath(rows: list[list[fmpq]]) -> tuple[mpmath.matrix, mpmath.matrix]:
    """phi(M) and e^M from one exponential of twice the size, with 60 digits."""
    n = len(rows)
    with mpmath.workdps(80):
        whole = mpmath.zeros(2 * n)
        for i, row in enumerate(rows):
            for j, x in enumerate(row):
                whole[i, j] = mpmath.mpf(int(x.p)) / int(x.q)
            whole[i, n + i] = 1
        found = mpmath.expm(whole)
        return found[:n, n:], found[:n, :n]


def holds(ball: PolynomialMatrix, point: tuple[fmpq, ...], exact: mpmath.matrix) -> bool:
    """Whether the value of 60 digits lies in the enclosure at a point."""
    before, ctx.prec = ctx.prec, 300
    try:
        return all(
            entry.overlaps(arb(mpmath.nstr(exact[i, j], 60)))
            for i, row in enumerate(arb_mat(ball.at(point)).tolist()) for j, entry in enumerate(row)
        )  # fmt: skip
    finally:
        ctx.prec = before


def with_norm(matrix: PolynomialMatrix, norm: float) -> PolynomialMatrix:
    total = sum(row_sum(entries) for entries in matrix.terms.values())
    return matrix * (fmpq(*norm.as_integer_ratio()) / fmpq(*total.as_integer_ratio())) if total else matrix


@pytest.mark.parametrize("norm", [1e-9, 0.1, 0.5, 0.6, 1.0, 3.0, 10.0, 30.0])
@pytest.mark.parametrize("seed", range(6))
def test_exponentials_contain_those_of_mpmath(norm: float, seed: int) -> None:
    rng = np.random.default_rng([seed, int(1000 * norm)])
    n, variables = int(rng.integers(1, 5)), int(rng.integers(1, 3))
    matrix = with_norm(random_matrix(rng, (n, n), variables, int(rng.integers(0, 4))), norm)
    integral = phi(matrix)
    assert integral is not None
    power = exponential(matrix, integral)
    for _ in range(3):
        t = random_point(rng, variables)
        wanted = by_mpmath(value(matrix, t))
        assert holds(integral, t, wanted[0]) and holds(power, t, wanted[1])


@pytest.mark.parametrize("seed", range(8))
def test_exponentials_of_badly_scaled_matrices(seed: int) -> None:
    """States in mm beside states in km: the diagonal scaling makes small what can be made small, and stays exact."""
    rng = np.random.default_rng(seed)
    matrix = with_norm(random_matrix(rng, (3, 3), 1, 2), float(rng.uniform(0.5, 6.0)))
    weights = [fmpq(10) ** int(k) if k >= 0 else fmpq(1, 10 ** int(-k)) for k in rng.integers(-6, 7, 3)]
    scaled = matrix.map(lambda m: fmpq_mat([[weights[i] * m[i, j] / weights[j] for j in range(3)] for i in range(3)]))
    integral = phi(scaled)
    assert integral is not None
    power = exponential(scaled, integral)
    for _ in range(3):
        t = random_point(rng, 1)
        wanted = by_mpmath(value(scaled, t))
        assert holds(integral, t, wanted[0]) and holds(power, t, wanted[1])


def test_exponentials_are_narrow() -> None:
    """Negative control of the above: an enclosure that is too wide would contain everything. e and e - 1, to 18 digits."""
    one = constant(fmpq_mat([[1]]), 1)
    integral = phi(one)
    assert integral is not None
    power = exponential(one, integral).at((fmpq(0),))[0, 0]
    assert power.contains(arb(1).exp()) and float(power.rad()) < 1e-16
    assert not power.overlaps(arb("2.71828182845904")) and not power.overlaps(arb("2.71828182845905"))
    wide = phi(constant(fmpq_mat([[0, 20], [-20, 0]]), 1))
    assert wide is not None and max(float(x.rad()) for x in wide.at((fmpq(0),)).entries()) < 1e-6
    short = phi(PolynomialMatrix({(0,): fmpq_mat([[1]]), (1,): fmpq_mat([[fmpq(1, 10)]])}, (1, 1), 1))
    assert short is not None and max(float(x.rad()) for m in short.terms.values() for x in m.entries()) < 1e-9


def test_exponentials_of_balls_contain_those_of_every_matrix_in_them() -> None:
    rng = np.random.default_rng(5)
    exact = with_norm(random_matrix(rng, (2, 2), 1, 1), 2.0)
    inflated = exact.balls().inflated(lambda i, j: arb("0.01"))
    integral = phi(inflated)
    assert integral is not None
    for _ in range(8):
        shift = fmpq_mat(2, 2, [random_rational(rng, 0.01) for _ in range(4)])
        t = random_point(rng, 1)
        wanted = by_mpmath(value(exact + constant(shift, 1), t))
        assert holds(integral, t, wanted[0]) and holds(exponential(inflated, integral), t, wanted[1])


def test_exponentials_of_large_matrices_are_not_tried() -> None:
    assert phi(constant(fmpq_mat([[int(LARGEST) + 1]]), 1)) is None
    assert phi(constant(fmpq_mat([[-100, 1], [1, 0]]), 1)) is None
    zero = phi(constant(fmpq_mat([[0, 0], [0, 0]]), 2))
    assert zero is not None and contains(zero, (fmpq(0), fmpq(0)), value(identity_of_rationals(), (fmpq(0), fmpq(0))))


def identity_of_rationals() -> PolynomialMatrix:
    return constant(fmpq_mat([[1, 0], [0, 1]]), 2)


def test_balancing_is_a_scaling_by_powers_of_two() -> None:
    matrix = constant(fmpq_mat([[-1, 10**6], [fmpq(1, 10**6), -2]]), 1)
    weights = balance(matrix)
    assert all((w.p & (w.p - 1)) == 0 and (w.q & (w.q - 1)) == 0 for w in map(Power, weights))
    scaled = rescaled(matrix.balls(), weights).at((fmpq(0),))
    assert row_sum(scaled) < 4.0 < row_sum(matrix.terms[(0,)])
    back = rescaled(rescaled(matrix.balls(), weights), [1 / w for w in weights])
    assert contains(back, (fmpq(0),), value(matrix, (fmpq(0),)))


class Power:
    """Numerator and denominator as integers of Python."""

    def __init__(self, number: fmpq) -> None:
        self.p, self.q = int(number.p), int(number.q)


def test_variables_and_unit_matrices() -> None:
    assert value(variable(1, 3), (fmpq(2), fmpq(5), fmpq(7))) == [[fmpq(5)]]
    assert contains(identity(2, 1), (fmpq(3),), [[fmpq(1), fmpq(0)], [fmpq(0), fmpq(1)]])
