"""All real roots of an expression in one symbol: exact numbers where they exist, else isolated in ball arithmetic."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sympy as sp
from flint import arb, arb_series

from analysis.errors import AnalysisError
from analysis.observability.exact_expression import in_cases
from analysis.observability.lie_series import Evaluator, ball, series_arithmetic

BITS = 256
PIECES = 4000  # of the range, at most
BISECTIONS = 130
CLOSE = sp.Rational(1, 10**25)
Range = tuple[sp.Expr, sp.Expr]


def numerator(expression: sp.Expr) -> sp.Expr:
    """Where this vanishes and the denominator does not, the expression does."""
    return sp.numer(sp.cancel(sp.together(expression)))


def real_roots(expression: sp.Expr, symbol: sp.Symbol, inside: Range | None = None) -> tuple[sp.Expr, ...]:
    """Real roots, ascending; those of polynomials as exact numbers, others as solved by sympy or to 30 digits.

    `inside` is a closed range, which other functions than polynomials need: all their roots there are isolated in ball
    arithmetic, or, where that cannot decide (a double root, a kink), taken as solved by sympy. Raises AnalysisError where the
    expression vanishes everywhere, and where roots cannot be told apart.
    """
    upper, lower = sp.fraction(sp.cancel(sp.together(expression)))
    if upper == 0:
        raise AnalysisError(f"the condition vanishes for every {symbol}: there is no list of roots")
    if symbol not in upper.free_symbols:
        return ()
    found: dict[sp.Expr, None] = {}
    for factor, _ in sp.factor_list(upper)[1]:
        if symbol in factor.free_symbols:
            found.update(dict.fromkeys(_roots(factor, symbol, inside)))
    within = [r for r in found if (inside is None or inside[0] <= r <= inside[1]) and lower.subs(symbol, r) != 0]
    return tuple(sorted(within, key=lambda root: sp.N(root, 40)))


def _roots(factor: sp.Expr, symbol: sp.Symbol, inside: Range | None) -> tuple[sp.Expr, ...]:
    if factor.is_polynomial(symbol):
        polynomial = sp.Poly(factor, symbol)
        if polynomial.degree() == 1:
            return (sp.simplify(-polynomial.nth(0) / polynomial.nth(1)),)
        if polynomial.domain in (sp.ZZ, sp.QQ):
            return tuple(sp.real_roots(polynomial, multiple=True))
        if inside is None:  # Cauchy's bound: no root is larger
            size = sp.N(1 + sum(abs(c / polynomial.LC()) for c in polynomial.all_coeffs()))
            inside = (-sp.Integer(int(size) + 1), sp.Integer(int(size) + 1))
    if inside is None:
        raise AnalysisError(f"{factor} is no polynomial in {symbol}: give the range to search (roots_inside)")
    solved = _solved(factor, symbol, inside)
    try:
        isolated = _isolated(factor, symbol, inside)
    except (AnalysisError, ValueError) as error:
        if solved is None:
            raise AnalysisError(
                f"the roots of {factor} in {symbol} cannot be told apart ({error}); narrow the range"
            ) from None
        return solved
    known = solved or ()
    return (*known, *(root for root in isolated if not any(abs(sp.N(root - k, 40)) < CLOSE for k in known)))


def _solved(factor: sp.Expr, symbol: sp.Symbol, inside: Range) -> tuple[sp.Expr, ...] | None:
    """What sympy solves in closed form, each root checked by inserting it; None if it does not."""
    real = sp.Dummy(symbol.name, real=True)
    try:
        found = sp.solveset(factor.subs(symbol, real), real, sp.Interval(*inside))
    except (NotImplementedError, ValueError, TypeError):
        return None
    if not isinstance(found, sp.FiniteSet):
        return () if found is sp.S.EmptySet else None
    return tuple(root for root in found if root.is_real and abs(sp.N(factor.subs(symbol, root), 30)) < CLOSE)


def _isolated(factor: sp.Expr, symbol: sp.Symbol, inside: Range) -> tuple[sp.Expr, ...]:
    """Every root in the range to 30 digits: intervals with one sign change and a derivative that does not vanish."""
    compiled = Evaluator(list(in_cases(sp.Matrix([factor]))))
    with series_arithmetic(2, BITS):

        def value(at: Any) -> Any:
            try:
                return compiled({symbol.name: at})[0]
            except AnalysisError:  # the piece holds a kink or the border of the domain: smaller ones may not
                return arb_series([arb("nan"), arb("nan")])

        low, high = (ball(sp.Rational(end)) if end.is_Rational else arb(str(sp.N(end, 60))) for end in inside)
        edge = (high - low) * arb(2) ** -80  # roots at the ends belong to the range
        pieces = arb_series.find_roots(value, (low - edge).mid(), (high + edge).mid(), maxn=PIECES)
        found = [_narrowed(value, a.mid(), b.mid()) for a, b in pieces]
    return tuple(inside[0] if root < inside[0] else inside[1] if root > inside[1] else root for root in found)


def _narrowed(value: Callable[[Any], Any], low: Any, high: Any) -> sp.Float:
    """The only root between two points of different sign, by bisection."""
    rises = value(arb_series([low, 1]))[0] < 0
    for _ in range(BISECTIONS):
        middle = ((low + high) / 2).mid()
        at = value(arb_series([middle, 1]))[0]
        if at.contains(0):
            low = high = middle
        elif (at < 0) == rises:
            low = middle
        else:
            high = middle
    return sp.Float(((low + high) / 2).mid().str(40, radius=False), 30)
