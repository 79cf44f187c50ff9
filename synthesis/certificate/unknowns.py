"""The inequalities of a claim with float64 numbers and unknowns: what the solver is given."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from synthesis.loop.system import System
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.matrix import MatrixPolynomial, constant, symmetric_block


class Unknowns:
    """Float arithmetic for the inequalities (`synthesis.certificate.inequalities.Arithmetic`)."""

    def eye(self, size: int, like: Any) -> MatrixPolynomial:
        """The unit matrix."""
        return constant(np.eye(size), like.variables)

    def known(self, rows: Any, like: Any) -> MatrixPolynomial:
        """A matrix of numbers."""
        return constant(np.asarray(rows, float), like.variables)

    def block(self, rows: Any) -> MatrixPolynomial:
        """A symmetric block matrix."""
        return symmetric_block(rows)

    def trace(self, matrix: MatrixPolynomial) -> MatrixPolynomial:
        """The sum of the diagonal, 1 x 1."""
        return MatrixPolynomial(np.einsum("...iim->...m", matrix.coefficients)[..., None, None, :])

    def exp(self, exponent: Any) -> float:
        """e^x."""
        return math.exp(exponent)


def floats(matrix: PolynomialMatrix) -> MatrixPolynomial:
    """The middles of the balls."""
    out = np.zeros((*(d + 1 for d in matrix.degrees), *matrix.shape, 1))
    for powers, entries in matrix.terms.items():
        out[powers] = np.array([float(_middle(x)) for x in entries.entries()]).reshape(*matrix.shape, 1)
    return MatrixPolynomial(out)


def _middle(x: Any) -> Any:
    return x.mid() if hasattr(x, "mid") else int(x.p) / int(x.q)


def in_scaled_states(system: System, scale: FloatArray) -> System:
    """The system in the states diag(scale) x, in floats; its output stays what it is."""
    left, right = np.diag(scale), np.diag(1.0 / scale)

    def turned(matrix: PolynomialMatrix | None) -> MatrixPolynomial | None:
        if matrix is None:
            return None
        found = floats(matrix)
        return constant(left, found.variables) @ found @ constant(right, found.variables)

    def lifted(matrix: PolynomialMatrix) -> MatrixPolynomial:
        found = floats(matrix)
        return constant(left, found.variables) @ found

    C = floats(system.C)
    return System(
        system.time,
        turned(system.A),
        {name: lifted(matrix) for name, matrix in system.B.items()},
        C @ constant(right, C.variables),
        {name: floats(matrix) for name, matrix in system.D.items()},
        turned(system.coasting),
        None if system.denominator is None else floats(system.denominator),
        system.shared,
    )
