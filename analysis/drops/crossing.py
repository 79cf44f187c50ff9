"""The real eigenvalue at which a radius reaches 1 first, and whether rounding shows in it."""

from __future__ import annotations

import numpy as np

from estimators.arrays import BoolArray, FloatArray

# A real eigenvalue of a non-symmetric matrix comes out with an imaginary part of up to the square root of the rounding
# error where it is nearly double.
REAL = 1e-6
VISIBLE = 1e-8  # relative change of an answer from which rounding counts as showing in it


def largest_real(K: FloatArray, condition: FloatArray) -> tuple[FloatArray, BoolArray]:
    """The largest real eigenvalue (...) of K (..., d, d), 0 if none is positive, and where it is in doubt.

    `condition` (...) is that of the equation that K solves. Rounding moves an eigenvalue by its own condition number
    (Wilkinson 1965).
    """
    mu, vectors = np.linalg.eig(K)
    identity = np.eye(K.shape[-1])
    single = (np.linalg.slogdet(vectors)[0] != 0.0)[..., None]
    back = np.linalg.inv(np.where(single[..., None], vectors, identity))
    with np.errstate(over="ignore"):  # vectors that are nearly parallel: infinite is what it is then
        steep = np.where(single, np.linalg.norm(back, axis=-1), np.inf)
    size = np.linalg.norm(K, axis=(-2, -1)) * (1.0 + condition / 8.0)
    moved = len(identity) * np.finfo(float).eps * size[..., None] * steep
    real = np.abs(mu.imag) <= REAL * np.abs(mu)
    largest = np.where(real, mu.real, 0.0).max(axis=-1)
    # In doubt: an eigenvalue that may be the real one that counts, and whose own error is visible.
    first = (mu.real + moved >= np.maximum(largest, 1.0)[..., None]) & (np.abs(mu.imag) <= moved + REAL * np.abs(mu))
    return np.asarray(largest, float), np.asarray(
        (first & (moved > VISIBLE * np.maximum(np.abs(mu), 1.0))).any(axis=-1)
    )
