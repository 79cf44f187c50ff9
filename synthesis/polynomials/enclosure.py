"""Matrix polynomials over exact numbers or balls: the ring in which proofs are made.

    M(t) = sum over k of t^k M_k,    t in [-1, 1]^v,    M_k a matrix of rationals (flint.fmpq_mat) or of balls (flint.arb_mat)

A ball is a number with a bound on its error; every operation on balls encloses the exact result, so what is shown of a ball
polynomial is true of everything in it. The operations are those of `synthesis.polynomials.matrix.MatrixPolynomial`, which
carries unknowns for the solver: an inequality is written once and read in both rings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import comb
from operator import add
from typing import Any, TypeAlias

from flint import arb, arb_mat, ctx, fmpq, fmpq_mat

ctx.prec = 128  # bits of a ball; rounding errors of 1e-38 leave every margin that a float64 table can have

Entries: TypeAlias = Any  # fmpq_mat or arb_mat; flint has no type stubs
Powers: TypeAlias = tuple[int, ...]


class PolynomialMatrix:
    """M(t) as a mapping from powers (one for every variable) to coefficient matrices; absent powers are zero."""

    __slots__ = ("shape", "terms", "variables")

    def __init__(self, terms: Mapping[Powers, Entries], shape: tuple[int, int], variables: int) -> None:
        self.terms = dict(terms)
        self.shape = shape
        self.variables = variables

    @property
    def degrees(self) -> Powers:
        """Largest power of every variable."""
        return tuple(max((powers[i] for powers in self.terms), default=0) for i in range(self.variables))

    @property
    def T(self) -> PolynomialMatrix:
        """The transpose."""
        return PolynomialMatrix({k: m.transpose() for k, m in self.terms.items()}, self.shape[::-1], self.variables)

    def map(self, function: Callable[[Entries], Entries]) -> PolynomialMatrix:
        """Every coefficient matrix through a linear function that keeps its shape."""
        return PolynomialMatrix({k: function(m) for k, m in self.terms.items()}, self.shape, self.variables)

    def __neg__(self) -> PolynomialMatrix:
        return self.map(lambda m: -1 * m)

    def __add__(self, other: PolynomialMatrix) -> PolynomialMatrix:
        if (self.shape, self.variables) != (other.shape, other.variables):
            raise ValueError(
                f"cannot add {self.shape} and {other.shape} in {self.variables}, {other.variables} variables"
            )
        terms = dict(self.terms)
        for powers, matrix in other.terms.items():
            terms[powers] = terms[powers] + matrix if powers in terms else matrix
        return PolynomialMatrix(terms, self.shape, self.variables)

    def __sub__(self, other: PolynomialMatrix) -> PolynomialMatrix:
        return self + (-other)

    def __mul__(self, factor: Any) -> PolynomialMatrix:
        return self.map(lambda m: m * factor)

    __rmul__ = __mul__

    def __matmul__(self, other: PolynomialMatrix) -> PolynomialMatrix:
        """The product of matrix polynomials."""
        if self.shape[1] != other.shape[0]:
            raise ValueError(f"cannot multiply {self.shape} by {other.shape}")
        terms: dict[Powers, Entries] = {}
        for left, a in self.terms.items():
            for right, b in other.terms.items():
                powers = tuple(map(add, left, right))
                terms[powers] = terms[powers] + a * b if powers in terms else a * b
        return PolynomialMatrix(terms, (self.shape[0], other.shape[1]), self.variables)

    def scaled_by(self, scalar: PolynomialMatrix) -> PolynomialMatrix:
        """Every entry times a 1 x 1 polynomial."""
        terms: dict[Powers, Entries] = {}
        for left, a in self.terms.items():
            for right, b in scalar.terms.items():
                powers = tuple(map(add, left, right))
                part = a * b[0, 0]
                terms[powers] = terms[powers] + part if powers in terms else part
        return PolynomialMatrix(terms, self.shape, self.variables)

    def derivative(self, variable: int) -> PolynomialMatrix:
        """dM/dt of one variable."""
        terms = {
            (*k[:variable], k[variable] - 1, *k[variable + 1 :]): m * k[variable]
            for k, m in self.terms.items()
            if k[variable]
        }
        return PolynomialMatrix(terms, self.shape, self.variables)

    def affine(self, offsets: Sequence[Any], factors: Sequence[Any]) -> PolynomialMatrix:
        """The same polynomial in new variables s, where t = offset + factor s."""
        found = self
        for variable, (offset, factor) in enumerate(zip(offsets, factors, strict=True)):
            terms: dict[Powers, Entries] = {}
            for powers, matrix in found.terms.items():
                n = powers[variable]
                for k in range(n + 1):
                    weight = comb(n, k) * offset ** (n - k) * factor**k
                    if weight == 0:
                        continue
                    place = (*powers[:variable], k, *powers[variable + 1 :])
                    part = matrix * weight
                    terms[place] = terms[place] + part if place in terms else part
            found = PolynomialMatrix(terms, self.shape, self.variables)
        return found

    def in_variables(self, variables: int) -> PolynomialMatrix:
        """The same polynomial, further variables (on which it does not depend) behind its own."""
        more = (0,) * (variables - self.variables)
        return PolynomialMatrix({(*k, *more): m for k, m in self.terms.items()}, self.shape, variables)

    def at(self, point: Sequence[Any]) -> Entries:
        """The value at one point."""
        total = zero(self.shape) if not self.terms else None
        for powers, matrix in self.terms.items():
            weight: Any = fmpq(1)
            for value, power in zip(point, powers, strict=True):
                weight = weight * value**power
            total = matrix * weight if total is None else total + matrix * weight
        return total

    def balls(self) -> PolynomialMatrix:
        """The same polynomial with balls for coefficients."""
        return self.map(arb_mat)

    def inflated(self, radius: Callable[[int, int], Any]) -> PolynomialMatrix:
        """Every entry (i, j) uncertain by +-radius(i, j), everywhere."""
        rows, columns = self.shape
        spread = arb_mat(rows, columns, [arb(0, radius(i, j)) for i in range(rows) for j in range(columns)])
        return self + constant(spread, self.variables)

    def truncated(self, order: int) -> PolynomialMatrix:
        """An enclosure of total degree `order` on [-1, 1]^v: |t^k| <= 1, so higher terms only widen the constant one."""
        kept, size = {}, None
        for powers, matrix in self.terms.items():
            if sum(powers) <= order:
                kept[powers] = matrix
            else:
                size = magnitudes(matrix) if size is None else size + magnitudes(matrix)
        found = PolynomialMatrix(kept, self.shape, self.variables)
        if size is None:
            return found
        return found.inflated(lambda i, j: size[i, j].abs_upper())

    def shortened(self, share: float) -> PolynomialMatrix:
        """Without its highest terms, as many as add up to no more than this share of the largest row sum of all terms."""
        sizes = {powers: row_sum(matrix) for powers, matrix in self.terms.items()}
        allowed, order = share * sum(sizes.values()), max((sum(powers) for powers in sizes), default=0)
        while order > 0 and (size := sum(s for powers, s in sizes.items() if sum(powers) == order)) <= allowed:
            allowed, order = allowed - size, order - 1
        return self.truncated(order)


def row_sum(matrix: Entries) -> float:
    """An upper bound of the largest row sum of absolute values."""
    rows = magnitudes(matrix).tolist()
    return max((float(sum(row, arb(0)).abs_upper()) * (1.0 + 1e-15) for row in rows), default=0.0)


def constant(matrix: Entries, variables: int) -> PolynomialMatrix:
    """A matrix that depends on no variable."""
    return PolynomialMatrix({(0,) * variables: matrix}, (matrix.nrows(), matrix.ncols()), variables)


def zero(shape: tuple[int, int]) -> Entries:
    """A zero matrix of rationals."""
    return fmpq_mat(*shape, [fmpq(0)] * (shape[0] * shape[1]))


def identity(size: int, variables: int) -> PolynomialMatrix:
    """The unit matrix."""
    return constant(
        fmpq_mat(size, size, [fmpq(int(i == j)) for i in range(size) for j in range(size)]), variables
    ).balls()


def variable(index: int, variables: int) -> PolynomialMatrix:
    """The 1 x 1 polynomial t_index."""
    return PolynomialMatrix({tuple(int(i == index) for i in range(variables)): fmpq_mat([[1]])}, (1, 1), variables)


def magnitudes(matrix: Entries) -> Entries:
    """Upper bounds of the absolute values of all entries, as balls without error."""
    return arb_mat(matrix.nrows(), matrix.ncols(), [abs(arb(entry)).abs_upper() for entry in matrix.entries()])


def block(rows: Sequence[Sequence[PolynomialMatrix | None]]) -> PolynomialMatrix:
    """A symmetric block matrix from its upper triangle; None below the diagonal is the transpose, above it zero."""
    diagonal = [row[i] for i, row in enumerate(rows)]
    sizes = [part.shape[0] for part in diagonal if part is not None]
    starts = [sum(sizes[:i]) for i in range(len(sizes))]
    size, variables = sum(sizes), next(part.variables for part in diagonal if part is not None)
    terms: dict[Powers, list[list[Any]]] = {}
    for i, row in enumerate(rows):
        for j in range(i, len(rows)):
            part = row[j]
            for powers, matrix in (part.terms if part is not None else {}).items():
                cells = terms.setdefault(powers, [[0] * size for _ in range(size)])
                for a, line in enumerate(matrix.tolist()):
                    for b, entry in enumerate(line):
                        cells[starts[i] + a][starts[j] + b] = entry
                        if i != j:
                            cells[starts[j] + b][starts[i] + a] = entry
    return PolynomialMatrix({k: arb_mat(cells) for k, cells in terms.items()}, (size, size), variables)


def from_coefficients(
    items: Iterable[tuple[Powers, Sequence[Sequence[Any]]]], shape: tuple[int, int], variables: int
) -> PolynomialMatrix:
    """From pairs of powers and matrices of rationals, given as rows."""
    terms = {tuple(k): fmpq_mat(*shape, [entry for row in rows for entry in row]) for k, rows in items}
    return PolynomialMatrix(terms, shape, variables)
