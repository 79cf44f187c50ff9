"""A schedule file read independently: json, sympy for its formulas, numpy and scipy for its loop; no code of the prover.

Everything is for one scheduling parameter p; arrays carry the points of p in front.
"""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
import sympy as sp
from numpy.polynomial import chebyshev
from scipy.linalg import expm
from sympy.parsing.sympy_parser import parse_expr, rationalize, standard_transformations

SHAPES = {
    "A": ("states", "states"), "B": ("states", "inputs"), "C": ("outputs", "states"),
    "D": ("outputs", "inputs"), "E": ("states", "disturbances"), "F": ("outputs", "disturbances"),
}  # fmt: skip


class Oracle:
    """What a content says, in float64; polynomials are expanded exactly around the middle of the range first."""

    def __init__(self, content: Mapping[str, Any]) -> None:
        self.content = content
        (self.parameter,) = content["scheduling"]
        self.low, self.high = float(self.parameter["min"]), float(self.parameter["max"])
        self.points = np.array(self.parameter["breakpoints"], float)
        self.period = float(content["update"]["sample_time"])
        self.held = content["update"]["kind"] == "held"
        self.names = {key: [signal["name"] for signal in content["model"][key]] for key in ("states", "disturbances")}

    @cached_property
    def formulas(self) -> dict[str, list[list[list[float]]]]:
        """Coefficients of every entry in powers of u = (p - middle)/half, from formulas and constants."""
        return {
            key: [[[float(c) for c in series] for series in row] for row in rows]
            for key, rows in self.formulas_exact.items()
        }

    @cached_property
    def formulas_exact(self) -> dict[str, list[list[tuple[Fraction, ...]]]]:
        """The same before they are rounded."""
        model, name = self.content["model"], self.parameter["name"]
        constants = {key: _decimal(entry["value"]) for key, entry in model["constants"].items()}
        box = (_decimal(self.parameter["min"]), _decimal(self.parameter["max"]))
        return {
            key: [[_series(text, name, tuple(sorted(constants.items())), box) for text in row] for row in rows]
            for key, rows in model["matrices"].items()
        }

    def scaled(self, p: np.ndarray) -> np.ndarray:
        """u of p."""
        return (np.asarray(p) - 0.5 * (self.low + self.high)) / (0.5 * (self.high - self.low))

    def matrix(self, key: str, p: np.ndarray) -> np.ndarray:
        """A matrix of the plant from its formulas, (g, rows, columns)."""
        u, (rows, columns) = self.scaled(p), SHAPES[key]
        sizes = (len(self.content["model"][rows]), len(self.content["model"][columns]))
        out = np.zeros((len(u), *sizes))
        for i, row in enumerate(self.formulas[key]):
            for j, series in enumerate(row):
                out[:, i, j] = np.polynomial.polynomial.polyval(u, series)
        return out

    def stored(self, key: str, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same from the stored Chebyshev coefficients, and the sum of their absolute values."""
        series = _dense(self.content["plant"][key], self.matrix(key, np.array([self.low])).shape[1:])
        return np.moveaxis(chebyshev.chebval(self.scaled(p), series), -1, 0), np.abs(series).sum(axis=0)

    def lyapunov(self, claim: Mapping[str, Any], p: np.ndarray, derivative: bool = False) -> np.ndarray:
        """P of a claim, or dP/dp."""
        n = len(self.names["states"])
        series = _dense(claim["P"], (n, n))
        if derivative:
            series = chebyshev.chebder(series) if len(series) > 1 else np.zeros((1, n, n))
            series = series / (0.5 * (self.high - self.low))
        return np.moveaxis(chebyshev.chebval(self.scaled(p), series), -1, 0)

    def gain(self, p: np.ndarray) -> np.ndarray:
        """The table, linear between its breakpoints."""
        table = np.array(self.content["gain"]["table"], float)
        flat = table.reshape(len(self.points), -1)
        return np.stack([np.interp(p, self.points, column) for column in flat.T], -1).reshape(len(p), *table.shape[1:])

    def equation(self, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """e' = A e + B d, the gains in continuous time."""
        A, C, E, F = (self.matrix(key, p) for key in "ACEF")
        L = self.gain(p)
        return A - L @ C, E - L @ F

    def update(self, p: np.ndarray) -> dict[str, np.ndarray]:
        """e+ = A e + B d + N x' of one sample with everything held, and A while no measurement comes in; by scipy's expm."""
        A, C, E, F = (self.matrix(key, p) for key in "ACEF")
        L, T, n, unit = self.gain(p), self.period, A.shape[-1], np.broadcast_to(np.eye(A.shape[-1]), A.shape)
        coasting, integral = _held(A, np.concatenate([unit, E], axis=-1), T)
        if not self.held:
            out = {"A": coasting - L @ C, "B": integral[..., n:] - L @ F}
        else:
            closed, driven = _held(A - L @ C, np.concatenate([unit, E - L @ F], axis=-1), T)
            out = {"A": closed, "B": driven[..., n:], "motion": integral[..., :n] - driven[..., :n]}
        return out | {"coasting": coasting}

    def driven(self, p: np.ndarray, period: float) -> np.ndarray:
        """(x, u) over a period with u held and p at rest: the plant itself, without an observer."""
        A, B = self.matrix("A", p), self.matrix("B", p)
        state, forced = _held(A, B, period)
        n, m = B.shape[-2:]
        out = np.zeros((len(p), n + m, n + m))
        out[:, :n, :n], out[:, :n, n:], out[:, n:, n:] = state, forced, np.eye(m)
        return out

    def grid(self, inside: int = 8) -> np.ndarray:
        """Points of every cell, breakpoints among them."""
        parts = [np.linspace(a, b, inside, endpoint=False) for a, b in zip(self.points, self.points[1:], strict=False)]
        return np.array([*np.concatenate(parts), self.points[-1]])

    def walks(self, rng: np.random.Generator, count: int, samples: int) -> np.ndarray:
        """Admissible motions from sample to sample, (samples + 1, count): some wander, some go as fast as they may."""
        p = np.empty((samples + 1, count))
        p[0] = rng.uniform(self.low, self.high, count)
        rates = np.array([self.parameter["rate_min"], self.parameter["rate_max"]], float)
        way = rng.integers(0, 2, count)
        for k in range(samples):
            way = np.where(rng.random(count) < 0.05, 1 - way, way)
            rate = np.where(np.arange(count) % 2 == 0, rates[way], rng.uniform(rates[0], rates[1], count))
            p[k + 1] = np.clip(p[k] + rate * self.period, self.low, self.high)
        return p


def _held(A: np.ndarray, B: np.ndarray, period: float) -> tuple[np.ndarray, np.ndarray]:
    n, m = B.shape[-2:]
    whole = np.zeros((len(A), n + m, n + m))
    whole[:, :n, :n], whole[:, :n, n:] = A * period, B * period
    with np.errstate(all="ignore"):
        found = expm(whole)
    return found[:, :n, :n], found[:, :n, n:]


def _dense(stored: Mapping[str, Any], shape: tuple[int, int]) -> np.ndarray:
    series = np.zeros((max((order for (order,) in stored["orders"]), default=0) + 1, *shape))
    for (order,), matrix in zip(stored["orders"], stored["coefficients"], strict=True):
        series[order] = np.array(matrix, float).reshape(shape)
    return series


def _decimal(number: float) -> Fraction:
    return Fraction(repr(float(number)))


@lru_cache(maxsize=4096)
def _series(
    text: str, name: str, constants: tuple[tuple[str, Fraction], ...], box: tuple[Fraction, Fraction]
) -> tuple[Fraction, ...]:
    p, u = sp.Symbol(name), sp.Dummy("u")
    known = {key: sp.Symbol(key) for key, _ in constants} | {name: p}
    formula = parse_expr(text, local_dict=known, transformations=(*standard_transformations, rationalize))
    values = {known[key]: sp.Rational(value.numerator, value.denominator) for key, value in constants}
    low, high = (sp.Rational(value.numerator, value.denominator) for value in box)
    inner = sp.sympify(formula).subs(values).subs(p, (low + high) / 2 + (high - low) / 2 * u)
    return tuple(Fraction(int(c.p), int(c.q)) for c in sp.Poly(sp.expand(inner), u).all_coeffs()[::-1])
