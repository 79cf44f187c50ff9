r"""x' = A(p) x + b(p) over a sample, for a batch of runs: exact while p stands still, of fourth order while it moves.

phi(M) R with phi(M) = int_0^1 e^(Ms) ds by its series in equal pieces of the sample, each with |M| <= 1: TERMS terms leave less
than 1/19! of R. While p moves linearly over the sample, each of its parts is the product of two exponentials (commutator-free
Magnus integrator of order four; Blanes, Moan 2006, with the Gauss points 1/2 -+ sqrt(3)/6).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from estimators.arrays import FloatArray
from estimators.lpv.exact_step import norm_bound

TERMS = 18
GAUSS = 0.5 - np.sqrt(3.0) / 6.0, 0.5 + np.sqrt(3.0) / 6.0
NEAR, FAR = 0.25 + np.sqrt(3.0) / 6.0, 0.25 - np.sqrt(3.0) / 6.0

Rates = Callable[[FloatArray], tuple[FloatArray, FloatArray]]  # of parameters (runs, p): A (runs, n, n) and b (runs, n)


def phi_times(M: FloatArray, R: FloatArray) -> FloatArray:
    """phi(M) R of stacks M (..., n, n) and R (..., n, m)."""
    size = np.abs(M).reshape(-1, *M.shape[-2:]).max(axis=0, initial=0.0)
    pieces = max(1, int(np.ceil(norm_bound(size))))
    M, rate = M / pieces, R / pieces
    total = np.zeros_like(rate)
    for _ in range(pieces):
        term = change = rate
        for k in range(TERMS):
            term = (M @ term) / (k + 2.0)
            change = change + term
        total = total + change
        rate = rate + M @ change
    return np.asarray(total)


def held(rates: Rates, x: FloatArray, p: FloatArray, period: float) -> FloatArray:
    """x (runs, n) at the end of a sample over which p (runs, p) stands still; exact."""
    A, b = rates(p)
    return _moved(period * A, period * b, x)


def moving(rates: Rates, x: FloatArray, p: FloatArray, p_next: FloatArray, period: float, parts: int) -> FloatArray:
    """x at the end of a sample over which the parameters move linearly from p to p_next, in `parts` steps of order four."""
    step = period / parts
    for k in range(parts):
        (A1, b1), (A2, b2) = (rates(p + (p_next - p) * ((k + c) / parts)) for c in GAUSS)
        x = _moved(step * (NEAR * A1 + FAR * A2), step * (NEAR * b1 + FAR * b2), x)
        x = _moved(step * (FAR * A1 + NEAR * A2), step * (FAR * b1 + NEAR * b2), x)
    return x


def _moved(M: FloatArray, b: FloatArray, x: FloatArray) -> FloatArray:
    rate = (M @ x[..., None])[..., 0] + b
    return np.asarray(x + phi_times(M, rate[..., None])[..., 0])
