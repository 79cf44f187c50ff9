"""Matrices that come from a fit as formulas: coefficients in scaled parameters, units, and what the fit leaves over.

    entry = one [unit of its place] * sum over k of c_k u^k,    u = (p - middle) / half_width

so that units stay complete and numbers stay of the size of the entry. The truth is the fit plus Delta with |Delta_ij| <= R_ij.
To an observer of x' = A x + B u + E d this is a disturbance of the size

    r_i = sum_j R^A_ij |x_j| + R^B_ij |u_j| + R^E_ij |d_j|

in row i (and with C, D, F in the outputs), |x_j| the largest magnitudes that a user states: a column of E or F with the entry
r_i, a constant of the model, times a disturbance between -1 and 1.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from estimators.errors import unknown
from estimators.schedule.check import SHAPES
from synthesis.errors import ModelError
from synthesis.models.param import Constant, SchedulingParameter, Signal, registry
from synthesis.polynomials.rational import decimal

EXACT = 1e-9  # of the largest entry: a residual below counts as none
Signals = Mapping[str, tuple[Signal, ...]]


@dataclass
class Fitted:
    """Collects the constants that formulas of fitted entries need."""

    where: str
    source: str
    parameters: tuple[SchedulingParameter, ...]
    signals: Signals
    constants: dict[str, Constant] = field(default_factory=dict)

    @property
    def normalised(self) -> bool:
        """Whether everything has the unit 1, time included."""
        units = [s.unit for group in self.signals.values() for s in group] + [p.unit for p in self.parameters]
        return all(unit == "1" for unit in units)

    def entry(self, key: str, i: int, j: int, coefficients: FloatArray) -> sp.Expr:
        """The formula of tensor Chebyshev coefficients (d_1+1, .., d_p+1)."""
        total: sp.Expr = sp.Integer(0)
        for orders, coefficient in np.ndenumerate(coefficients):
            if coefficient != 0.0:
                exact = decimal(float(coefficient))
                total += sp.Rational(int(exact.p), int(exact.q)) * sp.Mul(
                    *(sp.chebyshevt(k, sp.Symbol(f"_{axis}")) for axis, k in enumerate(orders))
                )
        polynomial = sp.expand(total)
        scaled = {sp.Symbol(f"_{axis}"): self._scaled(p) for axis, p in enumerate(self.parameters)
                  if sp.Symbol(f"_{axis}") in polynomial.free_symbols}  # fmt: skip
        return polynomial.subs(scaled) * (1 if polynomial == 0 else self._one(key, i, j))

    def _scaled(self, p: SchedulingParameter) -> sp.Expr:
        names = f"{p.name}_middle", f"{p.name}_half_width"
        for name, value in zip(names, (p.middle, p.half_width), strict=True):
            self.constants[name] = Constant(value, p.unit, "scaling of the fit")
        middle, half = map(sp.Symbol, names)
        return (sp.Symbol(p.name) - middle) / half

    def unit(self, key: str, i: int, j: int) -> str:
        """That of a place."""
        above, beside = (self.signals[kind] for kind in SHAPES[key])
        return "1" if self.normalised else quotient(above[i].unit, beside[j].unit, "s" if key in "ABE" else "1")

    def _one(self, key: str, i: int, j: int) -> sp.Expr:
        """The unit of a place, as a constant of the value one."""
        unit = self.unit(key, i, j)
        if unit == "1":
            return sp.Integer(1)
        words = unit.replace("**", "").replace("/", "_per_")
        name = "one_" + re.sub(r"\W+", "_", words).strip("_")
        self.constants[name] = Constant(1.0, unit, "unit of fitted entries")
        return sp.Symbol(name)

    def with_errors(
        self, matrices: dict[str, sp.Matrix], residuals: Mapping[str, FloatArray], sizes: Mapping[str, float] | None
    ) -> tuple[dict[str, sp.Matrix], tuple[Signal, ...]]:
        """E and F with a column for every row that the fit leaves an error in, and all disturbances.

        `residuals` are bounds (rows, columns) of the entries, already without those that count as none. Raises ModelError where
        an error is left and the sizes of the signals that it multiplies are not stated.
        """
        disturbances, sizes = list(self.signals["disturbances"]), dict(sizes or {})
        known = [s.name for kind in ("states", "inputs", "disturbances") for s in self.signals[kind]]
        for name, size in sizes.items():
            if name not in known:
                raise ModelError(f"{self.where}: sizes: {unknown('signal', name, known)}")
            if not (np.isfinite(size) and size > 0.0):
                raise ModelError(f"{self.where}: sizes: {name} = {size}; give its largest magnitude, a positive number")
        E, F = matrices["E"], matrices["F"]
        for keys, kind in ((("A", "B", "E"), "states"), (("C", "D", "F"), "outputs")):
            for i, signal in enumerate(self.signals[kind]):
                size = sum(self._row(residuals[key][i], key, i, sizes) for key in keys)
                if size <= 0.0:
                    continue
                name = f"{signal.name}_fit_error"
                unit = "1" if self.normalised else quotient(signal.unit, "1", "s" if kind == "states" else "1")
                self.constants[f"{name}_size"] = Constant(float(f"{1.0005 * size:.3e}"), unit, self.source)
                column = sp.Matrix([sp.Symbol(f"{name}_size") if k == i else 0 for k in range(len(self.signals[kind]))])
                E = E.row_join(column if kind == "states" else sp.zeros(E.rows, 1))
                F = F.row_join(column if kind == "outputs" else sp.zeros(F.rows, 1))
                disturbances.append(Signal(name, "1"))
        return {**matrices, "E": E, "F": F}, tuple(disturbances)

    def _row(self, residual: FloatArray, key: str, i: int, sizes: Mapping[str, float]) -> float:
        total = 0.0
        for j, (bound, signal) in enumerate(zip(residual, self.signals[SHAPES[key][1]], strict=True)):
            if bound > 0.0:
                if signal.name not in sizes:
                    raise ModelError(
                        f"{self.where}: {key}[{i}][{j}] is off by up to {bound:.3g}; give the largest magnitude of "
                        f"'{signal.name}' [{signal.unit}] in sizes, so that it enters as a disturbance, or a higher degree"
                    )
                total += bound * sizes[signal.name]
        return total


def quotient(above: str, below: str, per: str) -> str:
    """above / (below per) as a unit that pint reads, '1' if it is none."""
    units: Any = registry()
    found = units.Unit("")
    for unit, power in ((above, 1), (below, -1), (per, -1)):
        if unit != "1":
            found = found * units.parse_units(unit) ** power
    text = f"{found:~C}"
    plain = found.dimensionless and abs(units.Quantity(1.0, found).to_base_units().magnitude - 1.0) < 1e-12
    return "1" if plain or not text else text


def beyond_tolerance(
    where: str, residuals: Mapping[str, FloatArray], largest: Mapping[str, FloatArray], tolerance: float
) -> str | None:
    """The entry that is fitted worst, in words, if it is off by more than `tolerance` of its largest magnitude."""
    worst, words = tolerance, None
    for key, residual in residuals.items():
        for (i, j), bound in np.ndenumerate(residual):
            size = float(largest[key][i, j])
            if size > 0.0 and bound / size > worst:
                worst = float(bound) / size
                words = f"{where}: {key}[{i}][{j}] is off by {bound:.3g}, {100 * worst:.2g} % of its largest value {size:.3g}"
    return words


def without_exact(residuals: Mapping[str, FloatArray], largest: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    """Residuals that are more than rounding."""
    return {key: np.where(r > EXACT * largest[key], r, 0.0) for key, r in residuals.items()}
