"""Exact systems in float64 and in scaled states: what a search works with."""

from __future__ import annotations

from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from synthesis.loop.system import System
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.matrix import MatrixPolynomial, constant
from synthesis.polynomials.rational import as_float


def floats(matrix: PolynomialMatrix) -> MatrixPolynomial:
    """The middles of the balls."""
    out = np.zeros((*(d + 1 for d in matrix.degrees), *matrix.shape, 1))
    for powers, entries in matrix.terms.items():
        out[powers] = np.array([float(_middle(x)) for x in entries.entries()]).reshape(*matrix.shape, 1)
    return MatrixPolynomial(out)


def _middle(x: Any) -> Any:
    return x.mid() if hasattr(x, "mid") else as_float(x)


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


def middle_of(matrix: object) -> FloatArray:
    """A known matrix polynomial in the middle of its region."""
    coefficients = matrix.coefficients  # type: ignore[attr-defined]
    return np.asarray(coefficients[(0,) * matrix.variables][..., 0])  # type: ignore[attr-defined]
