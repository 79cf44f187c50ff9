"""Proof that a known matrix polynomial is positive definite on a box: matrix Bernstein coefficients and subdivision."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError
from synthesis.polynomials.bernstein import halved, in_bernstein
from synthesis.polynomials.matrix import MatrixPolynomial


@dataclass(frozen=True)
class Positivity:
    """`proved` on the whole box; `smallest` eigenvalue seen at `place`; `scale` the largest eigenvalue magnitude seen."""

    proved: bool
    refuted: bool
    smallest: float
    place: FloatArray
    scale: float


def prove_positive(matrix: MatrixPolynomial, depth: int = 16, magnitude: float = 0.0) -> Positivity:
    r"""Decide M(u) > 0 on [-1, 1]^v in floating point with a guard for rounding.

    M(u) = sum_k B_k(u) M_k with Bernstein polynomials B_k >= 0 that sum to one, so M_k > 0 for all k proves M > 0; corner
    coefficients are values of M, so a non-positive one refutes it. Boxes that decide nothing are halved, all at once.
    The guard bounds every rounding error: conversion and halving are averages, so nothing grows beyond the sum of the
    absolute coefficients. `magnitude` says how large the numbers were of which the coefficients were added up: what cancelled
    there left rounding errors of that size. Raises ProblemError for coefficients that are not finite.
    """
    v = matrix.variables
    local = matrix.coefficients[..., 0]
    if not np.isfinite(local).all():
        raise ProblemError("a matrix polynomial with coefficients that are not finite has no sign")
    size = max(float(np.abs(local).sum(axis=tuple(range(v))).sum(axis=-1).max()), magnitude)
    local = in_bernstein(local, range(v))
    boxes, lower, width = local[None], np.zeros((1, v)), np.ones((1, v))
    scale = float(np.abs(np.linalg.eigvalsh(local)).max()) or 1.0
    guard = 4 * np.finfo(float).eps * size * (local.shape[-1] + sum(local.shape[:v]))
    axes = [axis for axis in range(v) if local.shape[axis] > 1]
    smallest, place = np.inf, np.zeros(v)
    for level in range(depth * max(len(axes), 1) + 1):
        eigenvalues = np.linalg.eigvalsh(boxes)[..., 0]
        for corner in np.ndindex(*(2 if n > 1 else 1 for n in local.shape[:v])):
            values = eigenvalues[(slice(None), *(-c for c in corner))]
            worst = int(np.argmin(values))
            if values[worst] < smallest:
                smallest, place = float(values[worst]), lower[worst] + width[worst] * np.array(corner)
        if smallest <= guard:
            break
        open_boxes = ~(eigenvalues.reshape(len(boxes), -1).min(axis=1) > guard)
        if not open_boxes.any():
            return Positivity(True, False, *_refine(matrix, 2.0 * place - 1.0, smallest), scale)
        if not axes or level == depth * len(axes) or open_boxes.sum() > 200_000:
            break
        boxes, lower, width = boxes[open_boxes], lower[open_boxes], width[open_boxes]
        boxes, lower, width = _halve(boxes, lower, width, axes[level % len(axes)])
    smallest, place = _refine(matrix, 2.0 * place - 1.0, smallest)
    return Positivity(False, smallest < -guard, smallest, place, scale)


def _halve(
    boxes: FloatArray, lower: FloatArray, width: FloatArray, axis: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cut in the middle of one axis, all boxes at once."""
    halves = halved(boxes, axis + 1)
    width = width.copy()
    width[:, axis] *= 0.5
    shifted = lower.copy()
    shifted[:, axis] += width[:, axis]
    return np.concatenate(halves), np.concatenate([lower, shifted]), np.concatenate([width, width])


def _refine(matrix: MatrixPolynomial, place: FloatArray, smallest: float) -> tuple[float, FloatArray]:
    """The tightest place on a grid along each axis through the best corner seen (for the message, not for the proof)."""
    for axis in range(matrix.variables):
        if matrix.degrees[axis] == 0:
            continue
        number = 2 if matrix.degrees[axis] == 1 else 129
        points = np.tile(place, (number, 1))
        points[:, axis] = np.linspace(-1.0, 1.0, number)
        eigenvalues = np.linalg.eigvalsh(matrix.at(points)[..., 0])[:, 0]
        best = int(np.argmin(eigenvalues))
        if eigenvalues[best] < smallest:
            smallest, place = float(eigenvalues[best]), points[best]
    return smallest, place
