"""N / d on many boxes at once (`synthesis.polynomials.quotient` in the ring of `boxes`)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from estimators.arrays import FloatArray
from synthesis.polynomials.boxes import EPS, INFLATE, TINY, Boxes, orders
from synthesis.polynomials.quotient_fit import fit, monomials, nodes, to_chebyshev


def quotients(matrices: Mapping[str, Boxes], below: Boxes) -> dict[str, Boxes] | None:
    """Enclosures of N / d on every box; None if d is not certainly positive on one of them."""
    series, size = _chebyshev(below)
    lower = series[:, 0, 0, 0] - INFLATE * (size[:, 0, 0] - np.abs(series[:, 0, 0, 0]))
    lower = lower - INFLATE * EPS * size[:, 0, 0]
    if not (np.isfinite(lower).all() and (lower > 0.0).all()):
        return None
    points = nodes(below.variables, below.highest)
    basis = monomials(points, orders(below.variables, below.highest).powers)
    divisors = _at(below, basis)
    found = {}
    for key, above in matrices.items():
        values = _at(above, basis) / divisors
        middle = np.einsum("kn,gnij->gkij", fit(below.variables, below.highest), values)
        near = above._like(middle, np.zeros((len(middle), *above.shape)))
        wide = below.highest + _degree(below)
        _, rest = _chebyshev(_raised(above, wide) - _raised(near, wide).scaled_by(_raised(below, wide)))
        found[key] = near.widened(INFLATE * rest / lower[:, None, None])
    return found


def _at(matrix: Boxes, basis: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nk,gkij->gnij", basis, matrix.middle))


def _degree(matrix: Boxes) -> int:
    """Its total degree."""
    used = np.flatnonzero(matrix.middle.any(axis=(0, 2, 3)))
    return sum(orders(matrix.variables, matrix.highest).powers[int(used[-1])]) if len(used) else 0


def _raised(matrix: Boxes, highest: int) -> Boxes:
    """The same with room for terms of a higher degree; monomials stand in the order of their degrees."""
    count = len(orders(matrix.variables, highest).powers)
    middle = np.zeros((len(matrix.middle), count, *matrix.shape))
    middle[:, : matrix.middle.shape[1]] = matrix.middle
    return Boxes(middle, matrix.radius, matrix.variables, highest)


def _chebyshev(matrix: Boxes) -> tuple[FloatArray, FloatArray]:
    """Chebyshev coefficients (g, K, rows, columns), and a bound (g, rows, columns) of the sum of their absolute values.

    The bound holds the radius and what is rounded here: entries of the change are at most one and add up to one.
    """
    change = to_chebyshev(matrix.variables, matrix.highest)
    series = np.einsum("mk,gkij->gmij", change, matrix.middle)
    rounding = EPS * (len(change) + 8 * matrix.highest) * np.abs(matrix.middle).sum(axis=1)
    return series, INFLATE * (np.abs(series).sum(axis=1) + matrix.radius + rounding) + TINY
