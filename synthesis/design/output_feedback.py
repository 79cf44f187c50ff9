r"""Full-order dynamic output feedback for LPV plants by linear matrix inequalities, with gains that need no rate.

    x' = A(p) x + B(p) u + E(p) d,   y = C(p) x + D(p) u + F(p) d;     xk' = Ak(p) xk + Bk(p) y,   u = Ck(p) xk + Dk(p) y

What is asked for and how it becomes linear: `synthesis.design.output_feedback_lmi`. Both of its forms are tried (the one whose X
follows the parameters, and the one whose Y does) and the better is taken. The controller is a design: what runs is a table, and
what is claimed of it is proved of that table, whatever the inequalities here have said.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np
from scipy.optimize import minimize

from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.design.asked import check_degree_and_poles, check_shares, minimised_channel
from synthesis.design.feedback_channel import FeedbackChannel, check_feedback_channels, feedback_channel_matrices
from synthesis.design.generalised_plant import Frame, GeneralisedPlant, frame_of, generalised_plant, measured_rows
from synthesis.design.halves import halves_of
from synthesis.design.output_feedback_lmi import Still, Wanted, build
from synthesis.design.pole_regions import PoleRegions
from synthesis.design.reconstruct import reconstructed
from synthesis.design.refusals import refuse_feedthrough, refuse_undetectable, refuse_unstabilisable
from synthesis.design.three_solves import Problem, least, starting_places, three_solves
from synthesis.errors import ProblemError
from synthesis.lmi.exchange import Memory
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.feedback import Measured
from synthesis.models.lpv import LpvModel

RATIONAL = 2  # degrees of P that come close to an inverse
TRIALS = 12  # of each weight
HUGE = 1e30  # for a search, what was not found at all

Tried = tuple[LmiResult, Wanted, Problem, Memory]


@dataclass(frozen=True, repr=False)
class OutputFeedbackDesign(Display):
    """What is asked of the controller.

    >>> gain = FeedbackChannel(("gust",), ("roll",), bound=2.0)
    >>> OutputFeedbackDesign((gain, FeedbackChannel(("noise",), ("aileron",))), decay_rate=0.5).minimised.name
    'noise -> aileron'
    """

    shown_units: ClassVar = {"decay_rate": "1/s", "fastest_pole": "1/s"}

    channels: tuple[FeedbackChannel, ...]
    degree: int = 1  # of all unknowns in the parameters
    decay_rate: float = 0.0  # alpha, 1/s
    fastest_pole: float | None = None  # radius of the disc about zero that holds every frozen pole, 1/s; None: no bound
    feedthrough: bool | None = None  # whether y acts on u at once; None: where the plant allows it
    measured: tuple[str, ...] | None = None  # the outputs that the controller sees, in this order; None: all
    still: Still | None = None  # which Lyapunov matrix does not follow the parameters; None: the better of both
    backoff: float = 0.01  # the minimised gain may be this fraction worse; what it buys is margin
    reserve: float = 0.01  # poles are designed this much tighter than they are claimed, for the table's sake
    settings: LmiSettings = field(default_factory=LmiSettings)
    regions: PoleRegions = field(default_factory=PoleRegions)  # of every frozen pole, in continuous time

    def __post_init__(self) -> None:
        check_feedback_channels(self.channels)
        check_degree_and_poles(self.degree, self.decay_rate, self.fastest_pole)
        check_shares(self.backoff, self.reserve)
        if self.backoff == 0.0:
            raise ProblemError("backoff 0 must be more: gains grow without end at the optimum")
        self.regions.refuse_for("continuous")

    @property
    def minimised(self) -> FeedbackChannel:
        """The channel without a bound."""
        return minimised_channel(self.channels)


@dataclass(frozen=True, repr=False)
class OutputFeedback(Display):
    """A controller with the bound that was minimised.

    `gamma` is the level that the inequalities prove, `gamma_lower` a bound from below for every X and Y of these degrees in one
    of the two forms (weak duality), where there is one; where norms differ, for the weights of channels that were found.
    `result` carries verdict and margins, `optimum` the first solve, and `wanted.still` says which form was taken.
    """

    design: OutputFeedbackDesign
    model: LpvModel
    gamma_lower: float | None
    gamma: float
    result: LmiResult
    optimum: LmiResult
    frame: Frame
    wanted: Wanted
    measured: Measured = "outputs"

    @property
    def order(self) -> int:
        """Of the controller: that of the plant."""
        return len(self.model.states)

    @property
    def rational(self) -> int:
        """Degrees more that P has in claims: of both forms, that with a moving Y has (Y - X^-1)^-1 in its P."""
        return RATIONAL if self.wanted.still == "X" else 0

    @property
    def verdict(self) -> Verdict:
        """Of the solve that the controller comes from."""
        return self.result.verdict

    def controller(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Ak (g, nx, nx), Bk (g, nx, ny), Ck (g, nu, nx) and Dk (g, nu, ny) at parameter values (g,) or (g, p).

        The states are an estimate of those of the plant, in their units. Columns of outputs that are not measured are zero.
        """
        place = self.model.scaled(points)
        plants, middle = plants_of(self.model, self.design)
        weights = halves_of(middle, self.frame).weights
        owner = self.model.cells.owner(place)
        parts = []
        for index in np.unique(owner):
            halves = halves_of(plants[index], self.frame, weights)
            parts.append(reconstructed(halves, self.result, self.wanted, place[owner == index], self.level))
        order = np.argsort(np.argsort(owner, kind="stable"), kind="stable")
        Ak, Bk, Ck, Dk = (np.concatenate(matrices)[order] for matrices in zip(*parts, strict=True))
        T, u, y, clock = self.frame.filter, self.frame.inputs[:, None], self.frame.outputs, self.frame.clock
        back = np.linalg.inv(T) * clock
        Ak, Bk, Ck, Dk = back @ Ak @ T, back @ Bk / y, u * Ck @ T, u * Dk / y
        rows = measured_rows(self.model, self.design.measured)
        D, seen = self.model.on(points).D[:, rows], np.eye(len(self.model.outputs))[rows]
        return Ak - Bk @ D @ Ck, Bk @ seen, Ck, Dk @ seen  # designed for y - D u, and Dk D = 0

    @property
    def level(self) -> float:
        """gamma in the unit of the frame."""
        return self.gamma / self.frame.unit


