"""Finite Markov chains, with any leading batch axes: checks, classes, stationary distribution, paths."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.checks import probability, square, whole
from analysis.errors import AnalysisError
from estimators.arrays import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# How far the sum of a row of printed probabilities may lie from 1: accumulated rounding, not rounding to a few digits.
ROW_SUM_TOLERANCE = 1e-9


def stochastic(name: str, array: ArrayLike) -> FloatArray:
    """Transition matrices (..., m, m), transition[i, j] = Pr(next = j | now = i), rows made to sum to 1 exactly.

    Raises AnalysisError for negative entries or a row that does not sum to 1, with the place; a matrix whose columns sum to 1
    instead is called transposed.
    """
    out = square(name, array)
    if (out < 0.0).any():
        place = tuple(int(i) for i in np.argwhere(out < 0.0)[0])
        raise AnalysisError(f"{name}{list(place)} = {out[place]:g} is negative; probabilities lie between 0 and 1")
    error = np.abs(out.sum(axis=-1) - 1.0)
    if (error > ROW_SUM_TOLERANCE).any():
        place = tuple(int(i) for i in np.argwhere(error > ROW_SUM_TOLERANCE)[0])
        remedy = "give transition[i, j] = Pr(next = j | now = i), so that every row sums to 1"
        if (np.abs(out.sum(axis=-2) - 1.0) <= ROW_SUM_TOLERANCE).all():
            remedy = "its columns do, so it is transposed: pass its transpose"
        raise AnalysisError(f"row {list(place)} of {name} sums to {out[place].sum():.12g}, not 1; {remedy}")
    return np.asarray(out / out.sum(axis=-1, keepdims=True))


def distribution(name: str, array: ArrayLike, modes: int) -> FloatArray:
    """Probabilities (..., m) of the modes. Raises AnalysisError for negative ones, another length or a sum other than 1."""
    out = stochastic_vector(name, array)
    if out.shape[-1] != modes:
        raise AnalysisError(f"{name} has {out.shape[-1]} entries for {modes} modes; give one probability a mode")
    return out


def stochastic_vector(name: str, array: ArrayLike) -> FloatArray:
    """Non-negative numbers that sum to 1 along the last axis."""
    out = probability(name, array)
    if out.ndim == 0 or not out.shape[-1]:
        raise AnalysisError(f"{name} is not a list of probabilities; give one a mode")
    error = np.abs(out.sum(axis=-1) - 1.0)
    if (error > ROW_SUM_TOLERANCE).any():
        raise AnalysisError(f"{name} sums to {out.sum(axis=-1).flat[int(error.argmax())]:.12g}, not 1")
    return np.asarray(out / out.sum(axis=-1, keepdims=True))


def reachable(transition: FloatArray) -> BoolArray:
    """Whether j can be reached from i in any number of steps, zero included."""
    size = transition.shape[-1]
    out = (transition > 0.0) | np.eye(size, dtype=bool)
    for _ in range(max(size - 1, 1).bit_length()):
        out = (out.astype(np.int64) @ out.astype(np.int64)) > 0
    return np.asarray(out)


def recurrent(transition: FloatArray) -> BoolArray:
    """Modes that are visited for ever once entered: every mode that can be reached leads back."""
    reach = reachable(transition)
    return np.asarray((~reach | np.swapaxes(reach, -1, -2)).all(axis=-1))


def stationary_distribution(transition: ArrayLike) -> FloatArray:
    """pi = pi P with sum 1, shape (..., m) for transition matrices (..., m, m); zero on transient modes.

    Raises AnalysisError for a matrix that is not stochastic, and if the chain has several closed classes (several absorbing
    modes): where it ends depends on where it starts, and no single answer exists.

    >>> stationary_distribution([[0.9, 0.1], [0.3, 0.7]]).round(6).tolist()
    [0.75, 0.25]
    """
    transition = stochastic("transition", transition)
    reach, home = reachable(transition), recurrent(transition)
    apart = home[..., :, None] & home[..., None, :] & ~reach
    if apart.any():
        *where, i, j = (int(k) for k in np.argwhere(apart)[0])
        place = f" (chain {where})" if where else ""
        raise AnalysisError(
            f"modes {i} and {j}{place} lie in different closed classes, so the stationary distribution is not unique; "
            "propagate an initial distribution instead"
        )
    order = np.argsort(~home, axis=-1, kind="stable")  # the closed class first
    P = np.take_along_axis(np.take_along_axis(transition, order[..., :, None], -2), order[..., None, :], -1)
    pi = np.take_along_axis(_eliminated(P), np.argsort(order, axis=-1), -1)
    pi = np.where(home, pi, 0.0)
    return np.asarray(pi / pi.sum(axis=-1, keepdims=True))


def _eliminated(P: FloatArray) -> FloatArray:
    """pi up to a factor, by elimination without a subtraction [Grassmann1985]: every entry keeps its relative accuracy.

    Mode after mode is watched no longer; the chain that is seen at the others alone has P_ij + P_ik P_kj / sum_{l<k} P_kl.
    """
    P = P.copy()
    size = P.shape[-1]
    for k in range(size - 1, 0, -1):
        away = P[..., k, :k].sum(axis=-1)[..., None]
        P[..., :k, k] = np.divide(P[..., :k, k], away, out=np.zeros_like(P[..., :k, k]), where=away > 0.0)
        P[..., :k, :k] += P[..., :k, k, None] * P[..., k, None, :k]
    pi = np.ones(P.shape[:-1])
    for k in range(1, size):
        pi[..., k] = (pi[..., :k] * P[..., :k, k]).sum(axis=-1)
    return pi


def sample_paths(
    transition: ArrayLike, start: ArrayLike, steps: int, runs: int, generator: np.random.Generator
) -> IntArray:
    """Modes (steps + 1, runs) of independent runs of one chain (m, m); `start` (m,) is the distribution of the first one.

    Raises AnalysisError for a batch of chains, and for numbers that are no probabilities or no counts.

    >>> import numpy as np
    >>> sample_paths([[0.0, 1.0], [1.0, 0.0]], [1.0, 0.0], 3, 1, np.random.default_rng(1))[:, 0].tolist()
    [0, 1, 0, 1]
    """
    transition = stochastic("transition", transition)
    start = distribution("start", start, transition.shape[-1])
    if transition.ndim != 2 or start.ndim != 1:
        raise AnalysisError(f"transition {transition.shape} and start {start.shape} are stacks; paths are of one chain")
    steps, runs = whole("steps", steps), whole("runs", runs)
    cumulative = np.cumsum(transition, axis=-1)
    modes = np.empty((steps + 1, runs), dtype=np.int64)
    last = transition.shape[-1] - 1
    modes[0] = np.minimum(np.searchsorted(np.cumsum(start), generator.random(runs), side="right"), last)
    for k in range(steps):
        draw = generator.random(runs)
        modes[k + 1] = np.minimum((cumulative[modes[k]] <= draw[:, None]).sum(axis=1), last)
    return modes
