r"""Stability of stacks of matrices with three answers: a pole on the boundary within precision decides nothing.

Eigenvalues of floats are those of A + E with |E| <= a few eps |A|, and so are, as a rule, the matrices that users give. If no
such E puts an eigenvalue on the boundary, which is the smallest singular value of A - j omega I (A - z I on the unit circle)
staying above that size [Byers1988], then all A + E have the same number of poles on each side, and computed signs are
right, defective or not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from analysis.drops.balance import balanced
from analysis.errors import AnalysisError
from analysis.norms.compensated import determinant, expanded
from analysis.norms.modal import EPS, norm
from estimators.arrays import BoolArray, ComplexArray, FloatArray

PRECISION = 16.0 * EPS  # of the entries, and of what linear algebra does to them, times the number of states


class Stability(NamedTuple):
    """Certainly strictly stable, certainly not, and (neither) undecided; certainly no pole on the boundary, or one exactly
    there."""

    stable: BoolArray
    unstable: BoolArray
    clear: BoolArray
    on_edge: BoolArray

    @property
    def undecided(self) -> BoolArray:
        """Stable and unstable within the precision of the data."""
        return np.asarray(~(self.stable | self.unstable))


def stability(A: FloatArray, discrete: bool) -> Stability:
    """Of A (g, n, n). Systems with two states are decided by trace and determinant, entry by entry, others by singular values."""
    if A.shape[-1] <= 2:
        return _small(A, discrete)
    poles, vectors = np.linalg.eig(A)
    with np.errstate(all="ignore"):
        try:
            kappa = norm(np.linalg.inv(vectors))
        except np.linalg.LinAlgError:
            kappa = np.full(poles.shape, np.inf)
    return from_poles(A, poles, EPS * np.sqrt((A * A).sum(axis=(-2, -1)))[:, None] * kappa, discrete)


def require_stable(A: FloatArray, discrete: bool) -> None:
    """Raise AnalysisError that names the first of A (g, n, n) that is not certainly stable."""
    found = stability(A, discrete)
    if not found.stable.all():
        first = int(np.argmin(found.stable))
        how = (
            "unstable"
            if found.unstable[first]
            else "not stable or unstable at this precision: a pole is on the boundary"
        )
        raise AnalysisError(f"system {first} of {len(A)} is {how}; this needs strictly stable systems")


def from_poles(A: FloatArray, poles: ComplexArray, sizes: FloatArray, discrete: bool) -> Stability:
    """With computed eigenvalues (g, n) and what an error of eps |A| does to each; only doubtful members cost more."""
    inside = _inside(poles, discrete)
    far = np.abs(inside) > 16.0 * A.shape[-1] * np.where(np.isfinite(sizes), sizes, np.inf)
    stable, unstable = (far & (inside > 0.0)).all(axis=-1), (far & (inside < 0.0)).any(axis=-1)
    clear, on_edge = far.all(axis=-1), np.zeros(len(A), bool)
    for i in np.flatnonzero(~clear):
        stable[i], sure, clear[i], on_edge[i] = _careful(A[i], discrete)
        unstable[i] |= sure
    return Stability(stable, unstable, clear, on_edge)


def _inside(poles: ComplexArray, discrete: bool) -> FloatArray:
    return np.asarray(1.0 - np.abs(poles) if discrete else -poles.real)


def _careful(A: FloatArray, discrete: bool) -> tuple[bool, bool, bool, bool]:
    """The four answers for one matrix, by exact poles and the distance to the boundary of what is left."""
    block, exact = _peeled(A)
    ahead = _inside(exact.astype(complex), discrete)
    on_edge, beyond = bool((ahead == 0.0).any()), bool((ahead <= 0.0).any())
    if not len(block):
        return not beyond, beyond, not on_edge, on_edge
    block = balanced(block[None], np.zeros_like(block)[None])[0][0]
    poles = np.linalg.eigvals(block)
    turn = np.unique(np.append(np.abs(np.angle(poles)) if discrete else np.abs(poles.imag), 0.0))
    turn = np.concatenate([turn, 0.5 * (turn[1:] + turn[:-1]), [np.pi] if discrete else []])
    points = np.exp(1j * turn) if discrete else 1j * turn
    shifted = block - points[:, None, None] * np.eye(len(block))
    distance = np.linalg.svd(shifted, compute_uv=False)[:, -1].min()
    far = bool(distance > PRECISION * len(block) * np.linalg.norm(block))
    inside = _inside(poles, discrete)
    stable, unstable = far and bool((inside > 0.0).all()), far and bool((inside < 0.0).any())
    return stable and not beyond, unstable or beyond, far and not on_edge, on_edge


def _peeled(A: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What is left of a matrix without the states that are alone in their row or column, and the poles of those, which are
    exact."""
    left, exact = np.ones(len(A), bool), list[float]()
    beside = (A != 0.0) & ~np.eye(len(A), dtype=bool)
    while True:
        kept = beside & left[:, None] & left
        alone = np.flatnonzero(left & ~(kept.any(axis=0) & kept.any(axis=1)))
        if not len(alone):
            return A[np.ix_(left, left)], np.array(exact, np.float64)
        left[alone[0]] = False
        exact.append(A[alone[0], alone[0]])


def _small(A: FloatArray, discrete: bool) -> Stability:
    """One and two states: the signs that stability needs, each against what relative errors of the entries do to it."""
    if A.shape[-1] == 1:
        ahead = _inside(A[:, 0].astype(complex), discrete)[:, 0]
        return Stability(ahead > 0.0, ahead <= 0.0, ahead != 0.0, ahead == 0.0)
    a, b, c, d = A.reshape(-1, 4).T
    diagonal, products = np.abs(a) + np.abs(d), np.abs(a * d) + np.abs(b * c)
    if discrete:
        needed = [expanded(a, b, c, d, 1, 1), expanded(a, b, c, d, 1, -1), -expanded(a, b, c, d, -1, 0)]
        # to first order, entry by entry: near z = -1 and z = 1 errors of trace and determinant cancel
        crossed = 2.0 * np.abs(b * c)
        sizes = [np.abs(a) * np.abs(d + z) + np.abs(d) * np.abs(a + z) + crossed for z in (1.0, -1.0)]
        sizes.append(products)
        swinging = [True, True, np.abs(a + d) <= 2.0]
    else:
        needed, sizes = [-(a + d), determinant(a, b, c, d)], [diagonal, products]
        swinging = [needed[1] >= 0.0, True]
    bounds = [2.0 * PRECISION * size for size in sizes]
    stable, unstable, edge = np.ones(len(A), bool), np.zeros(len(A), bool), np.zeros(len(A), bool)
    doubtful = np.zeros(len(A), bool)
    # a pole on the boundary needs the last of these signs to vanish with poles that swing, or one of the others
    for value, bound, possible in zip(needed, bounds, swinging, strict=True):
        stable &= value > bound
        unstable |= (value < -bound) | ((value <= 0.0) & (bound == 0.0))
        doubtful |= (np.abs(value) <= bound) & possible
        edge |= (value == 0.0) & (bound == 0.0) & possible
    plain = (b == 0.0) | (c == 0.0)  # the poles are entries
    if plain.any():
        ahead = _inside(np.stack([a, d], axis=-1)[plain].astype(complex), discrete)
        edge[plain] = (ahead == 0.0).any(axis=-1)
        doubtful[plain], stable[plain], unstable[plain] = (
            edge[plain],
            (ahead > 0.0).all(axis=-1),
            (ahead <= 0.0).any(axis=-1),
        )
    return Stability(stable, unstable, ~doubtful, edge)
