"""Dynamic weights: linear systems in series with the signals of a plant, as more states of one model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.lpv import LpvModel
from synthesis.models.param import Constant, Signal

RATE = "weight_rate"


@dataclass(frozen=True)
class _Filter:
    name: str
    unit: str
    A: sp.Matrix
    B: sp.Matrix
    C: sp.Matrix
    D: sp.Rational

    @property
    def states(self) -> tuple[Signal, ...]:
        return tuple(Signal(f"{self.name}_weight_{i + 1}", self.unit) for i in range(self.A.shape[0]))


def weighted(model: LpvModel, weights: Mapping[str, Any]) -> LpvModel:
    r"""The model with weights W(s) in series: v = W s at states, outputs and inputs, d = W v before disturbances.

    `weights` maps a signal to a system with one input and one output in continuous time (`control.StateSpace`, or a proper
    `control.TransferFunction`). A weight at a state, output or input adds the output `NAME_weighted` to the model; a design that
    must not measure it names its `measured` outputs. A weight at a disturbance shapes it: the disturbance keeps its name and
    stands for what enters the weight. Every weight adds its states, `NAME_weight_1` and so on; numbers are taken as the decimals
    that they show. Gains of weights are pure numbers: states and outputs that are added have the unit of the signal, and a
    constant `weight_rate` of 1 1/s gives coefficients their unit (but in a model where everything has the unit 1).

    Raises ModelError for an unknown signal, and a weight that is no such system.

    >>> import control, sympy as sp
    >>> one = sp.Matrix([[1]])
    >>> names = {key: (Signal(key[0], "1"),) for key in ("states", "outputs", "inputs", "disturbances")}
    >>> plant = LpvModel("lag", "an example", parameters=(), A=-one, B=one, C=one, E=one, **names)
    >>> shaped = weighted(plant, {"s": control.tf([0.3, 1.2], [1, 0.04]), "d": control.tf([1], [1, 2])})
    >>> [s.name for s in shaped.states], [o.name for o in shaped.outputs]
    (['s', 's_weight_1', 'd_weight_1'], ['o', 's_weighted'])
    """
    shown = [signal.name for group in (model.states, model.outputs, model.inputs) for signal in group]
    driven = [signal.name for signal in model.disturbances]
    for name in weights:
        if name not in [*shown, *driven]:
            raise ModelError(f"model '{model.name}', weights: {unknown('signal', name, [*shown, *driven])}")
    rate, constants = _rate(model)
    filters = {name: _filter(model, name, weight, rate) for name, weight in weights.items()}
    if not any(f.states for f in filters.values()):
        constants = model.constants
    before = [filters[name] for name in driven if name in filters]
    after = [filters[name] for name in shown if name in filters]
    n, nu, nd = len(model.states), len(model.inputs), len(driven)
    A, B, C, D, E, F = (sp.Matrix(getattr(model, key)) for key in "ABCDEF")
    Ab, Bb, Cb, Db = _beside(before)
    Aa, Ba, Ca, Da = _beside(after)
    # d = shaped xb + direct v, xb the states of the weights before the plant
    chosen = sp.zeros(nd, len(before))
    for j, f in enumerate(before):
        chosen[driven.index(f.name), j] = 1
    shaped, direct = chosen * Cb, sp.eye(nd) + chosen * (Db - sp.eye(len(before))) * chosen.T
    # What is weighed, as rows of x, u and d
    rows = [shown.index(f.name) for f in after]
    of_x, of_u, of_d = (
        sp.Matrix.vstack(*parts).extract(rows, list(range(parts[0].shape[1])))
        for parts in (
            (sp.eye(n), C, sp.zeros(nu, n)),
            (sp.zeros(n, nu), D, sp.eye(nu)),
            (sp.zeros(n, nd), F, sp.zeros(nu, nd)),
        )
    )
    nb = Ab.shape[0]
    return LpvModel(
        constraints=model.constraints,
        tables=model.tables,
        name=f"{model.name} weighted",
        source=model.source,
        states=(*model.states, *(s for f in (*after, *before) for s in f.states)),
        inputs=model.inputs,
        disturbances=model.disturbances,
        outputs=(*model.outputs, *(Signal(f"{f.name}_weighted", f.unit) for f in after)),
        parameters=model.parameters,
        constants=constants,
        A=_blocks([A, sp.zeros(n, Aa.shape[0]), E * shaped], [Ba * of_x, Aa, Ba * of_d * shaped], [None, None, Ab]),
        B=sp.Matrix.vstack(B, Ba * of_u, sp.zeros(nb, nu)),
        C=_blocks([C, sp.zeros(C.shape[0], Aa.shape[0]), F * shaped], [Da * of_x, Ca, Da * of_d * shaped]),
        D=sp.Matrix.vstack(D, Da * of_u),
        E=sp.Matrix.vstack(E * direct, Ba * of_d * direct, Bb * chosen.T),
        F=sp.Matrix.vstack(F * direct, Da * of_d * direct),
    )


def _blocks(*rows: list[sp.Matrix | None]) -> sp.Matrix:
    widths = [block.shape[1] for block in rows[0] if block is not None]
    filled = []
    for row in rows:
        height = next(block.shape[0] for block in row if block is not None)
        filled.append([sp.zeros(height, w) if b is None else b for b, w in zip(row, widths, strict=True)])
    return sp.Matrix.vstack(*(sp.Matrix.hstack(*row) for row in filled))


def _beside(filters: list[_Filter]) -> tuple[sp.Matrix, sp.Matrix, sp.Matrix, sp.Matrix]:
    """A, B, C, D of independent filters, each with its own input and output."""
    states, count = sum(f.A.shape[0] for f in filters), len(filters)
    A, B, C, D = sp.zeros(states, states), sp.zeros(states, count), sp.zeros(count, states), sp.zeros(count, count)
    start = 0
    for j, f in enumerate(filters):
        own = slice(start, start + f.A.shape[0])
        A[own, own], B[own, j], C[j, own], D[j, j] = f.A, f.B, f.C, f.D
        start = own.stop
    return A, B, C, D


def _rate(model: LpvModel) -> tuple[sp.Expr, Mapping[str, Constant]]:
    """What coefficients of a weight per second are multiplied by, and the constants with it."""
    signals = (*model.states, *model.inputs, *model.outputs, *model.disturbances)
    units = [s.unit for s in signals] + [p.unit for p in model.parameters] + [c.unit for c in model.constants.values()]
    if all(unit == "1" for unit in units):
        return sp.Integer(1), model.constants
    return sp.Symbol(RATE), {**model.constants, RATE: Constant(1.0, "1/s", "unit of the weights' coefficients")}


def _filter(model: LpvModel, name: str, weight: Any, rate: sp.Expr) -> _Filter:
    import control  # half a second: paid by those who use it

    where = f"model '{model.name}', weight of '{name}'"
    try:
        system = control.ss(weight)
    except Exception as error:  # python-control raises several kinds
        raise ModelError(
            f"{where} is no proper linear system ({error}); give control.tf(..) or control.ss(..)"
        ) from None
    if system.ninputs != 1 or system.noutputs != 1 or system.dt not in (0, None):
        raise ModelError(
            f"{where} has {system.ninputs} inputs, {system.noutputs} outputs and the sample time {system.dt}; give one with one "
            "input and one output in continuous time"
        )
    matrices = [np.asarray(getattr(system, key), float) for key in "ABCD"]
    if not all(np.isfinite(m).all() for m in matrices):
        raise ModelError(f"{where} has coefficients that are not finite")
    A, B, C, D = (sp.Matrix(*m.shape, [_decimal(x) for x in m.ravel()]) for m in matrices)
    named = (*model.states, *model.outputs, *model.inputs, *model.disturbances)
    return _Filter(name, next(s.unit for s in named if s.name == name), A * rate, B * rate, C, D[0, 0])


def _decimal(number: float) -> sp.Rational:
    """As `repr` shows it, exactly; zero has no sign."""
    return sp.Rational(repr(float(number))) if number else sp.Integer(0)
