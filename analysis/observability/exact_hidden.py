"""What a pair of floats never sees, in exact rationals: the numbers are read bit for bit."""

from __future__ import annotations

from typing import Any

from flint import fmpq, fmpq_mat, fmpq_poly

from analysis.exact import rationals
from estimators.arrays import FloatArray


def hidden_is_stable(A: FloatArray, C: FloatArray, discrete: bool) -> bool:
    """Whether every mode that A (n, n), C (m, n) do not see decays strictly; exact, also on the border."""
    polynomial = hidden_polynomial(A, C)
    return _is_schur(polynomial) if discrete else is_hurwitz(polynomial)


def hidden_polynomial(A: FloatArray, C: FloatArray) -> Any:
    """The characteristic polynomial of A on its unobservable subspace; 1 if that is zero."""
    n = A.shape[0]
    exact = rationals(A)
    block, rows = rationals(C), []
    for _ in range(n):
        rows += block.entries()
        block = block * exact
    reduced, rank = fmpq_mat(n * C.shape[0], n, rows).rref()
    pivots = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
    free = [j for j in range(n) if j not in pivots]
    if not free:
        return fmpq_poly([1])
    basis = fmpq_mat(n, len(free))
    for number, j in enumerate(free):
        basis[j, number] = fmpq(1)
        for i, pivot in enumerate(pivots):
            basis[pivot, number] = -reduced[i, j]
    moved = exact * basis  # = basis K, and basis is an identity in its free rows
    return fmpq_mat(len(free), len(free), [moved[j, k] for j in free for k in range(len(free))]).charpoly()


def is_hurwitz(polynomial: Any) -> bool:
    """Routh's test in exact numbers: every root has a negative real part."""
    coefficients = [polynomial[k] for k in range(polynomial.degree(), -1, -1)]
    upper, lower = coefficients[0::2], coefficients[1::2]
    sign = upper[0]
    while lower:
        if not lower[0] * sign > 0:
            return False
        ratio = upper[0] / lower[0]
        padded = [*lower[1:], *[fmpq(0)] * (len(upper) - len(lower))]
        upper, lower = lower, [a - ratio * b for a, b in zip(upper[1:], padded, strict=True)]
    return True


def _is_schur(polynomial: Any) -> bool:
    """Every root inside the unit circle: z = (1 + s)/(1 - s) maps to the left half-plane; a root at -1 loses a degree."""
    n = polynomial.degree()
    if n == 0:
        return True
    plus, minus, mapped = fmpq_poly([1, 1]), fmpq_poly([1, -1]), fmpq_poly([0])
    for k in range(n + 1):
        mapped += polynomial[k] * plus**k * minus ** (n - k)
    return bool(mapped.degree() == n) and is_hurwitz(mapped)
