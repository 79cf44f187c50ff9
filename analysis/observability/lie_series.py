"""Sympy expressions evaluated on power series with ball arithmetic: Taylor coefficients with proved error bounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import reduce
from operator import add, mul
from typing import Any

import sympy as sp
from flint import arb, arb_series, ctx, fmpq

from analysis.errors import AnalysisError

Series = Any  # flint.arb_series; flint has no type stubs

FUNCTIONS: Mapping[type, Callable[[Series], Series]] = {
    sp.sin: lambda s: s.sin(),
    sp.cos: lambda s: s.cos(),
    sp.tan: lambda s: s.tan(),
    sp.atan: lambda s: s.atan(),
    sp.exp: lambda s: s.exp(),
    sp.log: lambda s: s.log(),
    sp.asin: lambda s: s.asin(),
    sp.acos: lambda s: s.acos(),
    sp.cot: lambda s: s.cos() / s.sin(),
    sp.sec: lambda s: 1 / s.cos(),
    sp.csc: lambda s: 1 / s.sin(),
    sp.sinh: lambda s: (s.exp() - (-s).exp()) / 2,
    sp.cosh: lambda s: (s.exp() + (-s).exp()) / 2,
    sp.tanh: lambda s: 1 - 2 / ((2 * s).exp() + 1),
    sp.coth: lambda s: 1 + 2 / ((2 * s).exp() - 1),
    sp.asinh: lambda s: (s + (s * s + 1).sqrt()).log(),
    sp.acosh: lambda s: (s + (s - 1).sqrt() * (s + 1).sqrt()).log(),
    sp.atanh: lambda s: ((1 + s) / (1 - s)).log() / 2,
    sp.erf: lambda s: s.erf(),
}
NUMBERS: Mapping[Any, Callable[[], Any]] = {sp.pi: arb.pi, sp.E: arb.const_e}
LOGICAL = (sp.core.relational.Relational, sp.And, sp.Or, sp.Not, sp.ITE)


@contextmanager
def series_arithmetic(length: int, bits: int) -> Iterator[None]:
    """Length and precision of flint's series, restored afterwards (they are global to flint)."""
    before = ctx.cap, ctx.prec
    ctx.cap, ctx.prec = length, bits
    try:
        yield
    finally:
        ctx.cap, ctx.prec = before


def ball(number: sp.Rational) -> Any:
    """A rational number as a ball."""
    return arb(fmpq(int(number.p), int(number.q)))


class Evaluator:
    """Several expressions at once, shared subexpressions evaluated once; symbols are bound to series by name."""

    def __init__(self, expressions: list[sp.Expr]) -> None:
        self.steps, self.results = sp.cse(expressions, order="none")

    def __call__(self, bound: Mapping[str, Series]) -> list[Series]:
        """The series of every expression. Raises AnalysisError where one divides by zero or has no Taylor series."""
        known = dict(bound)
        try:
            for symbol, expression in self.steps:
                known[str(symbol)] = (_holds if isinstance(expression, LOGICAL) else _value)(expression, known)
            return [_value(expression, known) for expression in self.results]
        except _DivisionError as error:
            divisor = error.divisor
            for symbol, expression in reversed(self.steps):
                divisor = divisor.xreplace({symbol: expression})
            raise AnalysisError(
                f"{divisor} = 0 divides at this point: the model is singular here; move off it"
            ) from None


class _DivisionError(Exception):
    """Carries the divisor, still in terms of shared subexpressions."""

    def __init__(self, divisor: sp.Expr) -> None:
        super().__init__(str(divisor))
        self.divisor = divisor


def _value(expression: sp.Expr, known: Mapping[str, Series]) -> Series:
    if expression.is_Symbol:
        return known[str(expression)]
    if expression.is_Rational:
        return arb_series([ball(expression)])
    if expression in NUMBERS:
        return arb_series([NUMBERS[expression]()])
    if isinstance(expression, sp.Piecewise):
        return _branch(expression, known)
    if isinstance(expression, sp.Pow):
        return _power(expression, known)
    arguments = [_value(argument, known) for argument in expression.args]
    if expression.is_Add:
        return reduce(add, arguments)
    if expression.is_Mul:
        return reduce(mul, arguments)
    function = FUNCTIONS.get(type(expression))
    if function is None:
        raise AnalysisError(
            f"'{expression.func.__name__}' has no series here; known: {', '.join(sorted(f.__name__ for f in FUNCTIONS))}, "
            "powers and Piecewise"
        )
    try:
        return _finite(function(arguments[0]), expression)
    except (ZeroDivisionError, ValueError):  # flint: a quotient by a series that begins with zero
        raise AnalysisError(f"{expression} has no Taylor series at this point; the model is singular here") from None


def _power(expression: sp.Pow, known: Mapping[str, Series]) -> Series:
    base, exponent = expression.args
    value = _value(base, known)
    if not (exponent.is_Rational and exponent.q in (1, 2)):  # b^e = exp(e log b) for b > 0
        return _finite((_value(exponent, known) * value.log()).exp(), expression)
    root = value if exponent.q == 1 else _finite(value.sqrt(), expression)
    out = reduce(mul, [root] * abs(int(exponent.p)))
    if exponent.p > 0:
        return out
    if out.length() == 0 or out[0].contains(0):
        raise _DivisionError(base)
    return _finite(1 / out, expression)


def _branch(expression: sp.Piecewise, known: Mapping[str, Series]) -> Series:
    for value, condition in expression.args:
        if _holds(condition, known):
            return _value(value, known)
    raise AnalysisError(f"no branch of {expression} holds at this point")


def _holds(condition: sp.Basic, known: Mapping[str, Series]) -> bool:
    """Whether a comparison is true at the point itself; on the switching surface no Taylor series exists."""
    if condition in (sp.true, True):
        return True
    if condition.is_Symbol:
        return bool(known[str(condition)])
    if isinstance(condition, sp.ITE):  # what sympy makes of cases inside a comparison
        first, then, otherwise = condition.args
        return _holds(then if _holds(first, known) else otherwise, known)
    if isinstance(condition, sp.And | sp.Or | sp.Not):
        parts = [_holds(part, known) for part in condition.args]
        return (
            all(parts)
            if isinstance(condition, sp.And)
            else any(parts)
            if isinstance(condition, sp.Or)
            else not parts[0]
        )
    if not condition.is_Relational or isinstance(condition, sp.Equality | sp.Unequality):
        raise AnalysisError(f"the condition {condition} of a Piecewise must consist of inequalities")
    difference = _value(condition.lts - condition.gts, known)
    start = difference[0] if difference.length() else arb(0)
    if start.contains(0):
        raise AnalysisError(f"the point lies on the switching surface {condition}; move off it")
    return bool(start < 0)


def _finite(series: Series, expression: sp.Expr) -> Series:
    if not all(coefficient.is_finite() for coefficient in series.coeffs()):
        raise AnalysisError(f"{expression} has no Taylor series at this point; the model is singular here")
    return series
