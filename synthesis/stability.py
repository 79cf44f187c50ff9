r"""Affine quadratic stability of an observer with given gains, or with a whole box of gains (P1 (26)-(28), (40)).

    primal  P(p) > 0,  A_e'P + P A_e + dP/dt < 0      V = e'P(p)e
    dual    Q(p) > 0,  A_e Q + Q A_e' - dQ/dt < 0      V = e'Q(p)^-1 e

for all p in the box and all rates in theirs. A_e = A - L C is affine in L, so for a box of gains its vertices are exact.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product
from typing import Literal, get_args

import numpy as np

from synthesis.errors import ProblemError, unknown
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Margin, Verdict
from synthesis.lmi.scaling import error_scale
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import FloatArray

Form = Literal["primal", "dual"]


@dataclass(frozen=True)
class GainBox:
    """All gains L with lower <= L <= upper, entry by entry; arrays (nx, ny)."""

    lower: FloatArray
    upper: FloatArray

    def vertices(self) -> FloatArray:
        """The corner gains (2^k, nx, ny) over the k entries that vary."""
        lower, upper = np.asarray(self.lower, float), np.asarray(self.upper, float)
        if lower.shape != upper.shape or not (np.isfinite(lower) & np.isfinite(upper) & (lower <= upper)).all():
            raise ProblemError(f"gain box: lower {lower.tolist()} must not exceed upper {upper.tolist()}")
        options = [sorted({a, b}) for a, b in zip(lower.ravel(), upper.ravel(), strict=True)]
        return np.array(list(product(*options))).reshape(-1, *lower.shape)

    @property
    def middle(self) -> FloatArray:
        """The gain in the middle of the box."""
        return np.asarray(0.5 * (np.asarray(self.lower, float) + np.asarray(self.upper, float)))


@dataclass(frozen=True)
class StabilityResult:
    """Verdict, the Lyapunov matrix as coefficients in the physical parameters and states, and the margins.

    `lyapunov` has the shape (d_1+1, ..., d_p+1, nx, nx); it is P in the primal form and Q in the dual one. `unstable`
    names a place where the frozen loop has a pole in the closed right half-plane: then the verdict is REFUTED.
    """

    verdict: Verdict
    message: str
    form: Form
    lyapunov: FloatArray
    result: LmiResult
    margins: tuple[Margin, ...] = field(default_factory=tuple)


def affine_quadratic_stability(
    model: LpvModel,
    gains: FloatArray | GainBox,
    degree: int = 1,
    form: Form = "primal",
    settings: LmiSettings | None = None,
    decay_rate: float = 0.0,
) -> StabilityResult:
    """Search a Lyapunov matrix of the given degree; with `decay_rate` alpha for V' < -2 alpha V.

    CERTIFIED: proved on the continuum of parameters, rates and gains. REFUTED: a frozen pole is not stable.
    INCONCLUSIVE: neither; the message names the tightest inequality. Raises ProblemError for gains of a wrong shape.
    """
    settings = settings or LmiSettings()
    box = gains if isinstance(gains, GainBox) else GainBox(np.asarray(gains, float), np.asarray(gains, float))
    if form not in get_args(Form):
        raise ProblemError(unknown("form", form, get_args(Form)))
    if not 0.0 <= decay_rate < np.inf:
        raise ProblemError(f"decay rate {decay_rate} 1/s must be a number >= 0")
    vertices = box.vertices()
    shape = (len(model.states), len(model.outputs))
    if vertices.shape[1:] != shape:
        raise ProblemError(f"model '{model.name}': gains of shape {vertices.shape[1:]} do not fit {shape}")
    scale = _scale(model, box)
    problem = LmiProblem(model.parameters, maximise_margin=True)
    scaled = model.polynomial.with_states_scaled(scale)
    A, C, below = (problem.known(getattr(scaled, key)) for key in ("A", "C", "denominator"))
    P = problem.symmetric("P", shape[0], degree)
    problem.require("P > 0", P)
    problem.require("P < 1", problem.constant(np.eye(shape[0])) - P, strict=False)
    motion = problem.time_derivative(P).scaled_by(below)
    shift = P.scaled_by(below) * (2.0 * decay_rate)
    for gain in vertices:
        A_e = A - problem.constant(scale[:, None] * gain) @ C
        product_ = P @ A_e if form == "primal" else A_e @ P
        rate = motion if form == "primal" else -motion
        name = "dV/dt < 0" if len(vertices) == 1 else f"dV/dt < 0 with L = {np.round(gain.ravel(), 6).tolist()}"
        problem.require(name, -(product_ + product_.T + rate + shift))
    result = solve(problem, settings)
    weights = np.outer(scale, scale) if form == "primal" else 1.0 / np.outer(scale, scale)
    verdict, message = result.verdict, result.message
    if verdict is not Verdict.CERTIFIED:
        place = unstable_place(model, vertices)
        if place:
            verdict, message = Verdict.REFUTED, f"refuted: {place}"
    return StabilityResult(verdict, message, form, physical(model, result, "P") * weights, result, result.margins)


def physical(model: LpvModel, result: LmiResult, name: str) -> FloatArray:
    """Coefficients of an unknown in the physical parameters, shape (d_1+1, ..., d_p+1, rows, columns)."""
    count = len(model.parameters)
    offsets = np.array([-p.middle / p.half_width for p in model.parameters] + [0.0] * count)
    factors = np.array([1.0 / p.half_width for p in model.parameters] + [1.0] * count)
    coefficients = result.values[name].affine(offsets, factors).coefficients[..., 0]
    return np.asarray(coefficients.reshape(*coefficients.shape[:count], *coefficients.shape[-2:]))


def unstable_place(model: LpvModel, gains: FloatArray, points: int = 401) -> str:
    """Where a frozen loop has a pole that is not in the open left half-plane, in words; empty if nowhere on the grid."""
    number = max(2, round(points ** (1.0 / len(model.parameters))))
    axes = [np.linspace(p.minimum, p.maximum, number) for p in model.parameters]
    grid = np.stack([g.ravel() for g in np.meshgrid(*axes, indexing="ij")], axis=1)
    numeric = model.on(grid)
    for gain in gains:
        slowest = np.linalg.eigvals(numeric.error_dynamics(gain)[0]).real.max(axis=1)
        worst = int(np.argmax(slowest))
        if slowest[worst] >= 0.0:
            where = ", ".join(
                f"{p.name} = {v:.4g} {p.unit}" for p, v in zip(model.parameters, grid[worst], strict=True)
            )
            return f"pole at {slowest[worst]:+.3g} 1/s, {where}, L = {np.round(gain.ravel(), 6).tolist()}"
    return ""


def _scale(model: LpvModel, box: GainBox) -> FloatArray:
    middle = model.on(np.array([[p.middle for p in model.parameters]]))
    return error_scale(middle.error_dynamics(box.middle)[0][0])
