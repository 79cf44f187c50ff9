"""Formulas of matrix entries: read exactly, in any arithmetic, and nothing but what the grammar knows."""

from __future__ import annotations

import ast
from fractions import Fraction

import pytest
import sympy as sp

from synthesis.errors import ModelError
from synthesis.models.formula import DIGITS, LONGEST, POWER, parse, read, shown, used

NAMES = {"a": Fraction(3), "b": Fraction(-5, 7), "radius_2": Fraction(1, 3), "_x": Fraction(11, 2)}


def value(text: str) -> Fraction:
    found = read(parse(text, "here"), text.strip(), NAMES, Fraction, "here")
    assert isinstance(found, Fraction)
    return found


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("1", Fraction(1)),
        ("0.1", Fraction(1, 10)),
        (".5", Fraction(1, 2)),
        ("5.", Fraction(5)),
        ("1e-3", Fraction(1, 1000)),
        ("1_000", Fraction(1000)),
        ("1.25E+2", Fraction(125)),
        ("0.1234567890123456789012345678901234567", Fraction("0.1234567890123456789012345678901234567")),
        ("a", Fraction(3)),
        ("-a", Fraction(-3)),
        ("+-+a", Fraction(-3)),
        ("-a**2", Fraction(-9)),
        ("(-a)**2", Fraction(9)),
        ("a**-2", Fraction(1, 9)),
        ("a**- 2", Fraction(1, 9)),
        ("a**0", Fraction(1)),
        ("a - b - radius_2", Fraction(3) + Fraction(5, 7) - Fraction(1, 3)),
        ("a/b/radius_2", Fraction(3) / Fraction(-5, 7) * 3),
        ("a*b + _x*radius_2**2", Fraction(-15, 7) + Fraction(11, 18)),
        ("2*(a + b)*(a - b)/a**2", 2 * (9 - Fraction(25, 49)) / 9),
        (" a + 1 ", Fraction(4)),
        ("2**3 * 1/3", Fraction(8, 3)),
        ("a # + 1", Fraction(3)),
        ("0e-1000000000", Fraction(0)),
        ("0.0e1000000000 + 00", Fraction(0)),
    ],
)  # fmt: skip
def test_numbers_are_exact(text: str, wanted: Fraction) -> None:
    assert value(text) == wanted


def test_every_formula_is_what_sympy_makes_of_it() -> None:
    """An independent check, on sums of products of random depth."""
    import numpy as np

    rng = np.random.default_rng(3)

    def random(depth: int) -> str:
        if depth == 0 or rng.random() < 0.2:
            return str(rng.choice([*NAMES, "2", "0.25", "7", "1e-2"]))
        operator = str(rng.choice(["+", "-", "*", "/", "**", "()", "-()"]))
        if operator == "**":
            return f"({random(depth - 1)})**{int(rng.integers(0, 4))}"
        if operator.endswith("()"):
            return f"{operator[:-2]}({random(depth - 1)})"
        return f"({random(depth - 1)} {operator} {random(depth - 1)})"

    numbers = {sp.Symbol(name): sp.Rational(x.numerator, x.denominator) for name, x in NAMES.items()}
    compared = 0
    for _ in range(300):
        text = random(4)
        exact = sp.nsimplify(sp.sympify(text, rational=True).subs(numbers))
        try:
            found = value(text)
        except ModelError as error:
            assert "division by zero" in str(error)
            continue
        assert sp.Rational(found.numerator, found.denominator) == exact
        compared += 1
    assert compared > 200


def test_any_arithmetic_will_do() -> None:
    """Symbols of sympy instead of numbers."""
    p, k = sp.symbols("p k")
    text = "-k*p**2/3 + 0.5"
    found = read(parse(text, "here"), text, {"p": p, "k": k}, lambda x: sp.Rational(x.numerator, x.denominator), "here")
    assert sp.expand(found - (-k * p**2 / 3 + sp.Rational(1, 2))) == 0


def test_names_that_are_used() -> None:
    assert used(parse("a*b**2 - 3/a", "here")) == {"a", "b"}
    assert used(parse("1 + 2*3", "here")) == set()


@pytest.mark.parametrize(
    "text",
    [
        "", " ", "a b", "a +", "1 +* 2", "(a", "a)", "a**b", "a**0.5", f"a**{POWER + 1}", f"a**-{POWER + 1}", "a**(1+1)",
        "a**2**2", "a//b", "a % b", "a @ b", "a << 1", "a | b", "~a", "not a", "a and b", "a < b", "a if b else 1", "lambda: 1",
        "f(a)", "__import__('os')", "a.real", "a[0]", "[a]", "{a}", "{a: 1}", "(a, b)", "'a'", "b'a'", "f'{a}'", "True", "None",
        "...", "1j", "a := 1", "*a", "await a", "yield a", "0x10", "0x0", "0b1", "0o7", "1_", "01", "1e400", "1e-400",
        "1e1000000000",
        "1e-1000000000", "0." + "0" * 30 + "1e-999999999", "9" * (DIGITS + 1), "a\nb", "a\n", "a\t+1", "a\x00", "a\x1b[2K", "α",
        "a;b", "#", "a=1", "import os", "a" * (LONGEST + 1), "(" * 500 + "a" + ")" * 500, "-" * (LONGEST - 1) + "a",
        "+".join(["(a"] * 400) + ")" * 400, "9**9**9**9",
    ],
    ids=lambda text: ascii(text[:16]),
)  # fmt: skip
def test_everything_else_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(ModelError) as caught:
        value(text)
    assert str(caught.value).startswith("here: ")
    assert str(caught.value).isprintable() and len(str(caught.value)) < 250


@pytest.mark.parametrize("text", ["1/0", "a/(a - 3)", "(a - a)**-1", "1/(0*a)"])
def test_division_by_zero_is_named(text: str) -> None:
    with pytest.raises(ModelError, match=r"here: division by zero in"):
        value(text)


def test_names_must_be_known() -> None:
    with pytest.raises(ModelError, match=r"here: 'c' is neither a constant nor a scheduling parameter"):
        value("a + c")


def test_only_text_is_a_formula() -> None:
    for thing in (None, 1, 1.0, ["a"], {"a": 1}, True, b"a"):
        with pytest.raises(ModelError, match="a formula is one line of ASCII text"):
            parse(thing, "here")  # type: ignore[arg-type]


def test_the_longest_allowed_is_read() -> None:
    text = "+".join(["1"] * (LONGEST // 2))
    assert len(text) <= LONGEST
    assert isinstance(parse(text, "here"), ast.BinOp)
    assert value("a**16") == 3**16 and value("1" * DIGITS) == int("1" * DIGITS)


def test_foreign_text_is_shown_printable_and_short() -> None:
    assert shown("a\nb\x1b[31m") == "a?b?[31m"
    assert shown("x" * 100) == "x" * 57 + "..."
