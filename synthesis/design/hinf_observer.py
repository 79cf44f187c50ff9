r"""H-infinity gain synthesis for LPV observers (P1 (30)-(32), sign corrected) with several channels and a pole band.

With V = e'P(p)e, X = P L and phi = A'P + P A - X C - C'X' + dP/dt, for the error e' = (A - L C) e + (E - L F) d:

    decay          phi + 2 alpha P < 0                          |e| decays at least like exp(-alpha t)
    fastest pole   phi - dP/dt + 2 r P > 0                      every frozen pole has a real part above -r
    channel d -> z [phi, P E - X F, Z'; *, -g I, 0; *, *, -g I] < 0 L2 gain from d to z = Z e at most g
    generalised H2 [-phi, X F - P E; *, g I] > 0, [P, Z'; *, g I] > 0     |z| at most g times the root of the energy of d
    H2             [-phi, Z'; *, g I] > 0, [W, (P E - X F)'; *, P] > 0, tr W < g     energies of z after impulses at most g^2

The blocks have the form of (30), so one P serves all channels and weighs channel i by 1/g_i. Leaving that weight free would
push the noise gain down to its static floor, where the gains are not determined any more (0.6075 against 0.634 on the
longitudinal values of P1). A denominator of a rational model multiplies every inequality (it is positive on the range).

Errors are measured in the size that the disturbances give them (`error_unit`), so that the answer does not depend on the units
of disturbances and states. A level counts only if every inequality holds at it when re-evaluated.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.design.asked import check_channels, check_degree_and_poles, check_shares, minimised_channel
from synthesis.design.gains_summary import gains_summary
from synthesis.design.kinked import KinkedUnknown, kinked_values
from synthesis.design.norms import ChannelSizes, Norm, compact_form, levels, per_sample, require_energy
from synthesis.design.pole_regions import PoleRegions, require_regions
from synthesis.design.refusals import refuse_undetectable
from synthesis.design.three_solves import Problem, lyapunov_degree, problem_for, three_solves
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.scaling import correction_sizes, observer_scale
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.observer import Update
from synthesis.models.lpv import LpvModel
from synthesis.models.selection import selection
from synthesis.polynomials.matrix import MatrixPolynomial, symmetric_block


@dataclass(frozen=True, repr=False)
class Channel(Display):
    """The gain from some disturbances to some estimation errors: bounded by `bound`, or minimised if None.

    `weights` multiply the disturbances (their sizes), in the order of `disturbances`. `norm` says what is meant by gain
    (`synthesis.design.norms`): "H-infinity" (the L2 gain), "generalised H2" (the largest error by energy) or "H2".

    >>> Channel(("force", "noise"), ("velocity",), weights=(1.0, 0.002)).name
    'force+noise -> velocity'
    """

    disturbances: tuple[str, ...]
    errors: tuple[str, ...]
    bound: float | None = None
    weights: tuple[float, ...] | None = None
    norm: Norm = "H-infinity"

    @property
    def name(self) -> str:
        """Disturbances and errors in words."""
        return f"{'+'.join(self.disturbances)} -> {'+'.join(self.errors)}"


@dataclass(frozen=True, repr=False)
class ObserverDesign(Display):
    """What is asked of the gains.

    >>> bounded = Channel(("friction",), ("relative_velocity",), bound=1.05)
    >>> ObserverDesign((bounded, Channel(("force_noise",), ("relative_velocity",))), decay_rate=80.0).minimised.name
    'force_noise -> relative_velocity'
    """

    shown_units: ClassVar = {"decay_rate": "1/s", "fastest_pole": "1/s"}

    channels: tuple[Channel, ...]
    degree: int = 1  # of P and X in the parameters
    decay_rate: float = 0.0  # alpha, 1/s
    fastest_pole: float | None = None  # r, 1/s; None: no bound
    backoff: float = 0.01  # the minimised gain may be this fraction worse; what it buys is margin
    reserve: float = 0.01  # the pole band is designed this much tighter than it is claimed, for the table's sake
    settings: LmiSettings = field(default_factory=LmiSettings)
    regions: PoleRegions = field(default_factory=PoleRegions)

    def __post_init__(self) -> None:
        check_channels(self.channels, [channel.errors for channel in self.channels], "error")
        check_degree_and_poles(self.degree, self.decay_rate, self.fastest_pole)
        check_shares(self.backoff, self.reserve)

    @property
    def minimised(self) -> Channel:
        """The channel without a bound."""
        return minimised_channel(self.channels)

    @property
    def compact(self) -> bool:
        """Whether the solver minimises the square of the level (`synthesis.design.norms`)."""
        return compact_form([channel.norm for channel in self.channels])


@dataclass(frozen=True, repr=False)
class ObserverGains(Display):
    """L(p) = P(p)^-1 X(p) (or K(p) = G(p)^-1 X(p) of a sampled design) with the bound that was minimised.

    `gamma_lower` is a bound from below for every P and X of this degree (weak duality, margins taken out), where there is one;
    `gamma` the verified level. `result` carries verdict and margins, `optimum` the first solve. `update` and `sample_time` say
    how the gains are run (`synthesis.loop.observer`).
    """

    design: ObserverDesign
    model: LpvModel
    gamma_lower: float | None
    gamma: float
    result: LmiResult
    optimum: LmiResult
    scale: FloatArray
    update: Update = "held"
    sample_time: float | None = None

    def summary(self) -> tuple[str, ...]:
        """Verdict, level with its lower bound, how the gains are run, the tightest inequality."""
        return gains_summary(self)

    @property
    def verdict(self) -> Verdict:
        """Of the solve that the gains come from."""
        return self.result.verdict

    def gain(self, points: FloatArray) -> FloatArray:
        """L at parameter values (g,) or (g, p): array (g, nx, ny)."""
        u = self.model.scaled(points)
        still = np.hstack([u, np.zeros_like(u)])
        left = self.result.values["G" if self.update == "sampled" else "P"].at(still)[..., 0]
        X = kinked_values(self.result.values, self.model, "X", u) / outputs_of(self.model, self.design, self.scale)
        return np.asarray(np.linalg.solve(left, X) / self.scale[:, None])


def design_observer(model: LpvModel, design: ObserverDesign) -> ObserverGains:
    """Minimise the open channel, then give back `backoff` of it and take the gains that vary least and keep most of the margin.

    Raises ProblemError if nothing is found; a model with a hidden unstable mode is called undetectable.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> channels = (Channel(("friction",), ("relative_velocity",), bound=1.05), Channel(("force_noise",), ("relative_velocity",)))
    >>> gains = design_observer(model, ObserverDesign(channels, decay_rate=80.0, fastest_pole=600.0))
    >>> print(gains.verdict)
    certified
    >>> gains.gain([0.0, 140.0]).shape, bool(gains.gamma_lower <= gains.gamma)
    ((2, 2, 1), True)
    """
    scale, clock = timed_scale(model, design)

    def problem(gamma: float | None, maximise_margin: bool = True, floor: float = 0.0) -> LmiProblem:
        return observer_problem(model, design, scale, gamma, maximise_margin, floor, clock)

    return minimised(model, design, scale, problem)


def minimised(
    model: LpvModel,
    design: ObserverDesign,
    scale: FloatArray,
    problem: Problem,
    update: Update = "held",
    sample_time: float | None = None,
) -> ObserverGains:
    """The solves of a design (`three_solves`); `problem(gamma, maximise_margin, floor)` builds its inequalities."""
    refuse_undetectable(model)

    def level(objective: float) -> float:
        found = to_gamma(model, design, scale, objective)
        return found if sample_time is None else found / per_sample(design.minimised.norm, sample_time)

    found = three_solves(model.name, problem, level, design.backoff, design.settings)
    return ObserverGains(
        design, model, found.gamma_lower, found.gamma, found.result, found.optimum, scale, update, sample_time
    )


def design_scale(model: LpvModel, design: ObserverDesign) -> FloatArray:
    """`observer_scale` with every disturbance in the largest size that a channel gives it: units of sizes do not matter."""
    poly, sizes = model.cells.middle.polynomial, _sizes(model, design)
    return observer_scale(replace(poly, E=poly.E * sizes, F=poly.F * sizes), model.parameters)


def timed_scale(model: LpvModel, design: ObserverDesign) -> tuple[FloatArray, float]:
    """`design_scale` where time is counted in units of 1/clock s, and the clock: a power of 1e6 that follows the speed of errors.

    It is one for speeds from 0.01 to 1e4 1/s. Margins and tolerances of the solver are meant for numbers not far from one.
    """
    scale = design_scale(model, design)
    middle = model.on(np.array([[p.middle for p in model.parameters]]).reshape(1, len(model.parameters)))
    A, E = middle.A[0] * scale[:, None] / scale, middle.E[0] * scale[:, None] * _sizes(model, design)
    speed = max(float(np.linalg.norm(A, 2)), float(np.linalg.norm(E, 2)) ** 2 if E.size else 0.0)
    clock = 10.0 ** (6 * round((np.log10(speed) - 1.0) / 6)) if 0.0 < speed < np.inf else 1.0
    return scale * np.sqrt(clock), clock


def _sizes(model: LpvModel, design: ObserverDesign) -> FloatArray:
    sizes = np.zeros(len(model.disturbances))
    for channel in design.channels:
        sizes = np.maximum(sizes, np.abs(channel_matrices(model, channel)[0]).max(axis=1))
    sizes[sizes == 0.0] = 1.0  # in no channel
    return sizes


def outputs_of(model: LpvModel, design: ObserverDesign, scale: FloatArray) -> FloatArray:
    """Sizes (ny,) by which outputs are divided: `correction_sizes` in the middle of the range."""
    middle = model.on(np.array([[p.middle for p in model.parameters]]).reshape(1, len(model.parameters)))
    A, C, E, F = (getattr(middle, key)[0] for key in "ACEF")
    sizes = _sizes(model, design)
    return correction_sizes(A, C, E * sizes, F * sizes, scale)


def error_unit(model: LpvModel, design: ObserverDesign, scale: FloatArray) -> float:
    """The largest error of any channel when the scaled states are one: what unit disturbances make of it, roughly."""
    return max(float(np.abs(channel_matrices(model, channel)[1] / scale).max()) for channel in design.channels)


def to_gamma(model: LpvModel, design: ObserverDesign, scale: FloatArray, objective: float) -> float:
    """The gain that belongs to an objective value of `observer_problem`."""
    return error_unit(model, design, scale) * float(np.sqrt(objective) if design.compact else objective)


def observer_problem(
    model: LpvModel,
    design: ObserverDesign,
    scale: FloatArray,
    gamma: float | None = None,
    maximise_margin: bool = True,
    floor: float = 0.0,
    clock: float = 1.0,
) -> LmiProblem:
    """The LMIs of the module docstring in the states diag(scale) x and outputs of size one, time counted in units of 1/clock s.

    Without `gamma` the open channel is minimised; with it that channel is bounded by gamma and, unless told otherwise, a
    common margin of all inequalities is maximised. With a `floor` every inequality keeps that margin, and the decisions of
    least norm are sought.
    """
    problem = problem_for(model, gamma, maximise_margin, floor)
    unit, nx, ny = error_unit(model, design, scale), len(model.states), len(model.outputs)
    whole = problem.symmetric("P", nx, lyapunov_degree(model, design.degree))
    gains = KinkedUnknown.of(problem, model, "X", (nx, ny), design.degree)
    outputs = problem.constant(np.diag(1.0 / outputs_of(model, design, scale)))
    sizes: dict[str, tuple[MatrixPolynomial, MatrixPolynomial]] = {}
    problem.require("P > 0", whole)
    for number, piece in enumerate(model.pieces):
        problem.on_cell(number, piece.box)
        scaled = piece.polynomial.with_states_scaled(scale)
        known = {k: problem.here(problem.scaled(getattr(scaled, k))) for k in ("A", "C", "E", "F", "denominator")}
        known["C"], known["F"] = outputs @ known["C"], outputs @ known["F"]
        below, P, X = known["denominator"], problem.here(whole), gains.on(piece)
        closed = (P @ known["A"] - X @ known["C"]) * (1.0 / clock)
        frozen = closed + closed.T
        phi = frozen + problem.here(problem.time_derivative(whole)).scaled_by(below) * (1.0 / clock)
        decay = 2.0 * design.decay_rate * (1.0 + design.reserve) / clock
        if design.decay_rate > 0.0 or not design.channels:
            problem.require("decay rate", -(phi + P.scaled_by(below) * decay))
        if design.fastest_pole is not None:
            fastest = 2.0 * design.fastest_pole / (1.0 + design.reserve) / clock
            problem.require("fastest pole", frozen + P.scaled_by(below) * fastest)
        if design.regions:
            require_regions(problem, design.regions, design.reserve, clock, closed, P.scaled_by(below))
        for channel in design.channels:
            d, z = channel_matrices(model, channel)
            z = z / unit
            force = (P @ known["E"] - X @ known["F"]) @ problem.constant(d) * (1.0 / clock)
            level, bounded = channel.bound or gamma, channel.bound is not None
            if channel.name not in sizes:
                ratio = None if level is None else level / unit
                sizes[channel.name] = levels(problem, channel.name, bounded, ratio, design.compact)
            near, far = sizes[channel.name]
            output = problem.constant(z / scale).scaled_by(below)
            if channel.norm != "H-infinity":
                own = ChannelSizes(channel.name, channel.norm, design.degree, far, near)
                require_energy(problem, own, -phi, force, output.scaled_by(near), P, below, clock)
                continue
            outside = -problem.constant(np.eye(d.shape[1])).scaled_by(far.scaled_by(below))
            if design.compact:  # Schur complement of (30), with P scaled by gamma: a smaller block for the same bound
                corner = phi + problem.constant(z.T @ z / np.outer(scale, scale)).scaled_by(below).scaled_by(near)
                block = symmetric_block([[corner, force], [None, outside]])
            else:
                errors = problem.constant(np.eye(len(z))).scaled_by(near.scaled_by(below))
                block = symmetric_block([[phi, force, output.T], [None, outside, None], [None, None, -errors]])
            problem.require(f"gain {channel.name}", -block)
    problem.on_cell()
    return problem


def channel_matrices(model: LpvModel, channel: Channel) -> tuple[FloatArray, FloatArray]:
    """Selection (with weights) of disturbances (nd, k) and of errors (m, nx). Raises ProblemError for unknown names."""
    d, z = selection(model, channel.disturbances, channel.errors, f"channel '{channel.name}'", ProblemError)
    weights = channel.weights or (1.0,) * len(channel.disturbances)
    if len(weights) != len(channel.disturbances):
        raise ProblemError(
            f"channel '{channel.name}' has {len(weights)} weights for {len(channel.disturbances)} disturbances"
        )
    if not all(0.0 < weight < np.inf for weight in weights):
        raise ProblemError(f"channel '{channel.name}' has the weights {list(weights)}; give positive sizes")
    return d * np.array(weights), z
