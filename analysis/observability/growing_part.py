"""A part of the state that a pair hides to within a level, and of which a mode grows whatever a change of that size does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from analysis.observability.hautus_distance import border_clear
from estimators.arrays import FloatArray


def growing_mode(A: FloatArray, C: FloatArray, parts: list[FloatArray], discrete: bool, level: float) -> complex | None:
    """An eigenvalue that grows of V'AV for one of the orthonormal bases V (n, d) in `parts`; None if there is none for sure.

    |[A V - V V'AV; C V]| <= 4 level: a pair that near hides the span of V. On the border of stability sigma_min(V'AV - z I) is
    above the level and that residual, so that no change of that size lets an eigenvalue cross it.
    """
    for V in parts:
        inner = V.T @ A @ V
        rest = np.concatenate([A @ V - V @ inner, C @ V])
        residual = float(np.linalg.norm(rest, 2)) if rest.size else 0.0
        modes = np.linalg.eigvals(inner).astype(complex)
        grows = np.abs(modes) > 1.0 if discrete else modes.real > 0.0
        if residual <= 4.0 * level and grows.any() and border_clear(inner, discrete, level + residual):
            return complex(modes[grows][0])
    return None


def least_seen(A: FloatArray, C: FloatArray, mode: complex) -> Iterator[FloatArray]:
    """Orthonormal bases of the direction, and of the real plane, that [A - mode I; C] sees least."""
    stacked = np.concatenate([A - mode * np.eye(len(A)), C])
    v = np.linalg.svd(stacked)[2][-1].conj()
    v = v * np.exp(-0.5j * np.angle((v * v).sum()))  # as real as its phase allows
    plane = np.linalg.svd(np.stack([v.real, v.imag], axis=1), full_matrices=False)[0]
    yield np.asarray(plane[:, :1])
    if len(A) > 1:
        yield np.asarray(plane)
