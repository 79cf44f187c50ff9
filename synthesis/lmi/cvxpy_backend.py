"""The second back end: the same relaxed problem as one sparse affine map per block in cvxpy, for any of its solvers."""

from __future__ import annotations

import warnings
from time import perf_counter

import cvxpy as cp
import numpy as np

from estimators.errors import unknown
from synthesis.errors import ProblemError
from synthesis.lmi.clarabel_backend import RawAnswer
from synthesis.lmi.conic import gram_matrices, structural_zeros, triangle
from synthesis.lmi.relaxation import RelaxedProblem
from synthesis.lmi.settings import LmiSettings


def solve_with_cvxpy(relaxed: RelaxedProblem, solver: str, settings: LmiSettings) -> RawAnswer:
    """Solve with the named cvxpy solver. Shares no assembly with the first back end: cvxpy canonicalises by itself."""
    if solver not in cp.installed_solvers():
        raise ProblemError(unknown("cvxpy solver", solver, cp.installed_solvers()))
    x = cp.Variable(len(relaxed.cost))
    constraints = []
    for sampled in relaxed.sampled:
        zero = structural_zeros(sampled.values)
        keep = np.setdiff1d(np.arange(sampled.values.shape[1]), zero)
        for values in sampled.values:
            if len(zero):
                forced = values[zero].reshape(-1, values.shape[-1])
                constraints.append(forced[:, 1:] @ x + forced[:, 0] == 0)
            if len(keep):
                block = values[np.ix_(keep, keep)].reshape(-1, values.shape[-1])
                matrix = cp.reshape(block[:, 1:] @ x + block[:, 0], (len(keep), len(keep)), order="C")
                constraints.append((matrix + matrix.T) / 2 >> sampled.margin * np.eye(len(keep)))
    for sos in relaxed.sos:
        size = sos.values.shape[1]
        rows, columns, _ = triangle(size)
        values = sos.values[:, rows, columns].reshape(-1, sos.values.shape[-1])
        total = values[:, 1:] @ x + values[:, 0] - np.tile(sos.margin * (rows == columns), len(sos.values))
        for matching, basis in zip(gram_matrices(sos), sos.bases, strict=True):
            gram = cp.Variable((size * basis.shape[1],) * 2, PSD=True)
            first, second, svec = triangle(size * basis.shape[1])
            pick = np.zeros((len(first), gram.size))
            pick[np.arange(len(first)), first * gram.shape[0] + second] = svec
            total = total - (matching @ pick) @ cp.reshape(gram, (gram.size,), order="C")
        constraints.append(total == 0)
    cost = relaxed.cost @ x + (
        0.5 * cp.sum_squares(cp.multiply(np.sqrt(relaxed.weights), x)) if relaxed.weights.any() else 0.0
    )
    problem = cp.Problem(cp.Minimize(cost), constraints)
    start = perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # inaccurate answers are judged by re-evaluation, not by a warning
        try:
            problem.solve(solver=solver)
        except cp.error.SolverError as error:
            return RawAnswer(f"cvxpy:{solver}", np.zeros(len(relaxed.cost)), str(error), False, 0.0, 0, 0.0, -np.inf)
    stats = problem.solver_stats
    seconds = perf_counter() - start if stats is None or stats.solve_time is None else stats.solve_time
    found = x.value is not None
    return RawAnswer(
        f"cvxpy:{solver}",
        np.asarray(x.value, float) if found else np.zeros(len(relaxed.cost)),
        str(problem.status),
        problem.status in ("infeasible", "infeasible_inaccurate"),
        0.0,  # no common form of the certificate either, so nothing can be re-evaluated
        0 if stats is None or stats.num_iters is None else int(stats.num_iters),
        float(seconds),
        -np.inf,  # cvxpy hands out no common form of the dual objective
    )
