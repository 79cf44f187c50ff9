r"""Joint spectral radius: the fastest growth per step under arbitrary switching, as a proved bracket.

rho = lim max_w |A_(i_k) ... A_(i_1)|^(1/k). Every product gives a lower bound, every norm an upper one; x+ = A_i x is
stable under arbitrary switching if and only if rho < 1. Both ends are checked in exact rational arithmetic on the modes as
they are stored: the product by certified enclosures of its eigenvalues, the norm (an ellipsoid or a polytope) by its
defining inequalities. Deciding rho <= 1 is undecidable in general, so the bracket may stay open; then it says so.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from analysis.checks import positive, square
from analysis.errors import AnalysisError
from analysis.mode_objects import state_matrices
from analysis.switching.jsr_ellipsoid import Ellipsoid, best_ellipsoid
from analysis.switching.jsr_polytope import grow_polytope, proved_polytope_bound
from analysis.switching.jsr_products import multiply_out, proved_rate, search_products, vanishes
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.lmi.result import Verdict

Proof = Literal["ellipsoid", "polytope", "nilpotent"]
FRACTIONS = (0.8, 0.4)  # of the tolerance, by which modes are scaled down before a polytope is grown


@dataclass(frozen=True, repr=False)
class JointSpectralRadius(Display):
    """lower <= rho <= upper, both proved. `product` attains the lower one: the mode applied first stands first.

    `proof` says what bounds from above: `P` (n, n) with A_i'P A_i <= upper^2 P, or `vertices` (k, n) with A_i v_j in
    upper conv(+-v). `closed`: upper <= (1 + tolerance) lower.
    """

    lower: float
    upper: float
    product: tuple[int, ...]
    closed: bool
    proof: Proof
    P: FloatArray | None
    vertices: FloatArray | None

    @property
    def verdict(self) -> Verdict:
        """Stability under arbitrary switching: CERTIFIED if upper < 1, REFUTED if lower >= 1, else INCONCLUSIVE."""
        if self.upper < 1.0:
            return Verdict.CERTIFIED
        return Verdict.REFUTED if self.lower >= 1.0 else Verdict.INCONCLUSIVE


def joint_spectral_radius(
    modes: ArrayLike, tolerance: float = 1e-4, depth: int = 24, most_vertices: int | None = None
) -> JointSpectralRadius:
    """A proved bracket of the joint spectral radius of modes (m, n, n), with relative width `tolerance` where it closes.

    Modes may be a list of discrete-time objects with A and dt.

    `depth` bounds the length of products in the search, `most_vertices` the polytope (4000 in the plane, 250 above, where
    each gauge is a linear program). Raises AnalysisError for modes that are not finite square matrices of one size.

    >>> found = joint_spectral_radius([[[0.5, 0.0], [0.0, 0.9]], [[0.8, 0.0], [0.0, 0.3]]])
    >>> round(found.lower, 3), round(found.upper, 3)
    (0.9, 0.9)
    """
    A = square("modes", state_matrices(modes, discrete=True)[0], ndim=3)
    if A.ndim != 3 or not len(A):
        raise AnalysisError(f"modes have the shape {A.shape}; give one stack (m, n, n) of at least one mode")
    tolerance = positive("tolerance", tolerance)
    if vanishes(A):
        return JointSpectralRadius(0.0, 0.0, (0,), True, "nilpotent", None, None)
    unit = 2.0 ** np.round(np.log2(np.abs(A).max()))  # a power of two: exact both ways
    found = _bracket(A / unit, tolerance, depth, most_vertices or (4000 if A.shape[-1] == 2 else 250))
    return replace(found, lower=float(found.lower * unit), upper=float(found.upper * unit))


def _bracket(A: FloatArray, tolerance: float, depth: int, limit: int) -> JointSpectralRadius:
    radius = float(np.abs(np.linalg.eigvals(A)).max())
    ellipsoid = best_ellipsoid(A, radius, tolerance)
    R = np.linalg.cholesky(ellipsoid.P).T
    inverse = np.linalg.inv(R)
    found = search_products(R @ A @ inverse, 0.1 * tolerance, depth)
    word, lower = found.word, proved_rate(A, found.word)
    best = JointSpectralRadius(lower, ellipsoid.bound, word, False, "ellipsoid", ellipsoid.P, None)
    for fraction in FRACTIONS:
        if _closed(best, tolerance) or lower == 0.0:
            break
        best = _polytope(A, best, ellipsoid, lower * (1.0 + fraction * tolerance), limit)
    if not _closed(best, tolerance) and lower > 0.0:
        best = _coarse(A, best, ellipsoid, tolerance, limit)
    return replace(best, closed=_closed(best, tolerance))


def _polytope(
    A: FloatArray, best: JointSpectralRadius, ellipsoid: Ellipsoid, scale: float, limit: int
) -> JointSpectralRadius:
    """Grow a polytope for the modes divided by `scale`, and keep what it proves if that is better."""
    R = np.linalg.cholesky(ellipsoid.P).T
    inverse = np.linalg.inv(R)
    moved = R @ A @ inverse / scale
    growth = grow_polytope(moved, leading_vectors(moved, best.product), limit)
    if not growth.complete:
        return best
    vertices = growth.vertices @ inverse.T
    upper = proved_polytope_bound(A, vertices)
    if upper >= best.upper:
        return best
    return replace(best, upper=upper, proof="polytope", P=None, vertices=vertices)


def _coarse(
    A: FloatArray, best: JointSpectralRadius, ellipsoid: Ellipsoid, tolerance: float, limit: int
) -> JointSpectralRadius:
    """Where the tolerance is out of reach: the finest scale at which a polytope still closes, by bisection."""
    lower, steps = best.lower, 7 if A.shape[-1] == 2 else 3
    low, high = np.log(tolerance), np.log(max(best.upper / lower - 1.0, 2.0 * tolerance))
    for _ in range(steps):
        middle = 0.5 * (low + high)
        tried = _polytope(A, best, ellipsoid, lower * (1.0 + float(np.exp(middle))), limit)
        if tried.upper < best.upper:
            best, high = tried, middle
        else:
            low = middle
    return best


def leading_vectors(modes: FloatArray, word: tuple[int, ...]) -> FloatArray:
    """Real and imaginary part of the leading eigenvector of the product of a word, (1 or 2, n)."""
    values, vectors = np.linalg.eig(multiply_out(modes, word))
    leading = vectors[:, int(np.abs(values).argmax())]
    leading = leading * np.exp(-1j * np.angle(leading[np.abs(leading).argmax()]))
    parts = np.stack([leading.real, leading.imag])
    return np.asarray(parts[np.linalg.norm(parts, axis=1) > 1e-9])


def _closed(found: JointSpectralRadius, tolerance: float) -> bool:
    return found.upper <= found.lower * (1.0 + tolerance)
