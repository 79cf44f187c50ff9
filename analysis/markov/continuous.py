r"""Markov jump linear systems in continuous time: x' = A_i x, i jumping with a generator (Costa, Fragoso and Todorov 2013).

    X_j' = A_j X_j + X_j A_j' + sum_i q_ij X_i,    q_ij >= 0 the rate of jumps from i to j, q_ii = -sum of the others.

Mean-square stable if and only if the spectral abscissa of this operator is negative.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import expm

from analysis.checks import as_stack, leading, square
from analysis.errors import AnalysisError
from analysis.markov.chain import ROW_SUM_TOLERANCE, stationary_distribution
from analysis.markov.enclosure import enclosed, verdicts
from analysis.markov.power import abscissa_estimate
from analysis.markov.second_moment import triangle
from analysis.markov.system import LARGE, LIFTED
from analysis.mode_objects import state_matrices
from estimators.arrays import AnyArray, BoolArray, FloatArray
from estimators.display import Display
from synthesis.lmi.result import Verdict

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class MarkovJumpProcess(Display):
    """x' = A_i x with mode i following a Markov process.

    Args:
        modes: A_1..A_m in 1/s, shape (..., m, n, n); or a list of continuous-time objects with A and dt.
        generator: rates in 1/s, shape (..., m, m); generator[i, j] is the rate of jumps from i to j, rows sum to 0.

    Raises:
        AnalysisError: matrices that do not fit, negative rates, or rows that do not sum to 0.

    >>> process = MarkovJumpProcess([[[-1.0]], [[0.2]]], [[-1.0, 1.0], [9.0, -9.0]])  # seldom in the unstable mode
    >>> print(process.verdict())
    certified
    """

    def __init__(self, modes: ArrayLike, generator: ArrayLike) -> None:
        self.modes = square("modes", state_matrices(modes, discrete=False)[0], ndim=3)
        self.generator = _checked(generator)
        if self.generator.shape[-1] != self.modes.shape[-3]:
            raise AnalysisError(
                f"generator has the shape {self.generator.shape} for {self.modes.shape[-3]} modes; it must be (..., m, m)"
            )
        self.batch_shape = leading({"modes": self.modes[..., 0], "generator": self.generator})

    @cached_property
    def second_moment_operator(self) -> FloatArray:
        """Matrix (..., m d, m d), d = n(n+1)/2, with d/dt (svec X_1, ..., svec X_m) = operator (svec X_1, ...)."""
        return second_moment_flow(self.modes, self.generator)

    def second_moment_abscissa(self) -> FloatArray:
        """Largest real part of the eigenvalues in 1/s, shape of the batch: the rate at which E|x|^2 grows."""
        return self._estimates[0]

    def abscissa_bounds(self) -> tuple[FloatArray, FloatArray]:
        """lower <= abscissa <= upper in 1/s, shape of the batch each, for all processes whose entries round to these."""
        return self._estimates[1], self._estimates[2]

    @cached_property
    def _estimates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        n, m = self.modes.shape[-1], self.modes.shape[-3]
        if m * n * (n + 1) // 2 < LARGE:
            size = second_moment_flow(np.abs(self.modes), np.abs(self.generator))
            return enclosed(self.second_moment_operator, LIFTED * size, modulus=False)
        modes = np.broadcast_to(self.modes, (*self.batch_shape, *self.modes.shape[-3:]))
        generator = np.broadcast_to(self.generator, (*self.batch_shape, m, m))
        out = np.empty((3, *self.batch_shape))
        for place in np.ndindex(self.batch_shape):
            out[(slice(None), *place)] = abscissa_estimate(modes[place], generator[place])
        return out[0], out[1], out[2]

    def verdict(self) -> Verdict | AnyArray:
        """CERTIFIED: mean-square stable, REFUTED: not, INCONCLUSIVE: the abscissa is 0 to within what rounding of the data
        moves it.

        One verdict, or an object array of the batch's shape.
        """
        return verdicts(*self.abscissa_bounds(), border=0.0)

    def is_mean_square_stable(self) -> BoolArray:
        """Whether E|x|^2 tends to 0 from every start: abscissa < 0 for certain. False where `verdict` is INCONCLUSIVE."""
        return np.asarray(self.abscissa_bounds()[1] < 0.0)

    @property
    def margin(self) -> FloatArray:
        """Minus the abscissa, in 1/s."""
        return -self.second_moment_abscissa()

    def stationary_distribution(self) -> FloatArray:
        """pi Q = 0, shape (..., m). Raises AnalysisError if it is not unique."""
        scale = np.maximum(-np.diagonal(self.generator, axis1=-2, axis2=-1).min(axis=-1), np.finfo(float).tiny)
        return stationary_distribution(np.eye(self.generator.shape[-1]) + self.generator / scale[..., None, None])

    def propagate_second_moment(self, moments: ArrayLike, times: ArrayLike) -> FloatArray:
        """svec coordinates (t, ..., m d) of X_1..X_m at `times` (t,) in s, from those at time 0 (..., m d)."""
        start, instants = as_stack("moments", moments, ndim=1), as_stack("times", times, ndim=1)
        operator = self.second_moment_operator
        if start.shape[-1] != operator.shape[-1]:
            raise AnalysisError(f"moments has {start.shape[-1]} entries; m n(n+1)/2 = {operator.shape[-1]} are needed")
        steps = instants.reshape(-1, *(1,) * operator.ndim) * operator
        return np.asarray((expm(steps) @ start[..., None])[..., 0])


def second_moment_flow(modes: FloatArray, generator: FloatArray) -> FloatArray:
    """Matrix of the derivative of (svec X_1, ..., svec X_m) for modes (..., m, n, n) and rates (..., m, m)."""
    L = derivative_operator(modes)
    m, d = L.shape[-3], L.shape[-1]
    jumps = np.swapaxes(generator, -1, -2)[..., :, None, :, None] * np.eye(d)[:, None, :]
    blocks = np.eye(m)[:, None, :, None] * np.moveaxis(L, -3, -2)[..., None, :, :, :] + jumps
    return np.asarray(blocks.reshape(*blocks.shape[:-4], m * d, m * d))


def derivative_operator(A: FloatArray) -> FloatArray:
    """Matrix (..., d, d) of X -> A X + X A' on half-vectorised matrices."""
    rows, columns, weights = triangle(A.shape[-1])
    same = np.eye(A.shape[-1])
    out = sum(
        A[..., p, :][..., :, q] * same[r][:, s]
        for p, r in ((rows, columns), (columns, rows))
        for q, s in ((rows, columns), (columns, rows))
    )
    return np.asarray(out * (weights[:, None] / (weights * np.where(rows == columns, 2.0, 1.0))))


def _checked(generator: ArrayLike) -> FloatArray:
    Q = square("generator", generator)
    off = Q - np.eye(Q.shape[-1]) * Q
    if (off < 0.0).any():
        place = tuple(int(i) for i in np.argwhere(off < 0.0)[0])
        raise AnalysisError(f"generator{list(place)} = {Q[place]:g} is negative; rates of jumps are not")
    error = np.abs(Q.sum(axis=-1)) - ROW_SUM_TOLERANCE * np.maximum(1.0, np.abs(Q).max(axis=(-2, -1)))[..., None]
    if (error > 0.0).any():
        place = tuple(int(i) for i in np.argwhere(error > 0.0)[0])
        raise AnalysisError(
            f"row {list(place)} of generator sums to {Q[place].sum():.6g}, not 0; the diagonal is minus the sum of the others"
        )
    return np.asarray(off - np.eye(Q.shape[-1]) * off.sum(axis=-1, keepdims=True))
