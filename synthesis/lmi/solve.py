"""Solve an LMI problem and decide about the answer outside the solver."""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError
from synthesis.lmi.clarabel_backend import RawAnswer, solve_with_clarabel
from synthesis.lmi.conic import assemble
from synthesis.lmi.exchange import Memory, exchange, families_of, hopeless, remember, solve_sampled
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.relaxation import relax, relaxation_of
from synthesis.lmi.result import LmiResult, Margin, SolverReport, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.one_thread import one_thread
from synthesis.polynomials.matrix import constant
from synthesis.polynomials.positivity import prove_positive

# An objective on the boundary of feasibility is loosened by these fractions, in turn, until every inequality is proved.
LOOSENING = (0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)

# A re-evaluated certificate of infeasibility must exclude all decisions up to this size. Balanced problems have decisions of
# size one, but badly scaled ones that are feasible with decisions of 1e9 have been seen.
EXCLUDED = 1e12
NECESSARY = ("grid", "exact", "exchange")  # relaxations that no solution on the whole box violates
MOST_ITERATIONS = 600  # of the solver, over all rounds of an exchange


@one_thread
def solve(problem: LmiProblem, settings: LmiSettings | None = None, memory: Memory | None = None) -> LmiResult:
    """Relax, solve, substitute, re-evaluate every named inequality on the continuum, and return a verdict.

    With `memory` an exchange starts with the places that decided in the problem before, and leaves its own there.
    Raises ProblemError if the relaxation does not fit the problem or the solver is unknown.

    >>> import numpy as np
    >>> problem = LmiProblem((SchedulingParameter("speed", "m/s", 10.0, 40.0, -5.0, 5.0),))
    >>> P = problem.symmetric("P", 1)
    >>> problem.require("P > 1", P - problem.constant(np.eye(1)))
    >>> print(solve(problem).verdict)
    certified
    """
    settings = settings or LmiSettings()
    if not problem.inequalities:
        raise ProblemError("the problem has no inequality; require something")
    kind = relaxation_of(problem, settings)
    if kind == "exchange":
        answer, decisions, margins, assembly, verification = _exchanged(problem, settings, memory)
    else:
        answer, assembly = _relaxed(problem, settings)
        start, decisions = perf_counter(), answer.decisions
        margins = ()
        if settings.verify and not answer.infeasible and np.isfinite(decisions).all():
            decisions, margins, _ = _verified(problem, answer.decisions, settings)
        verification = perf_counter() - start
    verdict, message = _verdict(answer, margins, kind)
    report = SolverReport(
        answer.solver, answer.status, answer.iterations, answer.seconds, assembly, verification, kind, answer.dual_bound
    )
    objective = float(problem.cost @ decisions) * problem.sense if problem.objective else None
    # Vertices with multi-convexity, and Bernstein coefficients, only suffice: their optimum bounds nothing from below.
    necessary = kind in NECESSARY and problem.objective is not None
    lower = answer.dual_bound * problem.sense if necessary and np.isfinite(answer.dual_bound) else None
    values = {name: unknown.substitute(decisions) for name, unknown in problem.unknowns.items()}
    return LmiResult(verdict, message, margins, values, decisions, objective, lower, report)


def _relaxed(problem: LmiProblem, settings: LmiSettings) -> tuple[RawAnswer, float]:
    """The answer of the solver to one relaxed problem, and the seconds that its assembly took."""
    start = perf_counter()
    relaxed = relax(problem, settings)
    if relaxed.relaxation == "bernstein":
        assembly = perf_counter() - start
        return solve_sampled(relaxed, settings), assembly
    if settings.solver.startswith("cvxpy:"):
        assembly = perf_counter() - start
        from synthesis.lmi.cvxpy_backend import solve_with_cvxpy  # cvxpy takes 1 s to import

        return solve_with_cvxpy(relaxed, settings.solver.removeprefix("cvxpy:"), settings), assembly
    data = assemble(relaxed)
    assembly = perf_counter() - start
    return solve_with_clarabel(data, problem.decisions, settings), assembly


Exchanged = tuple[RawAnswer, FloatArray, tuple[Margin, ...], float, float]


