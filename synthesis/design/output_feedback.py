r"""Full-order dynamic output feedback for LPV plants by linear matrix inequalities, with gains that need no rate.

    x' = A(p) x + B(p) u + E(p) d,   y = C(p) x + D(p) u + F(p) d;     xk' = Ak(p) xk + Bk(p) y,   u = Ck(p) xk + Dk(p) y

What is asked for and how it becomes linear: `synthesis.design.output_feedback_lmi`. Both of its forms are tried (the one whose X
follows the parameters, and the one whose Y does) and the better is taken. The controller is a design: what runs is a table, and
what is claimed of it is proved of that table, whatever the inequalities here have said.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from estimators.arrays import FloatArray
from synthesis.certificate.refute import undetectable_place
from synthesis.design.generalised_plant import FeedbackChannel, Frame, GeneralisedPlant, frame_of, generalised_plant
from synthesis.design.output_feedback_lmi import Still, Wanted, build
from synthesis.design.reconstruct import reconstructed
from synthesis.design.settle import Build, Optimum, optimum, settle
from synthesis.errors import ProblemError
from synthesis.lmi.exchange import Memory
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.loop.from_model import plant_of
from synthesis.loop.plant import Plant
from synthesis.models.lpv import LpvModel
from synthesis.models.numeric import values


@dataclass(frozen=True)
class OutputFeedbackDesign:
    """What is asked of the controller.

    >>> gain = FeedbackChannel(("gust",), ("roll",), bound=2.0)
    >>> OutputFeedbackDesign((gain, FeedbackChannel(("noise",), ("aileron",))), decay_rate=0.5).minimised.name
    'noise -> aileron'
    """

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

    def __post_init__(self) -> None:
        if not 0 <= self.degree <= 8:
            raise ProblemError(f"degree {self.degree} of the controller must lie between 0 and 8")
        if sum(channel.bound is None for channel in self.channels) != 1:
            raise ProblemError("exactly one channel must have no bound: it is the one that is minimised")
        if not 0.0 <= self.decay_rate < np.inf:
            raise ProblemError(f"decay rate {self.decay_rate} 1/s must be a number and must not be negative")
        if self.fastest_pole is not None and not self.decay_rate < self.fastest_pole < np.inf:
            raise ProblemError(f"fastest pole {self.fastest_pole} 1/s must exceed the decay rate {self.decay_rate} 1/s")
        for name in ("backoff", "reserve"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ProblemError(f"{name} {getattr(self, name)} must lie between 0 and 1")

    @property
    def minimised(self) -> FeedbackChannel:
        """The channel without a bound."""
        return next(channel for channel in self.channels if channel.bound is None)


@dataclass(frozen=True)
class OutputFeedback:
    """A controller with the bound that was minimised.

    `gamma` is the level that the inequalities prove, `gamma_lower` a bound from below for every X and Y of these degrees in one of
    the two forms (weak duality), where there is one. `result` carries verdict and margins, `optimum` the first solve; `wanted.still`
    says which form was taken.
    """

    design: OutputFeedbackDesign
    model: LpvModel
    gamma_lower: float | None
    gamma: float
    result: LmiResult
    optimum: LmiResult
    frame: Frame
    wanted: Wanted

    @property
    def verdict(self) -> Verdict:
        """Of the solve that the controller comes from."""
        return self.result.verdict

    def controller(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Ak (g, nx, nx), Bk (g, nx, ny), Ck (g, nu, nx) and Dk (g, nu, ny) at parameter values (g,) or (g, p), in 1/s.

        The states are an estimate of those of the plant, in their units; ny counts the outputs that are measured.
        """
        count, grid = len(self.model.parameters), np.asarray(points, float)
        grid = grid.reshape(-1, count) if count else grid.reshape(len(grid), 0)
        middle, half = (np.array([getattr(p, key) for p in self.model.parameters]) for key in ("middle", "half_width"))
        given = generalised_plant(self.model, self.design.channels, self.design.measured)
        found = reconstructed(given.scaled(self.frame), self.result, self.wanted, (grid - middle) / half, self.level)
        Ak, Bk, Ck, Dk = found
        T, u, y, clock = self.frame.states, self.frame.inputs[:, None], self.frame.outputs, self.frame.clock
        back = np.linalg.inv(T) * clock
        Ak, Bk, Ck, Dk = back @ Ak @ T, back @ Bk / y, u * Ck @ T, u * Dk / y
        D = values(given.D, (grid - middle) / half) / values(given.denominator, (grid - middle) / half)
        return Ak - Bk @ D @ Ck, Bk, Ck, Dk  # designed for y - D u, and Dk D = 0

    @property
    def level(self) -> float:
        """gamma in the unit of the frame."""
        return self.gamma / self.frame.unit


