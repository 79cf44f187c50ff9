"""The solves of every H-infinity design: the least level, a back-off from it, and the gains that vary least there.

The optimum itself is attained only at the boundary of feasibility, where gains may be unbounded, and largest margins are flat: so
the last solve is strictly convex, and every number that is handed on is rounded to the digits that matter. A level counts only
if every inequality holds at it when re-evaluated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from synthesis.certificate.rounding import round_down, round_up
from synthesis.errors import ProblemError
from synthesis.lmi.exchange import Memory
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.relaxation import rate_vertices, relaxation_of
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.models.lpv import LpvModel

KEPT = 0.95  # of the largest common margin, when the gains are chosen
STEPS = (1.001, 1.01, 1.1, 1.5, 3.0, 10.0, 100.0)  # from the level that a solver names to one that holds
BISECTIONS = 14
# Places along each parameter that are solved for from the start, by their number; 2 for more
START = {1: 5, 2: 3}

Problem = Callable[..., LmiProblem]
Level = Callable[[float], float]


@dataclass(frozen=True)
class Settled:
    """`gamma_lower` a bound from below for every unknown of this degree, where there is one; `gamma` the verified level.

    `result` carries verdict and margins of the last solve, from which the gains are taken; `optimum` is the first solve.
    """

    gamma_lower: float | None
    gamma: float
    result: LmiResult
    optimum: LmiResult


def least(problem: Problem, backoff: float, settings: LmiSettings, memory: Memory) -> LmiResult:
    """The first of the solves: minimise. `memory` keeps the places that decided for the others."""
    first = problem(None)
    # By exchange it is not handed on: it need not hold on the continuum, only the level a back-off above it.
    bounding = backoff > 0.0 and relaxation_of(first, settings) == "exchange"
    return solve(first, replace(settings, verify=not bounding), memory)


def problem_for(model: LpvModel, gamma: float | None, maximise_margin: bool, floor: float) -> LmiProblem:
    """The problem without inequalities that a design begins with, over the model's set of parameters.

    With `gamma` a margin may be maximised; with a `floor` of all margins the decisions of least norm are sought.
    """
    return LmiProblem(
        model.parameters, maximise_margin and gamma is not None, least_norm=floor > 0.0, floor=floor,
        half_spaces=model.half_spaces,
    )  # fmt: skip


def lyapunov_degree(model: LpvModel, degree: int) -> int | tuple[int, ...]:
    """Of a Lyapunov matrix: a parameter that jumps may move the gains, but not it."""
    if not any(p.may_jump for p in model.parameters):
        return degree
    return tuple(0 if p.may_jump else degree for p in model.parameters)


def starting_places(problem: LmiProblem) -> Memory:
    """Where the solves start: in the corners alone, little is asked of laws that are free elsewhere, and unknowns run away.

    With one parameter as many places as the degree of the inequality has coefficients, denser towards the ends.
    """
    count = len(problem.parameters)
    out: Memory = {}
    for entry in problem.inequalities:
        degrees = entry.matrix.degrees[:count]
        numbers = [max(START.get(count, 2), degree + 1 if count == 1 else 0) if degree else 1 for degree in degrees]
        lines = [np.cos(np.linspace(np.pi, 0.0, n)) if n > 1 else np.zeros(1) for n in numbers]
        points, vertices = problem.places_on(lines), rate_vertices(entry.matrix, count)
        own, rates = (np.array(rows).reshape(len(rows), count) for rows in (points, vertices))
        out[entry.name] = np.hstack([np.repeat(own, len(rates), axis=0), np.tile(rates, (len(own), 1))])
    return out


def three_solves(
    name: str,
    problem: Problem,
    level: Level,
    backoff: float,
    settings: LmiSettings,
    optimum: LmiResult | None = None,
    memory: Memory | None = None,
) -> Settled:
    """Minimise, then give back `backoff` of the optimum and choose the gains there.

    `problem(gamma, maximise_margin, floor)` builds the inequalities, `level` turns their objective into a gain; `name` is that
    of the model, for messages. A first solve that was done already (`least`) is not done again. Raises ProblemError if nothing
    is found.
    """
    memory = {} if memory is None else memory
    optimum = least(problem, backoff, settings, memory) if optimum is None else optimum
    bounding = optimum.report.relaxation == "exchange" and backoff > 0.0
    lower = None if optimum.lower_bound is None else level(max(optimum.lower_bound, 0.0))
    named = optimum.objective is not None and optimum.objective > 0.0
    if bounding and named and optimum.report.status == "Solved":
        gamma = round_up(level(optimum.objective or 0.0) * (1.0 + backoff))
        result = solve(problem(gamma), settings, memory)
        bounding = result.verdict is Verdict.CERTIFIED
    else:
        bounding = False
    if not bounding:
        if optimum.verdict is Verdict.CERTIFIED and named:
            gamma, result = level(optimum.objective or 0.0), optimum
        else:
            gamma, result = _least_certified(name, problem, level, optimum, settings, memory)
    if backoff > 0.0:
        if not bounding:
            gamma = round_up(gamma * (1.0 + backoff))
            result = solve(problem(gamma), settings, memory)
        if result.verdict is not Verdict.CERTIFIED:
            raise ProblemError(f"model '{name}': {result.message}")
        floor = round_down(KEPT * float(result.objective or 0.0), 2)
        if floor > 0.0:
            settled = solve(problem(gamma, False, floor), settings, memory)
            result = settled if settled.verdict is Verdict.CERTIFIED else result
    return Settled(lower, gamma, result, optimum)


def _least_certified(
    name: str, problem: Problem, level: Level, optimum: LmiResult, settings: LmiSettings, memory: Memory
) -> tuple[float, LmiResult]:
    """A solve that stalled names some level, below or above the least one where a largest margin is certified: bracket that."""
    named = level(optimum.objective if optimum.objective is not None and optimum.objective > 0.0 else 1.0)
    low, found, high = named, None, named
    for step in STEPS:
        high = named * step
        found = solve(problem(high), settings, memory)
        if found.verdict is Verdict.CERTIFIED:
            break
    if found is None or found.verdict is not Verdict.CERTIFIED:
        raise ProblemError(f"model '{name}': {optimum.message}; loosen a bound, the decay rate or the fastest pole")
    for step in STEPS[1:] if high == named * STEPS[0] else ():  # the level that was named holds: what about lower ones?
        low = named / step
        tried = solve(problem(low), settings, memory)
        if tried.verdict is not Verdict.CERTIFIED:
            break
        found, high = tried, low
    for _ in range(BISECTIONS):
        if high <= low * 1.0005:
            break
        middle = float(np.sqrt(low * high))
        tried = solve(problem(middle), settings, memory)
        if tried.verdict is Verdict.CERTIFIED:
            found, high = tried, middle
        else:
            low = middle
    return high, found