def plants_of(model: LpvModel, design: OutputFeedbackDesign) -> tuple[list[GeneralisedPlant], GeneralisedPlant]:
    """On every piece of the model, and the one in the middle of the range."""
    plants = [generalised_plant(model, design.channels, design.measured, piece) for piece in model.pieces]
    return plants, plants[model.pieces.index(model.cells.middle)]


def design_output_feedback(model: LpvModel, design: OutputFeedbackDesign) -> OutputFeedback:
    """Minimise the open channel in both forms, then give back `backoff` of it and take the better form's answer of least norm.

    Raises ProblemError for a plant that is not stabilisable or not detectable at some place (the mode and the place), for a
    feedthrough that closes an algebraic loop, and if nothing is found.

    >>> import sympy as sp
    >>> from synthesis import SchedulingParameter, Signal
    >>> p = sp.Symbol("p")
    >>> names = {key: (Signal(name, "1"),) for key, name in (("states", "x"), ("inputs", "u"), ("outputs", "y"))}
    >>> plant = LpvModel(
    ...     name="unstable", source="made up", **names, disturbances=(Signal("w", "1"), Signal("n", "1")),
    ...     parameters=(SchedulingParameter("p", "1", 1.0, 2.0, -1.0, 1.0),),
    ...     A=sp.Matrix([[p]]), B=sp.Matrix([[1]]), C=sp.Matrix([[1]]), E=sp.Matrix([[1, 0]]), F=sp.Matrix([[0, 0.1]]),
    ... )
    >>> found = design_output_feedback(plant, OutputFeedbackDesign((FeedbackChannel(("w", "n"), ("x", "u")),)))
    >>> print(found.verdict), found.controller([1.0, 1.5, 2.0])[0].shape
    certified
    (None, (3, 1, 1))
    """
    refuse_unstabilisable(model)
    refuse_undetectable(model, measured_rows(model, design.measured))
    for channel in design.channels:
        if channel.norm != "H-infinity":
            W, Z = feedback_channel_matrices(model, channel)
            refuse_feedthrough(model, channel, Z, W)
    plants, middle = plants_of(model, design)
    feedthrough, frame, tight = _feedthrough(model, design, plants), frame_of(middle), 1.0 + design.reserve
    weights = halves_of(middle, frame).weights
    halves = [(piece.box, halves_of(plant, frame, weights)) for piece, plant in zip(model.pieces, plants, strict=True)]
    radius = None if design.fastest_pole is None else design.fastest_pole / tight / frame.clock
    settings = design.settings
    if settings.relaxation == "auto":  # unknowns that run away at the optimum end other solvers early
        settings = replace(settings, relaxation="exchange")
    tried: list[Tried] = []
    for form in _forms(model, design):
        wanted = Wanted(
            design.degree, design.decay_rate * tight / frame.clock, radius, feedthrough, form, frame.clock,
            design.regions, design.reserve, (1.0,) * len(design.channels),
        )  # fmt: skip

        def problem(
            gamma: float | None, margin: bool = True, floor: float = 0.0, wanted: Wanted = wanted
        ) -> LmiProblem:
            bounds = {c: gamma if c.bound is None else c.bound for c in design.channels}
            levels = {c: None if bound is None else bound / frame.unit for c, bound in bounds.items()}
            return build(
                halves, model.parameters, wanted, levels, margin and gamma is not None, floor, model.half_spaces
            )

        memory = starting_places(problem(None))

        def weighed(weights: tuple[float, ...], wanted: Wanted = wanted, memory: Memory = memory) -> Tried:
            own = replace(wanted, weights=weights)
            posed = partial(problem, wanted=own)
            return least(posed, design.backoff, settings, memory), own, posed, memory

        tried.append(_best_weighed(design, weighed))
    found = [entry[0] for entry in tried]
    optimum, wanted, problem, memory = min(tried, key=lambda entry: _named(entry[0]))
    settled = three_solves(model.name, problem, lambda x: x * frame.unit, design.backoff, settings, optimum, memory)
    lower = [result.lower_bound for result in found if np.isfinite(_named(result))]
    bound = None if None in lower else max(min(x for x in lower if x is not None), 0.0) * frame.unit
    return OutputFeedback(design, model, bound, settled.gamma, settled.result, optimum, frame, wanted)


