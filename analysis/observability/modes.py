"""Which modes a held (frozen) pair cannot see, and whether what it cannot see decays."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from analysis.errors import AnalysisError
from analysis.observability.exact_expression import exact
from analysis.observability.pair_balance import balanced_pair
from analysis.observability.pairs import EPSILON, observed_pair, unit_pair, without_dust
from analysis.observability.real_roots import numerator
from analysis.observability.staircase import separate
from estimators.arrays import BoolArray, ComplexArray, FloatArray
from estimators.display import Display

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

CANCELLED = 2.0**12 * EPSILON  # beside the largest entry of a row: what is left of terms a thousand times as large


@dataclass(frozen=True, repr=False)
class HautusTest(Display):
    r"""Which modes of frozen pairs are hidden: the Popov-Belevitch-Hautus test behind a staircase form.

    All arrays (..., n), in the order of `eigenvalues` [1/s, or 1 for discrete time]: first those of what is seen, then those
    of the unobservable subspace, as many as it has dimensions. `distance` is the smallest singular value of [A - lambda I; C] in
    units of |A| and |C|, of the seen part for its own modes: 0 means that the mode is never seen. `hidden` are the modes of the
    unobservable subspace and those with a distance below the tolerance. `decays` and `grows` are certain: the border of
    stability is further away than the tolerance; a mode that does neither is on the border at this precision.
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


def hautus_test(
    A: Any, C: ArrayLike | None = None, discrete: bool | None = None, tolerance: float = 1e-9
) -> HautusTest:
    r"""Test stacks A (..., n, n), C (..., m, n), or a system object in the place of A (`analysis.state_space`).

    Rank decisions count singular values above `tolerance` in units of |A| and |C|, after balancing (`pair_balance`), so that
    units decide nothing. The eigenvalues of a k-fold defective mode err by (rounding)^(1/k); the unobservable subspace is found
    without them, and its own eigenvalues do not mix with the others. For one pair with three verdicts ask `detectable`.
    Raises AnalysisError for shapes that do not fit and values not finite.

    >>> hautus_test([[1.0, 0.0], [0.0, -2.0]], [[0.0, 1.0]]).hidden.tolist()
    [False, True]
    """
    A, C, time = observed_pair(A, C, discrete)
    if not tolerance > 0.0:
        raise AnalysisError(f"tolerance = {tolerance} must be positive")
    n, lead = A.shape[-1], A.shape[:-2]
    count = int(np.prod(lead))
    pairs, outputs = A.reshape(count, n, n), C.reshape(count, *C.shape[-2:])
    found = _modes(pairs, outputs, time, tolerance)
    clean = without_dust(pairs, outputs, CANCELLED)
    dusty = np.flatnonzero((clean[0] != pairs).any(axis=(-2, -1)) | (clean[1] != outputs).any(axis=(-2, -1)))
    if len(dusty):  # entries that are rounding may hide as well as show: the worse answer counts
        other = _modes(clean[0][dusty], clean[1][dusty], time, tolerance)
        worse = other.hidden.sum(axis=-1) > found.hidden[dusty].sum(axis=-1)
        for name in ("eigenvalues", "distance", "hidden", "decays", "grows"):
            getattr(found, name)[dusty[worse]] = getattr(other, name)[worse]
    shape = (*lead, n)
    hidden, decays, grows = (f.reshape(shape) for f in (found.hidden, found.decays, found.grows))
    return HautusTest(found.eigenvalues.reshape(shape), found.distance.reshape(shape), hidden, decays, grows, tolerance)


def _modes(A: FloatArray, C: FloatArray, discrete: bool, tolerance: float) -> HautusTest:
    """The test of pairs A (count, n, n), C (count, m, n) as they stand."""
    n = A.shape[-1]
    near_A, near_C, _, _ = balanced_pair(A, C)
    pairs, outputs, size = unit_pair(near_A, near_C)
    size = size[..., 0]
    parts = separate(pairs, outputs, tolerance)
    moved, sees = np.swapaxes(parts.transform, -1, -2) @ pairs @ parts.transform, outputs @ parts.transform
    eigenvalues = np.zeros((len(pairs), n), complex)
    distance, clear = np.zeros((len(pairs), n)), np.zeros((len(pairs), n))
    for order in (int(r) for r in np.unique(n - parts.hidden)):
        here = n - parts.hidden == order
        for part in (slice(0, order), slice(order, n)):
            block, whole = moved[here][:, part, part], part.start > 0
            found = np.linalg.eigvals(block).astype(complex)
            eigenvalues[here, part] = found
            # Beside hidden modes their seen copies are tested on the seen part alone: the pair as a whole hides that eigenvalue.
            pair, output = (moved[here], sees[here]) if whole else (block, sees[here][:, :, part])
            distance[here, part] = _smallest(pair, output, found)
            clear[here, part] = _smallest(block, None, _border(found, size[here], discrete))
    hidden = (np.arange(n) >= n - parts.hidden[:, None]) | (distance < tolerance)
    modes = np.asarray(eigenvalues * size, complex)
    beyond = np.abs(modes) - 1.0 if discrete else modes.real
    certain = clear > tolerance
    return HautusTest(modes, distance, hidden, (beyond < 0.0) & certain, (beyond > 0.0) & certain, tolerance)


