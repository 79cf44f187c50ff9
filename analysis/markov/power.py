r"""The second-moment radius without the operator as a matrix: power iteration, judged by two-sided bounds.

One step T X costs 2 m matrix products of size n; the operator as a matrix has (m n (n+1)/2)^2 entries. X = T^k I tends to the
eigenvector, and `analysis.markov.bracket` turns any X into bounds. Where other eigenvalues have the modulus of the radius (a
periodic chain, a rotation) X is averaged with its step, which moves them inwards; where that is slow, Arnoldi's method finds
the eigenvalue of largest real part, which the radius is (Krein and Rutman). Blocks of states that drive each other are taken
one by one (`analysis.markov.blocks`), so that zeros in the data cost nothing. What is left is an eigenvector on the border of the
cone that no coordinates show: its bracket stays open below, and is reported so.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from analysis.markov.blocks import flow_blocks, step_blocks
from analysis.markov.bracket import DATA, Bracket, continuous_bracket, discrete_bracket
from estimators.arrays import BoolArray, FloatArray

Judge = Callable[[FloatArray], Bracket]
Step = Callable[[FloatArray], FloatArray]
LOOKS = (16, 32, 64, 128, 256, 512)  # steps after which the bounds are computed
CLOSED = 1e-11  # relative width of a bracket at which the search ends
BORDER = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)  # parts of the identity added to a singular X, for the upper bound
BASIS = 24  # vectors of Arnoldi's method
RESTARTS = 60


def radius_bracket(modes: FloatArray, transition: FloatArray, relative: float = DATA) -> Bracket:
    """Bounds of the radius of one system, modes (m, n, n) and transition (m, m), for all data within `relative` of these."""
    turned, onward = np.swapaxes(modes, -1, -2), np.ascontiguousarray(transition.T)

    def step(X: FloatArray) -> FloatArray:
        return np.asarray((onward @ (modes @ X @ turned).reshape(len(X), -1)).reshape(X.shape))

    found = Bracket(0.0, 0.0)
    for kept in step_blocks(modes, transition):
        part = _searched(step, lambda X, kept=kept: discrete_bracket(modes, transition, X, kept, relative), kept)  # type: ignore[misc]
        found = Bracket(max(found.lower, part.lower), max(found.upper, part.upper))
    return found


def abscissa_bracket(modes: FloatArray, generator: FloatArray, relative: float = DATA) -> Bracket:
    """Bounds in 1/s of the abscissa of one process, modes (m, n, n) in 1/s and generator (m, m), as `radius_bracket`."""
    size = 2.0 * float(np.linalg.norm(modes, axis=(-2, -1)).max()) + 2.0 * float(np.abs(generator).max())
    short, onward = 1.0 / max(size, np.finfo(float).tiny), np.ascontiguousarray(generator.T)

    def step(X: FloatArray) -> FloatArray:  # I + h T, h short enough for the abscissa to lead
        drift = modes @ X
        jumped = (onward @ X.reshape(len(X), -1)).reshape(X.shape)
        return np.asarray(X + short * (drift + np.swapaxes(drift, -1, -2) + jumped))

    found = Bracket(-np.inf, -np.inf)
    for kept in flow_blocks(modes, generator):
        part = _searched(step, lambda X, kept=kept: continuous_bracket(modes, generator, X, kept, relative), kept)  # type: ignore[misc]
        found = Bracket(max(found.lower, part.lower), max(found.upper, part.upper))
    return found


def _searched(step: Step, judge: Judge, kept: BoolArray) -> Bracket:
    """The tightest bracket that steps from the identity, averaged steps and Arnoldi's method find on one block."""
    both = kept[:, :, None] & kept[:, None, :]
    X = np.where(both, np.eye(kept.shape[1]), 0.0)
    found, averaged, done = judge(X), False, 0
    for look in LOOKS:
        for _ in range(look - done):
            X = _unit(step(X) * both, X if averaged else None)
        done, before = look, found.width
        found = found.meet(judge(X))
        if found.width <= CLOSED:
            return found
        averaged = averaged or not found.width < 0.5 * before
    X = _arnoldi(step, X, both)
    found = found.meet(judge(X))
    if found.width > CLOSED:
        one = np.where(both, np.eye(kept.shape[1]), 0.0) * float(np.abs(X).max())
        for part in BORDER:
            found = found.meet(judge(X + part * one))
    return found


def _unit(X: FloatArray, average: FloatArray | None = None) -> FloatArray:
    """X symmetric, with largest entry 1; zero where nothing is left of it. On request averaged with another such matrix."""
    X = 0.5 * (X + np.swapaxes(X, -1, -2))
    size = float(np.abs(X).max())
    if size <= 0.0:
        return X
    X = X / size
    return X if average is None else 0.5 * (X + average)


def _arnoldi(step: Step, start: FloatArray, both: BoolArray) -> FloatArray:
    """The eigenvector of largest real part as matrices >= 0, or `start` where Arnoldi's method does not converge."""
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

    places = np.flatnonzero(both)
    if len(places) < BASIS + 2:
        return start
    work = np.zeros(both.shape)

    def matvec(vector: FloatArray) -> FloatArray:
        work.flat[places] = np.asarray(vector, float).reshape(-1)
        return np.asarray(step(work).flat[places])

    operator = LinearOperator((len(places), len(places)), matvec=matvec, dtype=np.float64)
    try:
        _, vectors = eigs(operator, k=1, which="LR", v0=start.flat[places], ncv=BASIS, maxiter=RESTARTS, tol=1e-14)
    except ArpackError:
        return start
    X = np.zeros(both.shape)
    X.flat[places] = vectors[:, 0].real
    values, axes = np.linalg.eigh(_unit(X if np.trace(X.sum(axis=0)) >= 0.0 else -X))
    return np.asarray((axes * np.maximum(values, 0.0)[:, None, :]) @ np.swapaxes(axes, -1, -2)) * both
