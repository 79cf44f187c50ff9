"""Which modes a held (frozen) pair cannot see, and whether what it cannot see decays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from analysis.checks import as_stack, leading, square
from analysis.errors import AnalysisError
from estimators.arrays import BoolArray, FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True)
class HautusTest:
    r"""The Popov-Belevitch-Hautus test of frozen pairs: is [A - lambda I; C] of full column rank at every eigenvalue?

    All arrays (..., n), in the order of `eigenvalues` [1/s, or 1 for discrete time]. `distance` is the smallest
    singular value of [(A - lambda I)/|A|; C/|C|]: 0 means that the mode is never seen. `hidden` is distance below the
    tolerance. A frozen test says nothing of a pair that varies: use gramians or the time-varying matrix for that.
    """

    eigenvalues: np.ndarray[Any, np.dtype[np.complex128]]
    distance: FloatArray
    hidden: BoolArray
    decays: BoolArray
    tolerance: float

    @property
    def frozen_observable(self) -> BoolArray:
        """Every mode of the held pair is seen, (...)."""
        return np.asarray(~self.hidden.any(axis=-1))

    @property
    def frozen_detectable(self) -> BoolArray:
        """Every hidden mode of the held pair decays, (...)."""
        return np.asarray((self.decays | ~self.hidden).all(axis=-1))

    def require_detectable(self, name: str = "the pair (A, C)") -> None:
        """Raise AnalysisError that names the first undetectable mode and what to do."""
        bad = self.hidden & ~self.decays
        if bad.any():
            place = tuple(int(i) for i in np.argwhere(bad)[0])
            where = f" at {place[:-1]}" if len(place) > 1 else ""
            raise AnalysisError(
                f"{name} is not detectable{where}: the mode {self.eigenvalues[place]:.6g} is hidden (distance "
                f"{self.distance[place]:.1e}) and does not decay; add a sensor that sees it or leave that operating point"
            )


def hautus_test(A: ArrayLike, C: ArrayLike, discrete: bool = False, tolerance: float = 1e-9) -> HautusTest:
    """Test stacks A (..., n, n), C (..., m, n); raises AnalysisError for shapes that do not fit and values not finite."""
    A, C = square("A", A), as_stack("C", C)
    if C.shape[-1] != A.shape[-1]:
        raise AnalysisError(f"C has the shape {C.shape}; A {A.shape} needs {A.shape[-1]} columns")
    if not tolerance > 0.0:
        raise AnalysisError(f"tolerance = {tolerance} must be positive")
    lead = leading({"A": A, "C": C})
    n = A.shape[-1]
    A = np.broadcast_to(A, (*lead, n, n))
    C = np.broadcast_to(C, (*lead, *C.shape[-2:]))
    eigenvalues = np.linalg.eigvals(A).astype(complex)
    size = np.linalg.norm(A, 2, axis=(-2, -1))[..., None, None, None]
    seen = np.linalg.norm(C, 2, axis=(-2, -1))[..., None, None, None]
    shifted = A[..., None, :, :] - eigenvalues[..., :, None, None] * np.eye(n)
    outputs = np.broadcast_to(C[..., None, :, :], (*lead, n, *C.shape[-2:]))
    stacked = np.concatenate([shifted / np.where(size > 0.0, size, 1.0), outputs / np.where(seen > 0.0, seen, 1.0)], -2)
    distance = np.linalg.svd(stacked, compute_uv=False)[..., -1]
    decays = np.abs(eigenvalues) < 1.0 if discrete else eigenvalues.real < 0.0
    return HautusTest(eigenvalues, distance, distance < tolerance, decays, tolerance)


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

    More eigenvectors to one eigenvalue than outputs: one combination is always hidden. For one vector and several outputs
    `hidden_if` is their greatest common divisor.
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
        elif len(basis) == outputs.rows:
            condition = sp.factor(outputs.det())
        else:
            condition = sp.factor(sp.gcd_list([sp.numer(e) for e in outputs]))
        modes.append(
            FrozenMode(
                sp.factor(eigenvalue), sp.ImmutableMatrix(vectors), sp.ImmutableMatrix(outputs), condition, always
            )
        )
    return tuple(modes)
