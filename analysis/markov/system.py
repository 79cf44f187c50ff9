r"""Markov jump linear systems x+ = A_i x, i a Markov chain (P3 (21)-(25), Theorem 1; Costa, Fragoso and Marques 2005).

With X_j = E[x x' 1{mode = j}] the second moment moves by

    X_j+ = sum_i p_ij A_i X_i A_i',    p_ij = Pr(next = j | now = i),

whose block (j, i) on half-vectorised matrices is p_ij S(A_i). The system is mean-square stable if and only if the spectral
radius is below one: P3 (22) in a form half the size, with the same eigenvalue of largest modulus. Note the orientation: block
(j, i) carries p_ij. With two modes a transposed matrix gives the same radius, with three it does not.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import leading, positive_semidefinite, square, whole
from analysis.errors import AnalysisError
from analysis.markov.chain import distribution, stationary_distribution, stochastic
from analysis.markov.enclosure import DATA, EPS, enclosed, verdicts
from analysis.markov.planar import planar_radius
from analysis.markov.power import radius_estimate
from analysis.markov.regular import radius_verdicts
from analysis.markov.second_moment import lifted, spectral_radius
from analysis.mode_objects import state_matrices
from estimators.arrays import AnyArray, BoolArray, FloatArray
from estimators.display import Display
from synthesis.lmi.result import Verdict

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

MANY = 256  # two-state systems from which repeated squaring beats eigenvalue problems
LARGE = 150  # unknowns m n (n+1)/2 from which steps beat the operator as a matrix
LIFTED = (
    3.0 * DATA + 8.0 * EPS
)  # relative error of an entry p_ij a_kl a_rs of the operator: rounded data, and products of them


class MarkovJumpSystem(Display):
    """x+ = A_i x with mode i following a Markov chain.

    Args:
        modes: A_1..A_m, shape (..., m, n, n), any leading batch axes; or a list of discrete-time objects with A and dt.
        transition: (..., m, m), transition[i, j] = Pr(next = j | now = i); leading axes broadcast with those of `modes`.

    Raises:
        AnalysisError: matrices that are not square, finite or stochastic, or that do not fit.

    >>> system = MarkovJumpSystem([[[0.5]], [[1.2]]], [[0.9, 0.1], [0.8, 0.2]])
    >>> print(system.verdict())
    certified
    """

    def __init__(self, modes: ArrayLike, transition: ArrayLike) -> None:
        self.modes = _frozen(square("modes", state_matrices(modes, discrete=True)[0], ndim=3))
        self.transition = _frozen(stochastic("transition", transition))
        count = self.modes.shape[-3]
        if self.transition.shape[-1] != count:
            raise AnalysisError(
                f"transition has the shape {self.transition.shape} for {count} modes of shape {self.modes.shape}; "
                f"it must be (..., {count}, {count})"
            )
        self.batch_shape = leading({"modes": self.modes[..., 0], "transition": self.transition})

    @property
    def mode_count(self) -> int:
        """Number of modes m."""
        return int(self.modes.shape[-3])

    @property
    def size(self) -> int:
        """Number of states n."""
        return int(self.modes.shape[-1])

    @cached_property
    def second_moment_operator(self) -> FloatArray:
        """Matrix (..., m d, m d), d = n(n+1)/2, that moves (svec X_1, ..., svec X_m) by one step."""
        return _frozen(second_moment_operator(self.modes, self.transition))

    def second_moment_radius(self) -> FloatArray:
        """Spectral radius of the second-moment operator, shape of the batch (a 0-d array without one)."""
        return self._radius

    def radius_bounds(self) -> tuple[FloatArray, FloatArray]:
        """lower <= radius <= upper, shape of the batch each, for all systems whose entries round to these.

        By eigenvectors of the operator in discs (`analysis.markov.enclosure`), or for large systems by Collatz and
        Wielandt's bounds (`analysis.markov.bracket`). Wide where the eigenvalue is nearly defective: rounding alone then
        moves it that far.
        """
        return self._bounds

    @cached_property
    def _bounds(self) -> tuple[FloatArray, FloatArray]:
        if self._large:
            return self._estimates[1], self._estimates[2]
        operator = self.second_moment_operator
        size = second_moment_operator(np.abs(self.modes), self.transition)
        found = enclosed(operator, LIFTED * size)
        return _frozen(found.lower), _frozen(found.upper)

    @property
    def _large(self) -> bool:
        return self.mode_count * self.size * (self.size + 1) // 2 >= LARGE

    @cached_property
    def _estimates(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Radius, lower and upper bound of every system of a batch, without operators as matrices."""
        modes = np.broadcast_to(self.modes, (*self.batch_shape, *self.modes.shape[-3:]))
        transition = np.broadcast_to(self.transition, (*self.batch_shape, *self.transition.shape[-2:]))
        out = np.empty((3, *self.batch_shape))
        for place in np.ndindex(self.batch_shape):
            out[(slice(None), *place)] = radius_estimate(modes[place], transition[place])
        return _frozen(out[0]), _frozen(out[1]), _frozen(out[2])

    @cached_property
    def _radius(self) -> FloatArray:
        if self._large:
            return self._estimates[0]
        operator = self.second_moment_operator
        if self.size != 2 or self.mode_count < 2 or math.prod(self.batch_shape) < MANY:
            return _frozen(spectral_radius(operator))
        flat = operator.reshape(-1, *operator.shape[-2:])
        radius = planar_radius(flat)
        unmet = np.isnan(radius)
        if unmet.any():
            radius[unmet] = spectral_radius(flat[unmet])
        return _frozen(radius.reshape(self.batch_shape))

    def verdict(self) -> Verdict | AnyArray:
        """CERTIFIED: mean-square stable, REFUTED: not, INCONCLUSIVE: the radius is 1 to within what rounding of the data
        moves it.

        One verdict, or an object array of the batch's shape.
        """
        return self._verdict

    @cached_property
    def _verdict(self) -> Verdict | AnyArray:
        if self._large:
            return verdicts(*self.radius_bounds())
        size = second_moment_operator(np.abs(self.modes), self.transition)
        return radius_verdicts(self.second_moment_operator, LIFTED * size)

    def is_mean_square_stable(self) -> BoolArray:
        """Whether E|x|^2 tends to 0 from every start and every initial mode (P3 Definition 1): radius < 1 for certain.

        False where it is not, and where it cannot be decided at this precision: `verdict` tells them apart.
        """
        return np.asarray(np.asarray(self._verdict) == Verdict.CERTIFIED)

    @property
    def margin(self) -> FloatArray:
        """1 - radius, the margin of P3 Fig. 6; negative where the second moment grows."""
        return np.asarray(1.0 - self._radius)

    def stationary_distribution(self) -> FloatArray:
        """pi = pi P, shape (..., m). Raises AnalysisError if the chain has several closed classes."""
        return stationary_distribution(self.transition)

    def propagate_second_moment(self, second_moment: ArrayLike, mode_distribution: ArrayLike, steps: int) -> FloatArray:
        """E[x x' 1{mode = j}] for k = 0..steps, shape (steps+1, ..., m, n, n); its trace summed over m is E|x|^2.

        `second_moment` (..., n, n) is E[x x'] at the start, independent of the initial mode.
        """
        X = self.initial_second_moment(second_moment, mode_distribution)
        shape = (*self.batch_shape, self.mode_count, self.size, self.size)
        out = np.empty((_steps(steps) + 1, *np.broadcast_shapes(X.shape, shape)))
        out[0] = X
        onward = np.swapaxes(self.transition, -1, -2)
        for k in range(len(out) - 1):
            moved = self.modes @ out[k] @ np.swapaxes(self.modes, -1, -2)
            out[k + 1] = (onward @ moved.reshape(*moved.shape[:-2], self.size**2)).reshape(moved.shape)
        return out

    def initial_second_moment(self, second_moment: ArrayLike, mode_distribution: ArrayLike) -> FloatArray:
        """X_j(0) = pi_j E[x x'], shape (..., m, n, n)."""
        X = positive_semidefinite("second_moment", second_moment)
        pi = distribution("mode_distribution", mode_distribution, self.mode_count)
        if X.shape[-1] != self.size:
            raise AnalysisError(f"second_moment has the shape {X.shape} for {self.size} states")
        return np.asarray(pi[..., :, None, None] * X[..., None, :, :])


