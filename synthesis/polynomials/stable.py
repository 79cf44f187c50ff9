"""Are all eigenvalues of a matrix in the open left half-plane, or in the open unit disc? By signs alone.

Hurwitz: with a_0 > 0 every root of a_0 s^n + ... + a_n has a negative real part if and only if all leading minors of the Hurwitz
matrix are positive. Exact for rationals; with balls a sign counts only if it is certain. Multiple roots need no care: floating
point splits a fourfold pole at -1e-3 into a ring that reaches across the axis.
"""

from __future__ import annotations

from typing import Any

from flint import arb, arb_mat, fmpq, fmpq_mat

from synthesis.polynomials.enclosure import Entries


def is_hurwitz(matrix: Entries) -> bool | None:
    """True or False where it is certain, else None; entries are rationals or balls. True of an empty matrix."""
    return _left(_ascending(matrix), _kind(matrix))


def is_schur(matrix: Entries) -> bool | None:
    """The same for the open unit disc, by z = (1 + s)/(1 - s)."""
    coefficients = _ascending(matrix)
    n, kind = len(coefficients) - 1, _kind(matrix)
    mapped: list[Any] = [kind(0)] * (n + 1)
    for k, c in enumerate(coefficients):
        for power, weight in enumerate(_product(k, n - k)):
            mapped[power] = mapped[power] + c * weight
    if mapped[n] < 0:
        mapped = [-c for c in mapped]
    return _left(mapped, kind)


def _left(ascending: list[Any], kind: Any) -> bool | None:
    n = len(ascending) - 1
    a = ascending[::-1]
    certain = True
    if not a[0] > 0:
        if a[0] <= 0:
            return False
        certain = False
    full = [
        [a[2 * (j + 1) - (i + 1)] if 0 <= 2 * (j + 1) - (i + 1) <= n else kind(0) for j in range(n)] for i in range(n)
    ]
    make = fmpq_mat if kind is fmpq else arb_mat
    for size in range(1, n + 1):
        minor = make([row[:size] for row in full[:size]]).det()
        if minor > 0:
            continue
        if minor <= 0 and certain:
            return False
        certain = False
    return True if certain else None


def _kind(matrix: Entries) -> Any:
    return arb if isinstance(matrix, arb_mat) else fmpq


def _ascending(matrix: Entries) -> list[Any]:
    found = matrix.charpoly()
    return [found[k] for k in range(matrix.nrows() + 1)]


def _product(up: int, down: int) -> list[int]:
    """Coefficients of (1 + s)^up (1 - s)^down."""
    out = [1]
    for sign in [1] * up + [-1] * down:
        out = [a + sign * b for a, b in zip([*out, 0], [0, *out], strict=True)]
    return out
