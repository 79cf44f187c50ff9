"""Bounds of smooth expressions over a box in ball arithmetic: what a fit of a transcendental function leaves over, for certain.

    |r(u)| <= sum over |a| < K of |D^a r(middle)| h^a / a!  +  sum over |a| = K of max |D^a r| h^a / a!

on a cell with half-widths h (Taylor with Lagrange's remainder, a the multi-indices). The cell with the largest bound is halved
until the bound is close to the largest value that was seen, or cells run out.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Mapping, Sequence
from itertools import count, product
from math import factorial
from typing import Any

import sympy as sp
from flint import arb

from synthesis.errors import ModelError

MOST_CELLS = 1000
ORDERS = {1: 5, 2: 3}  # K by the number of variables; 2 for more
CLOSE = 1.25  # a bound of so many times the largest value seen is good enough

_FUNCTIONS: dict[Any, Callable[[Any], Any]] = {
    sp.sin: lambda x: x.sin(), sp.cos: lambda x: x.cos(), sp.tan: lambda x: x.tan(), sp.exp: lambda x: x.exp(),
    sp.log: lambda x: x.log(), sp.atan: lambda x: x.atan(), sp.asin: lambda x: x.asin(), sp.acos: lambda x: x.acos(),
    sp.sinh: lambda x: x.sinh(), sp.cosh: lambda x: x.cosh(), sp.tanh: lambda x: x.tanh(), sp.sec: lambda x: x.sec(),
    sp.cot: lambda x: x.cot(), sp.csc: lambda x: x.csc(), sp.asinh: lambda x: x.asinh(),
}  # fmt: skip


def evaluate(expression: sp.Expr, values: Mapping[sp.Symbol, arb]) -> arb:
    """The expression in balls: an enclosure of all its values. Raises ModelError for a function that is not known here."""
    if expression.is_Symbol:
        return values[expression]
    if expression.is_Rational:
        return arb(int(expression.p)) / int(expression.q)
    if expression is sp.pi:
        return arb.pi()
    if expression is sp.E:
        return arb(1).exp()
    if expression.is_Add or expression.is_Mul:
        parts = [evaluate(part, values) for part in expression.args]
        total = parts[0]
        for part in parts[1:]:
            total = total + part if expression.is_Add else total * part
        return total
    if expression.is_Pow:
        base, power = expression.args
        below = evaluate(base, values)
        if power.is_Integer:
            return below ** int(power) if power > 0 else 1 / below ** int(-power)
        if power == sp.Rational(1, 2):
            return below.sqrt()
        return below ** evaluate(power, values)
    if expression.func in _FUNCTIONS:
        return _FUNCTIONS[expression.func](evaluate(expression.args[0], values))
    raise ModelError(
        f"'{expression.func}' cannot be bounded; write it with sin, cos, tan, exp, log, sqrt, atan, tanh and powers"
    )


def largest_magnitude(expression: sp.Expr, symbols: Sequence[sp.Symbol], box: Sequence[tuple[float, float]]) -> float:
    """A bound on |expression| over the box, infinite where it is not finite."""
    order = ORDERS.get(len(symbols), 2)
    derivatives = {(0,) * len(symbols): expression}
    for powers in sorted(product(range(order + 1), repeat=len(symbols)), key=sum):
        if 0 < sum(powers) <= order:
            axis = next(k for k, power in enumerate(powers) if power)
            below = tuple(power - (k == axis) for k, power in enumerate(powers))
            derivatives[powers] = derivatives[below].diff(symbols[axis])
    number = count()

    def cell(
        middle: tuple[arb, ...], half: tuple[arb, ...]
    ) -> tuple[float, float, int, tuple[arb, ...], tuple[arb, ...]]:
        here = dict(zip(symbols, middle, strict=True))
        around = {s: m + arb(0, h) for s, m, h in zip(symbols, middle, half, strict=True)}
        bound, value = arb(0), 0.0
        for powers, derivative in derivatives.items():
            size = abs(evaluate(derivative, around if sum(powers) == order else here)).abs_upper()
            if not sum(powers):
                value = float(size)
            for h, power in zip(half, powers, strict=True):
                size = size * h**power / factorial(power)
            bound = bound + size
        upper = float(bound.abs_upper()) if bound.is_finite() else float("inf")
        return (-upper * (1.0 + 1e-12), value, next(number), middle, half)

    cells = [cell(*(tuple((arb(high) + sign * arb(low)) / 2 for low, high in box) for sign in (1, -1)))]
    seen = cells[0][1]
    while len(cells) < MOST_CELLS and -cells[0][0] > CLOSE * seen:
        _, _, _, middle, half = heapq.heappop(cells)
        for middle_part, half_part in _halves(middle, half):
            new = cell(middle_part, half_part)
            seen = max(seen, new[1])
            heapq.heappush(cells, new)
    return -cells[0][0]


def _halves(middle: tuple[arb, ...], half: tuple[arb, ...]) -> list[tuple[tuple[arb, ...], tuple[arb, ...]]]:
    """Cut across the widest side; sides are of scaled variables."""
    axis = max(range(len(half)), key=lambda k: float(half[k]))
    narrow = tuple(h / 2 if k == axis else h for k, h in enumerate(half))
    return [
        (tuple(m + sign * narrow[axis] if k == axis else m for k, m in enumerate(middle)), narrow) for sign in (-1, 1)
    ]
