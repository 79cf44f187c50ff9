r"""Two-sided bounds of a second-moment radius from any positive definite matrices, without its operator as a matrix.

The operator (T X)_j = sum_i p_ij A_i X_i A_i' leaves the cone of (X_1, ..., X_m), X_j >= 0, invariant. For X_j = L_j L_j' > 0
(Collatz and Wielandt; Krein and Rutman)

    min_j s_min(W_j)^2 <= radius <= max_j s_max(W_j)^2,    W_j = L_j^-1 [sqrt(p_1j) A_1 L_1, ..., sqrt(p_mj) A_m L_m],

with singular values s: equality holds at the eigenvector. Nobody has to believe how X was found. L is a matrix of floats,
so X is exact; what rounding does to W_j is bounded by |L_j^-1| |A_i| |L_i|, and the same bound carries a relative error of
every entry of A_i (Minkowski's inequality moves singular values by no more). The answer therefore holds for every system
within that error. In continuous time, with (T X)_j = A_j X_j + X_j A_j' + sum_i q_ij X_i, the eigenvalues of L_j^-1 (T X)_j
L_j^-T bound the abscissa.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from analysis.markov.enclosure import DATA, EPS
from estimators.arrays import BoolArray, FloatArray


class Bracket(NamedTuple):
    """lower <= radius (or abscissa) <= upper, for every system whose entries are these up to their rounding."""

    lower: float
    upper: float

    @property
    def width(self) -> float:
        """Relative to the larger end; inf where one side is open."""
        size = max(abs(self.lower), abs(self.upper))
        if size == 0.0:
            return 0.0
        return (self.upper - self.lower) / size if size < np.inf else np.inf

    @property
    def middle(self) -> float:
        """The mean of both ends."""
        return 0.5 * (self.lower + self.upper)

    def meet(self, other: Bracket) -> Bracket:
        """What both say."""
        return Bracket(max(self.lower, other.lower), min(self.upper, other.upper))


def discrete_bracket(
    modes: FloatArray, transition: FloatArray, X: FloatArray, kept: BoolArray, relative: float = DATA
) -> Bracket:
    """The radius of (m, n, n) modes on the states `kept` (m, n) of each mode, from X (m, n, n); (0, inf) if X is not definite.

    `relative` is the error of every entry of the modes and of the transition matrix, as a part of its size.
    """
    found = _factors(X, kept)
    if found is None:
        return Bracket(0.0, np.inf)
    L, K, defect = found
    n = kept.shape[1]
    root = np.sqrt(transition.T)[:, :, None, None]  # [j, i]: sqrt(p_ij)
    moved = root * (K[:, None] @ (modes @ L)[None])
    error = root * (np.abs(K)[:, None] @ (np.abs(modes) @ np.abs(L))[None])
    eta = (4.0 * (n + 2) * EPS + 2.0 * relative) * np.sqrt((error**2).sum(axis=(1, 2, 3)))
    gram = np.einsum("jiab,jicb->jac", moved, moved, optimize=True)
    low, high = _spectrum(gram, kept)
    low, high = np.sqrt(np.maximum(low, 0.0)), np.sqrt(np.maximum(high, 0.0))
    lower = np.maximum((low - eta) / (1.0 + defect), 0.0).min()
    upper = ((high + eta) / (1.0 - defect)).max()
    return Bracket(float(lower) ** 2 * (1.0 - 4.0 * EPS), float(upper) ** 2 * (1.0 + 4.0 * EPS))


def continuous_bracket(
    modes: FloatArray, generator: FloatArray, X: FloatArray, kept: BoolArray, relative: float = DATA
) -> Bracket:
    """The abscissa in 1/s of x' = A_i x under a generator, as `discrete_bracket`; (-inf, inf) if X is not definite."""
    found = _factors(X, kept)
    if found is None:
        return Bracket(-np.inf, np.inf)
    L, K, defect = found
    n = kept.shape[1]
    drift = K @ (modes @ L)
    rates = generator.T[:, :, None, None]  # [j, i]: q_ij
    jumped = K[:, None] @ L[None]
    pencil = drift + np.swapaxes(drift, -1, -2) + np.einsum("jiab,jicb->jac", rates * jumped, jumped, optimize=True)
    size = 2.0 * np.abs(K) @ (np.abs(modes) @ np.abs(L))
    spread = np.abs(K)[:, None] @ np.abs(L)[None]
    size += np.einsum("jiab,jicb->jac", np.abs(rates) * spread, spread, optimize=True)
    norm = np.sqrt((size**2).sum(axis=(1, 2)))
    eta = (8.0 * (n + 2) * EPS + 2.0 * relative + 3.0 * defect) * norm
    low, high = _spectrum(pencil, kept)
    return Bracket(float((low - eta).min()), float((high + eta).max()))


def _factors(X: FloatArray, kept: BoolArray) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """L (m, n, n), its computed inverse K and a bound (m,) on |K L - I|; the identity stands on states that are left out."""
    both = kept[:, :, None] & kept[:, None, :]
    try:
        L = np.linalg.cholesky(np.where(both, X, np.eye(kept.shape[1])))
        K = np.tril(np.linalg.inv(L))
    except np.linalg.LinAlgError:
        return None
    n = kept.shape[1]
    rounding = 2.0 * n * EPS * np.abs(K) @ np.abs(L)
    defect = np.sqrt(((np.abs(K @ L - np.eye(n)) + rounding) ** 2).sum(axis=(1, 2)))
    if not (defect < 0.5).all():
        return None
    return L * both, K * both, defect


def _spectrum(forms: FloatArray, kept: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Bounds (m',) of the eigenvalues of symmetric forms (m, n, n) on the states kept, for the modes that keep any."""
    some = kept.any(axis=1)
    forms, kept = forms[some], kept[some]
    diagonal = np.einsum("jaa->ja", forms)
    mean = np.where(kept, diagonal, 0.0).sum(axis=1) / kept.sum(axis=1)  # never outside the other eigenvalues
    filled = forms + np.where(kept, 0.0, mean[:, None])[:, :, None] * np.eye(kept.shape[1])
    values = np.linalg.eigvalsh(filled)
    rounding = 4.0 * (kept.shape[1] + len(forms)) * EPS * np.sqrt((forms**2).sum(axis=(1, 2)))
    return values[:, 0] - rounding, values[:, -1] + rounding
