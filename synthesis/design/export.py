"""A proved deployment as the content of a schedule file; nothing unproved leaves through this door."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import sympy as sp

from estimators.errors import ScheduleError
from estimators.schedule import SCHEMA, canonical, check_content, write_content
from estimators.schedule.check import SHAPES, SIGNALS
from synthesis.certificate.claims import Claim
from synthesis.certificate.proof import Proof, prove
from synthesis.design.deploy import Deployment
from synthesis.design.law_table import update_section
from synthesis.errors import ProblemError
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.chebyshev import to_chebyshev
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import as_float


def schedule_content(
    deployment: Deployment, name: str, description: str = "", spec: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The unsealed content of a `gainsmith.schedule/2` file (`estimators.schedule.check`).

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> channels = (Channel(("friction",), ("relative_velocity",), bound=1.05), Channel(("force_noise",), ("relative_velocity",)))
    >>> gains = design_observer(model, ObserverDesign(channels, degree=0, decay_rate=80.0, fastest_pole=600.0))
    >>> schedule_content(deploy(gains), "my-schedule")["schema"]
    'gainsmith.schedule/2'
    """
    model, gain = deployment.gains.model, deployment.table
    return {
        "schema": SCHEMA,
        "name": name,
        "description": description,
        "model": _model(model),
        "scheduling": [
            {"name": p.name, "unit": p.unit, "min": p.minimum, "max": p.maximum,
             "rate_min": None if p.may_jump else p.rate_minimum, "rate_max": None if p.may_jump else p.rate_maximum,
             "absolute": p.absolute, "breakpoints": line.tolist()}
            for p, line in zip(model.parameters, deployment.breakpoints, strict=True)
        ],
        **constraints_of(model),
        "update": update_section(deployment.gains, deployment.settings),
        "plant": _plant(model),
        "gain": {"dtype": deployment.settings.dtype, "interpolation": "linear", "table": gain.tolist()},
        "claims": [_claim(claim) for claim in deployment.claims],
        "provenance": _provenance(deployment, spec or {}),
    }  # fmt: skip


def export(path: Path, content: Mapping[str, Any]) -> list[Proof]:
    """Prove the content and write it; raises ProblemError naming the claim and the place if one is not proved.

    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> channels = (Channel(("friction",), ("relative_velocity",), bound=1.05), Channel(("force_noise",), ("relative_velocity",)))
    >>> gains = design_observer(model, ObserverDesign(channels, degree=0, decay_rate=80.0, fastest_pole=600.0))
    >>> with TemporaryDirectory() as folder:
    ...     proofs = export(Path(folder) / "my-schedule.json", schedule_content(deploy(gains), "my-schedule"))
    >>> all(proof.proved for proof in proofs)
    True
    """
    try:
        check_content(content, str(path))
        proofs = prove(content, str(path))
    except ScheduleError as error:
        raise ProblemError(f"{path} is not written: {str(error).removeprefix(f'{path}: ')}") from None
    for proof in proofs:
        if not proof.proved:
            raise ProblemError(
                f"{path} is not written: '{proof.claim}' at {proof.level:g} {proof.unit} fails at {proof.place}"
            )
    write_content(path, content)
    return proofs


def spec_digest(spec: Mapping[str, Any]) -> str:
    """Digest of a resolved specification, parameter values included."""
    return sha256(canonical(spec)).hexdigest()


def stored(matrix: PolynomialMatrix) -> dict[str, Any]:
    """Chebyshev coefficients by their orders, correctly rounded to float64; orders without entries are left out."""
    series = to_chebyshev(matrix)
    orders = sorted(k for k, m in series.terms.items() if any(x != 0 for x in m.entries())) or [(0,) * matrix.variables]
    coefficients = []
    for order in orders:
        entries = series.terms.get(order)
        rows, columns = matrix.shape
        coefficients.append(
            [[0.0 if entries is None else as_float(entries[i, j]) for j in range(columns)]
             for i in range(rows)]
        )  # fmt: skip
    return {"orders": [list(order) for order in orders], "coefficients": coefficients}


