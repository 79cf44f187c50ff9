r"""Coupled Lyapunov equations of a Markov jump system (Costa, Fragoso and Marques 2005, chapter 3).

    cost         P_i = W_i + A_i' (sum_j p_ij P_j) A_i      sum over k of E[x' W x] = sum_i tr(P_i X_i(0))
    covariance   X_j = sum_i p_ij (A_i X_i A_i' + pi_i N_i)  of x+ = A_i x + noise, in the long run

Both are linear in n(n+1)/2 m unknowns, with the second-moment operator or its transpose.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import positive_semidefinite
from analysis.errors import AnalysisError
from analysis.markov.second_moment import pack, unpack
from analysis.markov.system import MarkovJumpSystem
from estimators.arrays import FloatArray
from synthesis.lmi.result import Verdict

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def solve_coupled_lyapunov(system: MarkovJumpSystem, weights: ArrayLike) -> FloatArray:
    """P_i of the cost equation for W_i >= 0, shapes (..., m, n, n).

    Raises AnalysisError for weights that do not fit or are not positive semidefinite, and for a system that is not
    mean-square stable: its equation may have a solution, but that is not the (infinite) cost.

    >>> system = MarkovJumpSystem([[[0.5]]], [[1.0]])
    >>> solve_coupled_lyapunov(system, [[[1.0]]]).round(6).tolist()  # 1/(1 - 1/4)
    [[[1.333333]]]
    """
    W = _per_mode(system, "weights", weights)
    _require_stable(system, "the cost is infinite")
    return _solve(system, W, transposed=True)


def stationary_second_moment(system: MarkovJumpSystem, noise: ArrayLike) -> FloatArray:
    """X_j of x+ = A_i x + w, E[w w' | mode i] = N_i >= 0 white, shapes (..., m, n, n); sum over j for E[x x'].

    Raises AnalysisError as `solve_coupled_lyapunov`, or if the stationary distribution is not unique.

    >>> system = MarkovJumpSystem([[[0.5]]], [[1.0]])
    >>> stationary_second_moment(system, [[[1.0]]]).round(6).tolist()  # 1/(1 - 1/4)
    [[[1.333333]]]
    """
    N = _per_mode(system, "noise", noise)
    _require_stable(system, "the second moment grows without bound")
    pi = system.stationary_distribution()
    source = np.einsum("...ij,...i,...ikl->...jkl", system.transition, pi, N)
    return _solve(system, source, transposed=False)


def expected_cost(
    system: MarkovJumpSystem, weights: ArrayLike, second_moment: ArrayLike, mode_distribution: ArrayLike
) -> FloatArray:
    """sum over k >= 0 of E[x(k)' W_mode x(k)] for E[x(0) x(0)'] = second_moment (..., n, n); inf where it diverges.

    Raises AnalysisError for arguments that do not fit.

    >>> system = MarkovJumpSystem([[[0.5]]], [[1.0]])
    >>> round(float(expected_cost(system, [[[1.0]]], [[1.0]], [1.0])), 6)  # 1 / (1 - 0.5^2)
    1.333333
    """
    W = _per_mode(system, "weights", weights)
    X = system.initial_second_moment(second_moment, mode_distribution)
    verdict = np.asarray(system.verdict())
    stable = verdict == Verdict.CERTIFIED
    if stable.all():
        P = _solve(system, W, transposed=True)
        return np.asarray(np.einsum("...ikl,...ilk->...", P, X))
    if stable.ndim:
        raise AnalysisError(
            f"{int((~stable).sum())} of {stable.size} systems are not mean-square stable, or too close to the border to "
            f"tell (first at {[int(k) for k in np.argwhere(~stable)[0]]}); their cost is infinite or undefined: leave them out"
        )
    if verdict == Verdict.INCONCLUSIVE:
        raise AnalysisError(_undecided(system, ()))
    # Both sums lie in the interior of the cone only if the start excites, and the weight sees, the growing direction.
    if _fills(system.second_moment_operator, X) and _fills(np.swapaxes(system.second_moment_operator, -1, -2), W):
        return np.asarray(np.inf)
    raise AnalysisError(
        f"the system is not mean-square stable (second-moment radius {float(system.second_moment_radius()):.6g}), and this start "
        "or these weights leave out some of its directions: leave those states out of the model, or give definite matrices"
    )


def _fills(operator: FloatArray, start: FloatArray) -> bool:
    """Whether the matrices that the operator makes of `start` within m n steps are positive definite together."""
    m, n = start.shape[-3:-1]
    vector = pack(start).reshape(-1)
    total = np.zeros_like(vector)
    for _ in range(m * n):
        size = float(np.linalg.norm(vector))
        if size == 0.0:
            break
        vector = vector / size
        total += vector
        vector = operator @ vector
    eigenvalues = np.linalg.eigvalsh(unpack(total.reshape(m, -1), n))
    return bool((eigenvalues[:, 0] > 1e-12 * eigenvalues[:, -1].max()).all())


def _per_mode(system: MarkovJumpSystem, name: str, array: ArrayLike) -> FloatArray:
    out = positive_semidefinite(name, array)
    shape = (system.mode_count, system.size, system.size)
    if out.shape[-2:] != shape[-2:]:
        raise AnalysisError(f"{name} has the shape {out.shape}; it must end in {shape} or {shape[1:]}")
    if out.ndim == 2:
        out = np.broadcast_to(out, shape)
    if out.shape[-3] not in (1, shape[0]):
        raise AnalysisError(f"{name} has the shape {out.shape}; it must end in {shape}, one matrix a mode")
    return np.broadcast_to(out, (*out.shape[:-3], *shape))


def _require_stable(system: MarkovJumpSystem, consequence: str) -> None:
    verdict = np.asarray(system.verdict())
    for bad in (Verdict.REFUTED, Verdict.INCONCLUSIVE):
        if not (verdict == bad).any():
            continue
        worst = tuple(int(k) for k in np.argwhere(verdict == bad)[0])
        if bad is Verdict.INCONCLUSIVE:
            raise AnalysisError(_undecided(system, worst))
        place = f" (system {list(worst)})" if worst else ""
        radius = float(system.second_moment_radius()[worst])
        raise AnalysisError(
            f"the system is not mean-square stable: second-moment radius {radius:.6g}{place}, so {consequence}"
        )


def _undecided(system: MarkovJumpSystem, place: tuple[int, ...]) -> str:
    lower, upper = (float(bound[place]) for bound in system.radius_bounds())
    where = f" of system {list(place)}" if place else ""
    return (
        f"mean-square stability{where} is undecided at this precision: the second-moment radius lies between "
        f"1 - {1.0 - lower:.1e} and 1 + {upper - 1.0:.1e} for matrices that round to these; give more digits"
    )


def _solve(system: MarkovJumpSystem, source: FloatArray, *, transposed: bool) -> FloatArray:
    operator = system.second_moment_operator
    if transposed:
        operator = np.swapaxes(operator, -1, -2)  # svec is an isometry, so the transpose is the adjoint
    vector = pack(source).reshape(*source.shape[:-3], operator.shape[-1])
    found: FloatArray = np.asarray(
        np.linalg.solve(np.eye(operator.shape[-1]) - operator, vector[..., None])[..., 0], float
    )
    return unpack(
        found.reshape(*found.shape[:-1], system.mode_count, system.size * (system.size + 1) // 2), system.size
    )
