r"""Gramians, Hankel singular values and balanced realisations of stable time-invariant systems.

Gramians are computed as factors, X = L L', so that small Hankel singular values keep their digits. (Of windows of
time-varying sequences: `analysis.observability.gramians`.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.checks import as_stack, leading, square
from analysis.errors import AnalysisError
from analysis.norms.frequency_response import read_systems
from analysis.norms.stability import require_stable
from analysis.state_space import given_pair, state_space
from estimators.arrays import FloatArray
from estimators.display import Display

if TYPE_CHECKING:
    import control
    from numpy.typing import ArrayLike

DOUBLINGS = 64  # covers spectral radii up to 1 - 2^-60
TOO_NEAR = "a gramian did not converge: a pole is within 1e-16 of the stability boundary; check the model"
RESIDUAL = 1e-9  # of a Lyapunov equation, relative to its terms
BALANCED = 1e-6  # of the recomputed gramians of a balanced realisation, relative to the Hankel singular values


@dataclass(frozen=True, repr=False)
class BalancedRealization(Display):
    r"""A `control.StateSpace` whose gramians are both diag(`singular_values`), x = `transformation` x_balanced.

    `singular_values` (n,) are those of the given system, descending; of fewer kept states `error_bound` = 2 sum of those left
    out is at least the H-infinity norm of the error [Glover1984].
    """

    system: control.StateSpace
    singular_values: FloatArray
    transformation: FloatArray
    error_bound: float


def controllability_gramian(A: Any, B: ArrayLike | None = None, discrete: bool | None = None) -> FloatArray:
    r"""X with A X + X A' + B B' = 0, or X = A X A' + B B': (..., n, n) for stacks A (..., n, n), B (..., n, m) or a system
    object.

    Raises AnalysisError for systems that are not certainly stable, and where the equation is not satisfied when recomputed.

    >>> controllability_gramian([[-2.0]], [[1.0]]).round(12).tolist()  # 1/(2 * 2)
    [[0.25]]
    """
    A, B, discrete = given_pair(A, B, discrete, "B")
    return _gramian(square("A", A), as_stack("B", B), discrete)


def observability_gramian(A: Any, C: ArrayLike | None = None, discrete: bool | None = None) -> FloatArray:
    r"""Y with A'Y + Y A + C'C = 0, or Y = A'Y A + C'C: (..., n, n) for stacks A (..., n, n), C (..., p, n) or a system
    object.

    Raises AnalysisError for systems that are not certainly stable, and where the equation is not satisfied when recomputed.

    >>> observability_gramian([[-2.0]], [[1.0]]).round(12).tolist()  # 1/(2 * 2)
    [[0.25]]
    """
    A, C, discrete = given_pair(A, C, discrete, "C")
    return _gramian(np.swapaxes(square("A", A), -1, -2), np.swapaxes(as_stack("C", C), -1, -2), discrete)


def hankel_singular_values(
    A: Any,
    B: ArrayLike | None = None,
    C: ArrayLike | None = None,
    D: ArrayLike | None = None,
    discrete: bool | None = None,
) -> FloatArray:
    r"""sqrt(lambda_i(X Y)), descending, (..., n), from controllability gramian X and observability gramian Y; D does not
    matter.

    Stacks or a system object as in `hinf_norm`. Raises AnalysisError for systems that are not certainly stable.

    >>> hankel_singular_values([[-2.0]], [[1.0]], [[1.0]]).round(12).tolist()  # half of the gain at zero frequency
    [0.25]
    """
    shape, systems = read_systems(A, B, C, D, discrete)
    require_stable(systems.A, systems.discrete)
    reached, seen = _factors(systems.A, systems.B, systems.C, systems.discrete)
    values = np.linalg.svd(np.swapaxes(seen, -1, -2) @ reached, compute_uv=False)
    return np.asarray(values.reshape(*shape, values.shape[-1]))


def balanced_realization(
    A: Any, B: ArrayLike | None = None, C: ArrayLike | None = None, D: ArrayLike | None = None,
    discrete: bool | None = None, order: int | None = None,
) -> BalancedRealization:  # fmt: skip
    r"""The balanced realisation of one system (square-root method), or its truncation to `order` states.

    The result keeps the sample time of an object; arrays of a discrete system give dt = True. Raises AnalysisError for
    stacks, for systems that are not certainly stable, for systems that are not minimal (give `order`), and where the
    recomputed gramians are not balanced.

    >>> found = balanced_realization([[-1.0, 0.0], [0.0, -2.0]], [[1.0], [1.0]], [[1.0, 1.0]])
    >>> found.singular_values.round(4).tolist()  # Hankel singular values
    [0.731, 0.019]
    """
    shape, systems = read_systems(A, B, C, D, discrete)
    if shape:
        raise AnalysisError(f"a balanced realisation is of one system; A has leading axes {shape}")
    require_stable(systems.A, systems.discrete)
    reached, seen = (L[0] for L in _factors(systems.A, systems.B, systems.C, systems.discrete))
    left, values, right = np.linalg.svd(seen.T @ reached)
    n = len(values)
    least = int((values > n * np.finfo(float).eps * values[0]).sum())
    kept = n if order is None else order
    if not 1 <= kept <= least:
        raise AnalysisError(
            f"order = {kept}: of {n} Hankel singular values {least} are above rounding; give order = 1 to {least}"
            if least
            else "nothing is both controllable and observable; there is nothing to balance"
        )
    root = np.sqrt(values[:kept])
    T, inverse = reached @ right[:kept].T / root, (left[:, :kept] / root).T @ seen.T
    A_, B_, C_ = inverse @ systems.A[0] @ T, inverse @ systems.B[0], systems.C[0] @ T
    for factor in _factors(A_[None], B_[None], C_[None], systems.discrete):
        off = np.abs(factor[0] @ factor[0].T - np.diag(values[:kept])) / np.sqrt(np.outer(values[:kept], values[:kept]))
        if kept == n and off.max() > BALANCED:
            raise AnalysisError(
                f"the recomputed gramians differ from the Hankel singular values by {off.max():.1e}; give a smaller order"
            )
    system = state_space(A_, B_, C_, systems.D[0], A, systems.discrete)
    return BalancedRealization(system, values, T, float(2.0 * values[kept:].sum()))


def gramian_factor(A: FloatArray, B: FloatArray, discrete: bool) -> FloatArray:
    r"""L (g, n, k) with L L' = sum_k A^k B B' A'^k, or int e^(A t) B B' e^(A' t) dt, of stable A (g, n, n), B (g, n, m).

    Doubling (Smith) of the factor: L <- [L, A L], A <- A A. Raises AnalysisError if it does not converge.
    """
    n = A.shape[-1]
    A, factor = summed(A, B, discrete)
    for _ in range(DOUBLINGS):
        step = A @ factor
        size = np.sqrt((factor * factor).sum(axis=-1))  # each state against its own size: they differ in theirs
        if not (np.sqrt((step * step).sum(axis=-1)) > 1e-17 * size).any():
            return factor
        factor = np.concatenate([factor, step], axis=-1)
        if factor.shape[-1] > n:
            factor = np.swapaxes(np.linalg.qr(np.swapaxes(factor, -1, -2), mode="r"), -1, -2)
        A = A @ A
    raise AnalysisError(TOO_NEAR)


def gramian_matrix(A: FloatArray, B: FloatArray, discrete: bool) -> FloatArray:
    """L L' of `gramian_factor` (g, n, n) by X <- X + A X A': half the time, and small values lose digits."""
    A, B = summed(A, B, discrete)
    X = B @ np.swapaxes(B, -1, -2)
    for _ in range(DOUBLINGS):
        step = A @ X @ np.swapaxes(A, -1, -2)
        X = X + step
        size = np.sqrt(np.maximum(np.einsum("gii->gi", X), 0.0))
        if not (np.abs(step) > 1e-17 * size[:, :, None] * size[:, None, :]).any():
            return X
        A = A @ A
    raise AnalysisError(TOO_NEAR)


def summed(A: FloatArray, B: FloatArray, discrete: bool) -> tuple[FloatArray, FloatArray]:
    """A discrete system with the same gramian: s = c (z - 1)/(z + 1) with c the geometric middle of the pole sizes.

    Stiffness costs doublings, not accuracy.
    """
    if discrete or not len(A):
        return A, B
    size, eye = np.abs(np.linalg.eigvals(A)), np.eye(A.shape[-1])
    middle = np.sqrt(size.min(axis=-1) * size.max(axis=-1))[:, None, None]
    inverse = np.linalg.inv(middle * eye - A)
    return inverse @ (middle * eye + A), np.sqrt(2.0 * middle) * (inverse @ B)


def _factors(A: FloatArray, B: FloatArray, C: FloatArray, discrete: bool) -> tuple[FloatArray, FloatArray]:
    dual = np.swapaxes(A, -1, -2), np.swapaxes(C, -1, -2)
    return gramian_factor(A, B, discrete), gramian_factor(*dual, discrete)


def _gramian(A: FloatArray, B: FloatArray, discrete: bool) -> FloatArray:
    """The gramian with its equation recomputed."""
    n = A.shape[-1]
    if B.shape[-2] != n or not B.shape[-1]:
        raise AnalysisError(f"inputs (or outputs) have the shape {B.shape}, which does not fit {n} states")
    shape = leading({"A": A, "B": B})
    A, B = (np.broadcast_to(M, (*shape, *M.shape[-2:])).reshape(-1, *M.shape[-2:]) for M in (A, B))
    require_stable(A, discrete)
    factor = gramian_factor(A, B, discrete)
    At, X, Q = np.swapaxes(A, -1, -2), factor @ np.swapaxes(factor, -1, -2), B @ np.swapaxes(B, -1, -2)
    size = np.sqrt(np.einsum("gii->gi", X))
    if discrete:
        residual, terms = A @ X @ At + Q - X, (np.abs(A) @ size[..., None])[..., 0] + size
    else:
        residual, terms = A @ X + X @ At + Q, (np.abs(A) @ size[..., None])[..., 0]
    # |x_ij| <= size_i size_j: the terms of each entry, whatever the units of the states
    scale = terms[:, :, None] * (terms if discrete else size)[:, None] + (
        0.0 if discrete else size[:, :, None] * terms[:, None]
    )
    wrong = np.abs(residual) > RESIDUAL * scale
    if wrong.any():
        member = int(np.argwhere(wrong)[0][0])
        raise AnalysisError(
            f"the gramian of system {member} leaves a residual of {np.abs(residual[member]).max():.1e} in its equation; "
            "a pole is too near the stability boundary"
        )
    return np.asarray(X.reshape(*shape, n, n))
