"""Functions and kinks of symbolic models as power series in ball arithmetic, against mpmath's own Taylor coefficients."""

from __future__ import annotations

from collections.abc import Callable

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from flint import arb, arb_series

from analysis.errors import AnalysisError
from analysis.observability.exact_expression import exact, in_cases
from analysis.observability.lie_series import FUNCTIONS, Evaluator, series_arithmetic

x, y = sp.symbols("x y")
POINT = {sp.acosh: "1.7", sp.coth: "0.9", sp.log: "2.3"}


def coefficients(expression: sp.Expr, at: str, length: int = 6) -> list[arb]:
    """Of the Taylor series in x - at."""
    with series_arithmetic(length, 320):
        (found,) = Evaluator([expression])({"x": arb_series([arb(at), 1])})
        return [found[k] for k in range(length)]


def agree(found: list[arb], function: Callable[[mp.mpf], mp.mpf], at: str) -> None:
    """The ball holds the coefficient, and is no wider than 320 bits need."""
    with mp.workdps(60):
        wanted = mp.taylor(function, mp.mpf(at), len(found) - 1)
        for ball, number in zip(found, wanted, strict=True):
            assert float(ball.rad()) < 1e-80
            assert abs(mp.mpf(ball.mid().str(50, radius=False)) - number) < mp.mpf("1e-30") * (1 + abs(number))


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
def test_every_function_has_its_taylor_series(function: type) -> None:
    at = POINT.get(function, "0.37")
    agree(coefficients(function(x), at), getattr(mp, function.__name__), at)


@pytest.mark.parametrize(
    ("expression", "wanted"),
    [
        (sp.pi * x, lambda t: mp.pi * t),
        (x**sp.E, lambda t: t**mp.e),
        (x ** sp.Rational(2, 3), lambda t: t ** (mp.mpf(2) / 3)),
        (x ** sp.Rational(-3, 2), lambda t: t ** mp.mpf("-1.5")),
        (2**x, lambda t: 2**t),
        (1 / (1 + x**3), lambda t: 1 / (1 + t**3)),
        (sp.Max(x, 1, x**2 + 3), lambda t: t**2 + 3),
        (sp.Max(x**2, x, 1), lambda t: t**2),
        (sp.Min(x, x**2, 1 + x**3), lambda t: t),
        (sp.Min(1 + x**3, x**2 - 4, x), lambda t: t**2 - 4),
        (sp.Abs(x - 3) * sp.sign(x - 4), lambda t: t - 3),
        (sp.Abs(x + 3) + sp.Heaviside(x) * x**2 + sp.Heaviside(x - 5), lambda t: t + 3 + t**2),
    ],
)
def test_powers_constants_and_kinks(expression: sp.Expr, wanted: Callable[[mp.mpf], mp.mpf]) -> None:
    (cases,) = in_cases(sp.Matrix([expression]))
    agree(coefficients(cases, "1.3"), wanted, "1.3")


def test_cases_take_the_branch_that_holds() -> None:
    outside = sp.Piecewise((x**2, sp.Or(x < -1, x > 1)), (x**3, True))
    inside = sp.Piecewise((x**2, sp.And(x > -1, x < 1)), (x**3, True))
    beyond = sp.Piecewise((x**2, sp.Not(sp.Or(x < -1, x > 1), evaluate=False)), (x**3, True))
    for at, square in (("0.5", False), ("2", True), ("-2", True)):
        agree(coefficients(outside, at), (lambda t: t**2) if square else (lambda t: t**3), at)
        for expression in (inside, beyond):
            agree(coefficients(expression, at), (lambda t: t**3) if square else (lambda t: t**2), at)


def test_where_no_series_exists_is_said() -> None:
    for expression, at, words in (
        (sp.Abs(x), "0", "switching surface"),
        (sp.Piecewise((x, sp.Eq(x, 1)), (2 * x, True)), "1", "inequalities"),
        (sp.Piecewise((x, x > 2)), "1", "no branch"),
        (sp.sqrt(x), "0", "no Taylor series"),
        (1 / sp.sin(x), "0", "divides"),
        (sp.csc(x), "0", "no Taylor series"),
        (sp.acosh(x), "0.5", "no Taylor series"),
    ):
        (cases,) = in_cases(sp.Matrix([expression]))
        with pytest.raises(AnalysisError, match=words):
            coefficients(cases, at)


def test_numbers_are_the_decimals_that_were_written() -> None:
    a, b = sp.Float(0.1), sp.Float("0.1234567890123456789012345", 25)
    found = exact("M", [[a * x, b], [sp.Float(1 / 3), sp.Symbol("y", positive=True)]])
    assert found[0, 0] == x / 10 and found[0, 1] == sp.Rational("0.1234567890123456789012345")
    assert found[1, 0] == sp.Rational(repr(1 / 3)) and found[1, 1] == y
    for entry, words in ((sp.I * x, "complex"), (sp.oo, "finite"), (np.nan, "finite"), (sp.zoo, "finite")):
        with pytest.raises(AnalysisError, match=words):
            exact("M", [[entry]])
