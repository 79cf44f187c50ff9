"""Which modes a held (frozen) pair cannot see, and whether what it cannot see decays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from analysis.checks import as_stack, leading, square
from analysis.errors import AnalysisError
from analysis.state_space import given_system
from estimators.arrays import BoolArray, ComplexArray, FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True)
class HautusTest:
    r"""The Popov-Belevitch-Hautus test of frozen pairs: is [A - lambda I; C] of full column rank at every eigenvalue?

    All arrays (..., n), in the order of `eigenvalues` [1/s, or 1 for discrete time]. `distance` is the smallest
    singular value of [(A - lambda I)/|A|; C/|C|]: 0 means that the mode is never seen. `hidden` is distance below the
    tolerance; `decays` and `grows` are certain, and a mode that does neither is on the border within the tolerance.
    A frozen test says nothing of a pair that varies: use gramians or the time-varying matrix for that.
    """

    eigenvalues: ComplexArray
    distance: FloatArray
    hidden: BoolArray
    decays: BoolArray
    grows: BoolArray
    tolerance: float

    @property
    def frozen_observable(self) -> BoolArray:
        """Every mode of the held pair is seen, (...)."""
        return np.asarray(~self.hidden.any(axis=-1))

    @property
    def frozen_detectable(self) -> BoolArray:
        """Every hidden mode of the held pair certainly decays, (...)."""
        return np.asarray((self.decays | ~self.hidden).all(axis=-1))

    @property
    def undecided(self) -> BoolArray:
        """No hidden mode certainly grows, but one is on the border of stability at this precision, (...)."""
        return np.asarray(~self.frozen_detectable & ~(self.hidden & self.grows).any(axis=-1))

    def require_detectable(self, name: str = "the pair (A, C)") -> None:
        """Raise AnalysisError that names the first mode that is hidden and does not certainly decay, and what to do."""
        bad = self.hidden & ~self.decays
        if bad.any():
            place = tuple(int(i) for i in np.argwhere(bad)[0])
            where = f" at {place[:-1]}" if len(place) > 1 else ""
            how = "does not decay" if self.grows[place] else "is on the border of stability at this precision"
            raise AnalysisError(
                f"{name} is not detectable{where}: the mode {self.eigenvalues[place]:.6g} is hidden (distance "
                f"{self.distance[place]:.1e}) and {how}; add a sensor that sees it or leave that operating point"
            )


def hautus_test(
    A: Any, C: ArrayLike | None = None, discrete: bool | None = None, tolerance: float = 1e-9
) -> HautusTest:
    r"""Test stacks A (..., n, n), C (..., m, n), or a system object in the place of A (`analysis.state_space`).

    Raises AnalysisError for shapes that do not fit and values not finite.

    A k-fold defective eigenvalue comes out of any algorithm with errors of up to (rounding)^(1/k), while the mean of the k is
    accurate to rounding. So beside every eigenvalue the means of it with its nearest neighbours are looked at, as far as rounding
    explains their spread: a singular value at any point at all bounds the distance to a pair with a hidden mode.
    """
    A, _, C, _, discrete = given_system(A, C=C, discrete=discrete)
    if C is None:
        raise AnalysisError("C is missing; give A and C, or a system object with both")
    A, C = square("A", A), as_stack("C", C)
    if C.shape[-1] != A.shape[-1]:
        raise AnalysisError(f"C has the shape {C.shape}; A {A.shape} needs {A.shape[-1]} columns")
    if not tolerance > 0.0:
        raise AnalysisError(f"tolerance = {tolerance} must be positive")
    lead = leading({"A": A, "C": C})
    n = A.shape[-1]
    A = np.broadcast_to(A, (*lead, n, n))
    C = np.broadcast_to(C, (*lead, *C.shape[-2:]))
    size = np.linalg.norm(A, 2, axis=(-2, -1))[..., None]
    seen = np.linalg.norm(C, 2, axis=(-2, -1))[..., None, None]
    size, seen = np.where(size > 0.0, size, 1.0), np.where(seen > 0.0, seen, 1.0)
    eigenvalues = np.linalg.eigvals(A).astype(complex)
    distance, where = np.full((*lead, n), np.inf), eigenvalues.copy()
    for candidates in _cluster_means(eigenvalues, size[..., None]):
        shifted = (A[..., None, :, :] - candidates[..., None, None] * np.eye(n)) / size[..., None, None]
        outputs = np.broadcast_to((C / seen)[..., None, :, :], (*lead, n, *C.shape[-2:]))
        found = np.linalg.svd(np.concatenate([shifted, outputs], -2), compute_uv=False)[..., -1]
        better = found < distance
        distance, where = np.where(better, found, distance), np.where(better, candidates, where)
    beyond = np.abs(where) - 1.0 if discrete else where.real
    border = tolerance * size
    return HautusTest(where, distance, distance < tolerance, beyond < -border, beyond > border, tolerance)


def _cluster_means(eigenvalues: ComplexArray, size: FloatArray) -> Iterator[ComplexArray]:
    """Each eigenvalue, then its means with the 1, 2, ... nearest others where rounding explains their distance, (..., n)."""
    n = eigenvalues.shape[-1]
    apart = np.abs(eigenvalues[..., :, None] - eigenvalues[..., None, :])
    order = np.argsort(apart, axis=-1, kind="stable")
    near = np.take_along_axis(np.broadcast_to(eigenvalues[..., None, :], apart.shape), order, -1)
    spread = np.take_along_axis(apart, order, -1)
    means = np.cumsum(near, axis=-1) / np.arange(1, n + 1)
    for k in range(n):
        allowed = spread[..., k] <= 30.0 * np.finfo(float).eps ** (1.0 / (k + 1)) * size[..., 0]
        yield np.where(allowed, means[..., k], eigenvalues)


@dataclass(frozen=True, eq=False)
class FrozenMode:
    """A symbolic mode of a held pair: `hidden_if` vanishes where its outputs C v lose rank; `always` if they must."""

    eigenvalue: sp.Expr
    vectors: sp.ImmutableMatrix
    outputs: sp.ImmutableMatrix
    hidden_if: sp.Expr
    always: bool


def frozen_modes(A: sp.Matrix, C: sp.Matrix) -> tuple[FrozenMode, ...]:
    r"""Eigenvalues of a symbolic A with C v of their eigenvectors: the mode is hidden where rank(C V) < columns of V.

    More eigenvectors to one eigenvalue than outputs: one combination is always hidden. With more outputs than vectors `hidden_if`
    is the greatest common divisor of the maximal minors.
    """
    A, C = sp.Matrix(A), sp.Matrix(C)
    if A.rows != A.cols or C.cols != A.rows:
        raise AnalysisError(f"A has the shape {A.shape} and C {C.shape}; A must be (nx, nx) and C (ny, nx)")
    modes = []
    for eigenvalue, _, basis in A.eigenvects():
        vectors = sp.Matrix.hstack(*basis).applyfunc(sp.factor)
        outputs = (C * vectors).applyfunc(lambda e: sp.factor(sp.together(e)))
        always = outputs.rank(simplify=True) < len(basis)
        if always:
            condition = sp.Integer(0)
        else:
            chosen = combinations(range(outputs.rows), len(basis))
            minors = [outputs.extract(list(rows), list(range(len(basis)))).det() for rows in chosen]
            condition = sp.factor(sp.gcd_list([sp.numer(sp.together(minor)) for minor in minors]))
        modes.append(
            FrozenMode(
                sp.factor(eigenvalue), sp.ImmutableMatrix(vectors), sp.ImmutableMatrix(outputs), condition, always
            )
        )
    return tuple(modes)
