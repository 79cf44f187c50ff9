"""How near a schedule comes to what is proved about it, at every constant parameter value: a second calculation, in floats.

A constant parameter is one of the admissible motions, so no proved level can be better than what is found here; how far it
stays behind is the price of motion and of the proof. Norms and drop probabilities come from `analysis`, which shares nothing
with the verifier but the loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from flint import fmpq

from analysis import controllability_gramian, critical_drop_probability, hinf_norm
from estimators.arrays import FloatArray
from synthesis.certificate.claims import (
    ERROR_EQUATION,
    GAINS,
    LARGER_IS_BETTER,
    WITH_CHANNEL,
    Claim,
    claim_name,
    claim_unit,
    rows_of,
)
from synthesis.certificate.content import claims_of, subject_of
from synthesis.certificate.poles import CONTINUOUS, DISCRETE, pole_levels
from synthesis.certificate.refute import grid
from synthesis.loop.loop import Loop
from synthesis.loop.system import Region, System
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.rational import as_float


@dataclass(frozen=True)
class FrozenLevel:
    """A claim with its proved ``level`` and what constant parameters ``points`` (g, p) allow, ``values`` (g,)."""

    claim: str
    kind: str
    unit: str
    level: float
    points: FloatArray
    values: FloatArray

    @property
    def larger_is_better(self) -> bool:
        """Whether the proof is a bound from below."""
        return self.kind in LARGER_IS_BETTER

    @property
    def tightest(self) -> int:
        """The point where the value is nearest to the proved level."""
        return int(np.argmin(self.values) if self.larger_is_better else np.argmax(self.values))

    @property
    def slack(self) -> float:
        """What is left there, as a share of the level; negative would contradict the proof."""
        best = self.values[self.tightest]
        return float(best / self.level - 1.0 if self.larger_is_better else 1.0 - best / self.level)


def frozen_levels(content: Mapping[str, Any], where: str = "schedule") -> list[FrozenLevel]:
    """One for each claim of a checked schedule content. Raises ScheduleError as `synthesis.certificate.content.subject_of`."""
    subject = subject_of(content, where)
    loop, axes = subject.loop, subject.loop.plant.axes
    points = list(dict.fromkeys(grid(loop)))
    scale = np.array([[as_float(axis.middle), as_float(axis.half)] for axis in axes]).reshape(-1, 2)
    places = (
        np.array([[as_float(u) for u in point] for point in points]).reshape(len(points), -1) * scale[:, 1]
        + scale[:, 0]
    )
    found = []
    for claim in claims_of(content, subject, where):
        systems = _standing(loop, points, "continuous" if claim.kind in ERROR_EQUATION else "discrete")
        kept = np.array([system is not None for system in systems])
        values = _values(claim, [s for s in systems if s is not None], subject.names, loop)
        name = claim_name(claim.kind, claim.channel, subject.units, claim.centre)
        unit = claim_unit(claim.kind, claim.channel, subject.units)
        found.append(FrozenLevel(name, claim.kind, unit, claim.level, places[kept], values))
    return found


def _standing(loop: Loop, points: list[Any], time: Literal["continuous", "discrete"]) -> list[System | None]:
    count = len(loop.plant.axes)
    still = (fmpq(0),) * count
    return [loop.system(Region((*point, *still), still * 2), time) for point in points]


def _values(claim: Claim, systems: list[System], names: Any, loop: Loop) -> FloatArray:
    A = np.array([_matrix(system.A, system) for system in systems])
    poles = np.linalg.eigvals(A)
    if claim.kind in (*CONTINUOUS, *DISCRETE):
        poles = poles - (claim.centre or 0.0)
        return pole_levels(claim.kind, poles, 1.0 if loop.sample_time is None else as_float(loop.sample_time))
    match claim.kind:
        case "decay rate":
            return np.asarray(-poles.real.max(axis=-1), float)
        case "fastest pole":
            return np.asarray(-poles.real.min(axis=-1), float)
        case "internal update" | "sampled error":
            period = as_float(loop.sample_time) if loop.sample_time is not None else 1.0
            return np.asarray(-np.log(np.abs(poles).max(axis=-1)) / period, float)
        case "drop probability":
            return critical_drop_probability(np.array([_matrix(s.coasting, s) for s in systems]), A)
    assert claim.channel is not None
    group = WITH_CHANNEL[claim.kind]
    inputs = names.disturbances if group == "disturbances" else names.states
    where, sizes = rows_of(inputs, claim.channel)
    B = np.array([_matrix(system.B[group], system)[:, where] * np.array(sizes) for system in systems])
    channel = claim.channel
    Z = np.array([[float(name == error) for name in names.errors] for error in channel.errors])
    Z = Z / np.array(channel.error_sizes)[:, None]
    C = np.array([Z @ _entries(system.C) for system in systems])
    D = np.array([Z @ _entries(system.D[group])[:, where] * np.array(sizes) for system in systems])
    if claim.kind not in GAINS:
        discrete = claim.kind.startswith("sampled")
        period = as_float(loop.sample_time) if discrete and loop.sample_time is not None else 1.0
        return np.asarray(_impulse(A, B, C, D, discrete, peak=claim.kind.endswith("peak")) / np.sqrt(period))
    return hinf_norm(A, B, C, D, discrete=claim.kind != "gain").norm


def _impulse(A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, discrete: bool, peak: bool) -> FloatArray:
    """H2 norms, or with `peak` generalised H2 norms: root of the trace or of the largest eigenvalue of C X C' + D D'."""
    values = np.linalg.eigvals(A)
    stable = np.abs(values).max(axis=-1) < 1.0 if discrete else values.real.max(axis=-1) < 0.0
    out = np.full(len(A), np.inf)
    X = controllability_gramian(A[stable], B[stable], discrete=discrete)
    shown = C[stable] @ X @ np.swapaxes(C[stable], 1, 2)
    shown = shown + (D[stable] @ np.swapaxes(D[stable], 1, 2) if discrete else 0.0)
    out[stable] = np.sqrt(np.linalg.eigvalsh(shown)[:, -1] if peak else np.trace(shown, axis1=1, axis2=2))
    return out


def _matrix(matrix: PolynomialMatrix, system: System) -> FloatArray:
    """At the constant parameter, in floats."""
    below = 1.0 if system.denominator is None else _entries(system.denominator).item()
    return _entries(matrix) / below


def _entries(matrix: PolynomialMatrix) -> FloatArray:
    entries = matrix.terms.get((0,) * matrix.variables)
    if entries is None:
        return np.zeros(matrix.shape)
    return np.array([float(x.mid()) if hasattr(x, "mid") else as_float(x) for x in entries.entries()]).reshape(
        matrix.shape
    )
