"""Staircase forms: what a pair sees, and what it never sees, separated by orthogonal transformations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.errors import AnalysisError
from analysis.observability.pairs import EPSILON, driven_pair, observed_pair, unit_pair
from estimators.arrays import ComplexArray, FloatArray, IntArray
from estimators.display import Display

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, repr=False)
class Staircase(Display):
    r"""Orthogonal T (n, n) with T'AT = [[A_seen, 0], [*, A_hidden]], C T = [C_seen, 0], but for `residual`.

    For controllability everything is transposed: T'AT = [[A_reached, *], [0, A_unreached]], T'B = [B_reached; 0]. `stages` are
    the ranks of the steps, their sum is `order`. `residual` is the spectral norm of what was set to zero, A in units of |A|
    and C of |C|: a pair that near to the given one has exactly this hidden part.
    """

    A: FloatArray
    outer: FloatArray
    transform: FloatArray
    stages: tuple[int, ...]
    residual: float
    tolerance: float

    @property
    def order(self) -> int:
        """Number of states seen (reached)."""
        return sum(self.stages)

    @property
    def hidden_basis(self) -> FloatArray:
        """Orthonormal basis (n, n - order): of the unobservable subspace, or of what is orthogonal to all that is reached."""
        return self.transform[:, self.order :]

    @property
    def seen_basis(self) -> FloatArray:
        """Orthonormal basis (n, order): of the reachable subspace, or of what is orthogonal to all that is hidden."""
        return self.transform[:, : self.order]

    @property
    def hidden_modes(self) -> ComplexArray:
        """Eigenvalues of the hidden (unreached) part, (n - order,), 1/s or per sample."""
        return np.asarray(np.linalg.eigvals(self.A[self.order :, self.order :]), complex)


def observability_staircase(A: Any, C: ArrayLike | None = None, tolerance: float | None = None) -> Staircase:
    r"""Staircase form of A (n, n), C (m, n), or of a system object.

    As SLICOT's AB01ND on the dual pair; MATLAB's obsvf has the seen part last.

    Each step finds by singular values what the last one sees of the rest. A singular value counts if it is above `tolerance`
    times |A| (|C| in the first step); default 8 n eps, which suits data that is exact but for rounding: give the relative
    error of measured data. The decisions depend on units; `detectable` balances them first [Paige1981].
    Raises AnalysisError for shapes that do not fit, values not finite, several pairs at once and a tolerance outside [0, 1).

    >>> observability_staircase([[1.0, 0.0], [0.0, -2.0]], [[0.0, 1.0]]).hidden_modes.tolist()
    [(1+0j)]
    """
    A, C, _ = observed_pair(A, C, False if _is_open(A) else None)
    return _single(A, C, tolerance)


def controllability_staircase(A: Any, B: ArrayLike | None = None, tolerance: float | None = None) -> Staircase:
    """The same of A (n, n), B (n, m): the controllable part first (SLICOT AB01ND; MATLAB ctrbf with the parts exchanged).

    >>> controllability_staircase([[1.0, 0.0], [0.0, -2.0]], [[1.0], [0.0]]).hidden_modes.tolist()
    [(-2+0j)]
    """
    A, B, _ = driven_pair(A, B, False if _is_open(A) else None)
    found = _single(A, B, tolerance)
    return Staircase(found.A.T, found.outer.T, found.transform, found.stages, found.residual, found.tolerance)


def rounding_tolerance(states: int) -> float:
    """What orthogonal transformations of exact data leave: 8 n eps."""
    return 8.0 * states * EPSILON


@dataclass(frozen=True)
class Separation:
    """Staircase of a stack: T (count, n, n), hidden directions (count,), `stages` (count, n), residual (count,)."""

    transform: FloatArray
    hidden: IntArray
    stages: IntArray
    residual: FloatArray


def separate(A: FloatArray, C: FloatArray, tolerance: float) -> Separation:
    """Staircase of pairs A (count, n, n), C (count, m, n) of unit size; pairs of equal ranks go on together."""
    count, n = A.shape[0], A.shape[-1]
    transform = np.broadcast_to(np.eye(n), (count, n, n)).copy()
    hidden, stages, residual = np.zeros(count, int), np.zeros((count, n), int), np.zeros(count)
    waiting = [(np.arange(count), A, C, 0, 0)]
    while waiting:
        place, rest, sees, done, stage = waiting.pop()
        _, values, right = np.linalg.svd(sees, full_matrices=True)
        rank = (values > tolerance).sum(axis=-1)
        below = np.where(values > tolerance, 0.0, values).max(axis=-1, initial=0.0)
        residual[place] = np.hypot(residual[place], below)
        hidden[place[rank == 0]] = n - done
        for r in (int(r) for r in np.unique(rank[rank > 0])):
            chosen = rank == r
            here, V = place[chosen], np.swapaxes(right[chosen], -1, -2)
            transform[here, :, done:] = transform[here, :, done:] @ V
            stages[here, stage] = r
            if done + r < n:
                moved = np.swapaxes(V, -1, -2) @ rest[chosen] @ V
                waiting.append((here, moved[:, r:, r:], moved[:, :r, r:], done + r, stage + 1))
    return Separation(transform, hidden, stages, residual)


def _single(A: FloatArray, C: FloatArray, tolerance: float | None) -> Staircase:
    if A.ndim != 2:
        raise AnalysisError(
            f"A has the shape {A.shape}; a staircase is made of one pair (n, n), hautus_test takes stacks"
        )
    used = rounding_tolerance(A.shape[-1]) if tolerance is None else tolerance
    if not 0.0 <= used < 1.0:
        raise AnalysisError(f"tolerance = {tolerance} must lie in [0, 1); it is relative to |A| and |C|")
    unit_A, unit_C, _ = unit_pair(A, C)
    found = separate(unit_A[None], unit_C[None], used)
    T = found.transform[0]
    stages = tuple(int(r) for r in found.stages[0] if r)
    return Staircase(T.T @ A @ T, C @ T, T, stages, float(found.residual[0]), used)


def _is_open(system: Any) -> bool:
    """An object that does not say its time: a staircase does not need it."""
    return getattr(system, "dt", 0) is None
