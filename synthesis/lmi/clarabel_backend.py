"""The first back end: conic data straight into Clarabel."""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter

import clarabel
import numpy as np
from scipy import sparse

from estimators.arrays import FloatArray
from synthesis.lmi.conic import ConicData, triangle
from synthesis.lmi.settings import LmiSettings

PROJECTIONS = 50


@dataclass(frozen=True)
class RawAnswer:
    """A point and what the solver claims about it.

    `excluded` is what re-evaluation makes of a claim of infeasibility: no decisions of a 1-norm below it can satisfy the
    inequalities (0: nothing is excluded, or nothing was claimed). `centre` is a point on the way, and its mean complementarity:
    what the same problem with a few more inequalities does well to start from.
    """

    solver: str
    decisions: FloatArray
    status: str
    infeasible: bool
    excluded: float
    iterations: int
    seconds: float
    dual_bound: float
    centre: tuple[FloatArray, float] | None = None


def solve_with_clarabel(data: ConicData, decisions: int, settings: LmiSettings) -> RawAnswer:
    """Solve the conic problem; chordal decomposition is left on."""
    options = clarabel.DefaultSettings()
    options.verbose = False
    options.max_iter = settings.max_iterations
    options.max_threads = settings.threads
    options.max_step_fraction = 0.95  # closer to the boundary the grid problems end as 'almost solved'
    options.tol_gap_abs = options.tol_gap_rel = options.tol_feas = settings.tolerance
    cones = [clarabel.ZeroConeT(data.equalities)] if data.equalities else []
    cones += [clarabel.PSDTriangleConeT(size) for size in data.semidefinite]
    quadratic = sparse.csc_matrix(sparse.diags_array(data.weights))
    quadratic.eliminate_zeros()
    start = perf_counter()
    solver = clarabel.DefaultSolver(quadratic, data.q, data.A, data.b, cones, options)
    solution = solver.solve()
    seconds = perf_counter() - start
    status = str(solution.status)
    infeasible = status in ("PrimalInfeasible", "AlmostPrimalInfeasible")
    x, z = np.asarray(solution.x, float), np.asarray(solution.z, float)
    return RawAnswer(
        "clarabel",
        x[:decisions],
        status,
        infeasible,
        _excluded_radius(data, z) if infeasible else 0.0,
        solution.iterations,
        seconds,
        _dual_bound(data, x, z),
    )


def _excluded_radius(data: ConicData, z: FloatArray) -> float:
    """Farkas, re-evaluated: with z in the dual cone, A x + s = b and s in the cone give -b'z <= |x|_1 |A'z|_inf.

    What the solver claims is first improved by alternating projections on A'z = 0 and on the cone; it ends on the cone,
    so that neither the solver's rounding nor ours can refute anything: all that is left is in the residual.
    """
    dense = data.A.toarray()
    columns = dense[:, np.abs(dense).max(axis=0) > 0.0]
    basis, _ = np.linalg.qr(columns)
    z = _on_cone(data, z / np.abs(z).max())
    best = 0.0
    for _ in range(PROJECTIONS):
        gap, residual = -float((data.b + data.slack) @ z), float(np.abs(data.A.T @ z).max())
        if not gap > 0.0:
            break
        best = max(best, gap / max(residual, np.finfo(float).tiny))
        z = _on_cone(data, z - basis @ (basis.T @ z))
    return best


def _on_cone(data: ConicData, z: FloatArray) -> FloatArray:
    """Every matrix of the dual point without its negative eigenvalues."""
    z, start = z.copy(), data.equalities
    for size in data.semidefinite:
        rows, columns, weights = triangle(size)
        part = slice(start, start + len(rows))
        matrix = np.zeros((size, size))
        matrix[rows, columns] = matrix[columns, rows] = z[part] / weights
        values, vectors = np.linalg.eigh(matrix)
        if values[0] < 0.0:
            z[part] = ((vectors * np.maximum(values, 0.0)) @ vectors.T)[rows, columns] * weights
        start += len(rows)
    return z


def _dual_bound(data: ConicData, x: FloatArray, z: FloatArray) -> float:
    """Weak duality with the margin taken out again and the dual residual r = A'z + q charged at ten times |x|.

    For every feasible x': q'x' = r'x' - z'(A x') >= -b'z - |r|'|x'| with the b of the problem without margins.
    """
    if not (np.isfinite(x).all() and np.isfinite(z).all()):
        return float("-inf")
    residual = np.abs(data.A.T @ z + data.q)
    return float(-((data.b + data.slack) @ z) - 10.0 * residual @ np.maximum(np.abs(x), 1e-3))
