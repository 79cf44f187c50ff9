"""What a pair of floats never sees, in exact rationals: the numbers are read bit for bit."""

from __future__ import annotations

from flint import fmpq, fmpq_mat

from analysis.exact import Rational, rationals
from estimators.arrays import FloatArray
from synthesis.polynomials.stable import is_hurwitz, is_schur


def hidden_is_stable(A: FloatArray, C: FloatArray, discrete: bool) -> bool:
    """Whether every mode that A (n, n), C (m, n) do not see decays strictly; exact, also on the border."""
    part = hidden_part(A, C)
    return (is_schur if discrete else is_hurwitz)(part) is True


def hidden_part(A: FloatArray, C: FloatArray) -> Rational:
    """A on its unobservable subspace, in a basis of that: (k, k) rationals, k = 0 if nothing is hidden."""
    n = A.shape[0]
    exact = rationals(A)
    block, rows = rationals(C), []
    for _ in range(n):
        rows += block.entries()
        block = block * exact
    reduced, rank = fmpq_mat(n * C.shape[0], n, rows).rref()
    pivots = [next(j for j in range(n) if reduced[i, j] != 0) for i in range(rank)]
    free = [j for j in range(n) if j not in pivots]
    basis = fmpq_mat(n, len(free))
    for number, j in enumerate(free):
        basis[j, number] = fmpq(1)
        for i, pivot in enumerate(pivots):
            basis[pivot, number] = -reduced[i, j]
    moved = exact * basis  # = basis K, and basis is an identity in its free rows
    return fmpq_mat(len(free), len(free), [moved[j, k] for j in free for k in range(len(free))])
