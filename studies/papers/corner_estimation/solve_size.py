"""P1-hinf-time: what (30) costs, counted: what a modelling layer walks, what the solver gets, what the exact form needs.

Seconds belong to a machine and to its load, so they decide nothing: `time_table` measures them for the report alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from time import perf_counter
from typing import Any

import numpy as np

from studies.claim import Finding, JsonValue
from studies.papers.corner_estimation.inputs import CORNERS, POINTS, literal_design, topic
from studies.papers.verdicts import derived
from studies.study import Cell, PartResult, Scope, Table
from synthesis.design.hinf_observer import observer_problem
from synthesis.lmi.conic import ConicData, assemble
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.relaxation import RelaxedProblem, relax
from synthesis.lmi.scaling import observer_scale
from synthesis.lmi.settings import LmiSettings, Relaxation
from synthesis.lmi.solve import solve

TOPIC = topic()
Layer = Callable[[RelaxedProblem], Any]


def conic_problem(points: int, degree: int) -> tuple[LmiProblem, LmiSettings]:
    """(30) for the longitudinal corner, with the settings that put it on a grid of wheel speeds."""
    model, design = CORNERS["longitudinal"].design_model, literal_design(degree, points=points)
    return observer_problem(model, design, observer_scale(model.polynomial, model.parameters)), design.settings


def relaxed_problem(points: int, degree: int, relaxation: Relaxation) -> RelaxedProblem:
    """(30) point by point (`grid`), or on the whole range at once by sums of squares (`exact`)."""
    problem, settings = conic_problem(points, degree)
    return relax(problem, replace(settings, relaxation=relaxation))


def one_by_one(relaxed: RelaxedProblem) -> Any:
    """The sampled inequalities as a cvxpy problem: one matrix inequality for every point and rate."""
    import cvxpy as cp  # takes 1 s

    x = cp.Variable(len(relaxed.cost))
    constraints = []
    for sampled in relaxed.sampled:
        size = sampled.values.shape[1]
        for values in sampled.values.reshape(-1, size * size, len(relaxed.cost) + 1):
            matrix = cp.reshape(values[:, 1:] @ x + values[:, 0], (size, size), order="C")
            constraints.append((matrix + matrix.T) / 2 >> sampled.margin * np.eye(size))
    return cp.Problem(cp.Minimize(relaxed.cost @ x), constraints)


def expressions(problem: Any) -> int:
    """Nodes in the expression trees of all constraints: the layer visits each before the solver sees anything."""
    stack, count = list(problem.constraints), 0
    while stack:
        stack += stack.pop().args
        count += 1
    return count


@TOPIC.claim("P1-hinf-time")
def solve_size(points: int = POINTS, layer: Layer = one_by_one, walked: Callable[[Any], int] = expressions) -> Finding:
    """Count (30) in both assemblies and in its exact form, on `points` wheel speeds and on twice as many."""
    degree = 1
    grid, finer = (relaxed_problem(number, degree, "grid") for number in (points, 2 * points))
    exact, again = (assemble(relaxed_problem(number, degree, "exact")) for number in (points, 2 * points))
    direct, modelled = assemble(grid), layer(grid)
    work = {"points": walked(modelled), "twice_the_points": walked(layer(finer))}
    arrays = {"points": len(grid.sampled), "twice_the_points": len(finer.sampled)}
    same = _hands_over(modelled, direct)
    computed: dict[str, JsonValue] = {
        "points": points, "degree": degree, "conic_problem": _size(direct), "layer_hands_over_the_same_problem": same,
        "expressions_walked_by_the_layer": work, "arrays_stacked_by_direct_assembly": arrays,
        "exact_relaxation": _size(exact), "exact_relaxation_with_twice_the_points": _size(again),
    }  # fmt: skip
    grows = work["twice_the_points"] - work["points"] >= points and arrays["twice_the_points"] == arrays["points"]
    smaller = _size(exact) == _size(again) and exact.A.shape[0] < direct.A.shape[0]
    reading = (
        f"Counted, not timed: with {points} points and degree {degree}, (30) is {len(direct.semidefinite)} matrix "
        f"inequalities in {direct.A.shape[1]} unknowns, {direct.A.shape[0]} rows for the solver. Written in cvxpy, one "
        f"inequality for each point and rate, it is {work['points']} expressions for the layer to walk, and "
        f"{work['twice_the_points']} for twice the points, before it hands over {'the very same' if same else 'other'} "
        f"rows, which direct assembly stacks from {arrays['points']} arrays whatever the number of points: what the "
        "layer adds is preparation alone. The exact relaxation, which also holds between the points, has "
        f"{exact.A.shape[0]} rows, {exact.A.shape[1]} unknowns and {len(exact.semidefinite)} cones for any number of "
        "points. It holds as derived if the rows are the same, only the layer's work grows with the points, and the "
        "exact relaxation has fewer rows. Seconds are printed beside the claim and decide nothing."
    )
    return Finding(computed, derived(same and grows and smaller), reading)


def _size(data: ConicData) -> dict[str, JsonValue]:
    """Unknowns, rows of A x + s = b, and how many positive semidefinite cones there are of each size."""
    cones = {f"{size}x{size}": number for size, number in sorted(Counter(data.semidefinite).items())}
    return {"unknowns": data.A.shape[1], "rows": data.A.shape[0], "cones": cones}


def _hands_over(problem: Any, direct: ConicData) -> bool:
    """Whether the layer ends with the rows, cones and numbers of direct assembly, these to 1e-12 relative (rounding)."""
    data = problem.get_problem_data("CLARABEL")[0]
    cones, A = data["dims"], data["A"]
    if (cones.zero, tuple(cones.psd), A.shape) != (direct.equalities, direct.semidefinite, direct.A.shape):
        return False
    pairs = ((A.toarray(), direct.A.toarray()), (data["b"], direct.b), (data["c"], direct.q))
    return all(float(np.abs(a - b).max()) <= 1e-12 * float(np.abs(b).max()) for a, b in pairs)


@TOPIC.part("solve-time", "Preparing and solving the H-infinity problem", 8.0)
def solve_time(scope: Scope) -> PartResult:
    """How large (30) is for a solver, counted; and the seconds of this run, for information."""
    claims = TOPIC.found()
    found = claims[0].finding.computed
    rows: list[list[Cell]] = []
    forms = (f"{found['points']} points, one by one", "conic_problem"), ("exact relaxation", "exact_relaxation")
    for name, key in forms:
        unknowns, height, cones = found[key].values()
        sizes = ", ".join(f"{number} of {shape}" for shape, number in cones.items())
        rows.append([name, unknowns, height, sum(cones.values()), sizes])
    caption = (
        f"(30) as the solver sees it, degree {found['degree']}, longitudinal: unknowns, rows and positive semidefinite "
        "cones. The exact relaxation holds between the points, too, and does not grow with their number."
    )
    columns = ["form", "unknowns [1]", "rows [1]", "cones [1]", "their sizes"]
    return PartResult(claims, [Table("solve-size", caption, columns, rows), time_table(40 if scope.quick else POINTS)])


def time_table(points: int) -> Table:
    """Seconds of one solve of (30) by both assemblies, on this machine as busy as it is: no part of any verdict."""
    problem, settings = conic_problem(points, 1)
    rows: list[list[Cell]] = []
    roads = {"cvxpy, then Clarabel": "cvxpy:CLARABEL", "conic data assembled directly, Clarabel": "CLARABEL"}
    for name, solver in roads.items():
        solve(problem, replace(settings, solver=solver, points=2))  # imports and first calls are not counted
        start = perf_counter()
        report = solve(problem, replace(settings, solver=solver)).report
        preparation = perf_counter() - start - report.seconds - report.verification_seconds
        rows.append([name, preparation, report.seconds])
    caption = (
        f"Seconds of one solve of (30), {points} points, degree 1, longitudinal, measured in this run on this machine, "
        "which may be doing other things: information, and no part of any claim."
    )
    return Table("solve-time", caption, ["road", "preparation [s]", "solver [s]"], rows)
