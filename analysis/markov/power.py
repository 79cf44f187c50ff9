r"""The second-moment radius without the operator as a matrix: power iteration between two-sided bounds.

One step T X costs 2 m matrix products of size n; the operator as a matrix has (m n (n+1)/2)^2 entries. X = T^k I tends to the
eigenvector, and `analysis.markov.bracket` turns any X into bounds. Where other eigenvalues have the modulus of the radius (a
periodic chain, a rotation) X is averaged with its step, which moves them inwards; where that is slow, Arnoldi's method finds
the eigenvalue of largest real part, which the radius is (Krein and Rutman). Blocks of states that drive each other are taken
one by one (`analysis.markov.blocks`), so that zeros in the data cost nothing. What is left is an eigenvector on the border of the
cone that no coordinates show: its bracket stays open below, and is reported so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from analysis.markov.blocks import flow_blocks, step_blocks
from analysis.markov.bracket import Bracket, continuous_bracket, discrete_bracket
from analysis.markov.enclosure import DATA, EPS, enclosed
from estimators.arrays import BoolArray, FloatArray

LOOKS = (16, 32, 64, 128, 256, 512)  # steps after which the bounds are computed
CLOSED = 1e-11  # relative width of a bracket at which the search ends
BORDER = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11)  # parts of the identity added to a singular X, for the upper bound
BASIS, RESTARTS = 24, 60  # of Arnoldi's method
SMALL = 48  # unknowns of a block up to which its operator is written out at once
WIDE, LARGE = 1e-6, 600  # relative width of a bracket, and unknowns, up to which it is written out after all


class Estimate(NamedTuple):
    """`value` as found, and lower <= true value <= upper for all data within their error."""

    value: float
    lower: float
    upper: float


@dataclass(frozen=True)
class _Operator:
    """T as a function, the same with the sizes of all entries, a positive step whose eigenvector is the same, and bounds
    from X.
    """

    apply: Callable[[FloatArray], FloatArray]
    sizes: Callable[[FloatArray], FloatArray]
    step: Callable[[FloatArray], FloatArray]
    bracket: Callable[[FloatArray, BoolArray], Bracket]
    discrete: bool
    relative: float


def radius_estimate(modes: FloatArray, transition: FloatArray, relative: float = DATA) -> Estimate:
    """The radius of one system, modes (m, n, n) and transition (m, m), for all data within `relative` of these."""
    onward = np.ascontiguousarray(transition.T)

    def moved(A: FloatArray, X: FloatArray) -> FloatArray:
        return np.asarray((onward @ (A @ X @ np.swapaxes(A, -1, -2)).reshape(len(X), -1)).reshape(X.shape))

    def bracket(X: FloatArray, kept: BoolArray) -> Bracket:
        return discrete_bracket(modes, transition, X, kept, relative)

    absolute = np.abs(modes)
    operator = _Operator(
        lambda X: moved(modes, X), lambda X: moved(absolute, X), lambda X: moved(modes, X), bracket, True, relative
    )
    blocks = step_blocks(modes, transition)
    return _largest([_cycle(modes, transition, kept, relative) or _searched(operator, kept) for kept in blocks], 0.0)


def abscissa_estimate(modes: FloatArray, generator: FloatArray, relative: float = DATA) -> Estimate:
    """The abscissa in 1/s of one process, modes (m, n, n) in 1/s and generator (m, m), as `radius_estimate`."""
    size = 2.0 * float(np.linalg.norm(modes, axis=(-2, -1)).max()) + 2.0 * float(np.abs(generator).max())
    short = 1.0 / max(size, np.finfo(float).tiny)

    def flow(A: FloatArray, Q: FloatArray, X: FloatArray) -> FloatArray:
        drift = A @ X
        return np.asarray(drift + np.swapaxes(drift, -1, -2) + (Q.T @ X.reshape(len(X), -1)).reshape(X.shape))

    def bracket(X: FloatArray, kept: BoolArray) -> Bracket:
        return continuous_bracket(modes, generator, X, kept, relative)

    operator = _Operator(
        lambda X: flow(modes, generator, X),
        lambda X: flow(np.abs(modes), np.abs(generator), X),
        lambda X: X + short * flow(modes, generator, X),  # short enough for the abscissa to lead
        bracket,
        False,
        relative,
    )
    return _largest([_searched(operator, kept) for kept in flow_blocks(modes, generator)], -np.inf)


def _largest(parts: list[Estimate], least: float) -> Estimate:
    return (
        Estimate(*(max([least, *column]) for column in zip(*parts, strict=True))) if parts else Estimate(*[least] * 3)
    )


def _searched(operator: _Operator, kept: BoolArray) -> Estimate:
    """The tightest bracket that steps from the identity, averaged steps and Arnoldi's method find on one block."""
    both = kept[:, :, None] & kept[:, None, :]
    unknowns = int(np.triu(both).sum())
    if unknowns <= SMALL:
        return _written_out(operator, both)
    one = np.where(both, np.eye(kept.shape[1]), 0.0)
    X, found, averaged, done = one, operator.bracket(one, kept), False, 0
    for look in LOOKS if operator.discrete else LOOKS[:1]:  # short steps of a process say little: Arnoldi's method does
        for _ in range(look - done):
            X = _unit(operator.step(X) * both, X if averaged else None)
        done, before = look, found.width
        found = found.meet(operator.bracket(X, kept))
        if found.width <= CLOSED:
            return Estimate(found.middle, *found)
        averaged = averaged or not found.width < 0.5 * before
    value, X = _arnoldi(operator.apply, X, both)
    found = found.meet(operator.bracket(X, kept))
    for part in BORDER if found.width > CLOSED else ():
        found = found.meet(operator.bracket(X + part * float(np.abs(X).max()) * one, kept))
    if np.isnan(value) or (found.width > WIDE and unknowns <= LARGE):
        exact = _written_out(operator, both)
        value, found = exact.value, found.meet(Bracket(exact.lower, exact.upper))
    value = found.middle if found.width <= CLOSED else min(max(value, found.lower), found.upper)
    return Estimate(value, *found)