def _exchanged(problem: LmiProblem, settings: LmiSettings, memory: Memory | None) -> Exchanged:
    """Exchange, the proof on the continuum taking part: where it fails is solved for, too."""
    start = perf_counter()
    families, solving, verification, iterations = families_of(problem, memory), 0.0, 0.0, 0
    strict = [family for family in families if family.strict]
    while True:
        answer = exchange(problem, families, settings)
        iterations, solving = iterations + answer.iterations, solving + answer.seconds
        decisions = answer.decisions
        margins: tuple[Margin, ...] = ()
        if not settings.verify or answer.infeasible or not np.isfinite(decisions).all():
            break
        began = perf_counter()
        decisions, margins, places = _verified(problem, answer.decisions, settings)
        verification += perf_counter() - began
        failed = [(strict[i], places[i]) for i, margin in enumerate(margins) if not margin.proved]
        worst = [(family, family.around(answer.decisions, place[None])[0]) for family, place in failed]
        added = sum(family.add(place) for family, found in worst for place in found)
        if not added or iterations > MOST_ITERATIONS or hopeless(problem, answer):
            break
    if memory is not None and not answer.infeasible and np.isfinite(decisions).all():
        remember(families, answer.decisions, memory)
    answer = replace(answer, iterations=iterations, seconds=solving)
    return answer, decisions, margins, perf_counter() - start - solving - verification, verification


def _verified(
    problem: LmiProblem, decisions: FloatArray, settings: LmiSettings
) -> tuple[FloatArray, tuple[Margin, ...], list[FloatArray]]:
    """Margins at the solver's point, or at the same point with its objective loosened a little if that proves more.

    With them the scaled places where each inequality is tightest.
    """
    if problem.maximise_margin:
        return decisions, *_margins(problem, problem.without_margin(decisions), settings.proof_depth)
    cost, value = problem.cost, float(problem.cost @ decisions)
    for fraction in LOOSENING if problem.objective else (0.0,):
        candidate = decisions + cost * fraction * max(abs(value), 1e-3)
        margins, places = _margins(problem, candidate, settings.proof_depth)
        if all(margin.proved for margin in margins):
            return candidate, margins, places
    return decisions, *_margins(problem, decisions, settings.proof_depth)


def margins_of(problem: LmiProblem, decisions: FloatArray, depth: int) -> tuple[Margin, ...]:
    """Every named inequality at these decisions, on the whole box of parameters and rates."""
    return _margins(problem, decisions, depth)[0]


def _margins(problem: LmiProblem, decisions: FloatArray, depth: int) -> tuple[tuple[Margin, ...], list[FloatArray]]:
    out, places = [], []
    for entry in problem.inequalities:
        if not entry.strict:
            continue
        matrix, size = entry.matrix.substitute(decisions), entry.matrix.magnitude(decisions)
        if entry.floor:
            matrix = matrix + constant(entry.floor * np.eye(matrix.shape[0]), matrix.variables)
        found = prove_positive(matrix, depth, size, None if entry.offset.any() else problem.faces)
        place = problem.place(entry, found.place)
        out.append(Margin(entry.name, found.smallest / found.scale, place, found.proved))
        places.append(np.asarray(found.place))
    return tuple(out), places


def _verdict(answer: RawAnswer, margins: tuple[Margin, ...], relaxation: str) -> tuple[Verdict, str]:
    if answer.infeasible:
        if relaxation in NECESSARY and answer.excluded > EXCLUDED:
            # Points are necessary, sums of squares exact: this refutes the whole for this degree of the unknowns.
            return Verdict.REFUTED, (
                f"refuted: the {relaxation} relaxation has no solution (certificate re-evaluated: none with "
                f"decisions below {answer.excluded:.1e})"
            )
        return Verdict.INCONCLUSIVE, (
            f"inconclusive: the {relaxation} relaxation has no solution ({answer.solver}: {answer.status}); raise "
            "the degree or try the grid relaxation"
        )
    if not margins:
        return Verdict.INCONCLUSIVE, f"inconclusive: nothing was verified ({answer.solver}: {answer.status})"
    tightest = min(margins, key=lambda margin: (margin.proved, margin.value))
    words = f'"{tightest.name}" at {tightest.place}, margin {tightest.value:.1e}'
    if all(margin.proved for margin in margins):
        return Verdict.CERTIFIED, f"certified: tightest {words}"
    remedy = "scale the states, raise the degree or shrink the range"
    return Verdict.INCONCLUSIVE, f"not certified: tightest {words}; {remedy}"
