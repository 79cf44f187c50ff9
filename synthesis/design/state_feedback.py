r"""H-infinity gain synthesis for LPV state feedback u = K(p) x with several channels, pole regions and limits on the gains.

With Q(p) = P(p)^-1, V = x'P(p)x, Y = K Q, M = A Q + B Y and the performance signals z = Cz x + Dz u + Fz d (Bernussou, Peres,
Geromel 1989; Wu, Yang, Packard, Becker 1996; regions: Chilali, Gahinet 1996):

    decay          -(M + M' - dQ/dt + 2 alpha Q) > 0                         |x|_P decays at least like exp(-alpha t)
    fastest pole   [r Q, M; M', r Q] > 0                                     every frozen pole s has |s| < r
    damping        -[sin a (M + M'), cos a (M - M'); *, sin a (M + M')] > 0  |Im s| < tan a |Re s|, cos a the damping ratio
    channel        -[M + M' - dQ/dt, E, (Cz Q + Dz Y)'; *, -g I, Fz'; *, *, -g I] > 0        L2 gain from d to z at most g
    generalised H2 [-(M + M' - dQ/dt), -E; *, g I] > 0, [Q, (Cz Q + Dz Y)'; *, g I] > 0     |z| at most g (energy of d)^(1/2)
    H2             [-(M + M' - dQ/dt), -(Cz Q + Dz Y)'; *, g I] > 0, [W, E'; *, Q] > 0, tr W < g    energies after impulses
    limit of u_i   [q c^2, Y_i; *, Q] > 0,  Q > q S^2                        |K_i x| < c for all x with x'S^-2 x <= 1

One Q serves all channels and weighs channel i by 1/g_i. A denominator of a rational model multiplies every inequality (it is
positive on the range). States are measured in the size that the cost of the channels gives them, inputs in the size that moves
such states, so that the answer does not depend on units. It is the dual of `synthesis.design.hinf_observer`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display
from estimators.errors import unknown
from synthesis.design.asked import check_degree_and_poles, check_shares, minimised_channel
from synthesis.design.feedback_channel import FeedbackChannel, check_feedback_channels, feedback_channel_matrices
from synthesis.design.feedback_scale import FeedbackScale, feedback_scale
from synthesis.design.kinked import KinkedUnknown, kinked_values
from synthesis.design.norms import ChannelSizes, compact_form, levels, require_energy
from synthesis.design.pole_regions import PoleRegions, require_damping, require_disc, require_regions
from synthesis.design.refusals import refuse_feedthrough, refuse_unstabilisable
from synthesis.design.three_solves import lyapunov_degree, problem_for, three_solves
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.feedback import Measured
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block


@dataclass(frozen=True, repr=False)
class GainLimits(Display):
    """The largest |u_i| of some inputs for every state in the ellipsoid sum over j of (x_j / sizes_j)^2 <= 1.

    >>> GainLimits({"force": 3000.0}, {"deflection": 0.05, "speed": 0.5}).inputs["force"]
    3000.0
    """

    inputs: Mapping[str, float]
    sizes: Mapping[str, float]


@dataclass(frozen=True, repr=False)
class StateFeedbackDesign(Display):
    """What is asked of the gains.

    >>> road = FeedbackChannel(("road",), ("acceleration", "force"), sizes=(1.0, 500.0))
    >>> StateFeedbackDesign((road,), decay_rate=2.0, fastest_pole=400.0).minimised.name
    'road -> acceleration+force'
    """

    shown_units: ClassVar = {"decay_rate": "1/s", "fastest_pole": "1/s"}

    channels: tuple[FeedbackChannel, ...]
    degree: int = 1  # of Q and Y in the parameters
    decay_rate: float = 0.0  # alpha, 1/s
    fastest_pole: float | None = None  # r, 1/s; None: no bound
    damping: float | None = None  # least damping ratio of every frozen pole; None: no bound
    limits: GainLimits | None = None
    backoff: float = 0.01  # the minimised gain may be this fraction worse; what it buys is margin
    reserve: float = 0.01  # regions and limits are designed this much tighter than they are asked for
    settings: LmiSettings = field(default_factory=LmiSettings)
    regions: PoleRegions = field(default_factory=PoleRegions)

    def __post_init__(self) -> None:
        check_feedback_channels(self.channels)
        check_degree_and_poles(self.degree, self.decay_rate, self.fastest_pole)
        if self.damping is not None and self.regions.damping is not None:
            raise ProblemError("damping and regions.damping ask for the same twice; remove one")
        if self.damping is not None and not 0.0 < self.damping < 1.0:
            raise ProblemError(f"damping {self.damping} must be a damping ratio between 0 and 1")
        check_shares(self.backoff, self.reserve)

    @property
    def minimised(self) -> FeedbackChannel:
        """The channel without a bound."""
        return minimised_channel(self.channels)

    @property
    def compact(self) -> bool:
        """Whether the solver minimises the square of the level (`synthesis.design.norms`)."""
        return compact_form([channel.norm for channel in self.channels])


@dataclass(frozen=True, repr=False)
class StateFeedbackGains(Display):
    """K(p) = Y(p) Q(p)^-1, u = K x (of a sampled design Y(p) G(p)^-1), with the bound that was minimised.

    `gamma_lower` is a bound from below for every Q and Y of this degree (weak duality, margins taken out), where there is one;
    `gamma` the verified level, of the continuous-time loop unless the design is sampled. `result` carries verdict and margins,
    `optimum` the first solve.
    """

    design: StateFeedbackDesign
    model: LpvModel
    gamma_lower: float | None
    gamma: float
    result: LmiResult
    optimum: LmiResult
    scale: FeedbackScale
    measured: Measured = "states"
    order: int = 0
    sample_time: float | None = None  # s, of a sampled design (synthesis.design.sampled_state_feedback)

    @property
    def verdict(self) -> Verdict:
        """Of the solve that the gains come from."""
        return self.result.verdict

    def gain(self, points: FloatArray) -> FloatArray:
        """K at parameter values (g,) or (g, p): array (g, nu, nx)."""
        u = self.model.scaled(points)
        still = np.hstack([u, np.zeros_like(u)])
        right = self.result.values["Q" if self.sample_time is None else "G"].at(still)[..., 0]
        Y = kinked_values(self.result.values, self.model, "Y", u)
        K = np.swapaxes(np.linalg.solve(np.swapaxes(right, -1, -2), np.swapaxes(Y, -1, -2)), -1, -2)
        return np.asarray(K * self.scale.inputs[:, None] * self.scale.states)

    def controller(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Ak (g, 0, 0), Bk (g, 0, nx), Ck (g, nu, 0), Dk = K (g, nu, nx): a law without states of its own."""
        K = self.gain(points)
        g, nu, nx = K.shape
        return np.zeros((g, 0, 0)), np.zeros((g, 0, nx)), np.zeros((g, nu, 0)), K