def _cycle(modes: FloatArray, transition: FloatArray, kept: BoolArray, relative: float) -> Estimate | None:
    """A block whose modes follow each other in one order only: |eigenvalue|^2 of one product. None for any other block."""
    inside = np.flatnonzero(kept.any(axis=1))
    following = (transition[np.ix_(inside, inside)] > 0.0) @ np.eye(len(inside), dtype=int)
    if not (following.sum(axis=1) == 1).all():
        return None
    product, size, share, place = np.diag(kept[inside[0]].astype(float)), np.diag(kept[inside[0]].astype(float)), 1.0, 0
    for _ in inside:
        after = int(following[place].argmax())
        A = modes[inside[place]] * kept[inside[after]][:, None]
        product, size = A @ product, np.abs(A) @ size
        share *= float(transition[inside[place], inside[after]])
        place = after
    count, n = len(inside), kept.shape[1]
    found = enclosed(product, count * (relative + 2.0 * n * EPS) * size)
    slack = (1.0 - 2.0 * count * (relative + EPS), 1.0, 1.0 + 2.0 * count * (relative + EPS))
    ends = (found.lower, found.value, found.upper)
    lower, value, upper = ((share * float(x) ** 2 * f) ** (1.0 / count) for x, f in zip(ends, slack, strict=True))
    return Estimate(value, lower * (1.0 - 2.0 * EPS), upper * (1.0 + 2.0 * EPS))


def _unit(X: FloatArray, average: FloatArray | None = None) -> FloatArray:
    """X symmetric, with largest entry 1; zero where nothing is left of it. On request averaged with another such matrix."""
    X = 0.5 * (X + np.swapaxes(X, -1, -2))
    size = float(np.abs(X).max())
    if size <= 0.0:
        return X
    X = X / size
    return X if average is None else 0.5 * (X + average)


def _written_out(operator: _Operator, both: BoolArray) -> Estimate:
    """A block with few unknowns: its operator on the independent entries as a matrix, and its eigenvalues in discs."""
    places = np.argwhere(np.triu(both))
    matrix, size = np.empty((2, len(places), len(places)))
    where = tuple(places.T)
    for column, (j, a, b) in enumerate(places):
        unit = np.zeros(both.shape)
        unit[j, a, b] = unit[j, b, a] = 1.0
        matrix[:, column], size[:, column] = operator.apply(unit)[where], operator.sizes(unit)[where]
    rounding = 3.0 * operator.relative + (2.0 * both.shape[1] + both.shape[0] + 4.0) * EPS
    value, lower, upper = (float(x) for x in enclosed(matrix, rounding * size, modulus=operator.discrete))
    return Estimate(value, lower, upper)


def _arnoldi(apply: Callable[[FloatArray], FloatArray], start: FloatArray, both: BoolArray) -> tuple[float, FloatArray]:
    """The eigenvalue of largest real part and its eigenvector as matrices >= 0; NaN and `start` where it is not found."""
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

    places = np.flatnonzero(both)
    work = np.zeros(both.shape)

    def matvec(vector: FloatArray) -> FloatArray:
        work.flat[places] = np.asarray(vector, float).reshape(-1)
        return np.asarray(apply(work).flat[places])

    operator = LinearOperator((len(places), len(places)), matvec=matvec, dtype=np.float64)
    try:
        values, vectors = eigs(operator, k=1, which="LR", v0=start.flat[places], ncv=BASIS, maxiter=RESTARTS, tol=1e-14)
    except ArpackError:
        return float("nan"), start
    X = np.zeros(both.shape)
    X.flat[places] = vectors[:, 0].real
    sizes, axes = np.linalg.eigh(_unit(X if np.trace(X.sum(axis=0)) >= 0.0 else -X))
    return float(values[0].real), (axes * np.maximum(sizes, 0.0)[:, None, :]) @ np.swapaxes(axes, -1, -2) * both
