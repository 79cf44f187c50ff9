"""Solve an LMI problem and judge the answer outside the solver."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError
from synthesis.lmi.clarabel_backend import RawAnswer, solve_with_clarabel
from synthesis.lmi.conic import assemble
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.relaxation import RelaxedProblem, relax
from synthesis.lmi.result import LmiResult, Margin, SolverReport, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.polynomials.matrix import constant
from synthesis.polynomials.positivity import prove_positive

# An objective on the boundary of feasibility is loosened by these fractions, in turn, until every inequality is proved.
LOOSENING = (0.0, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5)

# A re-evaluated certificate of infeasibility must exclude all decisions up to this size. Balanced problems have decisions of
# size one, but badly scaled ones that are feasible with decisions of 1e9 have been seen.
EXCLUDED = 1e12


def solve(problem: LmiProblem, settings: LmiSettings | None = None) -> LmiResult:
    """Relax, solve, substitute, re-evaluate every named inequality on the continuum, and return a verdict.

    Raises ProblemError if the relaxation does not fit the problem or the solver is unknown.
    """
    settings = settings or LmiSettings()
    if not problem.inequalities:
        raise ProblemError("the problem has no inequality; require something")
    start = perf_counter()
    relaxed = relax(problem, settings)
    if settings.solver.startswith("cvxpy:"):
        assembly = perf_counter() - start
        from synthesis.lmi.cvxpy_backend import solve_with_cvxpy  # cvxpy takes 1 s to import

        answer = solve_with_cvxpy(relaxed, settings.solver.removeprefix("cvxpy:"), settings)
    else:
        data = assemble(relaxed)
        assembly = perf_counter() - start
        answer = solve_with_clarabel(data, problem.decisions, settings)
    start = perf_counter()
    decisions = answer.decisions
    margins: tuple[Margin, ...] = ()
    if settings.verify and not answer.infeasible and np.isfinite(decisions).all():
        decisions, margins = _verified(problem, answer.decisions, settings)
    verification = perf_counter() - start
    verdict, message = _judge(answer, margins, relaxed)
    report = SolverReport(
        answer.solver, answer.status, answer.iterations, answer.seconds, assembly, verification,
        relaxed.relaxation, answer.dual_bound,
    )  # fmt: skip
    objective = float(problem.cost @ decisions) * problem.sense if problem.objective else None
    # Vertices with multi-convexity only suffice: their optimum bounds nothing from below.
    necessary = relaxed.relaxation in ("grid", "exact") and problem.objective is not None
    lower = answer.dual_bound * problem.sense if necessary and np.isfinite(answer.dual_bound) else None
    values = {name: unknown.substitute(decisions) for name, unknown in problem.unknowns.items()}
    return LmiResult(verdict, message, margins, values, decisions, objective, lower, report)


def _verified(
    problem: LmiProblem, decisions: FloatArray, settings: LmiSettings
) -> tuple[FloatArray, tuple[Margin, ...]]:
    """Margins at the solver's point, or at the same point with its objective loosened a little if that proves more."""
    if problem.maximise_margin:
        return decisions, margins_of(problem, problem.without_margin(decisions), settings.proof_depth)
    cost, value = problem.cost, float(problem.cost @ decisions)
    margins: tuple[Margin, ...] = ()
    for fraction in LOOSENING if problem.objective else (0.0,):
        candidate = decisions + cost * fraction * max(abs(value), 1e-3)
        margins = margins_of(problem, candidate, settings.proof_depth)
        if all(margin.proved for margin in margins):
            return candidate, margins
    return decisions, margins_of(problem, decisions, settings.proof_depth)


def margins_of(problem: LmiProblem, decisions: FloatArray, depth: int) -> tuple[Margin, ...]:
    """Every named inequality at these decisions, on the whole box of parameters and rates."""
    out = []
    for entry in problem.inequalities:
        if not entry.strict:
            continue
        matrix, size = entry.matrix.substitute(decisions), entry.matrix.magnitude(decisions)
        if entry.floor:
            matrix = matrix + constant(entry.floor * np.eye(matrix.shape[0]), matrix.variables)
        found = prove_positive(matrix, depth, size)
        place = problem.place(entry, found.place)
        out.append(Margin(entry.name, found.smallest / found.scale, place, found.proved))
    return tuple(out)


def _judge(answer: RawAnswer, margins: tuple[Margin, ...], relaxed: RelaxedProblem) -> tuple[Verdict, str]:
    if answer.infeasible:
        if relaxed.relaxation in ("grid", "exact") and answer.excluded > EXCLUDED:
            # Points are necessary, sums of squares exact: this refutes the whole for this degree of the unknowns.
            return Verdict.REFUTED, (
                f"refuted: the {relaxed.relaxation} relaxation has no solution (certificate re-evaluated: none with "
                f"decisions below {answer.excluded:.1e})"
            )
        return Verdict.INCONCLUSIVE, (
            f"inconclusive: the {relaxed.relaxation} relaxation has no solution ({answer.solver}: {answer.status}); raise "
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
