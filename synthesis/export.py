"""A proved deployment as the content of a schedule file; nothing unproved leaves through this door."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from estimators.schedule import SCHEMA, canonical, write_content
from synthesis.claims import Claim
from synthesis.deploy import Deployment
from synthesis.deployed_loop import DeployedLoop, frozen_gain
from synthesis.errors import ProblemError
from synthesis.hinf_observer import channel_matrices
from synthesis.models.extract import MATRICES
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import FloatArray
from synthesis.verify import Proof, prove

METHOD = (
    "matrix Bernstein coefficients and subdivision in exact rational arithmetic, segment by segment (synthesis.verify)"
)


def schedule_content(
    deployment: Deployment, name: str, description: str = "", spec: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The unsealed content of a `gainsmith.schedule/1` file (DESIGN, schedule file).

    Raises ProblemError if the model is rational: the file format stores polynomial plants.
    """
    model, loop = deployment.gains.model, deployment.loop
    if not model.polynomial.is_polynomial:
        raise ProblemError(f"model '{model.name}' is rational; the schedule format stores polynomial plants")
    (parameter,) = model.parameters
    box = {
        "min": parameter.minimum,
        "max": parameter.maximum,
        "rate_min": parameter.rate_minimum,
        "rate_max": parameter.rate_maximum,
    }
    return {
        "schema": SCHEMA,
        "name": name,
        "description": description,
        "model": _model(model),
        "scheduling": [
            {"name": parameter.name, "unit": parameter.unit, **box, "absolute": parameter.absolute,
             "breakpoints": loop.breakpoints.tolist()}
        ],
        "sample_time": deployment.settings.sample_time,
        "plant": {
            "abs": [p.name for p in model.parameters if p.absolute],
            **{key: _polynomial(getattr(model.polynomial, key)) for key in MATRICES},
        },
        "gain": {
            "unit": [[f"({state.unit}/s)/({output.unit})" for output in model.outputs] for state in model.states],
            "dtype": deployment.settings.dtype,
            "interpolation": "linear",
            "table": loop.table.tolist(),
        },
        "guarantee": _guarantee(deployment),
        "certificate": {"method": METHOD, "box": box, "claims": [_claim(model, claim) for claim in deployment.claims]},
        "provenance": _provenance(deployment, spec or {}),
    }  # fmt: skip


def export(path: Path, content: Mapping[str, Any]) -> list[Proof]:
    """Prove the content and write it; raises ProblemError naming the claim and the place if one is not proved."""
    proofs = prove(content, str(path))
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


def _model(model: LpvModel) -> dict[str, Any]:
    signals = {
        key: [{"name": s.name, "unit": s.unit} for s in getattr(model, key)]
        for key in ("states", "inputs", "outputs", "disturbances")
    }
    constants = {
        name: {"value": float(c.value), "unit": c.unit, "source": c.source} for name, c in model.constants.items()
    }
    return {"id": model.name, "source": model.source, **signals, "constants": constants}


def _polynomial(coefficients: FloatArray) -> dict[str, Any]:
    """Coefficients (d+1, rows, columns) of one parameter as monomials and matrices."""
    return {"monomials": [[k] for k in range(len(coefficients))], "coefficients": np.asarray(coefficients).tolist()}


def _claim(model: LpvModel, claim: Claim) -> dict[str, Any]:
    request = claim.request
    out: dict[str, Any] = {"name": claim.name, "kind": request.kind, "level": claim.level, "unit": request.unit}
    if request.channel is not None:
        d, z = channel_matrices(model, request.channel)
        out |= {"disturbances": d.tolist(), "errors": z.tolist()}
    if request.kind in ("sampled", "drops"):
        out |= {"frozen_decay": request.frozen_decay, "growth": request.growth}
    if request.kind == "drops":
        out |= {"open_growth": request.open_growth}
    return out | {"P": _polynomial(claim.P)}


def _guarantee(deployment: Deployment) -> dict[str, Any]:
    """What is promised, each with the bound from below that shows how much of it is conservatism."""
    gains, loop, period = deployment.gains, deployment.loop, deployment.settings.sample_time
    claims = {claim.name: claim for claim in deployment.claims}
    channels = []
    for channel in gains.design.channels:
        claim = claims[f"gain {channel.name}"]
        channels.append(
            {"name": channel.name, "unit": claim.request.unit, "gamma_lower": frozen_gain(loop, channel),
             "gamma_certified": claim.level, "design_bound": channel.bound or gains.gamma}
        )  # fmt: skip
    sampled = claims["sampled decay rate"].level
    return {
        "claims": {claim.name: claim.level for claim in deployment.claims},
        "channels": channels,
        "design": {"gamma": gains.gamma, "gamma_lower": gains.gamma_lower, "degree": gains.design.degree,
                   "relaxation": gains.result.report.relaxation},
        "decay_rate": gains.design.decay_rate,
        "fastest_pole": gains.design.fastest_pole,
        "sampled_decay_rate": sampled,
        "sampled_contraction": math.exp(-sampled * period),
        "sampled_spectral_radius_max": sampled_radius(loop, period),
        "interpolation_cost": max(deployment.cost, 0.0),
    }  # fmt: skip


def sampled_radius(loop: DeployedLoop, period: float, points: int = 1401) -> float:
    """Largest spectral radius of e^{A_e T}, exp(T max Re), on a grid: informative; 'sampled decay rate' is the proof."""
    grid = np.linspace(loop.breakpoints[0], loop.breakpoints[-1], points)
    return float(np.exp(period * np.linalg.eigvals(loop.error_matrices(grid)[0]).real.max()))


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