def formula(entry: sp.Expr, model: LpvModel) -> str:
    """A matrix entry in the grammar of `synthesis.models.formula`; what it cannot say symbolically it says in numbers."""
    symbols = [sp.Symbol(name) for name in (*(p.name for p in model.parameters), *model.tables, *model.constants)]
    plain = entry.subs({s: sp.Symbol(s.name) for s in entry.free_symbols})
    plain = plain.replace(lambda e: e.is_Float, lambda e: sp.Rational(str(e)))
    rational = all(number.is_Rational for number in plain.atoms(sp.Number)) and not plain.atoms(
        sp.NumberSymbol, sp.Function
    )
    rational &= all(power.exp.is_Integer for power in plain.atoms(sp.Pow))
    if rational and plain.is_rational_function(*symbols):
        return str(plain)
    values = {sp.Symbol(name): sp.Rational(str(c.value)) for name, c in model.constants.items()}
    parameters = symbols[: len(model.parameters) + len(model.tables)]
    parts = []
    for part in sp.fraction(sp.cancel(sp.together(plain.subs(values)))):
        terms = {powers: sp.Rational(str(sp.N(c, 17))) for powers, c in sp.Poly(part, *parameters).terms()}
        parts.append(sp.Poly(terms, *parameters).as_expr())
    return str(parts[0] / parts[1])


def _model(model: LpvModel) -> dict[str, Any]:
    signals = {key: [{"name": s.name, "unit": s.unit} for s in getattr(model, key)] for key in SIGNALS}
    constants = {
        name: {"value": float(c.value), "unit": c.unit, "source": c.source} for name, c in model.constants.items()
    }
    matrices = {
        key: [[formula(entry, model) for entry in row] for row in getattr(model, key).tolist()] for key in SHAPES
    }
    tables = {"tables": {name: table.plain for name, table in model.tables.items()}} if model.tables else {}
    return {"id": model.name, "source": model.source, **signals, "constants": constants, **tables, "matrices": matrices}


def constraints_of(model: LpvModel) -> dict[str, Any]:
    """The section `constraints` of a schedule file where the set of the parameters is no box, with a place well inside."""
    if not model.constraints:
        return {}
    centre = model.centre[0]
    return {
        "constraints": {
            "centre": {p.name: float(value) for p, value in zip(model.parameters, centre, strict=True)},
            "inequalities": [
                {"coefficients": {name: float(c) for name, c in constraint.coefficients.items() if c},
                 "max": float(constraint.maximum), "unit": constraint.unit}
                for constraint in model.constraints
            ],
        }
    }  # fmt: skip


def _plant(model: LpvModel) -> dict[str, Any]:
    """Matrices over a common denominator, left out where it is one; of a plant by cells those of each in its coordinates."""
    if len(model.pieces) > 1:
        cells = [
            {key: stored(piece.exact.matrices[key].affine(piece.offset, piece.factor)) for key in SHAPES}
            for piece in model.pieces
        ]
        return {"breakpoints": [list(line) for line in model.cells.lines], "cells": cells}
    exact = model.pieces[0].exact
    below = {"denominator": stored(exact.denominator)} if any(exact.denominator.degrees) else {}
    return {key: stored(exact.matrices[key]) for key in SHAPES} | below


def _claim(claim: Claim) -> dict[str, Any]:
    out: dict[str, Any] = {"kind": claim.kind, "level": claim.level}
    if claim.channel is not None:
        channel = claim.channel
        errors = dict(zip(channel.errors, channel.sizes, strict=True)) if channel.sizes else list(channel.errors)
        out["channel"] = {"inputs": dict(channel.inputs), "errors": errors}
    if claim.centre is not None:
        out["centre"] = claim.centre
    return out | {"P": stored(claim.P)}


def _provenance(deployment: Deployment, spec: Mapping[str, Any]) -> dict[str, Any]:
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    moment = datetime.fromtimestamp(int(epoch), UTC) if epoch else datetime.now(UTC)
    return {
        "gainsmith": version("gainsmith"),
        "python": platform.python_version(),
        **{name: version(name) for name in ("numpy", "scipy", "clarabel", "python-flint")},
        "solver": deployment.gains.design.settings.solver,
        "spec": dict(spec),
        "spec_sha256": spec_digest(spec),
        "created": moment.isoformat(timespec="seconds"),
    }
