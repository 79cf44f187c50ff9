"""The symbolic nonlinear model: right-hand side and outputs as sympy expressions over named states and inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.param import Constant, Signal
from synthesis.models.symbols import plain


@dataclass(frozen=True, eq=False, repr=False)
class NonlinearModel(Display):
    r"""x' = f(x, u), y = h(x, u); f (nx, 1) and h (ny, 1) use the names of states, inputs and constants as symbols.

    Raises ModelError for a stray symbol, a shape that does not fit, a repeated name or a missing source.

    >>> import sympy as sp
    >>> x, y = sp.symbols("x y")
    >>> model = NonlinearModel(
    ...     "pair", "example", (Signal("x", "1"), Signal("y", "1")), (Signal("z", "1"),),
    ...     f=sp.Matrix([y, -x]), h=sp.Matrix([x**2]),
    ... )
    >>> model.state_symbols
    (x, y)
    """

    name: str
    source: str
    states: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    f: sp.Matrix
    h: sp.Matrix
    inputs: tuple[Signal, ...] = ()
    constants: Mapping[str, Constant] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.source.strip():
            raise ModelError(f"model '{self.name}' has no source; say where its equations come from")
        for key, signals in (("f", self.states), ("h", self.outputs)):
            matrix = plain(sp.Matrix(getattr(self, key)))
            if not signals or matrix.shape != (len(signals), 1):
                raise ModelError(
                    f"model '{self.name}': {key} has the shape {matrix.shape}, but {len(signals)} signals need "
                    f"{(max(len(signals), 1), 1)}"
                )
            object.__setattr__(self, key, matrix)
        # An output may carry the name of the state it measures.
        names = [s.name for s in (*self.states, *self.inputs)] + list(self.constants)
        repeated = sorted({n for n in names if names.count(n) > 1})
        if repeated:
            raise ModelError(f"model '{self.name}' uses the name(s) {', '.join(repeated)} twice; names must be unique")
        stray = sorted({str(s) for s in self.f.free_symbols | self.h.free_symbols} - set(names))
        if stray:
            raise ModelError(
                f"model '{self.name}': symbol(s) {', '.join(stray)} are neither state, input nor constant; "
                "give each a value or a place"
            )

    @property
    def state_symbols(self) -> tuple[sp.Symbol, ...]:
        """The states as symbols, in order."""
        return tuple(sp.Symbol(s.name) for s in self.states)

    @property
    def input_symbols(self) -> tuple[sp.Symbol, ...]:
        """The inputs as symbols, in order."""
        return tuple(sp.Symbol(s.name) for s in self.inputs)

    def with_constants_inserted(self) -> tuple[sp.Matrix, sp.Matrix]:
        """f and h with every constant as the exact rational number its decimals say."""
        values = {sp.Symbol(name): sp.Rational(str(c.value)) for name, c in self.constants.items()}
        return self.f.subs(values), self.h.subs(values)

    def linearised(self, point: Mapping[str, float]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """A = df/dx (nx, nx), B = df/du (nx, nu), C = dh/dx (ny, nx), D = dh/du (ny, nu) at named states and inputs.

        Raises ModelError for a name that is missing, unknown or not finite, and where a derivative does not exist.
        """
        symbols = (*self.state_symbols, *self.input_symbols)
        known = [str(s) for s in symbols]
        for name in point:
            if name not in known:
                raise ModelError(f"model '{self.name}': {unknown('state or input', name, known)}")
        missing = [n for n in known if n not in point or not np.isfinite(point[n])]
        if missing:
            raise ModelError(f"model '{self.name}': give a finite value for {', '.join(missing)}")
        f, h = self.with_constants_inserted()
        values = {s: sp.Float(point[str(s)], 30) for s in symbols}
        out = []
        for function in (f, h):
            for wanted in (self.state_symbols, self.input_symbols):
                jacobian = sp.Matrix(function.rows, len(wanted), lambda i, j, g=function, w=wanted: g[i].diff(w[j]))
                out.append(np.array(jacobian.subs(values).tolist(), dtype=complex).reshape(jacobian.shape))
        if any(not np.isfinite(m).all() or np.abs(m.imag).max(initial=0.0) > 0.0 for m in out):
            raise ModelError(
                f"model '{self.name}' has no derivative at {dict(point)}; move away from the singular point"
            )
        A, B, C, D = (np.ascontiguousarray(m.real) for m in out)
        return A, B, C, D
