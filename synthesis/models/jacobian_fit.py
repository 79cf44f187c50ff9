"""Entries of a Jacobian as formulas: rational ones as they are, others as polynomials with a residual that is proved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from synthesis.errors import ModelError
from synthesis.models.ball_bound import largest_magnitude
from synthesis.models.chebyshev_fit import fitted, on_grid
from synthesis.models.fitted import EXACT, Fitted

HIGHEST_DEGREE = 12
TRIED = {1: 201, 2: 31}  # points of each variable at which a degree is tried before it is proved; 9 with more variables


class JacobianFit:
    """`residuals` has a bound for every entry of the matrices that were made, zero where an entry is exact."""

    def __init__(
        self, build: Fitted, values: Mapping[sp.Symbol, sp.Rational], degree: int | None, tolerance: float
    ) -> None:
        self.build, self.values, self.degree, self.tolerance = build, values, degree, tolerance
        if degree is not None and not 0 <= degree <= HIGHEST_DEGREE:
            raise ModelError(f"{build.where}: degree {degree}; give one from 0 to {HIGHEST_DEGREE}")
        self.residuals: dict[str, FloatArray] = {}

    def matrix(self, key: str, matrix: sp.Matrix) -> sp.Matrix:
        """The formulas of one matrix."""
        self.residuals[key] = np.zeros(matrix.shape)
        entries = [self._entry(key, i, j, matrix[i, j]) for i in range(matrix.rows) for j in range(matrix.cols)]
        return sp.Matrix(matrix.rows, matrix.cols, entries)

    def _entry(self, key: str, i: int, j: int, entry: sp.Expr) -> sp.Expr:
        exact = entry.replace(lambda e: e.is_Float, lambda e: sp.Rational(str(e)))
        numbers = all(n.is_Rational for n in exact.atoms(sp.Number)) and not exact.atoms(sp.NumberSymbol)
        if numbers and exact.is_rational_function(*exact.free_symbols):
            return exact
        where = f"{self.build.where}: {key}[{i}][{j}] = {entry}"
        coefficients, bound, size = self._polynomial(exact, where)
        self.residuals[key][i, j] = bound if bound > EXACT * size else 0.0
        return self.build.entry(key, i, j, coefficients)

    def _polynomial(self, entry: sp.Expr, where: str) -> tuple[FloatArray, float, float]:
        """Coefficients, the bound of the residual, and the size of the entry."""
        parameters = self.build.parameters
        u = [sp.Symbol(f"_{k}") for k in range(len(parameters))]
        inside = {
            sp.Symbol(p.name): sp.Rational(str(p.middle)) + sp.Rational(str(p.half_width)) * v
            for p, v in zip(parameters, u, strict=True)
        }
        function = entry.subs(self.values).subs(inside)
        line = np.linspace(-1.0, 1.0, TRIED.get(len(u), 9))
        truth = self._values(function, u, line, where)
        size = float(np.abs(truth).max())
        off = np.inf
        for degree in range(HIGHEST_DEGREE + 1) if self.degree is None else [self.degree]:
            nodes = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
            values = self._values(function, u, nodes, where)
            coefficients = fitted([nodes] * len(u), values[..., None, None], [degree] * len(u))
            off = float(np.abs(on_grid(coefficients, [line] * len(u))[..., 0, 0] - truth).max())
            if off <= self.tolerance * size:
                off = largest_magnitude(function - _expression(coefficients[..., 0, 0], u), u, [(-1.0, 1.0)] * len(u))
                if off <= self.tolerance * size:
                    return coefficients[..., 0, 0], off, size
        raise ModelError(
            f"{where} is off by {off:.3g} of {size:.3g} as a polynomial of degree {degree}; give a higher degree, a narrower "
            f"range or a larger tolerance than {self.tolerance:g}"
        )

    @staticmethod
    def _values(function: sp.Expr, u: Sequence[sp.Symbol], line: FloatArray, where: str) -> FloatArray:
        mesh = np.meshgrid(*[line] * len(u), indexing="ij")
        with np.errstate(all="ignore"):
            found = np.broadcast_to(sp.lambdify(u, function, "numpy")(*mesh), mesh[0].shape)
        if np.iscomplexobj(found) or not np.isfinite(found).all():
            raise ModelError(f"{where} is not a finite number in the whole range; shrink it")
        return np.asarray(found, float)


def _expression(coefficients: FloatArray, u: Sequence[sp.Symbol]) -> sp.Expr:
    total: sp.Expr = sp.Integer(0)
    for orders, c in np.ndenumerate(coefficients):
        total += sp.Rational(repr(float(c))) * sp.Mul(*(sp.chebyshevt(k, v) for k, v in zip(orders, u, strict=True)))
    return sp.expand(total)
