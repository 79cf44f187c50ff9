"""Matrix inequalities without parameters: the engine of the parameter-dependent ones, at a point."""

from __future__ import annotations

import numpy as np

from estimators.arrays import FloatArray
from synthesis.lmi.problem import LmiProblem
from synthesis.polynomials.matrix import MatrixPolynomial


def constant_problem() -> LmiProblem:
    """A margin-maximising problem without parameters."""
    return LmiProblem((), maximise_margin=True)


def matrix_of(polynomial: MatrixPolynomial) -> FloatArray:
    """The value of a substituted unknown that depends on no parameter."""
    return np.asarray(polynomial.coefficients[(0,) * polynomial.variables][..., 0])
