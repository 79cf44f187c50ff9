"""Formulas of matrix entries as text: parsed into a tree, read in exact arithmetic, never evaluated as code.

    formula := sum of products of names, decimal numbers, integer powers and parentheses     - kappa*radius*wheel_speed/2

The same tree is read in any arithmetic that has + - * /: exact rational functions of the scheduling parameters for a proof, units
for a check of dimensions.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import partial
from operator import mul
from typing import Any, TypeVar

from synthesis.errors import ModelError

Value = TypeVar("Value")

LONGEST = 2000  # characters of a formula
DIGITS = 40  # characters of a number
POWER = 16  # largest exponent


def parse(text: str, where: str) -> ast.expr:
    """The tree of a formula.

    Raises ModelError naming the place for anything but names, numbers, + - * / and ** with an integer exponent.
    """
    if not isinstance(text, str) or not 0 < len(text) <= LONGEST or not (text.isascii() and text.isprintable()):
        raise ModelError(f"{where}: a formula is one line of ASCII text of 1 to {LONGEST} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        place = getattr(error, "offset", None)
        raise ModelError(
            f"{where}: '{shown(text)}' is not a formula of names, numbers, + - * / and **", place - 1 if place else None
        ) from None
    _check(tree, text.strip(), where)
    return tree


def _check(tree: ast.expr, text: str, where: str) -> None:
    waiting: list[ast.expr] = [tree]
    while waiting:
        node = waiting.pop()
        match node:
            case ast.BinOp(left, ast.Pow(), right):
                if exponent(right) is None:
                    words = f"{where}: exponents are integers from -{POWER} to {POWER} in '{shown(text)}'"
                    raise ModelError(words, right.col_offset)
                waiting.append(left)
            case ast.BinOp(left, ast.Add() | ast.Sub() | ast.Mult() | ast.Div(), right):
                waiting += [left, right]
            case ast.UnaryOp(ast.UAdd() | ast.USub(), operand):
                waiting.append(operand)
            case ast.Name():
                pass
            case ast.Constant(value) if type(value) in (int, float):
                number(node, text, where)
            case _:
                raise ModelError(
                    f"{where}: '{shown(ast.get_source_segment(text, node) or text)}' is not allowed in a formula; "
                    "use names, numbers, + - * / and ** with an integer",
                    getattr(node, "col_offset", None),
                )


def exponent(node: ast.expr) -> int | None:
    """The integer that a node spells, if it is one and small enough."""
    sign = 1
    while isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        sign, node = (-sign if isinstance(node.op, ast.USub) else sign), node.operand
    if isinstance(node, ast.Constant) and type(node.value) is int and abs(node.value) <= POWER:
        return sign * node.value
    return None


def number(node: ast.Constant, text: str, where: str) -> Fraction:
    """The decimal as it is written, exactly."""
    segment = text[node.col_offset : node.end_col_offset].replace("_", "")  # one line of ASCII: columns are places
    value = node.value if isinstance(node.value, (int, float)) else float("nan")
    size = abs(float(value)) if not isinstance(value, int) or abs(value) < 10**DIGITS else float("inf")
    if size == 0.0 and not segment.lower().partition("e")[0].strip("0."):
        return Fraction(0)  # 0e-1000000000 included
    if len(segment) > DIGITS or not 1e-100 <= size <= 1e100:
        raise ModelError(
            f"{where}: the number '{shown(segment)}' is beyond 1e100 or {DIGITS} characters", node.col_offset
        )
    try:
        return Fraction(segment)
    except ValueError:
        raise ModelError(f"{where}: '{shown(segment)}' is not a decimal number", node.col_offset) from None


def read(
    tree: ast.expr, text: str, names: Mapping[str, Value], literal: Callable[[Fraction], Value], where: str
) -> Value:
    """The formula in the arithmetic of `names`; `literal` makes a value of a number.

    Raises ModelError for a name that is not known, and for a division by zero; its offset, and that of an error of the
    arithmetic, is where the operand stands.
    """

    def value(node: ast.expr) -> Any:
        match node:
            case ast.BinOp(left, ast.Pow(), right):
                power = exponent(right) or 0
                base = value(left) if power >= 0 else quotient(literal(Fraction(1)), value(left), left)
                found = literal(Fraction(1))
                for _ in range(abs(power)):
                    found = placed(partial(mul, found, base), left)
                return found
            case ast.BinOp(left, operator, right):
                above, below = value(left), value(right)
                return placed(lambda: combined(above, operator, below, right), right)
            case ast.UnaryOp(ast.USub(), operand):
                return literal(Fraction(-1)) * value(operand)
            case ast.UnaryOp(_, operand):
                return value(operand)
            case ast.Name(name):
                if name not in names:
                    from difflib import get_close_matches  # needed for a refusal alone

                    close = get_close_matches(name, list(names), n=1)
                    hint = f"; did you mean {close[0]}?" if close else ""
                    words = f"{where}: '{shown(name)}' is neither a constant nor a scheduling parameter{hint}"
                    raise ModelError(words, node.col_offset)
                return names[name]
            case ast.Constant():
                return literal(number(node, text, where))
        raise ModelError(f"{where}: '{shown(text)}' is not a formula")

    def placed(action: Callable[[], Any], node: ast.expr) -> Any:
        try:
            return action()
        except ModelError as error:
            error.offset = node.col_offset if error.offset is None else error.offset
            raise

    def combined(above: Any, operator: ast.operator, below: Any, right: ast.expr) -> Any:
        match operator:
            case ast.Add():
                return above + below
            case ast.Sub():
                return above - below
            case ast.Mult():
                return above * below
        return quotient(above, below, right)

    def quotient(above: Any, below: Any, right: ast.expr) -> Any:
        try:
            return above / below
        except ZeroDivisionError:
            raise ModelError(f"{where}: division by zero in '{shown(text)}'", right.col_offset) from None

    try:
        return value(tree)  # type: ignore[no-any-return]
    except RecursionError:
        raise ModelError(f"{where}: '{shown(text)}' is nested too deeply") from None


def used(tree: ast.expr) -> set[str]:
    """The names in a formula."""
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


def shown(text: str, most: int = 60) -> str:
    """A piece of a foreign text for a message: printable, and not long."""
    clean = "".join(c if c.isprintable() else "?" for c in text)
    return clean if len(clean) <= most else clean[: most - 3] + "..."