def second_moment_operator(modes: FloatArray, weights: FloatArray) -> FloatArray:
    """Matrix with block (j, i) = weights[i, j] S(A_i) for modes (..., m, n, n) and weights (..., m, m)."""
    S = lifted(modes)
    m, d = S.shape[-3], S.shape[-1]
    blocks = np.swapaxes(weights, -1, -2)[..., :, None, :, None] * np.moveaxis(S, -3, -2)[..., None, :, :, :]
    return np.asarray(blocks.reshape(*blocks.shape[:-4], m * d, m * d))


def independent(modes: ArrayLike, probabilities: ArrayLike) -> MarkovJumpSystem:
    """Modes drawn independently at every step: every row of the transition matrix is the distribution (P3 (25)).

    >>> independent([[[0.5]], [[1.2]]], [0.9, 0.1]).transition.tolist()
    [[0.9, 0.1], [0.9, 0.1]]
    """
    stack = square("modes", state_matrices(modes, discrete=True)[0], ndim=3)
    pi = distribution("probabilities", probabilities, stack.shape[-3])
    return MarkovJumpSystem(stack, np.repeat(pi[..., None, :], stack.shape[-3], axis=-2))


def _frozen(array: FloatArray) -> FloatArray:
    out = np.array(array, dtype=float)
    out.setflags(write=False)
    return out


def _steps(steps: int) -> int:
    return whole("steps", steps)
