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
from flint import fmpq, fmpq_mat

from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from synthesis.certificate.claims import Claim
from synthesis.certificate.proof import place_words
from synthesis.certificate.refute import unstable_place
from synthesis.certificate.rounding import rounded_lyapunov
from synthesis.certificate.verify import Names, Outcome, Verifier
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Margin, Verdict
from synthesis.lmi.scaling import error_scale
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.loop.from_model import plant_of
from synthesis.loop.observer import ObserverLoop
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.rational import as_float, decimal, rational

PRECISE = 15  # digits of P when it is proved right here

Form = Literal["primal", "dual"]


@dataclass(frozen=True, repr=False)
class GainBox(Display):
    """All gains L with lower <= L <= upper, entry by entry; arrays (nx, ny).

    >>> GainBox(lower=[[0.5], [60.0]], upper=[[0.9], [210.0]]).vertices().shape
    (4, 2, 1)
    """

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


@dataclass(frozen=True, repr=False)
class StabilityResult(Display):
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

    CERTIFIED: proved for the exact model on the continuum of parameters, rates and gains, in ball arithmetic. REFUTED: a frozen
    pole is not left of -decay_rate, by exact signs.
    INCONCLUSIVE: neither; the message names the tightest inequality. Raises ProblemError for gains of a wrong shape.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> print(affine_quadratic_stability(model, [[0.68], [183.1]], degree=1).verdict)
    certified
    >>> print(affine_quadratic_stability(model, [[0.68], [-183.1]], degree=1).verdict)
    refuted
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
    problem = LmiProblem(model.parameters, maximise_margin=True, half_spaces=model.half_spaces)
    scaled = model.polynomial.with_states_scaled(scale)
    A, C, below = (problem.scaled(getattr(scaled, key)) for key in ("A", "C", "denominator"))
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
    weights = scale if form == "primal" else 1.0 / scale
    lyapunov = physical(model, result, "P") * np.outer(weights, weights)
    verdict, message = _verdict(model, vertices, result, weights, form, decay_rate)
    return StabilityResult(verdict, message, form, lyapunov, result, result.margins)


def _verdict(
    model: LpvModel, gains: FloatArray, result: LmiResult, weights: FloatArray, form: Form, decay_rate: float
) -> tuple[Verdict, str]:
    """The verdict on the exact model and the P that was found, in ball arithmetic; refuted where a frozen pole is not stable."""
    plant, rate = plant_of(model), decimal(float(decay_rate))
    loops = [
        ObserverLoop.constant_gain(plant, fmpq_mat([[rational(float(x)) for x in row] for row in gain]))
        for gain in gains
    ]
    names = Names(tuple(s.name for s in model.states), ())
    failed: Outcome | None = None
    if result.verdict is Verdict.CERTIFIED or (result.margins and result.verdict is Verdict.INCONCLUSIVE):
        P = rounded_lyapunov(result.values["P"].coefficients[..., 0], weights, len(model.parameters), digits=PRECISE)
        claim = Claim("decay rate", float(decay_rate), P)
        outcomes = (Verifier(loop, names).prove(claim, dual=form == "dual") for loop in loops)
        failed = next((outcome for outcome in outcomes if not outcome.proved), None)
        if failed is None:
            return Verdict.CERTIFIED, result.message.replace("not certified", "certified").split("; scale the states")[
                0
            ]
    first = [] if failed is None else [failed.place[: len(model.parameters)]]
    for loop, gain in zip(loops, gains, strict=True):
        place = unstable_place(loop, rate, first)
        if place is not None:
            return Verdict.REFUTED, f"refuted: {_pole_words(model, gain, place, decay_rate)}"
    if result.verdict is Verdict.CERTIFIED and failed is not None:
        words = place_words(plant.axes, failed.place)
        return Verdict.INCONCLUSIVE, f"not certified: '{failed.inequality}' is not proved at {words}; raise the degree"
    # That no P of this degree exists refutes the degree, not the stability of the loop.
    return Verdict.INCONCLUSIVE, result.message.replace("refuted:", "inconclusive:")


def _pole_words(model: LpvModel, gain: FloatArray, place: tuple[fmpq, ...], decay_rate: float) -> str:
    values = [p.middle + p.half_width * as_float(u) for p, u in zip(model.parameters, place, strict=True)]
    point = np.array([values]).reshape(1, len(values))
    inside = np.clip(point, [p.minimum for p in model.parameters], [p.maximum for p in model.parameters])
    pole = float(np.linalg.eigvals(model.on(inside).error_dynamics(gain)[0]).real.max())
    where = ", ".join(f"{p.name} = {v:.6g} {p.unit}" for p, v in zip(model.parameters, values, strict=True))
    asked = f", not below {-decay_rate:g}" if decay_rate else ""
    return f"pole at {pole:+.3g} 1/s{asked}, {where or 'no parameter'}, L = {np.round(gain.ravel(), 6).tolist()}"


def physical(model: LpvModel, result: LmiResult, name: str) -> FloatArray:
    """Coefficients of an unknown in the physical parameters, shape (d_1+1, ..., d_p+1, rows, columns)."""
    count = len(model.parameters)
    offsets = np.array([-p.middle / p.half_width for p in model.parameters] + [0.0] * count)
    factors = np.array([1.0 / p.half_width for p in model.parameters] + [1.0] * count)
    coefficients = result.values[name].affine(offsets, factors).coefficients[..., 0]
    return np.asarray(coefficients.reshape(*coefficients.shape[:count], *coefficients.shape[-2:]))


def _scale(model: LpvModel, box: GainBox) -> FloatArray:
    middle = model.on(np.array([[p.middle for p in model.parameters]]))
    return error_scale(middle.error_dynamics(box.middle)[0][0])
