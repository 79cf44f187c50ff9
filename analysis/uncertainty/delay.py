r"""Constant delay of the measurements of a sampled observer: which delays it stands.

A measurement taken at t_k - d is compared with the estimate of its own time (it carries a time stamp), and the correction is
made when it comes, at t_k; between samples the corrected estimate runs on. With e_k the error before the correction at t_k and
d = s T + r, 0 <= r < T, the error at t_k - d is e^(-rA) e_(k-s), so

    e_(k+1) = e^(TA) e_k - K C e^(-rA) e_(k-s)          (without delay the update e+ = (e^(TA) - K C) e).

The delay is constant, so that every value of it is either stable or not. All delays of an interval at once: the interval is a
ball, the exponentials are enclosed, and the signs of the stability test count only where they are certain
(`synthesis.polynomials.stable`); else it is halved.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from flint import arb, arb_mat, fmpq
from numpy.typing import ArrayLike

from analysis.checks import positive
from analysis.uncertainty.jitter import observer_matrices
from estimators.arrays import FloatArray
from estimators.display import Display
from synthesis.polynomials.rational import as_float, rational
from synthesis.polynomials.stable import is_schur

FINEST = 14  # halvings of a sample before a delay counts as open
COARSEST = 4  # halvings to begin with
BEYOND = 20  # doublings of the smallest piece in the search for a witness


@dataclass(frozen=True, repr=False)
class DelayMargin(Display):
    """Stable for every constant delay in [0, lower) s; not stable at the delay `upper` s (inf: none found up to `looked` s)."""

    shown_units: ClassVar = {"lower": "s", "upper": "s", "looked": "s"}

    lower: float
    upper: float
    looked: float


def delay_margin(A: ArrayLike, C: ArrayLike, K: ArrayLike, sample_time: float, most_samples: int = 4) -> DelayMargin:
    """The largest constant delay up to which xhat+ = e^(TA) xhat + .. + K (y - C xhat)(t - d) is stable, as a bracket, s.

    A (n, n), C (p, n), K (n, p), `sample_time` in s; delays up to `most_samples` samples are looked at. Both bounds are 0 for
    an observer that is certainly not stable without delay. Raises AnalysisError for matrices that do not fit or are not finite.

    >>> found = delay_margin([[0.0, 1.0], [0.0, -1.0]], [[1.0, 0.0]], [[0.2], [0.1]], sample_time=0.1)
    >>> 0.0 < found.lower <= found.upper
    True
    """
    a, c, k = observer_matrices(A, C, K)
    period = rational(positive("sample_time", sample_time))
    most = max(1, int(most_samples))
    proved = fmpq(0)
    for s in range(most):
        waiting = [(fmpq(i, 2**COARSEST), fmpq(i + 1, 2**COARSEST), COARSEST) for i in reversed(range(2**COARSEST))]
        while waiting:
            low, high, level = waiting.pop()
            if is_schur(_between(a, c, k, period, s, low, high)) is True:
                proved = period * (s + high)
                continue
            if level == FINEST:
                return DelayMargin(_down(proved), _witness(a, c, k, period, s, low), _up(period * most))
            middle = (low + high) / 2
            waiting += [(middle, high, level + 1), (low, middle, level + 1)]
    return DelayMargin(_down(proved), np.inf, _up(period * most))


def _witness(A: FloatArray, C: FloatArray, K: FloatArray, period: fmpq, s: int, low: fmpq) -> float:
    """A delay a little beyond at which the observer is certainly not stable; inf if none was met."""
    for place in (low, *(low + fmpq(2**doubling, 2 ** (FINEST + 2)) for doubling in range(BEYOND))):
        if not place < 1:
            break
        if is_schur(_between(A, C, K, period, s, place, place)) is False:
            return _up(period * (s + place))
    return np.inf


def _between(A: FloatArray, C: FloatArray, K: FloatArray, period: fmpq, s: int, low: fmpq, high: fmpq) -> arb_mat:
    """The update for all d = (s + r) T with r in [low, high]."""
    a, half = _balls(A), period * (high - low) / 2
    spread = arb(0, arb(half).abs_upper()) if half else arb(0)
    # e^(M + N) with N a ball: the middle exactly, the rest by its own, much smaller exponential.
    back = (a * arb(-period * (low + high) / 2)).exp() * (a * spread).exp()
    return _companion((a * arb(period)).exp(), _balls(K) * _balls(C) * back, s)


def _companion(first: arb_mat, correction: arb_mat, s: int) -> arb_mat:
    """[e_(k+1), e_k, ..] from [e_k, .., e_(k-s)] with e_(k+1) = first e_k - correction e_(k-s)."""
    n = first.nrows()
    size = n * (s + 1)
    rows = [[arb(0)] * size for _ in range(size)]
    for i in range(n):
        for j in range(n):
            rows[i][j] = rows[i][j] + first[i, j]
            rows[i][n * s + j] = rows[i][n * s + j] - correction[i, j]
    for i in range(n * s):
        rows[n + i][i] = arb(1)
    return arb_mat(rows)


def _balls(matrix: FloatArray) -> arb_mat:
    return arb_mat([[arb(float(x)) for x in row] for row in matrix])


def _down(number: fmpq) -> float:
    value = as_float(number)
    return value if rational(value) <= number else float(np.nextafter(value, -np.inf))


def _up(number: fmpq) -> float:
    value = as_float(number)
    return value if rational(value) >= number else float(np.nextafter(value, np.inf))
