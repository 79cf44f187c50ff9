"""Simulation of Markov jump systems against the exact second moment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import norm

from analysis.checks import as_stack, whole
from analysis.errors import AnalysisError
from analysis.markov.chain import distribution, sample_paths
from analysis.markov.coupled_lmi import single
from analysis.markov.system import MarkovJumpSystem
from estimators.arrays import FloatArray
from estimators.display import Display

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, repr=False)
class SecondMomentCheck(Display):
    """E|x(k)|^2 for k = 0..steps, all arrays (steps + 1,): exact, estimated, and bounds of the estimate.

    The bounds hold for all steps together with the given confidence (Bonferroni), as far as the mean of `runs` values is
    normally distributed. |x|^2 is a product of random factors, so that fails on long horizons: few runs then carry the mean,
    `largest_share` of it comes from a single run, and an estimate with a share near 1 says nothing.
    """

    exact: FloatArray
    estimate: FloatArray
    lower: FloatArray
    upper: FloatArray
    largest_share: FloatArray
    confidence: float
    runs: int

    @property
    def agrees(self) -> bool:
        """Whether the exact value lies inside the bounds at every step."""
        slack = 1e-12 * np.abs(self.exact)
        return bool(((self.exact >= self.lower - slack) & (self.exact <= self.upper + slack)).all())


def check_second_moment(
    system: MarkovJumpSystem,
    state: ArrayLike,
    mode_distribution: ArrayLike,
    steps: int,
    runs: int,
    generator: np.random.Generator,
    confidence: float = 0.999,
) -> SecondMomentCheck:
    """Simulate `runs` paths from one state (n,) and compare the mean of |x|^2 with its exact value.

    Raises AnalysisError for a batch of systems, fewer than 100 runs, or a confidence outside (0, 1).

    >>> import numpy as np
    >>> system = MarkovJumpSystem([[[0.5]], [[1.1]]], [[0.9, 0.1], [0.8, 0.2]])
    >>> check_second_moment(system, [1.0], [1.0, 0.0], 5, 400, np.random.default_rng(1)).agrees
    True
    """
    steps = whole("steps", steps)
    if whole("runs", runs) < 100 or not 0.0 < confidence < 1.0:
        raise AnalysisError(f"runs = {runs} must be at least 100 and confidence = {confidence} inside (0, 1)")
    A, P = single(system)
    x = as_stack("state", state, ndim=1)
    if x.shape != (system.size,):
        raise AnalysisError(f"state has the shape {x.shape}; it must be ({system.size},)")
    pi = distribution("mode_distribution", mode_distribution, system.mode_count)
    exact = np.trace(system.propagate_second_moment(np.outer(x, x), pi, steps), axis1=-2, axis2=-1).sum(axis=-1)
    modes = sample_paths(P, pi, steps, runs, generator)
    states = np.tile(x, (runs, 1))
    squares = np.empty((steps + 1, runs))
    squares[0] = float(x @ x)
    for k in range(steps):
        states = (A[modes[k]] @ states[..., None])[..., 0]
        squares[k + 1] = np.einsum("ri,ri->r", states, states)
    estimate = squares.mean(axis=1)
    half = norm.ppf(1.0 - 0.5 * (1.0 - confidence) / (steps + 1)) * squares.std(axis=1, ddof=1) / np.sqrt(runs)
    share = squares.max(axis=1) / np.maximum(squares.sum(axis=1), np.finfo(float).tiny)
    return SecondMomentCheck(exact, estimate, estimate - half, estimate + half, share, confidence, runs)
