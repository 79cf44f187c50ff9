r"""Mean-square stability by LMI, the second method beside the spectral radius: P_i > 0 with

P_i - A_i' (sum_j p_ij P_j) A_i > 0   for every mode i   (Costa, Fragoso and Marques 2005, Theorem 3.9).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import matrix_balance

from analysis.constant_lmi import constant_problem, matrix_of
from analysis.errors import AnalysisError
from analysis.markov.system import MarkovJumpSystem
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.lmi.result import LmiResult, Margin, Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve
from synthesis.polynomials.matrix import MatrixPolynomial


@dataclass(frozen=True, repr=False)
class MeanSquareCertificate(Display):
    """Verdict with the Lyapunov matrices (m, n, n) in the states as given, and the margins of the inequalities.

    CERTIFIED: proved by these matrices. REFUTED: the second-moment radius is not below 1, for any
    data that round to these. INCONCLUSIVE: neither.
    """

    verdict: Verdict
    message: str
    lyapunov: FloatArray
    margins: tuple[Margin, ...]
    radius: float
    result: LmiResult


def mean_square_lmi(system: MarkovJumpSystem, settings: LmiSettings | None = None) -> MeanSquareCertificate:
    """Search P_1..P_m, maximising the margin, and check them outside the solver.

    Raises AnalysisError for a batch of systems; ProblemError as `solve`.

    >>> system = MarkovJumpSystem([[[0.5]], [[1.1]]], [[0.9, 0.1], [0.8, 0.2]])
    >>> print(mean_square_lmi(system).verdict)
    certified
    """
    A, P_ij = single(system)
    scale = state_scale(np.abs(A).sum(axis=0))
    A = A * (scale[:, None] / scale)
    m, n = A.shape[:2]
    problem = constant_problem()
    P = [problem.symmetric(f"P{i}", n) for i in range(m)]
    for i in range(m):
        problem.require(f"P{i} > 0", P[i])
        problem.require(f"P{i} < 1", problem.constant(np.eye(n)) - P[i], strict=False)
    for i in range(m):
        step = problem.constant(A[i])
        problem.require(f"decrease from mode {i}", P[i] - step.T @ weighted_sum(P, P_ij[i]) @ step)
    result = solve(problem, settings)
    values = np.stack([matrix_of(result.values[f"P{i}"]) for i in range(m)]) * np.outer(scale, scale)
    radius = float(system.second_moment_radius())
    verdict = result.verdict
    worst = result.tightest
    message = f'{verdict}: tightest "{worst.name}", margin {worst.value:.1e}; second-moment radius {radius:.6g}'
    if verdict is not Verdict.CERTIFIED and system.verdict() is Verdict.REFUTED:
        verdict, message = Verdict.REFUTED, f"refuted: second-moment radius {radius:.6g} is not below 1"
    return MeanSquareCertificate(verdict, message, values, result.margins, radius, result)


def weighted_sum(terms: list[MatrixPolynomial], weights: FloatArray) -> MatrixPolynomial:
    """sum_j w_j P_j."""
    total = terms[0] * float(weights[0])
    for term, weight in zip(terms[1:], weights[1:], strict=True):
        if weight:
            total = total + term * float(weight)
    return total


def state_scale(pattern: FloatArray) -> FloatArray:
    """Diagonal scaling (n,) with x_scaled = scale * x that balances a non-negative matrix."""
    if pattern.shape[0] == 1:
        return np.ones(1)
    _, (scaling, _) = matrix_balance(pattern, permute=False, separate=True)
    return np.asarray(1.0 / scaling)


def single(system: MarkovJumpSystem) -> tuple[FloatArray, FloatArray]:
    """Modes (m, n, n) and transition (m, m) of a system without batch axes. Raises AnalysisError otherwise."""
    if system.batch_shape:
        raise AnalysisError(f"a batch of shape {system.batch_shape} was given; this takes one system at a time")
    return system.modes, system.transition
