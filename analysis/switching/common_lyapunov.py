r"""One quadratic Lyapunov function for all modes: by LMI with a proof either way, and an exact test for two 2 x 2 modes.

continuous  P > 0,  A_i'P + P A_i < 0 for all i;   discrete  P > 0,  A_i'P A_i - P < 0 for all i.

There is none if and only if some X_i >= 0, not all zero, give sum_i (A_i X_i + X_i A_i') >= 0 (or sum_i (A_i X_i A_i' -
X_i) >= 0): multiply by P and take the trace. Both problems are solved; whichever has a positive margin in exact rational
arithmetic decides, whatever the solver said.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import matrix_balance
from scipy.sparse.csgraph import connected_components

from analysis.checks import square
from analysis.constant_lmi import constant_problem, matrix_of
from analysis.errors import AnalysisError
from analysis.exact import Rational, congruence, is_positive, rationals, total
from analysis.mode_objects import state_matrices
from estimators.arrays import FloatArray, IndexArray
from estimators.display import Display
from synthesis.lmi.problem import LmiProblem
from synthesis.lmi.result import Verdict
from synthesis.lmi.settings import LmiSettings
from synthesis.lmi.solve import solve

SETTINGS = LmiSettings(relaxation="vertex")


@dataclass(frozen=True, repr=False)
class CommonLyapunov(Display):
    """CERTIFIED with `P` (n, n), REFUTED with the multipliers `X` (m, k, k), or INCONCLUSIVE with neither proved.

    The multipliers belong to `states`, a diagonal block that no mode leaves and enters again: all states unless some are
    decoupled. `margin` > 0 is how far inside the certificate is: smallest eigenvalue of the named inequalities divided
    by the largest, in balanced coordinates. A solver status is not part of any verdict.
    """

    verdict: Verdict
    message: str
    P: FloatArray | None
    X: FloatArray | None
    states: tuple[int, ...]
    margin: float


def common_quadratic_lyapunov(modes: ArrayLike, discrete: bool | None = None) -> CommonLyapunov:
    """Decide whether the modes, (m, n, n) or a list of objects with A and dt, share a quadratic Lyapunov function.

    Modes that are block triangular in the given states share one if and only if their diagonal blocks do (P is put
    together with growing weights), so decoupled states are taken one block at a time. Raises AnalysisError for modes that
    are not finite square matrices of one size. A common one proves stability under arbitrary switching; none proves
    nothing about it (see `joint_spectral_radius`).

    >>> print(common_quadratic_lyapunov([[[-1.0, 1.0], [0.0, -1.0]], [[-1.0, 0.0], [1.0, -1.0]]]).verdict)
    certified
    """
    matrices, discrete = state_matrices(modes, discrete)
    A = square("modes", matrices, ndim=3)
    if A.ndim != 3 or not len(A):
        raise AnalysisError(f"modes have the shape {A.shape}; give one stack (m, n, n) of at least one mode")
    blocks = coupled_blocks(A)
    found = [_decide(A[:, block[:, None], block], block, discrete) for block in blocks]
    refuted = next((f for f in found if f.verdict is Verdict.REFUTED), None)
    if refuted is not None or len(found) == 1:
        return refuted or found[0]
    weakest = min(found, key=lambda f: f.margin)
    if all(f.P is not None for f in found):
        for exponent in range(0, 40, 2):
            P = np.zeros(A.shape[1:])
            for i, (block, part) in enumerate(zip(blocks, found, strict=True)):
                assert part.P is not None
                P[block[:, None], block] = part.P * 2.0 ** (exponent * i)
            if _certifies(A, P, discrete):
                return replace(weakest, P=P, states=tuple(range(A.shape[-1])))
    message = "inconclusive: every diagonal block has a P, but no weights were found that put them together"
    return CommonLyapunov(Verdict.INCONCLUSIVE, message, None, None, weakest.states, weakest.margin)


def coupled_blocks(modes: FloatArray) -> list[IndexArray]:
    """Sets of states that drive each other in some mode (strong components), driven blocks before those that drive them."""
    pattern = (modes != 0.0).any(axis=0)
    count, label = connected_components(pattern, directed=True, connection="strong")
    blocks = [np.flatnonzero(label == k) for k in range(count)]
    reach = np.linalg.matrix_power(pattern.astype(float) + np.eye(len(pattern)), len(pattern)) > 0.0
    # in x' = A x entry (i, j) lets j drive i; drivers get the larger weights, so they come last
    return sorted(blocks, key=lambda block: -int(reach[block[0]].sum()))


def _decide(A: FloatArray, block: IndexArray, discrete: bool) -> CommonLyapunov:
    """The verdict on one coupled block."""
    states = tuple(int(i) for i in block)
    scale = _balance(A)
    scaled = scale[:, None] * A / scale
    P, primal = _primal(scaled, discrete)
    if P is not None and _certifies(scaled, P, discrete):
        message = "certified: a common P is positive in exact arithmetic"
        return CommonLyapunov(Verdict.CERTIFIED, message, scale[:, None] * P * scale, None, states, primal)
    X, dual = _dual(scaled, discrete)
    if X is not None and _refutes(scaled, X, discrete):
        message = "refuted: multipliers X exclude every common P, in exact arithmetic"
        return CommonLyapunov(Verdict.REFUTED, message, None, X / scale[:, None] / scale, states, dual)
    message = (
        f"inconclusive: best margins {primal:.1e} for a common P and {dual:.1e} against one, and neither is proved in exact "
        "arithmetic; the modes are near the boundary, or in units too far apart"
    )
    return CommonLyapunov(Verdict.INCONCLUSIVE, message, None, None, states, max(primal, dual))


def _primal(A: FloatArray, discrete: bool) -> tuple[FloatArray | None, float]:
    problem = constant_problem()
    P = problem.symmetric("P", A.shape[-1])
    problem.require("P > 0", P)
    problem.require("P < 1", problem.constant(np.eye(A.shape[-1])) - P, strict=False)
    for i, mode in enumerate(A):
        a = problem.constant(mode)
        change = a.T @ P @ a - P if discrete else a.T @ P + P @ a
        problem.require(f"mode {i}", -change * (1.0 / max(1.0, float(np.abs(mode).max()))))
    return _answer(problem, ["P"])


def _dual(A: FloatArray, discrete: bool) -> tuple[FloatArray | None, float]:
    problem = constant_problem()
    names, change, trace = [], None, None
    one = np.eye(A.shape[-1])
    for i, mode in enumerate(A):
        names.append(f"X{i}")
        a, X = problem.constant(mode / max(1.0, float(np.abs(mode).max()))), problem.symmetric(names[-1], len(one))
        problem.require(f"X{i} > 0", X)
        if discrete:
            b = problem.constant(mode)
            term = b @ X @ b.T - X
        else:
            term = a @ X + X @ a.T
        change = term if change is None else change + term
        trace = X if trace is None else trace + X
    assert change is not None and trace is not None
    problem.require("change", change)
    problem.require("size", problem.constant(one) - trace, strict=False)
    found, margin = _answer(problem, names)
    if found is not None and not discrete:  # X_i of the modes as they were given
        found = found / np.maximum(1.0, np.abs(A).max(axis=(-2, -1)))[:, None, None]
    return found, margin


def _answer(problem: LmiProblem, names: list[str]) -> tuple[FloatArray | None, float]:
    """Values of the unknowns and the smallest relative margin of the engine's own re-evaluation."""
    result = solve(problem, SETTINGS)
    if not result.margins:
        return None, float("-inf")
    values = np.stack([matrix_of(result.values[name]) for name in names])
    values = 0.5 * (values + values.swapaxes(-1, -2))
    margin = min(entry.value for entry in result.margins)
    return (values[0] if names == ["P"] else values), margin


def _certifies(A: FloatArray, P: FloatArray, discrete: bool) -> bool:
    """P > 0 and every change < 0, in exact rational arithmetic on the scaled modes as stored."""
    exact = rationals(P)
    return is_positive(exact) and all(is_positive(_change(rationals(mode.T), exact, discrete) * -1) for mode in A)


def _refutes(A: FloatArray, X: FloatArray, discrete: bool) -> bool:
    """All X_i > 0 and the sum of the dual changes > 0, exactly."""
    if not all(is_positive(rationals(x)) for x in X):
        return False
    return is_positive(total([_change(rationals(a), rationals(x), discrete) for a, x in zip(A, X, strict=True)]))


def _change(left: Rational, middle: Rational, discrete: bool) -> Rational:
    """left middle left' - middle, or left middle + (left middle)'."""
    if discrete:
        return congruence(left, middle) - middle
    product = left * middle
    return product + product.transpose()


def _balance(A: FloatArray) -> FloatArray:
    """Powers of two that balance rows and columns of the mean size of the modes, so that scaling is free of rounding."""
    _, (scaling, _) = matrix_balance(np.abs(A).sum(axis=0), permute=False, separate=True)
    return np.asarray(2.0 ** -np.round(np.log2(scaling)))
