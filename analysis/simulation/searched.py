"""A schedule's update, or its error equation, as a system that the search of `analysis.lpv` can look for bad trajectories of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from analysis.lpv.frozen import largest_gain, slowest_decay
from analysis.lpv.lifted import lift, samples, worst_input
from analysis.lpv.trajectory import Path, admissible
from analysis.lpv.worst_path import gain_of, growth_of, simple_paths, worst_path
from analysis.simulation.box import box_of
from analysis.simulation.channel import channel_of
from analysis.simulation.linear import Linear
from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule, PlantQuotient
from estimators.schedule.gain_schedule import AnyPlant
from estimators.schedule.plant_cells import PlantByCells
from synthesis.certificate.claims import ERROR_EQUATION, ClaimChannel
from synthesis.loop.plant import Axis
from synthesis.models.constraint import ParameterConstraint, half_spaces_of
from synthesis.polynomials.half_spaces import HalfSpaces
from synthesis.polynomials.rational import as_float, decimal

EVALUATIONS = 40  # of the search for slow decay
GENERATIONS, BEST, CHILDREN, CHANGE = 2, 4, 8, 0.4  # of the search for large gains
PARTS = 16  # intervals of every piece of a path of the error equation
SHORT = 400  # samples of a run while searching
CLOSE = 2  # degrees by which a polynomial exceeds those of a quotient that it stands for
Measure = Callable[[Linear], FloatArray]  # of systems along trajectories (R, N+1, ..): how bad each is (R,)


@dataclass(frozen=True)
class ScheduleQuestion:
    """x+ or x' = A(p) x + B(p) w, z = C(p) x + D(p) w of one channel; in discrete time a sample is the unit of time."""

    schedule: GainSchedule
    kind: str
    channel: ClaimChannel

    @property
    def order(self) -> int:
        """One more than the degree of the error equation along a line in one cell: that of the plant, and of L times C.

        A rational plant, and one by cells, counts as a polynomial that comes close over the short pieces of a trajectory.
        """
        degrees = {key: _degree(matrix) for key, matrix in self.schedule.plant.items()}
        most: int = max(*(degrees[key] for key in "AE"), *(degrees[key] + len(self.axes) for key in "CF"))
        return 1 + most

    @property
    def discrete(self) -> bool:
        """Whether the claim is about the update."""
        return self.kind not in ERROR_EQUATION

    @cached_property
    def axes(self) -> tuple[Axis, ...]:
        """Ranges, and rates per sample or per second."""
        box, period = box_of(self.schedule), decimal(self.schedule.sample_time if self.discrete else 1.0)
        rows = zip(*box[:6], strict=True)
        return tuple(
            Axis(
                name,
                unit,
                decimal(float(low)),
                decimal(float(high)),
                *(decimal(float(rate)) * period if np.isfinite(rate) else None for rate in rates),
            )
            for name, unit, low, high, *rates in rows
        )

    @cached_property
    def half_spaces(self) -> HalfSpaces:
        """Constraints between the parameters, scaled."""
        constraints = self.schedule.constraints
        if constraints is None:
            return ()
        given = [
            ParameterConstraint(
                dict(zip((axis.name for axis in self.axes), map(float, row), strict=True)), float(bound)
            )
            for row, bound in zip(constraints.normals, constraints.bounds, strict=True)
        ]
        return half_spaces_of([(a.name, a.low, a.high) for a in self.axes], given, f"schedule '{self.schedule.name}'")

    def frozen(self, u: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """A, B, C, D at scaled parameters (g, p)."""
        return tuple(channel_of(self.schedule, self.kind, self.channel, self.physical(u)))  # type: ignore[return-value]

    def physical(self, u: FloatArray) -> FloatArray:
        """Parameter values of scaled ones, inside the range."""
        box = box_of(self.schedule)
        middle, half = (np.array([as_float(getattr(axis, key)) for axis in self.axes]) for key in ("middle", "half"))
        found: FloatArray = np.clip(middle + half * u, box.low, box.high)
        return found

    def repeated(self, path: Path, count: int) -> FloatArray:
        """`count` samples of a periodic path, (count, p), admissible to the last bit."""
        if self.discrete:
            once = self.physical(samples(path))
            many = np.tile(once, (-(-count // len(once)), 1))[None, :count]
        else:
            time: FloatArray = np.asarray(self.schedule.sample_time * np.arange(count), float)
            many = self.physical(_between(path, time))[None]
        found: FloatArray = box_of(self.schedule).limited(many, self.schedule.sample_time)[0]
        return found


def bad_trajectories(question: ScheduleQuestion, measure: Measure, count: int, seed: int) -> FloatArray:
    """Trajectories (1 + BEST, count, p): the place where the frozen gain is largest, and the worst periodic paths found.

    `measure` says how bad a trajectory is. Simple paths first, then some generations of random changes of the best ones, a
    whole generation in one batch.
    """
    rng = np.random.default_rng(seed)
    place, _, _ = largest_gain(question)
    known: list[tuple[float, Path]] = []
    paths = list(simple_paths(question, place))
    for generation in range(GENERATIONS + 1):
        p = np.stack([question.repeated(path, min(count, SHORT)) for path in paths])
        system = channel_of(question.schedule, question.kind, question.channel, p)
        known += zip((float(value) for value in measure(system)), paths, strict=True)
        known = sorted(known, key=lambda entry: -entry[0])[:BEST]
        if generation < GENERATIONS:
            paths = [
                _changed(path, question.axes, rng, question.half_spaces) for _, path in known for _ in range(CHILDREN)
            ]
    standing = np.broadcast_to(question.physical(place[None]), (count, len(place)))
    return np.stack([standing, *(question.repeated(path, count) for _, path in known)])


def _changed(path: Path, axes: tuple[Axis, ...], rng: np.random.Generator, half_spaces: HalfSpaces = ()) -> Path:
    """A path nearby; durations stay whole samples."""
    durations = np.maximum(1.0, np.round(path.durations * np.exp(CHANGE * rng.standard_normal(len(path.durations)))))
    return admissible(path.knots + CHANGE * rng.standard_normal(path.knots.shape), durations, axes, half_spaces)


def _between(path: Path, time: FloatArray) -> FloatArray:
    """u of a periodic path in continuous time at times (g,), s."""
    ends = np.cumsum(path.durations)
    within = np.mod(time, ends[-1])
    piece = np.minimum(np.searchsorted(ends, within, side="right"), len(ends) - 1)
    share = 1.0 - (ends[piece] - within) / path.durations[piece]
    found: FloatArray = path.start[piece] + (path.end - path.start)[piece] * share[:, None]
    return found


def least_decay(question: ScheduleQuestion, count: int) -> tuple[float, FloatArray]:
    """The slowest decay found, 1/s, frozen or along a periodic path, whose monodromy matrix has it; and that path (count, p)."""
    unit = question.schedule.sample_time if question.discrete else 1.0
    place, rate = slowest_decay(question)
    path, _ = worst_path(question, growth_of(question), (0.0,), place, EVALUATIONS)
    along = -growth_of(question)(path, 0.0)
    if along < rate:
        return along / unit, question.repeated(path, count)
    return rate / unit, np.broadcast_to(question.physical(place[None]), (count, len(place)))


def largest_continuous_gain(question: ScheduleQuestion, count: int) -> tuple[float, FloatArray]:
    """The largest gain of an error equation found, at a frozen place or along a periodic path, and that path (count, p)."""
    place, gain, frequency = largest_gain(question)
    path, carrier = worst_path(question, gain_of(question), tuple(dict.fromkeys((0.0, frequency))), place, EVALUATIONS)
    lifted = lift(question, path, carrier, PARTS)
    along = 0.0 if lifted is None else worst_input(lifted)[0]
    if along > gain:
        return along, question.repeated(path, count)
    return gain, np.broadcast_to(question.physical(place[None]), (count, len(place)))


def _degree(matrix: AnyPlant) -> int:
    if isinstance(matrix, PlantByCells):
        return int(sum(n - 1 for n in matrix.pieces.shape[1:-2])) + CLOSE
    if isinstance(matrix, PlantQuotient):
        return _degree(matrix.numerator) + 2 * _degree(matrix.denominator) + CLOSE
    return sum(max(n - 1, 0) for n in matrix.coefficients.shape[:-2])
