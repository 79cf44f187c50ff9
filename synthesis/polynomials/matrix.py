"""Matrix polynomials in the parameters, affine in the decision variables, held as one coefficient array."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError


@dataclass(frozen=True)
class MatrixPolynomial:
    r"""M(p, x) = sum_k p^k (M_k0 + sum_j x_j M_kj), the only form in which an LMI is written here.

    `coefficients` has shape (d_1+1, ..., d_v+1, rows, columns, 1+N): one leading axis of degrees for every variable
    (parameters first, then their rates), last axis = [constant, decision variables]. A known matrix has N = 0.
    Shapes are padded on the fly, so a polynomial never has to know how many decisions its problem has.
    """

    coefficients: FloatArray

    @property
    def variables(self) -> int:
        """Number of polynomial variables."""
        return int(self.coefficients.ndim) - 3

    @property
    def degrees(self) -> tuple[int, ...]:
        """Largest power of every variable."""
        return tuple(size - 1 for size in self.coefficients.shape[: self.variables])

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.coefficients.shape[-3], self.coefficients.shape[-2]

    @property
    def decisions(self) -> int:
        """Number of decision variables it may depend on."""
        return int(self.coefficients.shape[-1]) - 1

    @property
    def T(self) -> MatrixPolynomial:
        """The transpose."""
        return MatrixPolynomial(np.swapaxes(self.coefficients, -3, -2))

    def __neg__(self) -> MatrixPolynomial:
        return MatrixPolynomial(-self.coefficients)

    def __add__(self, other: MatrixPolynomial) -> MatrixPolynomial:
        if self.shape != other.shape:
            raise ProblemError(f"cannot add a {self.shape} and a {other.shape} matrix polynomial")
        leading = np.maximum(self.coefficients.shape[: self.variables], other.coefficients.shape[: self.variables])
        width = max(self.decisions, other.decisions) + 1
        shape = (*(int(n) for n in leading), *self.shape, width)
        return MatrixPolynomial(padded(self.coefficients, shape) + padded(other.coefficients, shape))

    def __sub__(self, other: MatrixPolynomial) -> MatrixPolynomial:
        return self + (-other)

    def __mul__(self, factor: float) -> MatrixPolynomial:
        return MatrixPolynomial(self.coefficients * factor)

    __rmul__ = __mul__

    def __matmul__(self, other: MatrixPolynomial) -> MatrixPolynomial:
        """Product of polynomials; at most one factor may contain decision variables (an LMI is affine in them)."""
        if self.shape[1] != other.shape[0]:
            raise ProblemError(f"cannot multiply a {self.shape} by a {other.shape} matrix polynomial")
        shape = (self.shape[0], other.shape[1])
        if other.decisions:
            return _convolve(self, other, shape, lambda known, unknown: np.einsum("ij,...jkm->...ikm", known, unknown))
        return _convolve(other, self, shape, lambda known, unknown: np.einsum("...ijm,jk->...ikm", unknown, known))

    def scaled_by(self, scalar: MatrixPolynomial, times: int = 1) -> MatrixPolynomial:
        """Multiply by a 1 x 1 polynomial, so many times: a rate, a common denominator, or an unknown scalar."""
        found = self
        for _ in range(times):
            if scalar.decisions:
                found = _convolve(found, scalar, self.shape, lambda known, unknown: known[..., None] * unknown)
            else:
                found = _convolve(scalar, found, self.shape, lambda known, unknown: known[0, 0] * unknown)
        return found

    def derivative(self, variable: int) -> MatrixPolynomial:
        """Partial derivative with respect to one variable."""
        size = self.coefficients.shape[variable]
        if size == 1:
            return MatrixPolynomial(np.zeros_like(self.coefficients))
        powers = np.arange(1, size).reshape([-1 if i == variable else 1 for i in range(self.coefficients.ndim)])
        tail = tuple(slice(1, None) if i == variable else slice(None) for i in range(self.variables))
        return MatrixPolynomial(self.coefficients[tail] * powers)

    def at(self, points: FloatArray) -> FloatArray:
        """Values at (g, v) points: array (g, rows, columns, 1+N)."""
        monomials = np.ones((len(points), 1))
        for variable in range(self.variables):
            powers = np.vander(points[:, variable], self.degrees[variable] + 1, increasing=True)
            monomials = (monomials[:, :, None] * powers[:, None]).reshape(len(points), -1)
        rest = self.coefficients.shape[self.variables :]
        return np.asarray((monomials @ self.coefficients.reshape(monomials.shape[1], -1)).reshape(len(points), *rest))

    def substitute(self, decisions: FloatArray) -> MatrixPolynomial:
        """The known polynomial that results when the decision variables take these values."""
        weights = np.concatenate([[1.0], decisions[: self.decisions]])
        return MatrixPolynomial((self.coefficients @ weights)[..., None])

    def magnitude(self, decisions: FloatArray) -> float:
        """Largest row sum of what `substitute` adds up, signs left out: its rounding is a few eps of this."""
        weights = np.abs(np.concatenate([[1.0], decisions[: self.decisions]]))
        sizes = (np.abs(self.coefficients) @ weights).sum(axis=tuple(range(self.variables)))
        return float(sizes.sum(axis=-1).max(initial=0.0))

    def affine(self, offsets: FloatArray, factors: FloatArray) -> MatrixPolynomial:
        """The same polynomial in new variables u, where p = offset + factor * u."""
        coefficients = self.coefficients
        for variable, (offset, factor) in enumerate(zip(offsets, factors, strict=True)):
            size = coefficients.shape[variable]
            matrix = np.zeros((size, size))  # column k: coefficients of (offset + factor u)^k
            column = np.zeros(size)
            column[0] = 1.0
            for k in range(size):
                matrix[:, k] = column
                column = offset * column + factor * np.concatenate([[0.0], column[:-1]])
            coefficients = np.moveaxis(np.tensordot(matrix, coefficients, axes=(1, variable)), 0, variable)
        return MatrixPolynomial(coefficients)


def _convolve(
    known: MatrixPolynomial,
    unknown: MatrixPolynomial,
    shape: tuple[int, int],
    combine: Callable[[FloatArray, FloatArray], FloatArray],
) -> MatrixPolynomial:
    """Sum over the few monomials of the known factor (never over grid points) of its matrix times the unknown one."""
    if known.decisions:
        raise ProblemError("a product of two unknown matrices is not affine: substitute a new variable for it")
    degrees = tuple(a + b + 1 for a, b in zip(known.degrees, unknown.degrees, strict=True))
    out = np.zeros((*degrees, *shape, unknown.decisions + 1))
    for index in np.ndindex(*known.coefficients.shape[: known.variables]):
        block = known.coefficients[index][..., 0]
        if block.any():
            window = tuple(
                slice(i, i + n) for i, n in zip(index, unknown.coefficients.shape[: known.variables], strict=True)
            )
            out[window] += combine(block, unknown.coefficients)
    return MatrixPolynomial(out)


def padded(coefficients: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Append zero coefficients so that the array has this shape."""
    if coefficients.shape == shape:
        return coefficients
    return np.pad(coefficients, [(0, want - have) for want, have in zip(shape, coefficients.shape, strict=True)])


