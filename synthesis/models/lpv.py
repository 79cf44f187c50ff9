"""The symbolic LPV model: written once, used by design, analysis and simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.extract import MATRICES, ExactModel, PolynomialModel, extract, in_floats
from synthesis.models.numeric import NumericModel, evaluate
from synthesis.models.param import Constant, SchedulingParameter, Signal
from synthesis.models.symbols import plain

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class LpvModel:
    r"""x' = A(p) x + B(p) u + E(p) d,  y = C(p) x + D(p) u + F(p) d, with p(t) in a box and dp/dt in another.

    Matrices are sympy matrices whose symbols are the names of `parameters` and `constants`, polynomial or rational in
    the parameters. A disturbance whose column of E is zero is measurement noise. B, D, E and F default to zero.

    Raises ModelError for a stray symbol, a shape that does not fit, a parameter that never appears, a dependence that
    is not rational, a denominator that vanishes inside the range, and repeated names.
    """

    name: str
    source: str
    states: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    parameters: tuple[SchedulingParameter, ...]
    A: sp.Matrix
    C: sp.Matrix
    inputs: tuple[Signal, ...] = ()
    disturbances: tuple[Signal, ...] = ()
    B: sp.Matrix | None = None
    D: sp.Matrix | None = None
    E: sp.Matrix | None = None
    F: sp.Matrix | None = None
    constants: Mapping[str, Constant] = field(default_factory=dict)

    def __post_init__(self) -> None:
        nx, ny, nu, nd = len(self.states), len(self.outputs), len(self.inputs), len(self.disturbances)
        shapes = {"A": (nx, nx), "B": (nx, nu), "C": (ny, nx), "D": (ny, nu), "E": (nx, nd), "F": (ny, nd)}
        self._check_names()
        for key, shape in shapes.items():
            given = getattr(self, key)
            try:
                matrix = plain(sp.zeros(*shape) if given is None else sp.Matrix(given))
            except (TypeError, ValueError) as error:
                raise ModelError(f"model '{self.name}': {key} is not a matrix ({error})") from None
            if matrix.shape != shape:
                raise ModelError(
                    f"model '{self.name}': {key} has the shape {matrix.shape}, but {nx} states, {nu} inputs, {ny} outputs and "
                    f"{nd} disturbances need {shape}"
                )
            object.__setattr__(self, key, matrix)
        self._check_symbols()
        self.polynomial  # noqa: B018  a model that is not rational, or divides by zero, must not exist

    def _check_names(self) -> None:
        if not self.states or not self.outputs:
            raise ModelError(f"model '{self.name}' needs at least one state and one output")
        names = [s.name for s in (*self.states, *self.inputs, *self.outputs, *self.disturbances)]
        names += [p.name for p in self.parameters] + list(self.constants)
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise ModelError(f"model '{self.name}' uses the name(s) {', '.join(repeated)} twice; names must be unique")
        if not self.source.strip():
            raise ModelError(f"model '{self.name}' has no source; say where its equations come from")

    def _check_symbols(self) -> None:
        used = {str(symbol) for key in MATRICES for symbol in getattr(self, key).free_symbols}
        known = {p.name for p in self.parameters} | set(self.constants)
        stray = sorted(used - known)
        if stray:
            raise ModelError(
                f"model '{self.name}': symbol(s) {', '.join(stray)} are neither parameter nor constant; "
                "give each a range or a value"
            )
        idle = sorted({p.name for p in self.parameters} - used)
        if idle:
            raise ModelError(f"model '{self.name}': parameter(s) {', '.join(idle)} appear in no matrix; remove them")

    @cached_property
    def exact(self) -> ExactModel:
        """Exact polynomials of the matrices in the scaled parameters u in [-1, 1], over a common denominator."""
        matrices = {key: getattr(self, key) for key in MATRICES}
        return extract(f"model '{self.name}'", matrices, self.parameters, self.constants)

    def __getstate__(self) -> dict[str, object]:
        """Without the exact coefficients, which cannot be pickled and are worked out again where they are needed."""
        return {key: value for key, value in self.__dict__.items() if key != "exact"}

    @cached_property
    def polynomial(self) -> PolynomialModel:
        """`exact` as float64 coefficient arrays."""
        return in_floats(self.exact)

    def on(self, grid: ArrayLike) -> NumericModel:
        """The model at g parameter values: the only border between sympy and numpy.

        `grid` has shape (g, p), or (g,) for one parameter; the matrices come out read-only as (g, rows, columns).
        Raises ModelError for values outside the range or not finite.
        """
        try:
            points = np.asarray(grid, float)
        except (TypeError, ValueError):
            raise ModelError(f"model '{self.name}': the grid {grid!r} is not an array of numbers") from None
        count = len(self.parameters)
        points = points.reshape(-1, 1) if points.ndim <= 1 and count == 1 else np.atleast_2d(points)
        if points.ndim != 2 or points.shape[-1] != count:
            raise ModelError(f"model '{self.name}': a grid of shape {points.shape} does not fit {count} parameters")
        self._check_range(points)
        return evaluate(self.polynomial, self.parameters, points)

    def _check_range(self, points: FloatArray) -> None:
        for column, p in zip(points.T, self.parameters, strict=True):
            slack = 1e-12 * (p.maximum - p.minimum)
            bad = np.flatnonzero(~((column >= p.minimum - slack) & (column <= p.maximum + slack)))
            if len(bad):
                raise ModelError(
                    f"{p.name} = {column[bad[0]]:.6g} {p.unit} is outside [{p.minimum:g}, {p.maximum:g}] {p.unit} "
                    f"(grid point {bad[0]}); widen the model's range or stay inside it"
                )

    def with_range(self, name: str, minimum: float, maximum: float) -> LpvModel:
        """The same model with another range of one parameter."""
        if name not in {p.name for p in self.parameters}:
            raise ModelError(unknown("parameter", name, (p.name for p in self.parameters)))
        changed = tuple(replace(p, minimum=minimum, maximum=maximum) if p.name == name else p for p in self.parameters)
        return replace(self, parameters=changed)
