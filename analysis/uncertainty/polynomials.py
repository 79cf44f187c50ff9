r"""Stability and gain of a whole family of systems as signs of polynomials in its parameters: exact, and nothing is lost.

Stability. chi(s; u) = det(s I - A(u)) = c_n s^n + .. + c_0 with c_n > 0. If one member is stable and, on a connected set of u,
c_n > 0, c_0 > 0 and the Hurwitz determinant H_(n-1) > 0, then all are: roots move continuously, and one that reaches the
imaginary axis makes c_0 or H_(n-1) zero (Orlando's formula). In discrete time z = (1 + s)/(1 - s) leads to the same.

Gain. On the imaginary axis det M(jw; u) = +-|chi(jw)|^2 det(g^2 I - G(jw)* G(jw)) with

    M(s) = [[A - s I, 0, B], [-C'C, -A' - s I, -C'D], [D'C, B', D'D - g^2 I]].

If all members are stable, one of them has a gain below g, and this polynomial in x = w^2 and u has no zero, then every gain is
below g.
"""

from __future__ import annotations

from math import comb
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly_ctx

from analysis.lpv.question import Question
from synthesis.polynomials.enclosure import PolynomialMatrix

Entry = Any  # flint.fmpq_mpoly; flint has no type stubs
S, G = 0, 1  # places of s and g^2 among the variables; then u_1 .. u_p


class Family:
    """The matrices of a question as rows of polynomials in (s, g^2, u_1 .. u_p)."""

    def __init__(self, question: Question) -> None:
        self.count = len(question.axes)
        self.context = fmpq_mpoly_ctx.get(["s", "g", *(f"u{i}" for i in range(self.count))])
        self.s, self.g = self.context.gens()[:2]
        self.rows = {key: self._rows(matrix) for key, matrix in question.exact.items()}
        self.d = self.rows["denominator"][0][0]
        self.discrete = question.discrete

    def _rows(self, matrix: PolynomialMatrix) -> list[list[Entry]]:
        rows, columns = matrix.shape
        cells: list[list[dict[tuple[int, ...], fmpq]]] = [[{} for _ in range(columns)] for _ in range(rows)]
        for powers, entries in matrix.terms.items():
            for i, row in enumerate(entries.tolist()):
                for j, entry in enumerate(row):
                    if entry != 0:
                        cells[i][j][(0, 0, *powers)] = entry
        return [[self.context.from_dict(cell) for cell in row] for row in cells]

    def stability(self) -> list[PolynomialMatrix]:
        """1 x 1 polynomials in u that are all positive where the system is stable, and change sign before it is not."""
        coefficients = self._characteristic()
        if self.discrete:
            coefficients = _bilinear(coefficients)
        centre = self._at_centre(coefficients[-1])
        if centre < 0:
            coefficients = [-c for c in coefficients]
        n = len(coefficients) - 1
        zero = self.context.from_dict({})
        hurwitz = [
            [
                coefficients[n - (2 * (j + 1) - (i + 1))] if 0 <= 2 * (j + 1) - (i + 1) <= n else zero
                for j in range(n - 1)
            ]
            for i in range(n - 1)
        ]
        found = [coefficients[-1], coefficients[0]] + ([determinant(hurwitz, self.context)] if n > 1 else [])
        return [self.in_parameters(entry) for entry in found]

    def _characteristic(self) -> list[Entry]:
        """c_0 .. c_n of det(s d I - A) for A/d, without common factors: these are powers of factors of d."""
        rows = self.rows["A"]
        n = len(rows)
        matrix = [[self.s * self.d * int(i == j) - rows[i][j] for j in range(n)] for i in range(n)]
        coefficients = self._in_s(determinant(matrix, self.context), n)
        common = coefficients[-1]
        for c in coefficients[:-1]:
            common = common.gcd(c)
        return [c / common for c in coefficients]

    def gain(self) -> list[Entry]:
        """Coefficients of x^0, x^1, .. of |chi|^2 det(g^2 I - G*G) times a power of d > 0, polynomials in g^2 and u."""
        A, B, C, D = (self.rows[key] for key in "ABCD")
        d, s = self.d, self.s
        n, m = len(A), len(B[0])
        CC, CD, DD = (_product(_transposed(a), b) for a, b in ((C, C), (C, D), (D, D)))
        zero = self.context.from_dict({})

        def unit(i: int, j: int, entry: Entry) -> Entry:
            return entry if i == j else zero

        top = [[A[i][j] - unit(i, j, s * d) for j in range(n)] + [zero] * n + B[i] for i in range(n)]
        middle = [
            [-CC[i][j] for j in range(n)]
            + [-A[j][i] * d - unit(i, j, s * d * d) for j in range(n)]
            + [-x for x in CD[i]]
            for i in range(n)
        ]
        bottom = [
            [CD[j][i] for j in range(n)] + [B[j][i] * d for j in range(n)]
            + [DD[i][j] - unit(i, j, self.g * d * d) for j in range(m)]
            for i in range(m)
        ]  # fmt: skip
        sign = -1 if (n + m) % 2 else 1
        even = self._in_s(determinant([*top, *middle, *bottom], self.context), 2 * n)[::2]
        return [c * (sign * (-1) ** k) for k, c in enumerate(even)]

    def _in_s(self, polynomial: Entry, degree: int) -> list[Entry]:
        """Coefficients of s^0 .. s^degree."""
        found: list[dict[tuple[int, ...], fmpq]] = [{} for _ in range(degree + 1)]
        for powers, value in polynomial.to_dict().items():
            found[powers[S]][(0, *powers[1:])] = value
        return [self.context.from_dict(terms) for terms in found]

    def _at_centre(self, polynomial: Entry) -> fmpq:
        return polynomial.to_dict().get((0,) * (self.count + 2), fmpq(0))

    def in_parameters(self, polynomial: Entry, square: fmpq | None = None) -> PolynomialMatrix:
        """A 1 x 1 polynomial in u, with a number in the place of g^2."""
        terms: dict[tuple[int, ...], fmpq] = {}
        for powers, value in polynomial.to_dict().items():
            weight = value if square is None else value * square ** int(powers[G])
            place = tuple(int(k) for k in powers[2:])
            terms[place] = terms.get(place, fmpq(0)) + weight
        return PolynomialMatrix({k: fmpq_mat([[v]]) for k, v in terms.items()}, (1, 1), self.count)


