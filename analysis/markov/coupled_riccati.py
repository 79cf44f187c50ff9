r"""Mode-dependent linear-quadratic control of a Markov jump system by coupled Riccati equations.

For x+ = A_i x + B_i u, cost sum of E[x' Q_i x + u' R_i u], mode i known (Blair and Sworder 1975; Costa, Fragoso and
Marques 2005, chapter 4), with E_i(X) = sum_j p_ij X_j:

    X_i = Q_i + A_i' E_i A_i - A_i' E_i B_i (R_i + B_i' E_i B_i)^-1 B_i' E_i A_i,    u = F_i x,
    F_i = -(R_i + B_i' E_i B_i)^-1 B_i' E_i A_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import as_stack, positive_definite, positive_semidefinite
from analysis.errors import AnalysisError
from analysis.markov.coupled_lmi import single
from analysis.markov.coupled_lyapunov import solve_coupled_lyapunov
from analysis.markov.system import MarkovJumpSystem
from estimators.arrays import FloatArray
from estimators.display import Display

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

SWEEPS = 20_000  # of value iteration before the system counts as not stabilisable
DIVERGED = 1e60  # growth of the cost, relative to the weights, from which it counts as infinite
NEWTON_STEPS = 50  # policy iteration converges quadratically; more than a dozen means that it does not converge
RESIDUAL = 1e-10  # of the Riccati equations, relative to the largest entry of X, at which a solution is accepted


@dataclass(frozen=True, repr=False)
class JumpRegulator(Display):
    """u = `gains`[mode] x (m, k, n) with cost x' `cost`[mode] x, cost (m, n, n); `radius` of the closed loop is below 1.

    `residual` is the largest error of the Riccati equations relative to the largest entry of the cost.
    """

    gains: FloatArray
    cost: FloatArray
    radius: float
    residual: float
    closed_loop: MarkovJumpSystem


def jump_regulator(
    system: MarkovJumpSystem, inputs: ArrayLike, state_weights: ArrayLike, input_weights: ArrayLike
) -> JumpRegulator:
    """The stabilising solution, by value iteration until the loop is stable and policy iteration from there.

    Args:
        system: one system (no batch), modes (m, n, n).
        inputs: B, shape (n, k) or (m, n, k).
        state_weights: Q >= 0, shape (n, n) or (m, n, n).
        input_weights: R > 0, shape (k, k) or (m, k, k).

    Raises:
        AnalysisError: shapes that do not fit, weights of the wrong sign, or a system that no mode-dependent feedback
            stabilises in the mean square (or whose unstable part no weight sees).

    >>> system = MarkovJumpSystem([[[1.0]]], [[1.0]])
    >>> jump_regulator(system, [[1.0]], [[1.0]], [[1.0]]).gains.round(4).tolist()  # the golden ratio less one
    [[[-0.618]]]
    """
    A, P = single(system)
    m, n = A.shape[:2]
    B = _per_mode("inputs", as_stack("inputs", inputs), m, (n, None))
    k = B.shape[-1]
    Q = _per_mode("state_weights", positive_semidefinite("state_weights", state_weights), m, (n, n))
    R = _per_mode("input_weights", positive_definite("input_weights", input_weights), m, (k, k))
    F = _stabilising(A, B, Q, R, P)
    X = np.zeros_like(A)
    for _ in range(NEWTON_STEPS):
        loop = MarkovJumpSystem(A + B @ F, P)
        previous, X = X, solve_coupled_lyapunov(loop, _symmetric(Q + _t(F) @ R @ F))
        F = policy(A, B, R, P, X)
        if np.abs(X - previous).max() <= 1e-14 * np.abs(X).max():
            break
    residual = float(np.abs(riccati(A, B, Q, R, P, X) - X).max() / max(np.abs(X).max(), np.finfo(float).tiny))
    loop = MarkovJumpSystem(A + B @ F, P)
    radius = float(loop.second_moment_radius())
    if not (loop.is_mean_square_stable() and residual <= RESIDUAL):
        raise AnalysisError(
            f"coupled Riccati equations: residual {residual:.1e}, closed-loop radius {radius:.6g}; scale states and inputs"
        )
    return JumpRegulator(F, X, radius, residual, loop)


def policy(A: FloatArray, B: FloatArray, R: FloatArray, P: FloatArray, X: FloatArray) -> FloatArray:
    """F_i for cost-to-go X."""
    expected = np.einsum("ij,jkl->ikl", P, X)
    return -np.linalg.solve(R + _t(B) @ expected @ B, _t(B) @ expected @ A)


def riccati(A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, P: FloatArray, X: FloatArray) -> FloatArray:
    """Right-hand side of the coupled Riccati equations, in the form that stays symmetric and positive."""
    F = policy(A, B, R, P, X)
    loop = A + B @ F
    return _symmetric(Q + _t(F) @ R @ F + _t(loop) @ np.einsum("ij,jkl->ikl", P, X) @ loop)


def _stabilising(A: FloatArray, B: FloatArray, Q: FloatArray, R: FloatArray, P: FloatArray) -> FloatArray:
    """A feedback whose loop is mean-square stable."""
    X, scale = np.zeros_like(A), max(float(np.abs(Q).max()), float(np.abs(R).max()))
    for sweep in range(SWEEPS):
        previous, X = X, riccati(A, B, Q, R, P, X)
        largest = float(np.abs(X).max())
        if largest > DIVERGED * scale:
            break
        settled = np.abs(X - previous).max() <= 1e-12 * largest
        if (
            settled or (sweep & (sweep + 1)) == 0
        ):  # at powers of two: the loop is stable long before the cost has settled
            F = policy(A, B, R, P, X)
            if float(MarkovJumpSystem(A + B @ F, P).second_moment_radius()) < 1.0:
                return F
        if settled:
            break
    raise AnalysisError(
        "no mode-dependent feedback found that is mean-square stable: either none exists, or the state weights do not see an "
        "unstable direction; check the inputs, or weight every state"
    )


def _per_mode(name: str, array: FloatArray, modes: int, shape: tuple[int, int | None]) -> FloatArray:
    out = np.broadcast_to(array, (modes, *array.shape)) if array.ndim == 2 else array
    want = (modes, shape[0], out.shape[-1] if shape[1] is None else shape[1])
    if out.shape != want or not out.shape[-1]:
        columns = "inputs" if shape[1] is None else shape[1]
        raise AnalysisError(
            f"{name} has the shape {array.shape}; it must be ({shape[0]}, {columns}) or ({modes}, {shape[0]}, {columns})"
        )
    return out


def _t(matrix: FloatArray) -> FloatArray:
    return np.swapaxes(matrix, -1, -2)


def _symmetric(matrix: FloatArray) -> FloatArray:
    return np.asarray(0.5 * (matrix + _t(matrix)))
