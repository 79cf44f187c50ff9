r"""Bounds by a fixed change of coordinates: P3 Proposition 1, (16)-(18), and (20), with the constants corrected.

With e_bar = T e, A_bar = T A T^-1, B_bar = T B, A_s = (A_bar + A_bar')/2 and V = e_bar'e_bar / 2, Young's inequality gives

    V' <= (lambda_max(A_s) + eps/2) |e_bar|^2 + lambda_max(B_bar'B_bar) |rho|^2 / (2 eps) <= eta1 V + eta2       (16)

(P3 prints half of both terms of Young's inequality, which is false: take B_bar rho = eps e_bar. Conclusions survive.)
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from analysis.checks import as_stack, positive, square
from analysis.errors import AnalysisError
from analysis.mode_objects import state_matrices
from estimators.arrays import FloatArray
from estimators.display import Display


@dataclass(frozen=True, repr=False)
class SimilarityBound(Display):
    """V' <= eta1 V + eta2, worst case over the stack: `eta1` in 1/s, `eta2` in the unit of V per second."""

    shown_units: ClassVar = {"eta1": "1/s", "growth": "1/s"}

    eta1: float
    eta2: float
    growth: float  # largest lambda_max(A_s)
    epsilon: float
    T: FloatArray

    @property
    def bounded(self) -> bool:
        """eta1 < 0 is what proves boundedness (P3 says eta2/eta1 < 0)."""
        return self.eta1 < 0.0

    def energy(self, time: ArrayLike, initial: float) -> FloatArray:
        """Bound on V(t) from V(0) (17): e^(eta1 t)(V(0) + eta2/eta1) - eta2/eta1; grows linearly for eta1 = 0."""
        t = as_stack("time", time, ndim=0)
        if (t < 0.0).any() or not initial >= 0.0:
            raise AnalysisError("time and initial energy must not be negative")
        if self.eta1 == 0.0:
            return np.asarray(initial + self.eta2 * t)
        return np.asarray(np.exp(self.eta1 * t) * initial + self.eta2 * np.expm1(self.eta1 * t) / self.eta1)

    def transformed_error(self, time: ArrayLike, initial: ArrayLike) -> FloatArray:
        """Bound on |T e(t)| from e(0) (18)."""
        start = 0.5 * float(np.sum((self.T @ as_stack("initial error", initial, ndim=1)) ** 2))
        return np.sqrt(2.0 * self.energy(time, start))


@dataclass(frozen=True, repr=False)
class DiagonalTransform(Display):
    """Best T = diag(gamma, 1) for 2 x 2 matrices: `growth` = lambda_max(A_s) with it, arrays over the leading axes.

    Where `attained` is false the infimum needs gamma -> 0 or infinity (a triangular matrix); `gamma` is 0 or inf there.
    """

    gamma: FloatArray
    growth: FloatArray
    attained: FloatArray


def symmetric_growth(A: ArrayLike, T: ArrayLike | None = None) -> FloatArray:
    """lambda_max of the symmetric part of T A T^-1 for a stack A (..., n, n): the growth rate of |T e| in 1/s.

    A may be a continuous-time object with A and dt, or a list of such, here and below.

    >>> float(symmetric_growth([[-1.0, 4.0], [0.0, -1.0]]))  # the norm grows at first, although the system is stable
    1.0
    """
    moved = _matrices("A", A)
    if T is not None:
        moved = _transformed(moved, T)
    return np.asarray(np.linalg.eigvalsh(0.5 * (moved + np.swapaxes(moved, -1, -2)))[..., -1])


def similarity_bound(
    A: ArrayLike, B: ArrayLike, T: ArrayLike, disturbance: float, epsilon: float | None = None
) -> SimilarityBound:
    """(16) for e' = A e + B rho with |rho| <= `disturbance`, the worst case of stacks A (..., n, n), B (..., n, m).

    eta1 = 2 (lambda_max(A_s) + eps/2), eta2 = lambda_max(B_bar'B_bar) disturbance^2 / (2 eps). Without `epsilon` it is
    |lambda_max(A_s)|, which makes the final bound -eta2/eta1 on V least. Raises AnalysisError for a singular T, matrices
    that do not fit, and a negative disturbance.

    >>> import numpy as np
    >>> similarity_bound([[-1.0, 0.0], [0.0, -2.0]], [[1.0], [0.0]], np.eye(2), disturbance=0.5).bounded
    True
    """
    a, b = _some("A", _matrices("A", A)), _some("B", as_stack("B", B))
    t = _transform(T, a.shape[-1])
    if b.shape[-2] != a.shape[-1]:
        raise AnalysisError(f"B has {b.shape[-2]} rows for {a.shape[-1]} states")
    if not (np.isfinite(disturbance) and disturbance >= 0.0):
        raise AnalysisError(f"disturbance bound {disturbance} must be finite and not negative")
    growth = float(symmetric_growth(a, t).max())
    chosen = positive("epsilon", abs(growth) or 1.0 if epsilon is None else epsilon)
    force = float(np.linalg.norm(t @ b, 2, axis=(-2, -1)).max()) ** 2
    return SimilarityBound(2.0 * growth + chosen, force * disturbance**2 / (2.0 * chosen), growth, chosen, t)


