"""Is a symmetric matrix polynomial positive definite on each of many boxes? Bernstein coefficients and a checked factor."""

from __future__ import annotations

from typing import Any

import numpy as np

from estimators.arrays import BoolArray, FloatArray
from synthesis.polynomials.bernstein import in_bernstein
from synthesis.polynomials.boxes import EPS, INFLATE, Boxes, orders


def positive(matrix: Boxes) -> BoolArray:
    """Which boxes (g,) certainly have M(t) > 0 everywhere, from their Bernstein coefficients; only a True says something.

    Every coefficient B, scaled by powers of two to a diagonal near one, is positive definite if B - c I = R'R + D with row sums
    of |D| and of the radius below c: R'R >= 0 whatever R is, so that how R was found does not matter.
    """
    good = _positive(matrix.shortened())
    left = np.flatnonzero(~good)
    if len(left):
        part = matrix if len(matrix.middle) == 1 else matrix._like(matrix.middle[left], matrix.radius[left])
        good[left] = _positive(part)
    return good


def _positive(matrix: Boxes) -> BoolArray:
    table = orders(matrix.variables, matrix.highest)
    used: list[tuple[int, ...]] = [
        p for p, k in zip(table.powers, np.abs(matrix.middle).max(axis=(0, 2, 3)), strict=True) if k > 0.0
    ]
    degrees = [max((k[i] for k in used), default=0) for i in range(matrix.variables)]
    n = matrix.shape[0]
    tensor = np.zeros((len(matrix.middle), *(d + 1 for d in degrees), n, n))
    for number, k in enumerate(table.powers):
        if all(a <= d for a, d in zip(k, degrees, strict=True)):
            place: Any = (slice(None), *k)
            tensor[place] = matrix.middle[:, number]
    tensor = in_bernstein(tensor, range(1, len(degrees) + 1))
    radius = matrix.radius + EPS * (2 * sum(degrees) + 8) * np.abs(matrix.middle).sum(axis=1)
    values = tensor.reshape(len(tensor), -1, n, n)
    return np.asarray(_definite(values, INFLATE * radius[:, None]).all(axis=1))


def _definite(values: FloatArray, radius: FloatArray) -> BoolArray:
    diagonal = np.diagonal(values, axis1=-2, axis2=-1)
    good = np.asarray((diagonal > 0.0).all(axis=-1) & np.isfinite(values).all(axis=(-2, -1)))
    scale = np.exp2(-np.round(0.5 * np.log2(np.where(good[..., None], diagonal, 1.0))))
    scaled = values * scale[..., :, None] * scale[..., None, :]
    spread = INFLATE * radius * scale[..., :, None] * scale[..., None, :]
    need = spread.sum(axis=-1).max(axis=-1)
    shift = 2.0 * need + 64 * values.shape[-1] ** 2 * EPS
    shifted = scaled - shift[..., None, None] * np.eye(values.shape[-1])
    R, found = _factor(shifted)
    back = np.swapaxes(R, -1, -2) @ R
    size = np.swapaxes(np.abs(R), -1, -2) @ np.abs(R) + np.abs(scaled) + shift[..., None, None]
    rest = np.abs(shifted - back) + EPS * (values.shape[-1] + 8) * size
    return np.asarray(good & found & (INFLATE * (rest.sum(axis=-1).max(axis=-1) + need) < shift))


def _factor(matrices: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Upper triangular R with R'R near the matrix, for a stack; and where every pivot was positive."""
    work, n = matrices.copy(), matrices.shape[-1]
    R = np.zeros_like(work)
    good: BoolArray = np.ones(work.shape[:-2], dtype=np.bool_)
    for k in range(n):
        pivot = work[..., k, k]
        good &= pivot > 0.0
        root = np.sqrt(np.where(good, pivot, 1.0))
        R[..., k, k:] = work[..., k, k:] / root[..., None]
        R[..., k, k] = root
        work[..., k + 1 :, k + 1 :] -= R[..., k, k + 1 :, None] * R[..., k, None, k + 1 :]
    return R, good
