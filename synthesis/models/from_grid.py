"""A model fitted to matrices or python-control systems at the points of a rectilinear grid."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray
from estimators.schedule.check import SHAPES
from synthesis.errors import ModelError
from synthesis.models.chebyshev_fit import at_points, between_points, fitted
from synthesis.models.fitted import Fitted, beyond_tolerance, without_exact
from synthesis.models.grid import grid_lines, table
from synthesis.models.grid_tables import as_tables
from synthesis.models.param import SchedulingParameter, Signal

Fit = Literal["polynomial", "piecewise-linear", "table"]
TABLE = "table"  # no fit at all
FITS: dict[str, Callable[..., FloatArray]] = {"polynomial": at_points, "piecewise-linear": between_points}
HIGHEST_DEGREE = 8


def grid_fields(
    name: str,
    source: str,
    parameters: Sequence[SchedulingParameter],
    points: Mapping[str, ArrayLike] | ArrayLike,
    matrices: Mapping[str, Any],
    signals: Mapping[str, tuple[Signal, ...]],
    degree: int | Sequence[int] | None,
    fit: Fit,
    tolerance: float,
    sizes: Mapping[str, float] | None,
) -> dict[str, Any]:
    """What `LpvModel` is made of, from tables of its matrices by their letters. Raises ModelError; see `LpvModel.from_grid`."""
    where = f"model '{name}'"
    if fit not in (*FITS, TABLE):
        raise ModelError(f"{where}: fit '{fit}' is not known; write {' or '.join((*FITS, TABLE))}")
    if fit == TABLE and degree is not None:
        raise ModelError(f"{where}: a table has no degree; leave it out, or take the fit 'polynomial'")
    if not parameters:
        raise ModelError(f"{where}: a grid needs at least one scheduling parameter")
    lines, order = grid_lines(points, parameters, where, fit == TABLE)
    tables = {}
    for key, (above, beside) in SHAPES.items():
        shape = (len(signals[above]), len(signals[beside]))
        if matrices.get(key) is None:
            tables[key] = np.zeros((*map(len, lines), *shape))
            continue
        tables[key] = table(matrices[key], key, lines, order, where)
        if tables[key].shape[-2:] != shape:
            raise ModelError(
                f"{where}: {key} has {tables[key].shape[-2:]} entries; {shape[0]} {above} and {shape[1]} {beside} need {shape}"
            )
    if fit == TABLE:
        build = Fitted(where, source, tuple(parameters), signals)
        formulas, found_tables = as_tables(build, source, lines, tables)
        return dict(
            name=name, source=source, parameters=tuple(parameters), constants=build.constants, tables=found_tables,
            **signals, **formulas,
        )  # fmt: skip
    scaled = tuple((line - p.middle) / p.half_width for line, p in zip(lines, parameters, strict=True))
    found, residuals = _fit(where, scaled, tables, degree, FITS[fit], tolerance)
    largest = {key: np.abs(values).max(axis=tuple(range(len(lines)))) for key, values in tables.items()}
    kept = without_exact(residuals, largest)
    build = Fitted(where, "largest residual of the fit", tuple(parameters), signals)
    made = {
        key: sp.Matrix(
            *coefficients.shape[-2:], lambda i, j, key=key, c=coefficients: build.entry(key, i, j, c[..., i, j])
        )
        for key, coefficients in found.items()
    }
    made, disturbances = build.with_errors(made, kept, sizes)
    own = {**signals, "disturbances": disturbances}
    return dict(name=name, source=source, parameters=tuple(parameters), constants=build.constants, **own, **made)


def _fit(
    where: str,
    lines: tuple[FloatArray, ...],
    tables: Mapping[str, FloatArray],
    degree: int | Sequence[int] | None,
    left_over: Callable[..., FloatArray],
    tolerance: float,
) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Coefficients and residual bounds of the lowest degree that meets the tolerance, or of the degree that is asked for."""
    axes = tuple(range(len(lines)))
    largest = {key: np.abs(values).max(axis=axes) for key, values in tables.items()}
    words = None
    for degrees in _degrees(where, lines, degree):
        found = {key: fitted(lines, values, degrees) for key, values in tables.items()}
        residuals = {key: left_over(found[key], lines, values) for key, values in tables.items()}
        words = beyond_tolerance(where, residuals, largest, tolerance)
        if words is None:
            return found, residuals
    cure = "give a higher degree" if degree is not None else "the points bend more than a polynomial of that degree"
    raise ModelError(
        f"{words} at degree {list(degrees)}; {cure}, a narrower range or a larger tolerance than {tolerance:g}"
    )


