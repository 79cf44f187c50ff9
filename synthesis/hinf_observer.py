r"""H-infinity gain synthesis for LPV observers (P1 (30)-(32), sign corrected) with several channels and a pole band.

With V = e'P(p)e, X = P L and phi = A'P + P A - X C - C'X' + dP/dt, for the error e' = (A - L C) e + (E - L F) d:

    decay          phi + 2 alpha P < 0                          |e| decays at least like exp(-alpha t)
    fastest pole   phi - dP/dt + 2 r P > 0                      every frozen pole has a real part above -r
    channel d -> z [phi, P E - X F, Z'; *, -g I, 0; *, *, -g I] < 0 L2 gain from d to z = Z e at most g

The blocks have the form of (30), so one P serves all channels and weighs channel i by 1/g_i. Leaving that weight free would
push the noise gain down to its static floor, where the gains are not determined any more (0.6075 against 0.634 on the
longitudinal values of P1). A denominator of a rational model multiplies every inequality (it is positive on the range).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from synthesis.errors import ProblemError, unknown
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.scaling import observer_scale
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import FloatArray, symmetric_block


@dataclass(frozen=True)
class Channel:
    """The L2 gain from some disturbances to some estimation errors: bounded by `bound`, or minimised if None.

    `weights` multiply the disturbances (their sizes), in the order of `disturbances`.
    """

    disturbances: tuple[str, ...]
    errors: tuple[str, ...]
    bound: float | None = None
    weights: tuple[float, ...] | None = None

    @property
    def name(self) -> str:
        """Disturbances and errors in words."""
        return f"{'+'.join(self.disturbances)} -> {'+'.join(self.errors)}"


@dataclass(frozen=True)
class ObserverDesign:
    """What is asked of the gains."""

    channels: tuple[Channel, ...]
    degree: int = 1  # of P and X in the parameters
    decay_rate: float = 0.0  # alpha, 1/s
    fastest_pole: float | None = None  # r, 1/s; None: no bound
    backoff: float = 0.01  # the minimised gain may be this fraction worse; what it buys is margin
    reserve: float = 0.01  # the pole band is designed this much tighter than it is claimed, for the table's sake
    settings: LmiSettings = field(default_factory=LmiSettings)

    def __post_init__(self) -> None:
        if not 0 <= self.degree <= 8:
            raise ProblemError(f"degree {self.degree} of the gains must lie between 0 and 8")
        if sum(channel.bound is None for channel in self.channels) != 1:
            raise ProblemError("exactly one channel must have no bound: it is the one that is minimised")
        for channel in self.channels:
            if channel.bound is not None and not channel.bound > 0.0:
                raise ProblemError(f"channel '{channel.name}' has the bound {channel.bound}; give a positive number")
            if not channel.disturbances or not channel.errors:
                raise ProblemError(f"channel '{channel.name}' needs at least one disturbance and one error")
        if not 0.0 <= self.decay_rate < np.inf:
            raise ProblemError(f"decay rate {self.decay_rate} 1/s must be a number and must not be negative")
        if self.fastest_pole is not None and not self.decay_rate < self.fastest_pole < np.inf:
            raise ProblemError(f"fastest pole {self.fastest_pole} 1/s must exceed the decay rate {self.decay_rate} 1/s")
        for name in ("backoff", "reserve"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ProblemError(f"{name} {getattr(self, name)} must lie in [0, 1)")

    @property
    def minimised(self) -> Channel:
        """The channel without a bound."""
        return next(channel for channel in self.channels if channel.bound is None)


@dataclass(frozen=True)
class ObserverGains:
    """L(p) = P(p)^-1 X(p) with the bound that was minimised.

    `gamma_lower` is a bound from below for every P and X of this degree (weak duality, margins taken out),
    `gamma` the verified one. `result` carries verdict and margins, `optimum` the first solve.
    """

    design: ObserverDesign
    model: LpvModel
    gamma_lower: float | None
    gamma: float
    result: LmiResult
    optimum: LmiResult
    scale: FloatArray

    @property
    def verdict(self) -> Verdict:
        """Of the solve that the gains come from."""
        return self.result.verdict

    def gain(self, points: FloatArray) -> FloatArray:
        """L at parameter values (g,) or (g, p): array (g, nx, ny)."""
        grid = np.asarray(points, float).reshape(-1, len(self.model.parameters))
        middle = np.array([p.middle for p in self.model.parameters])
        half = np.array([p.half_width for p in self.model.parameters])
        scaled = np.hstack([(grid - middle) / half, np.zeros_like(grid)])
        P = self.result.values["P"].at(scaled)[..., 0]
        X = self.result.values["X"].at(scaled)[..., 0]
        return np.asarray(np.linalg.solve(P, X) / self.scale[:, None])


def design_observer(model: LpvModel, design: ObserverDesign) -> ObserverGains:
    """Minimise the open channel, then give back `backoff` of it and maximise the margin of every inequality.

    The second solve makes the gains well determined (the optimum itself is attained only at the boundary of
    feasibility, where gains may be unbounded). Raises ProblemError if the first solve finds nothing.
    """
    scale = observer_scale(model.polynomial, model.parameters)
    problem = observer_problem(model, design, scale)
    optimum = solve(problem, design.settings)
    if optimum.objective is None or not optimum.margins or optimum.objective <= 0.0:
        raise ProblemError(
            f"model '{model.name}': {optimum.message}; loosen a bound, the decay rate or the fastest pole"
        )
    lower = None if optimum.lower_bound is None else to_gamma(design, max(optimum.lower_bound, 0.0))
    best = to_gamma(design, optimum.objective)
    result, gamma = optimum, best
    if design.backoff > 0.0:
        gamma = best * (1.0 + design.backoff)
        settled = solve(observer_problem(model, design, scale, gamma), design.settings)
        if settled.verdict is not Verdict.CERTIFIED:
            raise ProblemError(f"model '{model.name}': {settled.message}")
        result = settled
    return ObserverGains(design, model, lower, gamma, result, optimum, scale)


def objective_name(design: ObserverDesign) -> str:
    """What the first solve minimises: gamma^2 in the compact form of a single channel, else gamma."""
    return "gamma^2" if len(design.channels) == 1 else "gamma"


def to_gamma(design: ObserverDesign, objective: float) -> float:
    """The gain that belongs to an objective value."""
    return float(np.sqrt(objective)) if len(design.channels) == 1 else float(objective)


def observer_problem(
    model: LpvModel,
    design: ObserverDesign,
    scale: FloatArray,
    gamma: float | None = None,
    maximise_margin: bool = True,
) -> LmiProblem:
    """The LMIs of the module docstring in the states diag(scale) x.

    Without `gamma` the open channel is minimised; with it that channel is bounded by gamma and, unless told otherwise, a
    common margin of all inequalities is maximised.
    """
    problem = LmiProblem(model.parameters, maximise_margin=maximise_margin and gamma is not None)
    scaled = model.polynomial.with_states_scaled(scale)
    known = {key: problem.known(getattr(scaled, key)) for key in ("A", "C", "E", "F", "denominator")}
    below, nx, ny = known["denominator"], len(model.states), len(model.outputs)
    P = problem.symmetric("P", nx, design.degree)
    X = problem.matrix("X", nx, ny, design.degree)
    closed = P @ known["A"] - X @ known["C"]
    frozen = closed + closed.T
    phi = frozen + problem.time_derivative(P).scaled_by(below)

    problem.require("P > 0", P)
    if design.decay_rate > 0.0 or not design.channels:
        problem.require("decay rate", -(phi + P.scaled_by(below) * (2.0 * design.decay_rate * (1.0 + design.reserve))))
    if design.fastest_pole is not None:
        problem.require(
            "fastest pole", frozen + P.scaled_by(below) * (2.0 * design.fastest_pole / (1.0 + design.reserve))
        )
    compact = len(design.channels) == 1
    for channel in design.channels:
        d, z = channel_matrices(model, channel)
        force = (P @ known["E"] - X @ known["F"]) @ problem.constant(d)
        inputs, errors = problem.constant(np.eye(d.shape[1])), problem.constant(np.eye(len(z)))
        level = channel.bound or gamma
        if level is None:
            unknown_level = problem.scalar(objective_name(design))
            problem.minimise(objective_name(design))
        else:
            unknown_level = problem.constant(np.array([[level**2 if compact else level]]))
        unknown_level = unknown_level.scaled_by(below)
        if compact:  # Schur complement of (30), with P scaled by gamma: a smaller block for the same bound
            corner = phi + problem.constant(z.T @ z / np.outer(scale, scale)).scaled_by(below)
            block = symmetric_block([[corner, force], [None, -inputs.scaled_by(unknown_level)]])
        else:
            output = problem.constant((z / scale).T).scaled_by(below)
            block = symmetric_block(
                [
                    [phi, force, output],
                    [None, -inputs.scaled_by(unknown_level), None],
                    [None, None, -errors.scaled_by(unknown_level)],
                ]
            )
        problem.require(f"gain {channel.name}", -block)
    return problem


def channel_matrices(model: LpvModel, channel: Channel) -> tuple[FloatArray, FloatArray]:
    """Selection (with weights) of disturbances (nd, k) and of errors (m, nx). Raises ProblemError for unknown names."""
    disturbances, states = [d.name for d in model.disturbances], [s.name for s in model.states]
    for name in channel.disturbances:
        if name not in disturbances:
            raise ProblemError(f"channel '{channel.name}': {unknown('disturbance', name, disturbances)}")
    for name in channel.errors:
        if name not in states:
            raise ProblemError(f"channel '{channel.name}': {unknown('state', name, states)}")
    weights = channel.weights or (1.0,) * len(channel.disturbances)
    if len(weights) != len(channel.disturbances):
        raise ProblemError(
            f"channel '{channel.name}' has {len(weights)} weights for {len(channel.disturbances)} disturbances"
        )
    d = np.eye(len(disturbances))[:, [disturbances.index(name) for name in channel.disturbances]] * np.array(weights)
    return d, np.eye(len(states))[[states.index(name) for name in channel.errors]]
