"""Are polynomials positive on a box, or on what half spaces leave of it? Bernstein coefficients, and boxes that are halved.

Many boxes at once in float64 with a guard for all rounding, and what the guard leaves open in balls of 128 bits. A point where
a polynomial is not positive counts only if its exact value there is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from flint import fmpq

from estimators.arrays import FloatArray
from synthesis.polynomials.bernstein import halved, in_bernstein
from synthesis.polynomials.definite import sign_on_box
from synthesis.polynomials.enclosure import PolynomialMatrix
from synthesis.polynomials.half_spaces import Faces, HalfSpaces, faces_of
from synthesis.polynomials.rational import as_float, rational

MOST_BOXES = 300  # in balls
MOST_AT_ONCE, LEVELS = 60_000, 40  # in floats
GUARD = (
    1e-12  # times the sum of absolute coefficients: conversion, and LEVELS averages of each degree, lose less by far
)

Box = tuple[tuple[fmpq, ...], tuple[fmpq, ...]]  # centre and half widths


@dataclass(frozen=True)
class Decision:
    """`positive` everywhere; or a point where one certainly is not; or neither, and `open_at` is in a box that stayed open."""

    positive: bool
    fails_at: tuple[fmpq, ...] | None = None
    open_at: tuple[fmpq, ...] | None = None


def all_positive(
    polynomials: Sequence[PolynomialMatrix],
    offset: Sequence[fmpq],
    factor: Sequence[fmpq],
    half_spaces: HalfSpaces = (),
) -> Decision:
    """Every 1 x 1 polynomial on the box offset + factor t, t in [-1, 1]^v where the half spaces of t hold."""
    for polynomial in polynomials:
        local = polynomial.affine(offset, factor)
        found = _in_floats(local, half_spaces)
        if isinstance(found, list):
            found = _in_balls(local, found, half_spaces)
        if not found.positive:
            places = (None if t is None else _outside(t, offset, factor) for t in (found.fails_at, found.open_at))
            return Decision(False, *places)
    return Decision(True)


def _outside(t: tuple[fmpq, ...], offset: Sequence[fmpq], factor: Sequence[fmpq]) -> tuple[fmpq, ...]:
    return tuple(o + f * x for o, f, x in zip(offset, factor, t, strict=True))


def _in_floats(polynomial: PolynomialMatrix, half_spaces: HalfSpaces) -> Decision | list[Box]:
    """The decision, or the boxes of [-1, 1]^v that float64 leaves open."""
    degrees, v = polynomial.degrees, polynomial.variables
    coefficients = np.zeros([d + 1 for d in degrees])
    for powers, entries in polynomial.terms.items():
        coefficients[powers] = as_float(entries[0, 0])
    guard = GUARD * float(np.abs(coefficients).sum())
    whole = ((fmpq(0),) * v, (fmpq(1),) * v)
    if not np.isfinite(guard):
        return [whole]
    boxes, centre, half = in_bernstein(coefficients, range(v))[None], np.zeros((1, v)), np.ones((1, v))
    left: list[Box] = []
    faces = faces_of(half_spaces)
    for _ in range(LEVELS * max(v, 1)):
        if faces is not None:
            kept = ~faces.misses(centre, half)
            boxes, centre, half = boxes[kept], centre[kept], half[kept]
            if not len(boxes):
                return left or Decision(True)
        lowest, highest = (f(boxes.reshape(len(boxes), -1), axis=1) for f in (np.min, np.max))
        below = _negative_corner(boxes, centre, half, degrees, guard, faces)
        if below is not None:
            point = tuple(rational(float(x)) for x in below)
            if polynomial.at(point)[0, 0] <= 0 and all(h.holds(point) for h in half_spaces):
                return Decision(False, point)
        hopeless = highest <= 4.0 * guard
        left += [_exact(c, h) for c, h in zip(centre[hopeless], half[hopeless], strict=True)]
        waiting = ~(lowest > guard) & ~hopeless
        if not waiting.any():
            return left or Decision(True)
        if waiting.sum() > MOST_AT_ONCE or len(left) > MOST_BOXES or not any(degrees):
            break
        boxes, centre, half = _halved(boxes[waiting], centre[waiting], half[waiting])
    return left + [_exact(c, h) for c, h in zip(centre[: MOST_BOXES + 1], half[: MOST_BOXES + 1], strict=True)]


def _negative_corner(
    boxes: FloatArray,
    centre: FloatArray,
    half: FloatArray,
    degrees: tuple[int, ...],
    guard: float,
    faces: Faces | None,
) -> FloatArray | None:
    """The corner in the set with the least value, if that is certainly negative."""
    best, place = -guard, None
    for corner in np.ndindex(*(2 if d else 1 for d in degrees)):
        places = centre + half * (2.0 * np.array(corner) - 1.0)
        values = boxes[(slice(None), *(-c for c in corner))]
        values = values if faces is None else np.where(faces.inside(places), values, np.inf)
        worst = int(values.argmin())
        if values[worst] < best:
            best, place = float(values[worst]), places[worst]
    return place


def _halved(boxes: FloatArray, centre: FloatArray, half: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Every box cut along the axis in which its coefficients vary most."""
    v = centre.shape[1]
    variation = np.stack([
        np.abs(np.diff(boxes, axis=1 + i)).reshape(len(boxes), -1).max(axis=1, initial=0.0) * (boxes.shape[1 + i] - 1)
        for i in range(v)
    ])  # fmt: skip
    axes = variation.argmax(axis=0)
    parts: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    for axis in np.unique(axes):
        chosen = axes == axis
        low, high = halved(boxes[chosen], 1 + axis)
        narrow = half[chosen].copy()
        narrow[:, axis] *= 0.5
        for sign, side in ((-1.0, low), (1.0, high)):
            moved = centre[chosen].copy()
            moved[:, axis] += sign * narrow[:, axis]
            parts.append((side, moved, narrow))
    first, second, third = zip(*parts, strict=True)
    return np.concatenate(first), np.concatenate(second), np.concatenate(third)


def _exact(centre: FloatArray, half: FloatArray) -> Box:
    return tuple(rational(float(x)) for x in centre), tuple(rational(float(x)) for x in half)


def _in_balls(polynomial: PolynomialMatrix, boxes: list[Box], half_spaces: HalfSpaces) -> Decision:
    """The same in 128 bits, on boxes of [-1, 1]^v."""
    waiting, done = list(boxes), 0
    if len(boxes) > MOST_BOXES:
        return Decision(False, None, boxes[0][0])
    while waiting:
        centre, half = waiting.pop()
        if any(h.misses(centre, half) for h in half_spaces):
            continue
        done += 1
        local = polynomial.affine(centre, half)
        sign = sign_on_box(local.balls())
        if sign.fails_at is not None:
            point = _outside(tuple(fmpq(t) for t in sign.fails_at), centre, half)
            if all(h.holds(point) for h in half_spaces):
                return Decision(False, point)
        if sign.positive:
            continue
        if done > MOST_BOXES:
            return Decision(False, None, centre)
        axis = max(range(len(half)), key=lambda i: _weight(local, i), default=-1)
        if axis < 0:
            return Decision(False, None, centre)
        for direction in (1, -1):
            moved = (*centre[:axis], centre[axis] + direction * half[axis] / 2, *centre[axis + 1 :])
            waiting.append((moved, (*half[:axis], half[axis] / 2, *half[axis + 1 :])))
    return Decision(True)


def _weight(polynomial: PolynomialMatrix, axis: int) -> float:
    """How much a polynomial varies along an axis."""
    return sum(abs(as_float(m[0, 0])) * k[axis] for k, m in polynomial.terms.items())