def _degrees(where: str, lines: tuple[FloatArray, ...], degree: int | Sequence[int] | None) -> list[tuple[int, ...]]:
    most = tuple(len(line) - 1 for line in lines)
    if degree is None:
        lowered = [max(1, m // 2) for m in most]  # through all points there would be no residual left to look at
        highest = min(max(lowered), HIGHEST_DEGREE)
        return [tuple(min(d, m) for m in lowered) for d in range(highest + 1)]
    given = tuple(degree) if isinstance(degree, Sequence) else (degree,) * len(lines)
    if len(given) != len(lines) or not all(isinstance(d, int) and 0 <= d <= HIGHEST_DEGREE for d in given):
        raise ModelError(
            f"{where}: degree {degree}; give one whole number from 0 to {HIGHEST_DEGREE}, or one for each parameter"
        )
    if any(d > m for d, m in zip(given, most, strict=True)):
        raise ModelError(
            f"{where}: degree {list(given)} needs more points than {[m + 1 for m in most]}; lower it or add points"
        )
    return [given]


def from_systems(
    systems: Any, where: str, signals: Mapping[str, tuple[Signal, ...] | None]
) -> tuple[dict[str, FloatArray], dict[str, tuple[Signal, ...]]]:
    """Tables (g, rows, columns) of `control.StateSpace` objects in the order of the points, and the signals.

    The columns of B and D are the inputs, then the disturbances. Signals that are not given take the labels of the first system
    and the unit 1. Raises ModelError for what is no continuous state-space system, and for systems of different sizes.
    """
    flat = list(_flat(systems))
    if not flat or not all(hasattr(s, "A") and hasattr(s, "nstates") for s in flat):
        raise ModelError(
            f"{where}: systems must be control.StateSpace objects, one for every point; convert with control.ss"
        )
    first = flat[0]
    for k, system in enumerate(flat):
        if system.dt not in (None, 0):
            raise ModelError(f"{where}: system {k} is discrete (dt = {system.dt}); convert it to continuous time")
        if (system.nstates, system.ninputs, system.noutputs) != (first.nstates, first.ninputs, first.noutputs):
            raise ModelError(
                f"{where}: system {k} has other sizes than the first; give the same states, inputs and outputs everywhere"
            )
    labels = {"states": first.state_labels, "outputs": first.output_labels, "inputs": first.input_labels}
    disturbances = signals.get("disturbances") or ()
    own: dict[str, tuple[Signal, ...]] = {"disturbances": disturbances}
    for kind, names in labels.items():
        given = signals.get(kind)
        count = len(names) - (len(disturbances) if kind == "inputs" else 0)
        own[kind] = (
            given if given is not None else tuple(Signal(_identifier(label), "1") for label in names[: max(count, 0)])
        )
        if len(own[kind]) != count:
            raise ModelError(f"{where}: {len(own[kind])} {kind} for systems of {count}; name each once")
    nu = len(own["inputs"])
    A, B, C, D = (np.stack([np.asarray(getattr(s, key), float) for s in flat]) for key in "ABCD")
    tables = {"A": A, "B": B[..., :nu], "E": B[..., nu:], "C": C, "D": D[..., :nu], "F": D[..., nu:]}
    return tables, own


def with_noise(
    tables: Mapping[str, Any], signals: Mapping[str, tuple[Signal, ...]]
) -> tuple[dict[str, Any], dict[str, tuple[Signal, ...]]]:
    """One more disturbance for every output, added to it: `NAME_noise` in its unit."""
    outputs, states, before = signals["outputs"], signals["states"], signals["disturbances"]
    ny, nx, nd = len(outputs), len(states), len(before)
    noise = tuple(Signal(f"{s.name}_noise", s.unit) for s in outputs)
    E, F = tables.get("E"), tables.get("F")
    E, F = (np.zeros((rows, nd)) if m is None else np.asarray(m, float) for m, rows in ((E, nx), (F, ny)))
    wide = (
        np.broadcast_to(np.zeros((nx, ny)), (*E.shape[:-2], nx, ny)),
        np.broadcast_to(np.eye(ny), (*F.shape[:-2], ny, ny)),
    )
    return (
        {**tables, "E": np.concatenate([E, wide[0]], -1), "F": np.concatenate([F, wide[1]], -1)},
        {**signals, "disturbances": (*before, *noise)},
    )


def _flat(systems: Any) -> list[Any]:
    if isinstance(systems, (list, tuple)) or (isinstance(systems, np.ndarray) and systems.dtype == object):
        return [one for entry in systems for one in _flat(entry)]
    return [systems]


def _identifier(label: str) -> str:
    name = re.sub(r"\W+", "_", label).strip("_")
    return name if name.isidentifier() else f"x_{name}"
