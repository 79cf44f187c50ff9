"""The nonlinear truth behind an LPV model: x' = f(x, u), y = h(x, u) from sympy, integrated for a batch of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp

from analysis.errors import AnalysisError
from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.symbols import plain

NOISE = "_noise"  # ends the name of what is added to an output


class NonlinearPlant(Display):
    """A `NonlinearModel` whose scheduling parameters are formulas of its own states and inputs.

    Args:
        model: x' = f(x, u), y = h(x, u).
        scheduling: formula of every parameter, in order of the law's parameters: a name, or a sympy expression of states and
            inputs. Where a law is not scheduled, none.
        disturbances: inputs of the model that the law does not know. Beside them every output has NAME_noise, added to it.
        parts: steps of the classical Runge-Kutta method over a sample, inputs and disturbances held.

    Raises AnalysisError for names that the model does not have.

    >>> import sympy as sp
    >>> angle, rate, torque = sp.symbols("angle rate torque")
    >>> pendulum = NonlinearModel(
    ...     "pendulum", "example", (Signal("angle", "rad"), Signal("rate", "rad/s")), (Signal("seen", "rad"),),
    ...     inputs=(Signal("torque", "1/s^2"),), f=sp.Matrix([rate, torque - 9.81 * sp.sin(angle)]), h=sp.Matrix([angle]),
    ... )
    >>> plant = NonlinearPlant(pendulum, {"cosine": sp.cos(angle)}, disturbances=("torque",))
    >>> plant.disturbances
    ('torque', 'seen_noise')
    """

    def __init__(
        self,
        model: NonlinearModel,
        scheduling: Mapping[str, sp.Expr | str],
        disturbances: Sequence[str] = (),
        parts: int = 4,
    ) -> None:
        known = [s.name for s in model.inputs]
        for name in disturbances:
            if name not in known:
                raise AnalysisError(f"model '{model.name}': {unknown('input', name, known)}")
        self.name, self.parts = model.name, parts
        self.states = tuple(s.name for s in model.states)
        self.inputs = tuple(name for name in known if name not in disturbances)
        self.outputs = tuple(s.name for s in model.outputs)
        self.disturbances = (*disturbances, *(f"{name}{NOISE}" for name in self.outputs))
        self.unmeasured = len(disturbances)
        self.parameters = tuple(scheduling)
        formulas = plain(sp.Matrix([_expression(formula) for formula in scheduling.values()]))
        symbols = [sp.Symbol(name) for name in (*self.states, *self.inputs, *disturbances)]
        stray = sorted({str(s) for s in formulas.free_symbols} - {str(s) for s in symbols})
        if stray:
            raise AnalysisError(f"model '{model.name}': scheduling: {', '.join(stray)} is neither a state nor an input")
        f, h = model.with_constants_inserted()
        self._rows = {
            key: [sp.lambdify(symbols, entry, "numpy") for entry in matrix]
            for key, matrix in (("f", f), ("h", h), ("p", formulas))
        }

    def scheduled(self, x: FloatArray, u: FloatArray, d: FloatArray) -> FloatArray:
        """Parameters (runs, p)."""
        return self._values("p", x, u, d)

    def output(self, x: FloatArray, u: FloatArray, d: FloatArray, p: FloatArray) -> FloatArray:
        """h(x, u) and its noise; p is not asked."""
        return self._values("h", x, u, d) + d[:, self.unmeasured :]

    def advance(
        self, x: FloatArray, u: FloatArray, d: FloatArray, p: FloatArray, p_next: FloatArray, period: float
    ) -> FloatArray:
        """Runge-Kutta of order four; p is not asked."""
        step = period / self.parts
        for _ in range(self.parts):
            k1 = self._values("f", x, u, d)
            k2 = self._values("f", x + 0.5 * step * k1, u, d)
            k3 = self._values("f", x + 0.5 * step * k2, u, d)
            k4 = self._values("f", x + step * k3, u, d)
            x = x + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return x

    def _values(self, key: str, x: FloatArray, u: FloatArray, d: FloatArray) -> FloatArray:
        columns = (*x.T, *u.T, *d[:, : self.unmeasured].T)
        found = np.empty((len(x), len(self._rows[key])))
        for i, row in enumerate(self._rows[key]):
            found[:, i] = row(*columns)
        return found


def _expression(formula: sp.Expr | str) -> sp.Expr:
    return sp.Symbol(formula) if isinstance(formula, str) else formula