def constant(matrix: FloatArray, variables: int) -> MatrixPolynomial:
    """A matrix that depends on no parameter and no decision."""
    return MatrixPolynomial(np.asarray(matrix, float)[(None,) * variables][..., None])


def variable(index: int, variables: int) -> MatrixPolynomial:
    """The 1 x 1 polynomial p_index."""
    shape = [1] * variables + [1, 1, 1]
    shape[index] = 2
    coefficients = np.zeros(shape)
    coefficients.reshape(-1)[1] = 1.0
    return MatrixPolynomial(coefficients)


def symmetric_block(rows: list[list[MatrixPolynomial | None]]) -> MatrixPolynomial:
    """A symmetric block matrix from its upper triangle; None below the diagonal is the transpose, above it zero."""
    sizes = [rows[i][i].shape[0] for i in range(len(rows))]  # type: ignore[union-attr]
    present = [block for row in rows for block in row if block is not None]
    leading = np.max([block.coefficients.shape[: block.variables] for block in present], axis=0)
    width = max(block.decisions for block in present) + 1
    ends = np.concatenate([[0], np.cumsum(sizes)])
    out = np.zeros((*(int(n) for n in leading), ends[-1], ends[-1], width))
    for i, row in enumerate(rows):
        for j in range(i, len(row)):
            block = row[j]
            if block is None:
                continue
            target = (*(int(n) for n in leading), sizes[i], sizes[j], width)
            values = padded(block.coefficients, target)
            out[..., ends[i] : ends[i + 1], ends[j] : ends[j + 1], :] = values
            if i != j:
                out[..., ends[j] : ends[j + 1], ends[i] : ends[i + 1], :] = np.swapaxes(values, -3, -2)
    return MatrixPolynomial(out)


def across(*blocks: MatrixPolynomial) -> MatrixPolynomial:
    """[first, second, ..]."""
    return over(*(block.T for block in blocks)).T


def over(*blocks: MatrixPolynomial) -> MatrixPolynomial:
    """[first; second; ..]."""
    leading = np.max([block.coefficients.shape[: block.variables] for block in blocks], axis=0)
    width = max(block.decisions for block in blocks) + 1
    grown = [padded(b.coefficients, (*(int(n) for n in leading), *b.shape, width)) for b in blocks]
    return MatrixPolynomial(np.concatenate(grown, axis=-3))