def best_diagonal_transform(A: ArrayLike) -> DiagonalTransform:
    r"""argmin over gamma > 0 of lambda_max(sym(T A T^-1)), T = diag(gamma, 1), A = [[a, b], [c, d]] (..., 2, 2), closed form.

    The off-diagonal entry of the symmetric part is (gamma b + c/gamma)/2. For b c > 0 gamma* = sqrt(c/b) makes T A T^-1
    symmetric, so the growth is the largest eigenvalue of A itself, and no quadratic form does better. For b c < 0
    gamma* = sqrt(-c/b) removes the entry: max(a, d). For b c = 0 that is the infimum, attained only if b = c = 0.

    >>> round(float(best_diagonal_transform([[-1.0, 4.0], [1.0, -3.0]]).growth), 6)  # an eigenvalue of A
    0.236068
    """
    array = _matrices("A", A)
    if array.shape[-1] != 2:
        raise AnalysisError(f"the closed form is for 2 states, not {array.shape[-1]}; use common_quadratic_lyapunov")
    a, b, c, d = array[..., 0, 0], array[..., 0, 1], array[..., 1, 0], array[..., 1, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        gamma = np.where(b == 0.0, np.where(c == 0.0, 1.0, np.inf), np.sqrt(np.abs(c / b)))
    entry = np.sqrt(np.maximum(b * c, 0.0))
    growth = 0.5 * (a + d) + np.hypot(0.5 * (a - d), entry)
    return DiagonalTransform(gamma, growth, np.asarray((b * c != 0.0) | ((b == 0.0) & (c == 0.0))))


def diagonal_window(A: ArrayLike) -> tuple[FloatArray, FloatArray]:
    r"""The open interval of gamma > 0 for which sym(T A T^-1) < 0, T = diag(gamma, 1), for each 2 x 2 matrix; NaN if none.

    |gamma b + c/gamma| < 2 sqrt(a d) with a, d < 0, so with s = sqrt(a d) and q = sqrt(a d - b c) it is
    (|s - q|/|b|, (s + q)/|b|). Matrices share a diagonal T if and only if their windows meet.

    >>> lower, upper = diagonal_window([[-1.0, 4.0], [0.0, -1.0]])
    >>> float(lower), float(upper)
    (0.0, 0.5)
    """
    array = _matrices("A", A)
    if array.shape[-1] != 2:
        raise AnalysisError(f"the closed form is for 2 states, not {array.shape[-1]}")
    a, b, c, d = array[..., 0, 0], array[..., 0, 1], array[..., 1, 0], array[..., 1, 1]
    good = (a < 0.0) & (d < 0.0) & (a * d - b * c > 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        s, q, size = np.sqrt(a * d), np.sqrt(a * d - b * c), np.abs(b)
        low = np.where(size > 0.0, np.abs(s - q) / size, np.abs(c) / (2.0 * s))
        high = np.where(size > 0.0, (s + q) / size, np.inf)
    return np.where(good, low, np.nan), np.where(good, high, np.nan)


def common_growth(modes: ArrayLike, T: ArrayLike) -> float:
    """lambda_bar of (20): the largest 2 lambda_max(sym(T A T^-1)) over all modes and parameter values (..., n, n), in 1/s.

    Negative proves stability under arbitrary switching; positive proves nothing except that this T does not.

    >>> import numpy as np
    >>> common_growth([[[-1.0, 0.0], [0.0, -2.0]], [[-3.0, 0.0], [0.0, -1.0]]], np.eye(2))
    -2.0
    """
    return 2.0 * float(symmetric_growth(_some("modes", _matrices("modes", modes)), T).max())


def _matrices(name: str, A: ArrayLike) -> FloatArray:
    return square(name, state_matrices(A, discrete=False)[0])


def _some(name: str, stack: FloatArray) -> FloatArray:
    """The stack, which must hold a matrix: the worst case of none is no number."""
    if not stack.size:
        raise AnalysisError(f"{name} has the shape {stack.shape}; give at least one matrix")
    return stack


def _transform(T: ArrayLike, size: int) -> FloatArray:
    t = square("T", T)
    if t.shape != (size, size):
        raise AnalysisError(f"T has the shape {t.shape}; {size} states need ({size}, {size})")
    if np.linalg.cond(t) > 1e15:
        raise AnalysisError("T is singular; a change of coordinates must be invertible")
    return t


def _transformed(A: FloatArray, T: ArrayLike) -> FloatArray:
    t = _transform(T, A.shape[-1])
    return np.asarray(t @ A @ np.linalg.inv(t))
