"""The steps of `synthesis.design.static_feedback`: to stability by falling growth, then down with the open channel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from estimators.arrays import FloatArray
from estimators.errors import unknown
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.design.generalised_plant import Frame, GeneralisedPlant
from synthesis.design.static_feedback_design import StaticFeedbackDesign
from synthesis.design.static_feedback_lmi import Point, StaticLoop, Structure
from synthesis.design.three_solves import Problem, starting_places
from synthesis.errors import ProblemError
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult
from synthesis.lmi.solve import solve
from synthesis.models.lpv import LpvModel
from synthesis.models.numeric import values
from synthesis.polynomials.matrix import MatrixPolynomial

FINE = 1e-3  # relative fall of the level in one step, below which the steps end
SHARE = 0.05  # by which a growth is exceeded on the way to stability


class Steps:
    """The steps of one design, in the coordinates of its frame; `plants` are those of the model's pieces."""

    def __init__(
        self, model: LpvModel, design: StaticFeedbackDesign, plants: list[GeneralisedPlant], frame: Frame
    ) -> None:
        self.model, self.design, self.plants, self.frame = model, design, plants, frame
        self.settings = design.settings
        if self.settings.relaxation == "auto":
            self.settings = replace(self.settings, relaxation="exchange")
        self.decay = design.decay_rate * (1.0 + design.reserve) / frame.clock
        self.structure = Structure(structure(model, design.uses), design.degree)

    def unit(self, channel: FeedbackChannel) -> float:
        """What a level of one in the frame is; but for L2 gains it has a root of the frame's time in it."""
        return self.frame.unit * (1.0 if channel.norm == "H-infinity" else float(np.sqrt(self.frame.clock)))

    def start(self) -> MatrixPolynomial:
        """The gains that the design starts with, in the frame. Raises ProblemError for a wrong shape or a stray entry."""
        shape = len(self.model.inputs), len(self.model.outputs)
        given = np.zeros(shape) if self.design.start is None else np.array(self.design.start, float)
        if given.shape != shape or not np.isfinite(given).all() or given[self.structure.entries == 0.0].any():
            raise ProblemError(
                f"start has the shape {given.shape}; give {shape[0]} rows (inputs) of {shape[1]} numbers (outputs), zero where "
                "K must not join them"
            )
        return LmiProblem(self.model.parameters).constant(given / self.frame.inputs[:, None] * self.frame.outputs)

    def analysis(self, K: MatrixPolynomial) -> Problem:
        """Of P alone, as `three_solves` asks for it."""

        def problem(gamma: float | None, margin: bool = True, floor: float = 0.0) -> LmiProblem:
            return self._problem(gamma, margin and gamma is not None, floor, K, None)[0]

        return problem

    def lowered(self, point: Point) -> tuple[Point, list[float]]:
        """Steps down until they are short; each is also tried further along its own way, as far as that goes on paying."""
        best = self._solved(*self._problem(None, False, 0.0, point.K, None))
        if best is None:
            raise ProblemError(
                f"model '{self.model.name}': the start is stable, but no level of the open channel was found"
            )
        levels, reach = [best[1]], 1.0
        for _ in range(self.design.steps):
            before = best
            near = self._solved(*self._problem(None, False, 0.0, self.structure, before[0]))
            if near is None:
                break
            best, moved = near, near[0].K - before[0].K
            further = self._solved(*self._problem(None, False, 0.0, near[0].K + moved * reach, None))
            if further is not None and further[1] < near[1]:
                best, reach = further, 2.0 * reach
            else:  # the best P for this K is a new place to start, too
                reach = max(0.5 * reach, 0.5)
                again = self._solved(*self._problem(None, False, 0.0, near[0].K, None))
                best = again if again is not None and again[1] < near[1] else near
            levels.append(best[1])
            if levels[-1] > levels[-2] * (1.0 - FINE):
                break
        return best[0], [level * self.unit(self.design.minimised) for level in levels]

    def stable(self, K: MatrixPolynomial) -> Point:
        """A pair at which every channel has some level: the start itself, or what steps of falling growth lead to.

        Growth g means that (A + B K C - g) decays. Each step takes the largest margin of that at the growth of the step before.
        """
        point = self._certain(K)
        if point is None:
            growth = self._first_growth(K)
            for _ in range(self.design.steps):
                problem, loop = self._shifted(self.structure if point is not None else K, point, growth)
                result = solve(problem, replace(self.settings, verify=False))
                if not self._usable(result) or not (result.objective or 0.0) > 0.0:
                    break
                point = loop.found(result)
                growth = self._growth(point) + SHARE * abs(self._growth(point))
                if growth < -self.decay and self._certain(point.K) is not None:
                    break
            point = None if point is None else self._certain(point.K)
        if point is None:
            raise ProblemError(
                f"model '{self.model.name}': the steps found no stable loop; give another start, more steps, a higher degree, or "
                "more measurements"
            )
        return point

    def _certain(self, K: MatrixPolynomial) -> Point | None:
        """K with a P that certifies some level of every channel, as the solver sees it."""
        found = self._solved(*self._problem(None, False, 0.0, K, None))
        return None if found is None else found[0]

    def _problem(
        self, gamma: float | None, margin: bool, floor: float, gain: MatrixPolynomial | Structure, at: Point | None
    ) -> tuple[LmiProblem, StaticLoop]:
        problem = LmiProblem(
            self.model.parameters, margin, least_norm=floor > 0.0, floor=floor, half_spaces=self.model.half_spaces
        )
        for loop, plant in self._loops(problem, gain, at):
            if self.decay:
                loop.require_decay(self.decay)
            if self.design.fastest_pole is not None:
                loop.require_disc(self.design.fastest_pole / (1.0 + self.design.reserve) / self.frame.clock)
            for part in plant.channels:
                bound = gamma if part.channel.bound is None else part.channel.bound
                if bound is not None:
                    level = problem.constant(np.array([[bound / self.unit(part.channel)]]))
                else:
                    level = problem.unknowns.get("gamma") or problem.scalar("gamma")
                    problem.minimise("gamma")
                (loop.require_gain if part.channel.norm == "H-infinity" else loop.require_energy)(part, level)
        return problem, loop

    def _loops(
        self, problem: LmiProblem, gain: MatrixPolynomial | Structure, at: Point | None
    ) -> Iterator[tuple[StaticLoop, GeneralisedPlant]]:
        """The loop on every piece of the plant, while the problem asks about it; all share P and K."""
        first = None
        for number, (piece, plant) in enumerate(zip(self.model.pieces, self.plants, strict=True)):
            problem.on_cell(number, piece.box)
            loop = StaticLoop(problem, plant, self.frame.clock, self.design.degree, gain, at, first)
            first = first or loop
            yield loop, plant
        problem.on_cell()

    def _shifted(
        self, gain: MatrixPolynomial | Structure, at: Point | None, growth: float
    ) -> tuple[LmiProblem, StaticLoop]:
        """The largest margin of decay with (growth) taken off A, P < 1."""
        problem = LmiProblem(self.model.parameters, maximise_margin=True, half_spaces=self.model.half_spaces)
        for loop, _ in self._loops(problem, gain, at):
            loop.require_decay(-growth)
            unit = problem.constant(np.eye(loop.P.shape[0]))
            problem.require("P < 1", unit - loop.P, strict=False)
        return problem, loop

    def _solved(self, problem: LmiProblem, loop: StaticLoop) -> tuple[Point, float] | None:
        """The pair and the level of a problem that minimises, unless the solver found none."""
        result = solve(problem, replace(self.settings, verify=False), starting_places(problem))
        level = result.objective
        if not self._usable(result) or level is None or not 0.0 < level < np.inf:
            return None
        return loop.found(result), level

    def _usable(self, result: LmiResult) -> bool:
        return bool(np.isfinite(result.decisions).all()) and result.report.status.endswith("Solved")

    def _first_growth(self, K: MatrixPolynomial) -> float:
        """So fast that P = 1 shows it, whatever the rates."""
        places = self._grid()
        A = self._closed(K, places)
        return float(1.0 + SHARE) * max(float(np.linalg.eigvalsh(0.5 * (A + np.swapaxes(A, 1, 2))).max()), SHARE)

    def _growth(self, point: Point) -> float:
        """The least growth that P shows on a grid of places and rates."""
        problem = LmiProblem(self.model.parameters)
        moved = problem.time_derivative(point.P) * (1.0 / self.frame.clock)
        places = self._grid()
        A, P, later = self._closed(point.K, places), point.P.at(places)[..., 0], moved.at(places)[..., 0]
        inverse = np.linalg.inv(np.linalg.cholesky(P))
        rate = 0.5 * (P @ A + np.swapaxes(P @ A, 1, 2) + later)
        return float(np.linalg.eigvalsh(inverse @ rate @ np.swapaxes(inverse, 1, 2)).max())

    def _grid(self) -> FloatArray:
        """Scaled places with the ends of all rates (g, 2 p)."""
        count = len(self.model.parameters)
        line = np.linspace(-1.0, 1.0, 9 if count == 1 else 5)
        own = LmiProblem(self.model.parameters, half_spaces=self.model.half_spaces).places_on([line] * count)
        rates = np.array(list(product((-1.0, 1.0), repeat=count))).reshape(2**count, count)
        return np.hstack([np.repeat(own, len(rates), axis=0), np.tile(rates, (len(own), 1))])

    def _closed(self, K: MatrixPolynomial, places: FloatArray) -> FloatArray:
        still = places[:, : places.shape[1] // 2]
        gain, owner, n = K.at(places)[..., 0], self.model.cells.owner(still), len(self.model.states)
        closed = np.zeros((len(places), n, n))
        for index in np.unique(owner):
            plant, chosen = self.plants[index], owner == index
            below = values(plant.denominator, still[chosen])
            A, B, C = (values(getattr(plant, key), still[chosen]) / below for key in "ABC")
            closed[chosen] = A + B @ gain[chosen] @ C
        return closed


def structure(model: LpvModel, uses: tuple[tuple[str, str], ...] | None) -> FloatArray:
    """One where K may join an output to an input (nu, ny). Raises ProblemError for unknown names."""
    inputs, outputs = ([s.name for s in group] for group in (model.inputs, model.outputs))
    if uses is None:
        return np.ones((len(inputs), len(outputs)))
    found = np.zeros((len(inputs), len(outputs)))
    for pair in uses:
        for what, name, known in zip(("input", "output"), pair, (inputs, outputs), strict=True):
            if name not in known:
                raise ProblemError(f"model '{model.name}', uses: {unknown(what, name, known)}")
        found[inputs.index(pair[0]), outputs.index(pair[1])] = 1.0
    return found
