r"""Is a symmetric matrix polynomial positive definite on [-1, 1]^v? Tensor Bernstein coefficients and ball arithmetic.

M(t) = sum_k B_k(t) M_k with Bernstein polynomials B_k >= 0 that sum to one: all M_k > 0 proves M > 0 on the box. The coefficients
at the corners are values of M, so one that is certainly not positive definite shows a point where M > 0 fails. A box that
decides nothing is for the caller to cut in pieces. Every number is a ball; a sign counts only if it is certain.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import comb, prod
from typing import Any

from flint import fmpq

from synthesis.polynomials.enclosure import Entries, PolynomialMatrix, Powers

MOST_COEFFICIENTS = 20_000  # of a box; more are not looked at, and decide nothing


@dataclass(frozen=True)
class Sign:
    """`positive` on the whole box, or certainly not so at the corner `fails_at`, or (neither) undecided."""

    positive: bool
    fails_at: tuple[int, ...] | None = None


def sign_on_box(matrix: PolynomialMatrix) -> Sign:
    """Decide M(t) > 0 on [-1, 1]^v from its Bernstein coefficients; only the upper triangle is read."""
    degrees = matrix.degrees
    if prod(degree + 1 for degree in degrees) > MOST_COEFFICIENTS:
        return Sign(False)
    terms = bernstein(matrix)
    if not terms:  # the zero matrix, written without any term
        return Sign(False, (-1,) * matrix.variables)
    undecided = False
    for powers in sorted(terms, key=lambda k: not _corner(k, degrees)):  # corners first: one of them may end it
        found = is_positive_definite(terms[powers])
        if found:
            continue
        if found is False and _corner(powers, degrees):
            return Sign(False, tuple(1 if k and k == d else -1 for k, d in zip(powers, degrees, strict=True)))
        undecided = True
        if not _corner(powers, degrees):
            break
    return Sign(not undecided)


def _corner(powers: Powers, degrees: Powers) -> bool:
    return all(k in (0, d) for k, d in zip(powers, degrees, strict=True))


def bernstein(matrix: PolynomialMatrix) -> dict[Powers, Entries]:
    """Coefficients in the tensor Bernstein basis of [-1, 1]^v, by their indices."""
    terms = dict(matrix.terms)
    for axis, degree in enumerate(matrix.degrees):
        weights = to_bernstein(degree)
        out: dict[Powers, Entries] = {}
        for powers, entries in terms.items():
            for i in range(degree + 1):
                weight = weights[i][powers[axis]]
                if weight == 0:
                    continue
                place = (*powers[:axis], i, *powers[axis + 1 :])
                part = entries * weight
                out[place] = out[place] + part if place in out else part
        terms = out
    return terms


@cache
def to_bernstein(degree: int) -> tuple[tuple[fmpq, ...], ...]:
    """Matrix (i, k) from powers to Bernstein coefficients on [-1, 1]: the blossom of t^k with i arguments +1, the others -1."""

    def entry(i: int, k: int) -> fmpq:
        chosen = range(max(0, k - degree + i), min(i, k) + 1)
        return fmpq(sum(comb(i, j) * comb(degree - i, k - j) * (-1) ** (k - j) for j in chosen), comb(degree, k))

    return tuple(tuple(entry(i, k) for k in range(degree + 1)) for i in range(degree + 1))


def is_positive_definite(matrix: Entries) -> bool | None:
    """By elimination: True if every pivot is certainly positive, False if one is certainly not, None if a sign is open.

    Entries are balls or rationals; the matrix is symmetric, and only its upper triangle is read.
    """
    rows: list[list[Any]] = matrix.tolist()
    size = len(rows)
    for k in range(size):
        pivot = rows[k][k]
        if not pivot > 0:
            return False if pivot <= 0 else None
        for i in range(k + 1, size):
            factor = rows[k][i] / pivot
            row, top = rows[i], rows[k]
            for j in range(i, size):
                row[j] = row[j] - factor * top[j]
    return True
