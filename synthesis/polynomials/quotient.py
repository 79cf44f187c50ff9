r"""N / d of a matrix polynomial and a positive 1 x 1 polynomial, enclosed by a polynomial: a rational plant for an exponential.

    N / d = Q + (N - Q d) / d,    |N - Q d| / d <= (sum of the absolute Chebyshev coefficients of N - Q d) / min d

on [-1, 1]^v, whatever Q is: Q interpolates the quotient at Chebyshev nodes in float64, and the remainder widens its constant
term. On half of the box the remainder is smaller by about a factor of 2^order. min d is bounded from below by Bernstein
coefficients, on parts of the box where those of the whole do not decide.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import reduce
from itertools import product

import numpy as np
from flint import arb, arb_mat, fmpq, fmpq_mat

from estimators.arrays import FloatArray
from synthesis.polynomials.boxes import orders
from synthesis.polynomials.chebyshev import to_chebyshev
from synthesis.polynomials.definite import bernstein
from synthesis.polynomials.enclosure import PolynomialMatrix, magnitudes
from synthesis.polynomials.quotient_fit import fit, monomials, nodes

ORDER = 8  # of Q: what the exponentials keep
DEPTH, MOST_PARTS = 12, 400  # halvings along every variable, and parts, before min d stays open


@dataclass(frozen=True)
class Least:
    """A positive lower bound of a polynomial on [-1, 1]^v; or None, and a place where it is not shown to be positive."""

    bound: arb | None
    place: tuple[fmpq, ...] = ()


def least(polynomial: PolynomialMatrix) -> Least:
    """A lower bound of a 1 x 1 polynomial on [-1, 1]^v."""
    count = polynomial.variables
    axes = [i for i, degree in enumerate(polynomial.degrees) if degree]
    start = (fmpq(0),) * count
    waiting = [(start, (fmpq(1),) * count, 0)]
    bound: arb | None = None
    for _ in range(MOST_PARTS):
        if not waiting:
            return Least(bound)
        offset, factor, depth = waiting.pop()
        values = bernstein(polynomial.affine(offset, factor).balls())
        lows = [entries[0, 0].lower() for entries in values.values()]
        if lows and all(low > 0 for low in lows):
            bound = reduce(lambda a, b: a.min(b), lows if bound is None else [bound, *lows])
            continue
        ends = [(fmpq(0), fmpq(1), fmpq(-1)) if i in axes else (fmpq(0),) for i in range(count)]
        places = (tuple(o + f * s for o, f, s in zip(offset, factor, local, strict=True)) for local in product(*ends))
        zero = next((place for place in places if polynomial.at(place)[0, 0] <= 0), None)
        if zero is not None or not axes or depth == DEPTH * len(axes):
            return Least(None, offset if zero is None else zero)
        axis = axes[depth % len(axes)]
        half = (*factor[:axis], factor[axis] / 2, *factor[axis + 1 :])
        waiting += [
            ((*offset[:axis], offset[axis] + sign * half[axis], *offset[axis + 1 :]), half, depth + 1)
            for sign in (-1, 1)
        ]
    return Least(None, waiting[-1][0] if waiting else start)


def quotients(
    matrices: Mapping[str, PolynomialMatrix], below: PolynomialMatrix, order: int = ORDER
) -> dict[str, PolynomialMatrix] | None:
    """Enclosures of N / d on [-1, 1]^v, balls; None if d is not certainly positive there."""
    smallest = least(below).bound
    if smallest is None:
        return None
    if not any(below.degrees):
        factor = 1 / arb(below.at((fmpq(0),) * below.variables)[0, 0])
        return {key: matrix.balls() * factor for key, matrix in matrices.items()}
    return {key: _quotient(matrix.balls(), below.balls(), smallest, order) for key, matrix in matrices.items()}


def _quotient(above: PolynomialMatrix, below: PolynomialMatrix, smallest: arb, order: int) -> PolynomialMatrix:
    if 0 in above.shape:
        return above
    axes = [i for i in range(above.variables) if above.degrees[i] or below.degrees[i]]
    points, powers = nodes(len(axes), order), orders(len(axes), order).powers
    values = _values(above, axes, points) / _values(below, axes, points)
    near = np.tensordot(fit(len(axes), order), values, axes=(1, 0))
    terms = {}
    for power, matrix in zip(powers, near, strict=True):
        place = [0] * above.variables
        for axis, exponent in zip(axes, power, strict=True):
            place[axis] = exponent
        terms[tuple(place)] = arb_mat(
            fmpq_mat(*above.shape, [fmpq(*float(x).as_integer_ratio()) for x in matrix.ravel()])
        )
    found = PolynomialMatrix(terms, above.shape, above.variables)
    rest = arb_mat(*above.shape)
    for entries in to_chebyshev(above - found.scaled_by(below)).terms.values():
        rest = rest + magnitudes(entries)
    return found.inflated(lambda i, j: (rest[i, j] / smallest).abs_upper())


def _values(matrix: PolynomialMatrix, axes: list[int], points: FloatArray) -> FloatArray:
    """The middles of the balls at points (n, axes): array (n, rows, columns)."""
    rows, columns = matrix.shape
    powers = tuple(tuple(k[i] for i in axes) for k in matrix.terms)
    flat = np.array([[float(arb(x).mid()) for x in m.entries()] for m in matrix.terms.values()])
    return np.asarray(monomials(points, powers) @ flat.reshape(len(powers), rows * columns)).reshape(-1, rows, columns)
