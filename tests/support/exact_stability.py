"""An independent check of stability over a range, in rational numbers alone: nothing of `synthesis` is imported here.

Matrices are polynomials in v in [-1, 1], lists of coefficient matrices (rows of Fractions). All eigenvalues strictly left of the
axis: Routh's array at a point; on the whole range Hurwitz' determinants, as polynomials in v, without a root in [-1, 1] by
Sturm's theorem. Positive definite on the range: leading minors the same way. Both are complete: they decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

from flint import fmpq, fmpq_mat, fmpq_poly

Rows = Sequence[Sequence[Fraction]]
Series = Sequence[Rows]


def rational(x: Fraction | float | int) -> fmpq:
    """Exactly this number."""
    exact = Fraction(x)
    return fmpq(exact.numerator, exact.denominator)


# ---- at one point --------------------------------------------------------------------------------------------------------


def at(series: Series, v: Fraction) -> list[list[Fraction]]:
    """The value of a matrix polynomial."""
    size = range(len(series[0])), range(len(series[0][0]))
    return [[sum((m[i][j] * v**k for k, m in enumerate(series)), Fraction(0)) for j in size[1]] for i in size[0]]


def is_hurwitz(matrix: Rows) -> bool:
    """All eigenvalues strictly left, by Routh's array on the characteristic polynomial."""
    n = len(matrix)
    found = fmpq_mat(n, n, [rational(x) for row in matrix for x in row]).charpoly()
    coefficients = [found[n - k] for k in range(n + 1)]
    upper, lower = coefficients[0::2], coefficients[1::2]
    for _ in range(n):
        if not lower or not lower[0] > 0:
            return False
        following = [
            upper[k + 1] - upper[0] / lower[0] * (lower[k + 1] if k + 1 < len(lower) else fmpq(0))
            for k in range(len(upper) - 1)
        ]
        upper, lower = lower, following
    return True


def shifted(series: Series, rate: Fraction) -> list[list[list[Fraction]]]:
    """A + rate I."""
    out = [[list(row) for row in matrix] for matrix in series]
    for i in range(len(out[0])):
        out[0][i][i] += rate
    return out


# ---- on the whole range --------------------------------------------------------------------------------------------------


def stable_on_range(series: Series) -> bool:
    """Every frozen matrix on [-1, 1] is Hurwitz: it is at the middle, and no Hurwitz determinant has a root."""
    n = len(series[0])
    if not is_hurwitz(at(series, Fraction(0))):
        return False
    a = _characteristic(series)
    determinants = []
    for size in range(1, n + 1):
        rows = [[a[2 * (j + 1) - (i + 1)] if 0 <= 2 * (j + 1) - (i + 1) <= n else fmpq_poly([0]) for j in range(size)]
                for i in range(size)]  # fmt: skip
        determinants.append(determinant(rows))
    return all(no_root(found) for found in determinants)


def positive_on_range(series: Series) -> bool:
    """A symmetric matrix polynomial is positive definite on [-1, 1]: all leading minors are positive there."""
    entries = polynomials(series)
    n = len(entries)
    if any(entries[i][j] != entries[j][i] for i in range(n) for j in range(i)):
        return False
    for size in range(1, n + 1):
        minor = determinant([row[:size] for row in entries[:size]])
        if not minor(fmpq(0)) > 0 or not no_root(minor):
            return False
    return True


def lyapunov_on_range(
    A: Series, P: Series, below: Sequence[Fraction], rates: Sequence[Fraction], decay: Fraction, dual: bool
) -> bool:
    """P > 0 and -(P A + A'P + below (rate dP/dv + 2 decay P)) > 0 on the range at every rate of v given; A is over `below`.

    In the dual form A P + P A' - below rate dP/dv takes its place.
    """
    a, p, d = polynomials(A), polynomials(P), fmpq_poly([rational(x) for x in below])
    n = len(p)
    if not positive_on_range(P):
        return False
    for rate in rates:
        speed = rational(-rate if dual else rate)
        rows = []
        for i in range(n):
            row = []
            for j in range(n):
                if dual:
                    product = sum((a[i][k] * p[k][j] + p[i][k] * a[j][k] for k in range(n)), fmpq_poly([0]))
                else:
                    product = sum((p[i][k] * a[k][j] + a[k][i] * p[k][j] for k in range(n)), fmpq_poly([0]))
                row.append(-(product + d * (p[i][j].derivative() * speed + p[i][j] * (2 * rational(decay)))))
            rows.append(row)
        for size in range(1, n + 1):
            minor = determinant([row[:size] for row in rows[:size]])
            if not minor(fmpq(0)) > 0 or not no_root(minor):
                return False
    return True


def polynomials(series: Series) -> list[list[fmpq_poly]]:
    """Entries as polynomials in v."""
    rows, columns = range(len(series[0])), range(len(series[0][0]))
    return [[fmpq_poly([rational(m[i][j]) for m in series]) for j in columns] for i in rows]


def determinant(rows: list[list[fmpq_poly]]) -> fmpq_poly:
    """By the first column; sizes up to four."""
    if len(rows) == 1:
        return rows[0][0]
    total = fmpq_poly([0])
    for i, row in enumerate(rows):
        if row[0] != 0:
            rest = [other[1:] for k, other in enumerate(rows) if k != i]
            total = total + row[0] * determinant(rest) * (-1) ** i
    return total


def no_root(polynomial: fmpq_poly) -> bool:
    """No root in [-1, 1], the ends included: Sturm's theorem on the square-free part."""
    if polynomial.degree() <= 0:
        return bool(polynomial[0] != 0)
    if polynomial(fmpq(-1)) == 0 or polynomial(fmpq(1)) == 0:
        return False
    free = polynomial // polynomial.gcd(polynomial.derivative())
    chain = [free, free.derivative()]
    while chain[-1].degree() > 0:
        rest = -(chain[-2] % chain[-1])
        if rest.degree() < 0:
            break
        chain.append(rest * (1 / abs(rest.leading_coefficient())))
    return _changes(chain, fmpq(-1)) == _changes(chain, fmpq(1))


def _changes(chain: list[fmpq_poly], point: fmpq) -> int:
    signs = [1 if value > 0 else -1 for value in (member(point) for member in chain) if value != 0]
    return sum(a != b for a, b in pairwise(signs))


def _characteristic(series: Series) -> list[fmpq_poly]:
    """Coefficients a_0 = 1, a_1, ... of the characteristic polynomial as polynomials in v (Faddeev and LeVerrier)."""
    A = polynomials(series)
    n = len(A)
    out = [fmpq_poly([1])]
    M = [[fmpq_poly([int(i == j)]) for j in range(n)] for i in range(n)]
    for k in range(1, n + 1):
        moved = [[sum((A[i][m] * M[m][j] for m in range(n)), fmpq_poly([0])) for j in range(n)] for i in range(n)]
        c = sum((moved[i][i] for i in range(n)), fmpq_poly([0])) * fmpq(-1, k)
        out.append(c)
        M = [[moved[i][j] + (c if i == j else fmpq_poly([0])) for j in range(n)] for i in range(n)]
    return out