def _best_weighed(design: OutputFeedbackDesign, weighed: Callable[[tuple[float, ...]], Tried]) -> Tried:
    """The least first solve, over the weights of bounded channels where norms differ: a search, as it is not convex in them."""
    best = weighed((1.0,) * len(design.channels))
    free = [channel.bound is not None for channel in design.channels]
    if len({channel.norm for channel in design.channels}) == 1:
        return best

    def level(logarithms: FloatArray) -> float:
        nonlocal best
        weights = np.ones(len(free))
        weights[free] = 10.0**logarithms
        found = weighed(tuple(weights.tolist()))
        if _named(found[0]) < _named(best[0]):
            best = found
        return min(_named(found[0]), HUGE)

    count = sum(free)
    corners = 0.5 * np.vstack([np.zeros(count), np.eye(count)])
    options: Any = {"initial_simplex": corners, "maxfev": TRIALS * count, "xatol": 0.05, "fatol": 0.0}
    minimize(level, np.zeros(count), method="Nelder-Mead", options=options)
    return best


def _named(result: LmiResult) -> float:
    """The level that a first solve ends at; infinite if it found none."""
    level = result.objective
    usable = level is not None and level > 0.0 and not result.report.status.endswith("Infeasible")
    return float(level) if usable and level is not None else np.inf


def _forms(model: LpvModel, design: OutputFeedbackDesign) -> tuple[Still, ...]:
    """Both, unless one is asked for or no Lyapunov matrix may follow a moving parameter anyway."""
    if design.still is not None:
        return (design.still,)
    follows = any(not p.may_jump and (p.rate_minimum < 0.0 or p.rate_maximum > 0.0) for p in model.parameters)
    return ("X", "Y") if follows and design.degree else ("Y",)


def _feedthrough(model: LpvModel, design: OutputFeedbackDesign, plants: list[GeneralisedPlant]) -> bool:
    """Whether Dk is an unknown. Raises ProblemError where it is asked for and cannot be."""
    loops = any(plant.D.any() for plant in plants)
    for part in (part for plant in plants for part in plant.channels if part.channel.norm != "H-infinity"):
        if not (part.Dzu.any() and part.F.any()):
            continue
        if design.feedthrough:
            raise ProblemError(
                f"channel '{part.channel.name}': with feedthrough its measurement noise moves inputs at once, where the norm "
                f"'{part.channel.norm}' is infinite; leave `feedthrough` out"
            )
        loops = True
    if design.feedthrough and loops:
        raise ProblemError(
            f"model '{model.name}' takes no feedthrough: the inputs act on a measured output at once (D), which would close an "
            "algebraic loop; leave `feedthrough` out"
        )
    return not loops if design.feedthrough is None else design.feedthrough