def design_output_feedback(model: LpvModel, design: OutputFeedbackDesign) -> OutputFeedback:
    """Minimise the open channel in both forms, then give back `backoff` of it and take the better form's answer of least norm.

    Raises ProblemError for a plant that is not stabilisable or not detectable at some place (the mode and the place), for a
    feedthrough that closes an algebraic loop or meets a rational plant, and if nothing is found.

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
    plant = generalised_plant(model, design.channels, design.measured)
    feedthrough = _feedthrough(model, design, plant)
    _refuse_hidden(model, design)
    frame = frame_of(plant)
    scaled, where = plant.scaled(frame), f"model '{model.name}'"
    tried: list[tuple[Optimum, Wanted, Build, Memory]] = []
    for still in _forms(model, design):
        tight = 1.0 + design.reserve
        radius = None if design.fastest_pole is None else design.fastest_pole / tight / frame.clock
        wanted = Wanted(
            design.degree, design.decay_rate * tight / frame.clock, radius, feedthrough, still, frame.clock
        )

        def problem(
            level: float | None, margin: bool = False, floor: float = 0.0, wanted: Wanted = wanted
        ) -> LmiProblem:
            levels = {c: level if c.bound is None else c.bound / frame.unit for c in design.channels}
            return build(scaled, model.parameters, wanted, levels, margin, floor)

        memory: Memory = {}
        tried.append((optimum(problem, design.settings, memory), wanted, problem, memory))
    first, wanted, problem, memory = min(tried, key=lambda entry: entry[0].level)
    if not np.isfinite(first.level):
        raise ProblemError(f"{where}: {first.result.message}; loosen a bound, the decay rate or the fastest pole")
    settled = settle(problem, first, design.backoff, design.settings, where, memory)
    lower = [entry[0].lower for entry in tried]
    least = None if None in lower else max(min(x for x in lower if x is not None), 0.0) * frame.unit
    return OutputFeedback(
        design, model, least, settled.level * frame.unit, settled.result, first.result, frame, wanted
    )


def _forms(model: LpvModel, design: OutputFeedbackDesign) -> tuple[Still, ...]:
    """Both, unless one is asked for or no Lyapunov matrix may follow a moving parameter anyway."""
    if design.still is not None:
        return (design.still,)
    follows = any(not p.may_jump and (p.rate_minimum < 0.0 or p.rate_maximum > 0.0) for p in model.parameters)
    return ("X", "Y") if follows and design.degree else ("Y",)


def _feedthrough(model: LpvModel, design: OutputFeedbackDesign, plant: GeneralisedPlant) -> bool:
    """Whether Dk is an unknown. Raises ProblemError where it is asked for and cannot be."""
    loops, rational = bool(plant.D.any()), not model.polynomial.is_polynomial
    if design.feedthrough and (loops or rational):
        why = (
            "the inputs act on a measured output at once (D), which would close an algebraic loop"
            if loops
            else "it is rational, and its product with a feedthrough is not linear over one denominator"
        )
        raise ProblemError(f"model '{model.name}' takes no feedthrough: {why}; leave `feedthrough` out")
    return not (loops or rational) if design.feedthrough is None else design.feedthrough


def _refuse_hidden(model: LpvModel, design: OutputFeedbackDesign) -> None:
    """Raise ProblemError where an unstable mode cannot be moved by the inputs or does not show in the measured outputs."""
    plant, names = plant_of(model), [signal.name for signal in model.outputs]
    rows = [names.index(name) for name in design.measured or names]
    A, B = plant.matrices["A"], plant.matrices["B"]
    C = plant.matrices["C"].map(lambda m: type(m)([m.tolist()[i] for i in rows]))
    C = type(C)(C.terms, (len(rows), C.shape[1]), C.variables)
    for pair, word, action, signals, remedy in (
        ((A, C), "detectable", "does not show in the output(s)", design.measured or names, "measure it"),
        ((A.T, B.T), "stabilisable", "is not moved by the input(s)", [s.name for s in model.inputs], "actuate it"),
    ):
        place = undetectable_place(Plant(plant.axes, {"A": pair[0], "C": pair[1]}, plant.denominator))
        if place is None:
            continue
        u = np.array([int(x.p) / int(x.q) for x in place])
        where = ", ".join(
            f"{p.name} = {p.middle + p.half_width * x:.6g} {p.unit}" for p, x in zip(model.parameters, u, strict=True)
        )
        raise ProblemError(
            f"model '{model.name}' is not {word} at {where or 'its only point'}: {_mode(model, word, u)} {action} "
            f"{', '.join(signals)}; {remedy}, or shrink the range"
        )


def _mode(model: LpvModel, word: str, u: FloatArray) -> str:
    """The least visible of the modes that do not decay, in words."""
    p = model.parameters
    here = model.on(np.array([[q.middle + q.half_width * x for q, x in zip(p, u, strict=True)]]).reshape(1, len(p)))
    A, C = (here.A[0], here.C[0]) if word == "detectable" else (here.A[0].T, here.B[0].T)
    roots, vectors = np.linalg.eig(A)
    shown = np.linalg.norm(C @ vectors, axis=0) + np.where(roots.real >= -1e-9 * max(np.abs(A).max(), 1e-300), 0.0, np.inf)
    root = roots[int(np.argmin(shown))]
    return f"the mode at {root.real:.4g}{'' if abs(root.imag) < 1e-9 else f' +- {abs(root.imag):.4g}j'} 1/s"
