r"""phi(M) = int_0^1 e^(M s) ds of a matrix polynomial, enclosed: a Taylor polynomial in t with a bounded remainder.

    phi(X) = sum_k X^k / (k+1)!,    e^X = I + X phi(X),    phi(2X) = (I + X phi(X) / 2) phi(X)

With |X| <= 1/2 in the largest row sum, the terms from k = K on sum to less than |X|^K / (K+1)! / (1 - |X|/(K+2)). A diagonal
scaling by powers of two makes the row sums small first; it is exact. Products keep the terms up to `order` in t, and the
others widen the constant term, which is what is left of them on [-1, 1]^v.
"""

from __future__ import annotations

from math import ceil, factorial, log2

import numpy as np
from flint import arb, arb_mat, fmpq

from estimators.arrays import FloatArray
from synthesis.polynomials.enclosure import PolynomialMatrix, constant, identity, row_sum

TERMS = 16  # of the series at |X| <= 1/2: remainder 2e-20
ORDER = 8  # largest total degree in t that is kept
SHORT = 2.0**-36  # share of the highest terms that is given away for shorter polynomials; halving a region wins it back
SMALL = 2.0**-6  # row sum that is small enough
ROUNDED = 2.0**-16  # of the largest entry: what is smaller counts as so large in balancing
LARGEST = 50.0  # row sum of M beyond which nothing useful can come out (e^50)


def phi(matrix: PolynomialMatrix, order: int = ORDER) -> PolynomialMatrix | None:
    """An enclosure of phi(M(t)) on [-1, 1]^v; None if M is too large for one."""
    size, variables = matrix.shape[0], matrix.variables
    weights = balance(matrix)
    scaled = rescaled(matrix.balls(), weights)
    norm = sum(row_sum(entries) for entries in scaled.terms.values())  # of |M(t)| on [-1, 1]^v
    if not norm < LARGEST:
        return None
    halvings = max(0, ceil(log2(norm)) + 1) if norm > 0.0 else 0
    X = scaled * fmpq(1, 2**halvings)
    small = arb(norm) / 2**halvings
    unit = identity(size, variables)
    found = unit * fmpq(1, factorial(TERMS))
    for k in range(TERMS - 1, 0, -1):
        found = (X @ found).truncated(order) + unit * fmpq(1, factorial(k))
    rest = small**TERMS / factorial(TERMS + 1) / (1 - small / (TERMS + 2))
    found = found.inflated(lambda _i, _j: rest.abs_upper())
    for _ in range(halvings):
        grown = unit + (X @ found).truncated(order) * fmpq(1, 2)
        found = (grown @ found).truncated(order)
        X = X * 2
    return rescaled(found.shortened(SHORT), [1 / w for w in weights])


def exponential(matrix: PolynomialMatrix, integral: PolynomialMatrix, order: int = ORDER) -> PolynomialMatrix:
    """e^M = I + M phi(M), from phi(M)."""
    return identity(matrix.shape[0], matrix.variables) + (matrix.balls() @ integral).truncated(order).shortened(SHORT)


def rescaled(matrix: PolynomialMatrix, weights: list[fmpq]) -> PolynomialMatrix:
    """diag(w) M diag(w)^-1."""
    n = matrix.shape[0]
    left = arb_mat(n, n, [weights[i] if i == j else 0 for i in range(n) for j in range(n)])
    right = arb_mat(n, n, [1 / weights[i] if i == j else 0 for i in range(n) for j in range(n)])
    return constant(left, matrix.variables) @ matrix @ constant(right, matrix.variables)


def balance(matrix: PolynomialMatrix) -> list[fmpq]:
    """Powers of two w that nearly balance the rows and columns of diag(w) |M| diag(w)^-1 (Osborne's iteration)."""
    n = matrix.shape[0]
    size = np.zeros((n, n))
    for entries in matrix.terms.values():
        size += np.array([[float(abs(arb(x)).abs_upper()) for x in row] for row in entries.tolist()]).reshape(n, n)
    return balance_of(size)


def balance_of(size: FloatArray) -> list[fmpq]:
    """The same from bounds of the absolute values (n, n)."""
    n, size = len(size), np.array(size)
    # Opposite a zero any size can be had (A = [[a, 1e6], [0, b]]): as if there stood what makes it that of the diagonal.
    # Opposite one that is only nearly zero, by rounding, weights would run away otherwise.
    diagonal, largest = max(float(np.diag(size).max(initial=0.0)), SMALL), float(size.max(initial=0.0))
    if largest < np.inf:
        size = np.maximum(size, diagonal * (diagonal / largest) if diagonal < largest else ROUNDED * largest)
    np.fill_diagonal(size, 0.0)
    exponents = np.zeros(n, dtype=int)
    for _ in range(8):
        for i in range(n):
            row, column = size[i].sum(), size[:, i].sum()
            if row > 0.0 and column > 0.0:
                step = round(0.5 * log2(column / row))
                exponents[i] += step
                size[i] *= 2.0**step
                size[:, i] *= 2.0**-step
    return [fmpq(2) ** int(k) if k >= 0 else fmpq(1, 2 ** int(-k)) for k in exponents]
