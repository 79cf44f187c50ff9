"""One demand of the design is varied, the others stay as shipped."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from studies.beyond.well_posed_design.achieved import COLUMNS, Achieved, achieved, printed_achieved, short
from studies.beyond.well_posed_design.cases import PACKAGE, VELOCITY, Case, p1_cases
from studies.papers.topic import Topic
from studies.plots import Axis, Band, Figure, Level, Line, Mark, Panel, Shade
from studies.plots.colours import BLUE, GREEN, PURPLE, RED
from studies.study import Cell, PartResult, Scope, Table
from synthesis.design.hinf_observer import Channel, ObserverDesign, design_observer
from synthesis.errors import ProblemError

TOPIC = Topic(PACKAGE)
MOST_TICKS = 7
TICKS = (0.001, 0.01, 0.1, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 300.0, 600.0, 1000.0, 2000.0)
Vary = Callable[[ObserverDesign, float], ObserverDesign]


@dataclass(frozen=True)
class Sweep:
    """Demands (n,); gains (n, g, 2) over g wheel speeds; proved bounds of the design's own objective, NaN: infeasible."""

    case: Case
    demand: FloatArray
    gains: FloatArray
    gamma_lower: FloatArray
    gamma: FloatArray
    achieved: Achieved

    @property
    def feasible(self) -> BoolArray:
        """Mask (n,) of the demands that some gains of this degree meet."""
        return np.asarray(np.isfinite(self.gamma))


def friction_bound(design: ObserverDesign, bound: float) -> ObserverDesign:
    """Bound of the friction channel (its floor is 1)."""
    channels = tuple(c if c.bound is None else replace(c, bound=bound) for c in design.channels)
    return replace(design, channels=channels)


def decay_rate(design: ObserverDesign, rate: float) -> ObserverDesign:
    """alpha in 1/s."""
    return replace(design, decay_rate=rate)


def pole_limit(design: ObserverDesign, limit: float) -> ObserverDesign:
    """r in 1/s."""
    return replace(design, fastest_pole=limit)


def noise_weight(design: ObserverDesign, weight: float) -> ObserverDesign:
    """Acceleration error joins the minimised channel, `weight` m/s^2 of it for one unit of normalised force noise."""
    both = Channel(("force_noise", "acceleration_error"), VELOCITY, None, (1.0, weight))
    return replace(design, channels=tuple(both if c.bound is None else c for c in design.channels))


def sweep(case: Case, vary: Vary, demands: Sequence[float], points: int = 29) -> Sweep:
    """Design for every demand; one that no gains of this degree meet leaves NaN. Raises ProblemError if none is met."""
    grid, gains = case.grid(points), np.full((len(demands), points, 2), np.nan)
    lower, gamma = np.full((2, len(demands)), np.nan)
    for k, demand in enumerate(demands):
        with suppress(ProblemError):
            found = design_observer(case.model, vary(case.design, demand))
            gains[k], gamma[k] = found.gain(grid)[..., 0], found.gamma
            lower[k] = np.nan if found.gamma_lower is None else found.gamma_lower
    if not np.isfinite(gamma).any():
        degree = case.design.degree
        raise ProblemError(f"{case.title}: no gains of degree {degree} meet any of the demands {list(demands)}")
    return Sweep(case, np.array(demands), gains, lower, gamma, achieved(case, gains, grid))


@dataclass(frozen=True)
class Demand:
    """One demand and the values that are tried for both tires of P1; pictures show them less `offset`."""

    name: str
    title: str
    label: str
    caption: str
    vary: Vary
    longitudinal: Sequence[float]
    lateral: Sequence[float]
    offset: float = 0.0
    quick: bool = True

    def run(self, scope: Scope) -> PartResult:
        """The part of the study."""
        values = (asked[:: 3 if scope.quick else 1] for asked in (self.longitudinal, self.lateral))
        sweeps = [sweep(case, self.vary, asked) for case, asked in zip(p1_cases(), values, strict=True)]
        return PartResult((), [self.table(sweeps)], [self.figure(sweeps)])

    def table(self, sweeps: Sequence[Sweep]) -> Table:
        """Every design of a sweep."""
        rows: list[list[Cell]] = []
        for sweep in sweeps:
            for k, value in enumerate(sweep.demand):
                ends = np.stack([sweep.gains[k].min(axis=0), sweep.gains[k].max(axis=0)], axis=1).ravel()
                values = (*ends, sweep.gamma_lower[k], sweep.gamma[k], *(field[k] for field in sweep.achieved))
                rows.append([sweep.case.title, float(value), bool(sweep.feasible[k]), *short(values)])
        return Table(
            self.name,
            f"Designs of degree 1 for several values of one demand ({self.label}), everything else as shipped: ranges of "
            "the gains over the wheel speeds, the proved bound of the minimised channel with its lower bound, and what "
            "the gains do at the worst constant wheel speed.",
            ("case", self.label, "feasible", "L1 from [m/s]", "L1 to [m/s]", "L2 from [m/s^2]", "L2 to [m/s^2]",
             "lower bound", "proved bound", *COLUMNS), rows,
        )  # fmt: skip

    def figure(self, sweeps: Sequence[Sweep]) -> Figure:
        """Gains, proved bound and noise over the demand: a row for each case."""
        name, _, unit = self.label.rpartition(" ")
        label = f"{name} − {self.offset:g} {unit}" if self.offset else self.label
        return Figure(
            self.name,
            f"{self.caption} Blue: smallest to largest gain over the wheel speeds; red: what P1 prints. Green: bound on "
            "the gain from force noise to the velocity error, from its lower bound to the proved one (one Lyapunov "
            "matrix for all demands, any motion of the wheel speed); black: what the same gains have at constant wheel "
            "speed. Purple: H₂ gain, the price in broadband noise. Grey: no gains of this degree meet the demand.",
            "Two rows of four panels over the varied demand: bands of both gains, the proved noise bound, and the "
            "broadband noise, with red lines for the printed gains.",
            [_row(sweep, self.offset, label if sweep is sweeps[-1] else "") for sweep in sweeps],
            (10.6, 2.7 * len(sweeps) + 0.4), "below",
        )  # fmt: skip