def design_state_feedback(model: LpvModel, design: StateFeedbackDesign) -> StateFeedbackGains:
    """Minimise the open channel, then give back `backoff` of it and take the gains that vary least and keep most of the margin.

    Raises ProblemError if nothing is found, for unknown names, and for a model that is not stabilisable.

    >>> import sympy as sp
    >>> p = SchedulingParameter("p", "1", 1.0, 2.0, -1.0, 1.0)
    >>> names = {key: (Signal(key[0], "1"),) for key in ("states", "outputs", "inputs", "disturbances")}
    >>> one = sp.Matrix([[1]])
    >>> model = LpvModel("grows", "an example", parameters=(p,), A=sp.Matrix([[sp.Symbol("p")]]), B=one, C=one, E=one, **names)
    >>> gains = design_state_feedback(model, StateFeedbackDesign((FeedbackChannel(("d",), ("s", "i")),)))
    >>> print(gains.verdict, gains.gain([1.0, 2.0]).shape, bool(gains.gain([2.0]) < -2.0))
    certified (2, 1, 1) True
    """
    refuse_unstabilisable(model)
    check_limits(model, design.limits)
    scale = feedback_scale(model, design.channels)

    def problem(gamma: float | None, maximise_margin: bool = True, floor: float = 0.0) -> LmiProblem:
        return state_feedback_problem(model, design, scale, gamma, maximise_margin, floor)

    def level(objective: float) -> float:
        return scale.disturbance * float(np.sqrt(objective) if design.compact else objective)

    found = three_solves(model.name, problem, level, design.backoff, design.settings)
    return StateFeedbackGains(design, model, found.gamma_lower, found.gamma, found.result, found.optimum, scale)


