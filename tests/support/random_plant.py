"""Random two-state plants of one parameter with gains that stabilise them: symbols for the prover, numbers for a simulation.

Every number is a short decimal, so that the symbolic model and the floats here are one and the same plant. Nothing here asks
`synthesis` for a matrix: entries are sum_k c_k v^k with v = (p - centre)/half computed exactly, then rounded once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import ceil, log10
from typing import Any

import numpy as np
import sympy as sp
from scipy.linalg import expm

from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter, Signal

KINDS = ("stable", "oscillating", "unstable", "unstable oscillating", "integrators", "double pole")
RANGES = ("-1 1", "634.65 635.65", "0 140", "0.001 0.003", "9999.5 10000.5", "-5 20", "1 2")
SHAPES = {"A": (2, 2), "B": (2, 1), "C": (1, 2), "D": (1, 1), "E": (2, 2), "F": (1, 2)}


@dataclass(frozen=True)
class RandomPlant:
    """x' = A x + B u + E d, y = C x + D u + F d; `series[key][k]` are the coefficients of v^k, rows of decimals."""

    seed: int
    kind: str
    low: str
    high: str
    rates: tuple[float, float]
    sample_time: float
    speed: float  # 1/s: poles are of this size
    units: dict[str, float]  # sizes of x1, x2, u, y, d1, d2 in what one would call one
    series: dict[str, list[list[list[Fraction]]]]

    @cached_property
    def half(self) -> Fraction:
        return (Fraction(self.high) - Fraction(self.low)) / 2

    @cached_property
    def centre(self) -> Fraction:
        return (Fraction(self.high) + Fraction(self.low)) / 2

    @property
    def roundoff(self) -> float:
        """What float64 makes of v = (p - centre)/half and of polynomials in it, with room."""
        return 1e-13 + 2e-15 * float(abs(self.centre) / self.half)

    def at(self, parameters: Sequence[float] | np.ndarray) -> dict[str, np.ndarray]:
        """Matrices at parameter values (g,): (g, rows, columns)."""
        # The centre in two parts, as (p - 635.15) from the float64 next to it would be off by what is to be judged.
        rounded, half = float(self.centre), float(self.half)
        v = ((np.asarray(parameters, float) - rounded) - float(self.centre - Fraction(rounded))) / half
        return {
            key: sum(np.array(matrix, float) * v[:, None, None] ** k for k, matrix in enumerate(matrices))
            for key, matrices in self.series.items()
        }  # type: ignore[return-value]

    def held_over_a_sample(self, parameters: np.ndarray, extra: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
        """e^(TA) and T phi(TA) at the parameters, by scipy; A - extra takes the place of A if `extra` is given.

        expm is good to the norm of its argument, so the states are taken in their own sizes first.
        """
        A = self.at(parameters)["A"]
        A = A if extra is None else A - extra
        size = np.array([self.units["x1"], self.units["x2"]])
        augmented = np.zeros((len(A), 4, 4))
        augmented[:, :2, :2] = A / size[:, None] * size
        augmented[:, :2, 2:] = np.eye(2)
        found = expm(augmented * self.sample_time)
        back = size[:, None] / size
        return found[:, :2, :2] * back, found[:, :2, 2:] * back

    @cached_property
    def model(self) -> LpvModel:
        """The same plant in symbols."""
        p = sp.Symbol("p")
        centre, half = (sp.Rational(x.numerator, x.denominator) for x in (self.centre, self.half))

        def entry(key: str, i: int, j: int) -> sp.Expr:
            series = [sp.Rational(m[i][j].numerator, m[i][j].denominator) for m in self.series[key]]
            return sum(c * ((p - centre) / half) ** k for k, c in enumerate(series))

        matrices = {
            key: sp.Matrix(rows, columns, lambda i, j, key=key: sp.expand(entry(key, int(i), int(j))))
            for key, (rows, columns) in SHAPES.items()
        }
        return LpvModel(
            name=f"random-{self.seed}",
            source="drawn at random",
            states=(Signal("x1", "1"), Signal("x2", "1")),
            inputs=(Signal("u", "1"),),
            outputs=(Signal("y", "1"),),
            disturbances=(Signal("process", "1"), Signal("noise", "1")),
            parameters=(SchedulingParameter("p", "1", float(self.low), float(self.high), *self.rates),),
            **matrices,
        )

    def stabilising(self, update: str, breakpoints: np.ndarray, draw: np.random.Generator) -> np.ndarray:
        """Gains (b, 2, 1) that put the frozen poles somewhere at the breakpoints, in few digits (not checked in between)."""
        matrices, T = self.at(breakpoints), self.sample_time
        start = self.speed * 10 ** draw.uniform(-0.7, 0.7)
        if draw.random() < 0.6:
            wanted = -start * np.array([1.0, 10 ** draw.uniform(0.0, 0.7)])
        else:
            wanted = -start * np.array([1.0 + 1.0j, 1.0 - 1.0j])
        A = matrices["A"] if update == "held" else self.held_over_a_sample(breakpoints)[0]
        polynomial = np.poly(wanted if update == "held" else np.exp(wanted * T)).real
        table = []
        for a, c in zip(A, matrices["C"], strict=True):
            size = np.array([self.units["x1"], self.units["x2"]])
            scaled, row = a / size[:, None] * size, c * size / self.units["y"]
            observability = np.vstack([row, row @ scaled])
            value = polynomial[0] * scaled @ scaled + polynomial[1] * scaled + polynomial[2] * np.eye(2)
            gain = value @ np.linalg.solve(observability, [[0.0], [1.0]]) * size[:, None] / self.units["y"]
            table.append([[few_digits(x)] for x in gain[:, 0]])
        return np.array(table)

    def frozen(self, update: str, breakpoints: np.ndarray, table: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """A of the error's update at the parameters, with linearly interpolated gains: (g, 2, 2)."""
        gain = interpolated(breakpoints, table, parameters)
        C = self.at(parameters)["C"]
        if update == "held":
            return self.held_over_a_sample(parameters, gain @ C)[0]
        return self.held_over_a_sample(parameters)[0] - gain @ C


def interpolated(breakpoints: np.ndarray, table: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Gains (g, 2, 1) between the breakpoints."""
    columns = [np.interp(parameters, breakpoints, table[:, i, 0]) for i in (0, 1)]
    return np.stack(columns, axis=-1)[..., None]


def few_digits(x: float, digits: int = 5) -> float:
    """The number in few digits."""
    return float(f"{x:.{digits - 1}e}")


def random_plant(seed: int, given: dict[str, float] | None = None) -> RandomPlant:
    """Units (unless given), speeds, sample times and rates over several decades; about the same chance for every kind of pole."""
    draw = np.random.default_rng(seed)
    kind = KINDS[draw.integers(len(KINDS))]
    low, high = RANGES[draw.integers(len(RANGES))].split()
    T = few_digits(10 ** draw.uniform(-2.7, -0.7), 2)
    speed = 10 ** draw.uniform(-2.0, -0.3) / T
    half = float(Fraction(high) - Fraction(low)) / 2
    quick = half * 10 ** draw.uniform(-2.0, 0.5) / T * 0.1
    rates = (-few_digits(quick * draw.uniform(0.2, 1.0), 3), few_digits(quick * draw.uniform(0.0, 1.0), 3))
    units = {name: 10.0 ** int(draw.integers(-4, 5)) for name in ("x1", "x2", "u", "y", "d1", "d2")}
    if draw.random() < 0.3:
        units = dict.fromkeys(units, 1.0)
    units = given or units
    plain = _normalised(kind, draw)
    rows = {"A": ("x1", "x2"), "B": ("x1", "x2"), "C": ("y",), "D": ("y",), "E": ("x1", "x2"), "F": ("y",)}
    columns = {"A": ("x1", "x2"), "B": ("u",), "C": ("x1", "x2"), "D": ("u",), "E": ("d1", "d2"), "F": ("d1", "d2")}
    series: dict[str, Any] = {}
    for key, matrices in plain.items():
        factor = speed if key in "ABE" else 1.0
        series[key] = [
            [
                [Fraction(repr(few_digits(m[i, j] * factor * units[rows[key][i]] / units[columns[key][j]], 4)))
                 for j in range(m.shape[1])]
                for i in range(m.shape[0])
            ]
            for m in matrices
        ]  # fmt: skip
    return RandomPlant(seed, kind, low, high, rates, T, speed, units, series)


def _normalised(kind: str, draw: np.random.Generator) -> dict[str, list[np.ndarray]]:
    """Coefficients of v^k in units of time and signals in which they are numbers near one."""
    a, b, z = draw.uniform(0.2, 1.5, 3)
    A0 = {
        "stable": np.array([[-a, 0.5 * z], [-0.3 * b, -b - 0.2]]),
        "oscillating": np.array([[0.0, 1.0], [-(b**2), -0.1 * z * draw.integers(0, 2)]]),
        "unstable": np.array([[0.0, 1.0], [0.3 * b, -0.5 * z]]),
        "unstable oscillating": np.array([[0.1 * z, 1.0], [-b, 0.1 * a]]),
        "integrators": np.array([[0.0, 1.0], [0.0, 0.0]]),
        "double pole": np.array([[-a, 1.0], [0.0, -a]]),
    }[kind]
    degree = int(draw.integers(1, 4))
    A = [A0] + [draw.normal(0.0, 0.25 / k, (2, 2)) * (draw.random((2, 2)) < 0.6) for k in range(1, degree + 1)]
    if not any(m.any() for m in A[1:]):  # a parameter that appears nowhere is refused
        A[1][1, 0] = 0.3
    C0 = np.array([[1.0, draw.normal(0.0, 0.5)]])
    B, E = [draw.normal(0.0, 1.0, (2, 1))], [np.hstack([draw.normal(0.0, 1.0, (2, 1)), np.zeros((2, 1))])]
    C, D = [C0], [draw.normal(0.0, 1.0, (1, 1)) * draw.integers(0, 2)]
    F = [np.array([[draw.normal(0.0, 0.3) * draw.integers(0, 2), draw.uniform(0.1, 1.0)]])]
    for matrices, spread in ((B, 0.3), (C, 0.2), (D, 0.3), (E, 0.3), (F, 0.2)):
        if draw.random() < 0.5:
            matrices.append(draw.normal(0.0, spread, matrices[0].shape) * (matrices[0] != 0.0))
    return {"A": A, "B": B, "C": C, "D": D, "E": E, "F": F}


def places(low: float, high: float, count: int) -> np.ndarray:
    """Breakpoints in few digits from end to end, not quite equidistant."""
    inner = np.linspace(low, high, count)
    digits = max(0, 2 - ceil(log10((high - low) / count))) + 1
    return np.array([low, *(round(float(x), digits) for x in inner[1:-1]), high])