def _row(sweep: Sweep, offset: float, label: str) -> list[Panel]:
    case, good, demand = sweep.case, sweep.feasible, sweep.demand - offset
    reference, x = printed_achieved(case), demand[good]
    gamma, real = sweep.gamma[good], sweep.achieved
    marks: dict[str, list[Mark]] = {}
    for i, name in enumerate((f"{case.title}\n$L_1$ [m/s]", "$L_2$ [m/s²]")):
        low, high = sweep.gains[good, :, i].min(axis=1), sweep.gains[good, :, i].max(axis=1)
        marks[name] = [
            Shade(*case.printed_range[i], label="printed range", color=RED, alpha=0.10),
            Band(x, low, high, color=BLUE, alpha=0.35),
            Line(x, low, color=BLUE, width=1.2),
            Line(x, high, "design, least and largest over the wheel speeds", BLUE, width=1.2),
            _printed(case.printed[i]),
        ]
    marks["gain to the velocity error [m/s]"] = [
        Band(x, sweep.gamma_lower[good], gamma, color=GREEN, alpha=0.35),
        Line(x, gamma, "proved bound, any motion", GREEN, width=1.2, marker="o", size=3),
        Line(x, real.noise[good], "the same gains, constant wheel speed", "black", width=1.6),
        _printed(float(reference.noise)),
    ]
    marks["H₂ gain, force noise [m/s·√Hz]"] = [
        Line(x, real.noise_density[good], "H₂ gain of the design", PURPLE, width=1.2, marker="o", size=3),
        _printed(float(reference.noise_density)),
    ]
    ticks = [tick for tick in TICKS if demand.min() * 0.99 <= tick <= demand.max() * 1.01]
    if len(ticks) > MOST_TICKS:
        ticks = [tick for tick in ticks if float(np.log10(tick)).is_integer()]
    missing = [Level(x=place, color="0.6", width=4.0, alpha=0.4) for place in demand[~good]]
    return [Panel([*missing, *shown], Axis(label, scale="log", ticks=ticks), name) for name, shown in marks.items()]


def _printed(value: float) -> Level:
    return Level(value, label="printed gains", color=RED, dash="dashed", width=1.1)


FRICTION = (1.001, 1.002, 1.005, 1.01, 1.02, 1.05, 1.1, 1.2, 1.35, 1.5)
WEIGHTS = (0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
DEMANDS = (
    Demand(
        "friction-bound", "Friction bound", "bound of the friction gain [1]",
        "Gains over the bound that is asked of the friction channel (floor 1): close to the floor the bound on noise rises.",
        friction_bound, FRICTION, FRICTION, 1.0),
    Demand(
        "decay", "Decay rate", "decay rate that is asked for [1/s]",
        "Gains over the decay rate that is asked for: it sets L2 almost alone, and with it the broadband noise.",
        decay_rate, (10, 20, 40, 60, 80, 120, 160, 200, 230), (1, 2, 3, 4, 6, 8, 9, 10, 11)),
    Demand(
        "pole-limit", "Pole limit", "limit of the fastest pole [1/s]",
        "Gains over the limit of the fastest pole (tied to the sample time): it sets L1.",
        pole_limit, (300, 350, 400, 500, 600, 800, 1000, 1500, 2400), (150, 200, 220, 250, 300, 400, 600, 800, 1200),
        quick=False),
    Demand(
        "noise-weight", "Noise weight", "acceleration weight [m/s²]",
        "Gains over the size of acceleration errors that counts as much as one unit of normalised force noise; "
        "both share the minimised channel, whose bound is shown. A worse accelerometer asks for more L2.",
        noise_weight, WEIGHTS, WEIGHTS, quick=False),
)  # fmt: skip
for each in DEMANDS:
    TOPIC.part(each.name, each.title, 4.0, quick=each.quick)(each.run)