def over_frequencies(coefficients: list[PolynomialMatrix], centre: fmpq) -> PolynomialMatrix:
    """Sum of c_k(u) x^k on 0 <= x <= inf as a polynomial in (u, v), v in [-1, 1]: x = centre (1 + v)/(1 - v), times (1 - v)^n."""
    n, count = len(coefficients) - 1, coefficients[0].variables
    total = PolynomialMatrix({}, (1, 1), count + 1)
    for k, c in enumerate(coefficients):
        weights = _plus_minus(k, n - k)
        for power, weight in enumerate(weights):
            if weight:
                scaled = c * (fmpq(weight) * centre**k)
                total = total + PolynomialMatrix(
                    {(*key, power): m for key, m in scaled.terms.items()}, (1, 1), count + 1
                )
    return total


def determinant(rows: list[list[Entry]], context: Any) -> Entry:
    """By fraction-free elimination (Bareiss 1968): every division is exact."""
    work, sign = [list(row) for row in rows], 1
    before = context.from_dict({(0,) * context.nvars(): fmpq(1)})
    size = len(work)
    for k in range(size - 1):
        places = [i for i in range(k, size) if not work[i][k].is_zero()]
        if not places:
            return context.from_dict({})
        best = min(places, key=lambda i: len(work[i][k].to_dict()))
        if best != k:
            work[k], work[best], sign = work[best], work[k], -sign
        for i in range(k + 1, size):
            for j in range(k + 1, size):
                work[i][j] = (work[i][j] * work[k][k] - work[i][k] * work[k][j]) / before
        before = work[k][k]
    return work[-1][-1] * sign


def _bilinear(coefficients: list[Entry]) -> list[Entry]:
    """c_k z^k with z = (1 + s)/(1 - s), times (1 - s)^n, in powers of s."""
    n = len(coefficients) - 1
    out = [coefficients[0] * 0 for _ in range(n + 1)]
    for k, c in enumerate(coefficients):
        for power, weight in enumerate(_plus_minus(k, n - k)):
            out[power] = out[power] + c * weight
    return out


def _plus_minus(plus: int, minus: int) -> list[int]:
    """Coefficients of (1 + v)^plus (1 - v)^minus."""
    return [
        sum(comb(plus, i) * comb(minus, k - i) * (-1) ** (k - i) for i in range(max(0, k - minus), min(plus, k) + 1))
        for k in range(plus + minus + 1)
    ]


def _transposed(rows: list[list[Entry]]) -> list[list[Entry]]:
    return [list(column) for column in zip(*rows, strict=True)]


def _product(left: list[list[Entry]], right: list[list[Entry]]) -> list[list[Entry]]:
    columns = _transposed(right)
    out = []
    for row in left:
        line = []
        for column in columns:
            total = row[0] * column[0]
            for a, b in zip(row[1:], column[1:], strict=True):
                total = total + a * b
            line.append(total)
        out.append(line)
    return out
