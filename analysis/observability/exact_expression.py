"""Symbolic matrices as users write them, made fit for exact work: plain symbols, decimals as fractions, kinks as cases."""

from __future__ import annotations

from typing import Any

import sympy as sp

from analysis.errors import AnalysisError
from synthesis.models.symbols import plain


def exact(name: str, matrix: Any) -> sp.ImmutableMatrix:
    """The matrix with every float as the fraction that its shortest decimal says, and symbols without assumptions.

    Raises AnalysisError for complex numbers, NaN and infinities.
    """
    out = plain(sp.Matrix(matrix))
    decimals = out.atoms(sp.Float)
    if not all(number.is_finite for number in decimals):
        out = sp.ImmutableMatrix([sp.nan])
    # A float of 53 bits by its shortest decimal (sympy prints 15 digits only), longer ones by all their digits.
    out = out.xreplace({x: sp.Rational(repr(float(x)) if x._prec == 53 else str(x)) for x in decimals if x.is_finite})
    if out.has(sp.I):
        raise AnalysisError(f"{name} is complex; give real matrices (stack real and imaginary parts)")
    if out.has(sp.nan, sp.oo, -sp.oo, sp.zoo):
        raise AnalysisError(f"{name} has an entry that is not a finite number; remove it before the analysis")
    return sp.ImmutableMatrix(out)


def in_cases(matrix: sp.Matrix) -> sp.ImmutableMatrix:
    """abs, sign, max and min as cases, real parts of real symbols as themselves: each piece has derivatives.

    Without that, sympy differentiates Abs of a plain symbol as if it were complex.
    """

    def absolute(value: sp.Expr) -> sp.Expr:
        return sp.Piecewise((-value, value < 0), (value, True))

    def largest(*values: sp.Expr) -> sp.Expr:
        first, *rest = values
        for value in rest:
            first = sp.Piecewise((value, first - value < 0), (first, True))
        return first

    def signum(value: sp.Expr) -> sp.Expr:
        return sp.Piecewise((sp.Integer(-1), value < 0), (sp.Integer(1), True))

    out = sp.ImmutableMatrix(matrix)
    for kind, written in (
        (sp.Abs, absolute),
        (sp.sign, signum),
        (sp.Max, largest),
        (sp.Min, lambda *values: -largest(*(-value for value in values))),
        (sp.Heaviside, lambda value, *_: (signum(value) + 1) / 2),
    ):
        out = out.replace(kind, written)
    return sp.ImmutableMatrix(out)
