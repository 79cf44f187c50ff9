"""Proof that a known matrix polynomial is positive definite on a box: matrix Bernstein coefficients and subdivision."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError
from synthesis.polynomials.bernstein import halved, in_bernstein
from synthesis.polynomials.cut_boxes import positive_on_part
from synthesis.polynomials.half_spaces import Faces
from synthesis.polynomials.matrix import MatrixPolynomial

MOST_NUMBERS = 20_000_000  # of all boxes that are open where the set is no box: 160 MB


@dataclass(frozen=True)
class Positivity:
    """`proved` on the whole box; `smallest` eigenvalue seen at `place`; `scale` the largest eigenvalue magnitude seen."""

    proved: bool
    refuted: bool
    smallest: float
    place: FloatArray
    scale: float


def prove_positive(
    matrix: MatrixPolynomial, depth: int = 16, magnitude: float = 0.0, faces: Faces | None = None
) -> Positivity:
    r"""Decide M(u) > 0 on [-1, 1]^v, or on that part of it where `faces` hold, in floating point with a guard for rounding.

    M(u) = sum_k B_k(u) M_k with Bernstein polynomials B_k >= 0 that sum to one, so M_k > 0 for all k proves M > 0; corner
    coefficients are values of M, so a non-positive one refutes it. Boxes that decide nothing are halved, all at once.
    The guard bounds every rounding error: conversion and halving are averages, so nothing grows beyond the sum of the
    absolute coefficients. `magnitude` says how large the numbers were of which the coefficients were added up: what cancelled
    there left rounding errors of that size. With `faces` boxes wholly outside are left out, and a corner outside refutes
    nothing; boxes that the border cuts are proved whole or halved. Raises ProblemError for coefficients that are not finite.
    """
    v = matrix.variables
    local = matrix.coefficients[..., 0]
    if not np.isfinite(local).all():
        raise ProblemError("a matrix polynomial with coefficients that are not finite has no sign")
    size = max(float(np.abs(local).sum(axis=tuple(range(v))).sum(axis=-1).max()), magnitude)
    bounded = [] if faces is None else [int(axis) for axis in np.flatnonzero(faces.normals.any(axis=0))]
    for axis in bounded:  # a box must have its ends where it may be cut
        wide = [(0, int(k == axis and n == 1)) for k, n in enumerate(local.shape)]
        local = np.pad(local, wide)
    local = in_bernstein(local, range(v))
    boxes, lower, width = local[None], np.zeros((1, v)), np.ones((1, v))
    scale = float(np.abs(np.linalg.eigvalsh(local)).max()) or 1.0
    guard = 4 * np.finfo(float).eps * size * (local.shape[-1] + sum(local.shape[:v]))
    axes = [axis for axis in range(v) if local.shape[axis] > 1]
    smallest, place = np.inf, np.zeros(v)
    if faces is not None:  # what is affine in a variable is positive between its ends if it is so at both
        axes = [axis for axis in axes if axis in bounded or local.shape[axis] > 2]
        smallest, place = _at_corners(matrix, faces)
    for level in range(depth * max(len(axes), 1) + 1):
        eigenvalues = np.linalg.eigvalsh(boxes)[..., 0]
        for corner in np.ndindex(*(2 if n > 1 else 1 for n in local.shape[:v])):
            values = eigenvalues[(slice(None), *(-c for c in corner))]
            values = _within(faces, 2.0 * (lower + width * np.array(corner)) - 1.0, values)
            worst = int(np.argmin(values))
            if values[worst] < smallest:
                smallest, place = float(values[worst]), lower[worst] + width[worst] * np.array(corner)
        if smallest <= guard:
            break
        open_boxes = ~(eigenvalues.reshape(len(boxes), -1).min(axis=1) > guard)
        if faces is not None:
            centre = 2.0 * lower - 1.0 + width
            open_boxes &= ~faces.misses(centre, width)
            left = np.flatnonzero(open_boxes)[: MOST_NUMBERS // local.size]
            if len(left):
                open_boxes[left] = ~positive_on_part(boxes[left], centre[left], width[left], faces, guard)
        if not open_boxes.any():
            return Positivity(True, False, *_refine(matrix, 2.0 * place - 1.0, smallest, faces), scale)
        most = 200_000 if faces is None else MOST_NUMBERS // local.size
        if not axes or level == depth * len(axes) or open_boxes.sum() > most:
            break
        boxes, lower, width = boxes[open_boxes], lower[open_boxes], width[open_boxes]
        boxes, lower, width = _halve(boxes, lower, width, axes[level % len(axes)])
    smallest, place = _refine(matrix, 2.0 * place - 1.0, smallest, faces)
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


def _within(faces: Faces | None, points: FloatArray, values: Any) -> FloatArray:
    """Values at places, infinite outside the set."""
    return np.asarray(values if faces is None else np.where(faces.inside(points), values, np.inf), np.float64)


def _at_corners(matrix: MatrixPolynomial, faces: Faces) -> tuple[float, FloatArray]:
    """The least eigenvalue at the corners of the set and the ends of all other variables, and where, as a part of the box."""
    rest = matrix.variables - faces.corners.shape[1]
    ends = np.array(list(product((-1.0, 1.0), repeat=rest))).reshape(2**rest, rest)
    points = np.hstack([np.repeat(faces.corners, len(ends), axis=0), np.tile(ends, (len(faces.corners), 1))])
    least = np.linalg.eigvalsh(matrix.at(points)[..., 0])[:, 0]
    worst = int(np.argmin(least))
    return float(least[worst]), 0.5 * (points[worst] + 1.0)


def _refine(
    matrix: MatrixPolynomial, place: FloatArray, smallest: float, faces: Faces | None = None
) -> tuple[float, FloatArray]:
    """The tightest place on a grid along each axis through the best corner seen (for the message, not for the proof)."""
    for axis in range(matrix.variables):
        if matrix.degrees[axis] == 0:
            continue
        number = 2 if matrix.degrees[axis] == 1 else 129
        points = np.tile(place, (number, 1))
        points[:, axis] = np.linspace(-1.0, 1.0, number)
        eigenvalues = np.linalg.eigvalsh(matrix.at(points)[..., 0])[:, 0]
        eigenvalues = _within(faces, points, eigenvalues)
        best = int(np.argmin(eigenvalues))
        if eigenvalues[best] < smallest:
            smallest, place = float(eigenvalues[best]), points[best]
    return smallest, place
