"""Systems that are zero up to rounding."""

from __future__ import annotations

import numpy as np

from analysis.norms.frequency_response import Systems
from estimators.arrays import BoolArray


def is_zero(systems: Systems) -> tuple[BoolArray, BoolArray]:
    """Whether D and all Markov parameters C A^k B vanish up to rounding, and whether they do so exactly, term by term.

    Rounding is bounded entry by entry by |C| |A|^k |B|, which no scaling of the states can fool.
    """
    zero = np.asarray(~systems.D.any(axis=(-2, -1)))
    suspect = np.flatnonzero(zero)
    moved, bound, C = systems.B[suspect], np.abs(systems.B[suspect]), systems.C[suspect]
    A, n = np.zeros((len(suspect), 0, 0)), systems.A.shape[-1]
    exact = zero.copy()
    for power in range(n):
        roundoff = 4 * n * (power + 1) * np.finfo(float).eps * (np.abs(C) @ bound)
        exact[suspect[roundoff.any(axis=(-2, -1))]] = False
        keep = (np.abs(C @ moved) <= roundoff).all(axis=(-2, -1))
        zero[suspect[~keep]] = False
        suspect, C = suspect[keep], C[keep]
        if not len(suspect):
            break
        A = A[keep] if power else systems.A[suspect]
        A = A / np.maximum(np.abs(A).max(axis=(-2, -1), keepdims=True), np.finfo(float).tiny)  # against overflow only
        moved, bound = A @ moved[keep], np.abs(A) @ bound[keep]
    return zero, zero & exact