def _border(eigenvalues: ComplexArray, size: FloatArray, discrete: bool) -> ComplexArray:
    """The nearest point of the border of stability, in units of |A|."""
    if not discrete:
        return np.asarray(1j * eigenvalues.imag)
    length = np.abs(eigenvalues)
    return np.asarray(np.where(length > 0.0, eigenvalues / np.where(length > 0.0, length, 1.0), 1.0) / size)


def _smallest(A: FloatArray, C: FloatArray | None, points: ComplexArray) -> FloatArray:
    """The smallest singular values of [A - z I; C], z (count, k), as (count, k)."""
    if not points.shape[-1]:
        return np.zeros(points.shape)
    matrix = A[:, None] - points[..., None, None] * np.eye(A.shape[-1])
    if C is not None:
        matrix = np.concatenate([matrix, np.broadcast_to(C[:, None], (*points.shape, *C.shape[-2:]))], axis=-2)
    return np.asarray(np.linalg.svd(matrix, compute_uv=False)[..., -1])


@dataclass(frozen=True, eq=False, repr=False)
class FrozenMode(Display):
    """A symbolic mode of a held pair: `hidden_if` vanishes where its outputs C v lose rank; `always` if they must.

    `leftover` are the maximal minors divided by `hidden_if`: where all of them vanish together the mode is hidden as well (fewer
    dimensions); empty if they cannot. Eigenvalues that differ as expressions may meet at a point: one output cannot tell two
    eigenvectors there, and `rank_loss` of the frozen matrix has that set.
    """

    eigenvalue: sp.Expr
    vectors: sp.ImmutableMatrix
    outputs: sp.ImmutableMatrix
    hidden_if: sp.Expr
    always: bool
    leftover: tuple[sp.Expr, ...] = ()


def frozen_modes(A: sp.Matrix, C: sp.Matrix) -> tuple[FrozenMode, ...]:
    r"""Eigenvalues of a symbolic A with C v of their eigenvectors: the mode is hidden where rank(C V) < columns of V.

    More eigenvectors to one eigenvalue than outputs: one combination is always hidden. With more outputs than vectors `hidden_if`
    is the greatest common divisor of the maximal minors.

    >>> import sympy as sp
    >>> [str(mode.hidden_if) for mode in frozen_modes(sp.diag(1, -2), sp.Matrix([[1, sp.Symbol("c")]]))]
    ['c', '1']
    """
    A, C = sp.Matrix(exact("A", A)), sp.Matrix(exact("C", C))
    if A.rows != A.cols or C.cols != A.rows:
        raise AnalysisError(f"A has the shape {A.shape} and C {C.shape}; A must be (nx, nx) and C (ny, nx)")
    modes = []
    for eigenvalue, _, basis in A.eigenvects():
        vectors = sp.Matrix.hstack(*basis).applyfunc(sp.factor)
        outputs = (C * vectors).applyfunc(lambda e: sp.factor(sp.together(e)))
        always = outputs.rank(simplify=True) < len(basis)
        leftover: tuple[sp.Expr, ...] = ()
        if always:
            condition = sp.Integer(0)
        else:
            chosen = combinations(range(outputs.rows), len(basis))
            minors = [numerator(outputs.extract(list(rows), list(range(len(basis)))).det()) for rows in chosen]
            minors = [minor for minor in minors if minor != 0]
            condition = sp.factor(sp.gcd_list(minors))
            rest = [sp.cancel(minor / condition) for minor in minors]
            leftover = tuple(rest) if all(minor.free_symbols for minor in rest) else ()
        modes.append(
            FrozenMode(
                sp.factor(eigenvalue),
                sp.ImmutableMatrix(vectors),
                sp.ImmutableMatrix(outputs),
                condition,
                always,
                leftover,
            )
        )
    return tuple(modes)
