"""The Jacobian of a nonlinear model along a family of trims, as the parts of an LPV model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp

from estimators.errors import unknown
from synthesis.errors import ModelError
from synthesis.models.fitted import Fitted
from synthesis.models.jacobian_fit import JacobianFit
from synthesis.models.nonlinear import NonlinearModel
from synthesis.models.param import Constant, SchedulingParameter, Signal
from synthesis.models.symbols import plain

POINTS = 41  # of all parameters together, where a trim is tested
BALANCE = 1e-9  # of the terms that add up to a derivative: what is left of it counts as zero


def jacobian_fields(
    model: NonlinearModel,
    parameters: Sequence[SchedulingParameter],
    trim: Mapping[str, Any],
    disturbances: Sequence[str],
    drifting: Sequence[str],
    measurement_noise: bool,
    degree: int | None,
    tolerance: float,
    sizes: Mapping[str, float] | None,
) -> dict[str, Any]:
    """What `LpvModel` is made of. Raises ModelError; see `LpvModel.from_jacobian`."""
    where = f"model '{model.name}'"
    point = _trim(model, parameters, trim, where)
    _check_balance(model, parameters, point, drifting, where)
    known = [s.name for s in model.inputs]
    for name in disturbances:
        if name not in known:
            raise ModelError(f"{where}: disturbances: {unknown('input', name, known)}")
    inputs = tuple(s for s in model.inputs if s.name not in disturbances)
    unmeasured = tuple(next(s for s in model.inputs if s.name == name) for name in disturbances)
    noise = tuple(Signal(f"{s.name}_noise", s.unit) for s in model.outputs) if measurement_noise else ()
    signals = {
        "states": model.states,
        "inputs": inputs,
        "outputs": model.outputs,
        "disturbances": (*unmeasured, *noise),
    }
    x, u, d = ([sp.Symbol(s.name) for s in group] for group in (model.states, inputs, unmeasured))
    matrices = {}
    for key, function, variables in (
        ("A", model.f, x), ("B", model.f, u), ("E", model.f, d), ("C", model.h, x), ("D", model.h, u), ("F", model.h, d),
    ):  # fmt: skip
        jacobian = sp.Matrix(function.rows, len(variables), lambda i, j, g=function, v=variables: g[i].diff(v[j]))
        matrices[key] = jacobian.subs(point).applyfunc(sp.simplify)
    if noise:
        matrices["E"] = matrices["E"].row_join(sp.zeros(len(model.states), len(noise)))
        matrices["F"] = matrices["F"].row_join(sp.eye(len(noise)))
    build = Fitted(where, "largest error of the fitted Jacobian", tuple(parameters), signals)
    fit = JacobianFit(build, _numbers(model.constants), degree, tolerance)
    made = {key: fit.matrix(key, matrix) for key, matrix in matrices.items()}
    made, every = build.with_errors(made, fit.residuals, sizes)
    used = {str(s) for matrix in made.values() for s in matrix.free_symbols}
    constants = {name: c for name, c in {**model.constants, **build.constants}.items() if name in used}
    return dict(
        name=model.name, source=model.source, parameters=tuple(parameters), constants=constants,
        **{**signals, "disturbances": every}, **made,
    )  # fmt: skip


def _trim(
    model: NonlinearModel, parameters: Sequence[SchedulingParameter], trim: Mapping[str, Any], where: str
) -> dict[sp.Symbol, sp.Expr]:
    known = [s.name for s in (*model.states, *model.inputs)]
    for name in trim:
        if name not in known:
            raise ModelError(f"{where}: trim: {unknown('state or input', name, known)}")
    missing = [name for name in known if name not in trim]
    if missing:
        raise ModelError(
            f"{where}: trim: no value for {', '.join(missing)}; give a number or an expression in the parameters"
        )
    allowed = {p.name for p in parameters} | set(model.constants)
    point = {}
    for name, value in trim.items():
        (entry,) = plain(sp.Matrix([value]))
        stray = sorted({str(s) for s in entry.free_symbols} - allowed)
        if stray:
            raise ModelError(
                f"{where}: trim of {name}: {', '.join(stray)} is neither a scheduling parameter nor a constant"
            )
        point[sp.Symbol(name)] = entry.replace(lambda e: e.is_Float, lambda e: sp.Rational(str(e)))
    return point


def _check_balance(
    model: NonlinearModel, parameters: Sequence[SchedulingParameter], point: Mapping[sp.Symbol, sp.Expr],
    drifting: Sequence[str], where: str,
) -> None:  # fmt: skip
    """Every derivative vanishes on the trims, except those of states that may drift."""
    names = [s.name for s in model.states]
    for name in drifting:
        if name not in names:
            raise ModelError(f"{where}: drifting: {unknown('state', name, names)}")
    rng = np.random.default_rng(0)
    ends = np.array([(p.minimum, p.maximum) for p in parameters]).reshape(-1, 2)
    points = ends[:, 0] + (ends[:, 1] - ends[:, 0]) * rng.random((POINTS, len(parameters)))
    symbols, values = [sp.Symbol(p.name) for p in parameters], _numbers(model.constants)
    for signal, derivative in zip(model.states, model.f, strict=True):
        left = sp.expand(derivative.subs(point).subs(values))
        if signal.name in drifting or left == 0 or sp.simplify(left) == 0:
            continue
        terms = [sp.lambdify(symbols, term, "numpy") for term in sp.Add.make_args(left)]
        parts = np.array([np.broadcast_to(term(*points.T), len(points)) for term in terms], float)
        off, size = np.abs(parts.sum(axis=0)), np.abs(parts).sum(axis=0)
        worst = int(np.argmax(off - BALANCE * size))
        if not off[worst] <= BALANCE * size[worst]:
            at = ", ".join(f"{p.name} = {v:.4g} {p.unit}" for p, v in zip(parameters, points[worst], strict=True))
            raise ModelError(
                f"{where}: the trim is no equilibrium: d {signal.name}/dt = {parts.sum(axis=0)[worst]:.4g} ({signal.unit})/s "
                f"at {at}; correct the trim, or name '{signal.name}' in drifting"
            )


def _numbers(constants: Mapping[str, Constant]) -> dict[sp.Symbol, sp.Rational]:
    return {sp.Symbol(name): sp.Rational(str(c.value)) for name, c in constants.items()}