def state_feedback_problem(
    model: LpvModel,
    design: StateFeedbackDesign,
    scale: FeedbackScale,
    gamma: float | None = None,
    maximise_margin: bool = True,
    floor: float = 0.0,
) -> LmiProblem:
    """The LMIs of the module docstring in scaled states, inputs, disturbances and time.

    Without `gamma` the open channel is minimised; with it that channel is bounded by gamma and, unless told otherwise, a
    common margin of all inequalities is maximised. With a `floor` every inequality keeps that margin, and the decisions of
    least norm are sought. Of a single channel Q stands for g Q, and gamma^2 is minimised.
    """
    problem, clock = problem_for(model, gamma, maximise_margin, floor), scale.clock
    nx, nu = len(model.states), len(model.inputs)
    whole = problem.symmetric("Q", nx, lyapunov_degree(model, design.degree))
    gains = KinkedUnknown.of(problem, model, "Y", (nu, nx), design.degree)
    sizes: dict[str, tuple[MatrixPolynomial, MatrixPolynomial]] = {}
    problem.require("Q > 0", whole)
    for number, piece in enumerate(model.pieces):
        problem.on_cell(number, piece.box)
        scaled = scale.applied(piece.polynomial)
        letters = ("A", "B", "C", "D", "E", "F", "denominator")
        known = {key: problem.here(problem.scaled(getattr(scaled, key))) for key in letters}
        below, Q, Y = known["denominator"], problem.here(whole), gains.on(piece)
        M = (known["A"] @ Q + known["B"] @ Y) * (1.0 / clock)
        falling = problem.here(problem.time_derivative(whole)).scaled_by(below) * (1.0 / clock) - (M + M.T)
        if design.decay_rate > 0.0:
            decay = 2.0 * design.decay_rate * (1.0 + design.reserve) / clock
            problem.require("decay rate", falling - Q.scaled_by(below) * decay)
        if design.fastest_pole is not None:
            radius = design.fastest_pole / (1.0 + design.reserve) / clock
            require_disc(problem, "fastest pole", radius, M, Q.scaled_by(below))
        if design.damping is not None:
            require_damping(problem, design.damping + design.reserve * (1.0 - design.damping), M)
        if design.regions:
            require_regions(problem, design.regions, design.reserve, clock, M, Q.scaled_by(below))
        if design.limits is not None:
            require_limits(problem, model, design.limits, design.reserve, scale, Q, Q, Y)
        for channel in design.channels:
            W, Z = feedback_channel_matrices(model, channel)
            seen = performance(problem, Z, known, Q, Y, model, scale) * (1.0 / clock)
            force = known["E"] @ problem.constant(W / scale.disturbance)
            through = problem.constant(Z[:, nx : len(Z.T) - nu]) @ known["F"] @ problem.constant(W / scale.disturbance)
            level, bounded = channel.bound or gamma, channel.bound is not None
            if channel.name not in sizes:
                ratio = None if level is None else level / scale.disturbance
                sizes[channel.name] = levels(problem, channel.name, bounded, ratio, design.compact)
            near, far = sizes[channel.name]
            if design.compact:
                force, through = force.scaled_by(near), through.scaled_by(near)
            if channel.norm != "H-infinity":
                refuse_feedthrough(model, channel, Z, W)
                own = ChannelSizes(channel.name, channel.norm, design.degree, near, far)
                require_energy(problem, own, falling, force, seen, Q, below, clock)
                continue
            inner, outer = (
                problem.constant(np.eye(k)).scaled_by(below).scaled_by(size)
                for k, size in ((W.shape[1], near), (len(Z), far))
            )
            rows: list[list[MatrixPolynomial | None]] = [
                [falling, -force, -seen.T],
                [None, inner, -through.T],
                [None, None, outer],
            ]
            problem.require(f"gain {channel.name}", symmetric_block(rows))
    problem.on_cell()
    return problem


def performance(
    problem: LmiProblem,
    Z: FloatArray,
    known: Mapping[str, MatrixPolynomial],
    Q: MatrixPolynomial,
    Y: MatrixPolynomial,
    model: LpvModel,
    scale: FeedbackScale,
) -> MatrixPolynomial:
    """Cz Q + Dz Y, over the denominator, in scaled states: from states, outputs and inputs."""
    nx, nu, below = len(model.states), len(model.inputs), known["denominator"]
    of_x, of_y, of_u = Z[:, :nx] / scale.states, Z[:, nx : len(Z.T) - nu], Z[:, len(Z.T) - nu :] * scale.inputs
    plain = problem.constant(of_x) @ Q + problem.constant(of_u) @ Y
    return plain.scaled_by(below) + problem.constant(of_y) @ (known["C"] @ Q + known["D"] @ Y)


def require_limits(
    problem: LmiProblem,
    model: LpvModel,
    limits: GainLimits,
    reserve: float,
    scale: FeedbackScale,
    Q: MatrixPolynomial,
    below: MatrixPolynomial,
    Y: MatrixPolynomial,
) -> None:
    """The limits of the docstring, for K Q K' < Y below^-1 Y'."""
    S = scale.states * np.array([limits.sizes[s.name] for s in model.states])
    largest = float(S.max())
    q = problem.unknowns.get("q") or problem.scalar("q")  # of the docstring, times the largest size squared
    problem.require("states within their sizes", Q - problem.constant(np.diag((S / largest) ** 2)).scaled_by(q))
    for i, signal in enumerate(model.inputs):
        if signal.name in limits.inputs:
            most = limits.inputs[signal.name] / (1.0 + reserve) / scale.inputs[i] / largest
            row = problem.constant(np.eye(len(model.inputs))[i : i + 1] / most) @ Y
            problem.require(f"limit of {signal.name}", symmetric_block([[q, row], [None, below]]))


def check_limits(model: LpvModel, limits: GainLimits | None) -> None:
    """Raise ProblemError for limits of unknown inputs, sizes of unknown states, missing ones, or ones that are not positive."""
    if limits is None:
        return
    for what, given, signals in (("input", limits.inputs, model.inputs), ("state", limits.sizes, model.states)):
        known = [s.name for s in signals]
        for name, value in given.items():
            if name not in known:
                raise ProblemError(f"limits of model '{model.name}': {unknown(what, name, known)}")
            if not 0.0 < value < np.inf:
                raise ProblemError(
                    f"limits of model '{model.name}': {what} '{name}' has {value}; give a positive number"
                )
    missing = [s.name for s in model.states if s.name not in limits.sizes]
    if missing:
        raise ProblemError(
            f"limits of model '{model.name}': the state(s) {', '.join(missing)} have no size; a limit holds for states of a size"
        )
