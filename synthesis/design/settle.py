"""The solves of a feedback design: minimise the open level, give a little of it back, take the answer of least norm.

The optimum itself is attained only at the boundary of feasibility, where gains may be unbounded, and largest margins are flat: so
the last solve is strictly convex. A level counts only if every inequality holds at it when re-evaluated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from synthesis.certificate.rounding import round_down, round_up
from synthesis.errors import ProblemError
from synthesis.lmi.exchange import Memory
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import LmiResult, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve

KEPT = 0.95  # of the largest common margin, when the gains are chosen
STEPS = (1.001, 1.01, 1.05, 1.2, 1.5, 3.0, 10.0, 100.0)  # from the level that a solver names to one that holds
Build = Callable[..., LmiProblem]  # of a level (None: minimised), whether a margin is maximised, and a floor of all margins


@dataclass(frozen=True)
class Optimum:
    """The first solve: where the open level ends, as the solver sees it, and a bound from below (None: none)."""

    level: float
    lower: float | None
    result: LmiResult


@dataclass(frozen=True)
class Settled:
    """The level that holds, and the solve that shows it."""

    level: float
    result: LmiResult


def optimum(build: Build, settings: LmiSettings, memory: Memory) -> Optimum:
    """Minimise the open level; nothing is proved about the answer, which need not hold on the continuum."""
    result = solve(build(None), replace(settings, verify=False), memory)
    level = result.objective if result.objective is not None and result.objective > 0.0 else np.inf
    if result.report.status.endswith("Infeasible") or not np.isfinite(result.decisions).all():
        level = np.inf
    return Optimum(level, result.lower_bound, result)


def settle(build: Build, first: Optimum, backoff: float, settings: LmiSettings, where: str, memory: Memory) -> Settled:
    """The least level, a back-off above the optimum or further, at which a largest margin is proved, and the answer there.

    Raises ProblemError if there is none.
    """
    found = first.result
    for step in STEPS:
        level = round_up(first.level * (1.0 + backoff) * (step if step > STEPS[0] else 1.0))
        found = solve(build(level, True), settings, memory)
        if found.verdict is Verdict.CERTIFIED:
            break
    if found.verdict is not Verdict.CERTIFIED:
        raise ProblemError(f"{where}: {found.message}; loosen a bound, the decay rate or the fastest pole")
    floor = round_down(KEPT * float(found.objective or 0.0), 2)
    if floor > 0.0:
        least = solve(build(level, False, floor), settings, memory)
        found = least if least.verdict is Verdict.CERTIFIED else found
    return Settled(level, found)
