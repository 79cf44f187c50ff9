r"""Critical probabilities of one pair in exact rational arithmetic, for the entries as they are stored.

From a stable operator G at t = 0 towards F at t = 1, det(I - (1 - t) G - t F) = det(I - G) det(I - t K), K = (I - G)^-1 (F
- G): the first crossing is t = 1 / mu for the largest real eigenvalue mu >= 1 of K. K is a matrix of rationals, its
characteristic polynomial has no error, and its roots come in certified balls.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat

from analysis.errors import AnalysisError
from analysis.exact import Rational, eigenvalues, rationals
from estimators.arrays import FloatArray
from synthesis.polynomials.rational import rational

LARGEST = 36  # unknowns, beyond which exact fractions take too long


def exact_critical_drop(open_loop: FloatArray, closed_loop: FloatArray) -> float:
    """`critical_drop_probability` of matrices (n, n), correct to the last digit or two.

    0 where the received loop has an eigenvalue on or outside the unit circle. Raises AnalysisError for more than 8 states.
    """
    _allowed(_unknowns(open_loop), "drop")
    A0, A1 = rationals(open_loop), rationals(closed_loop)
    return first_crossing(_moved(A1), _moved(A0)) if _inside(A1) else 0.0


def exact_critical_recovery(open_loop: FloatArray, closed_loop: FloatArray, failure: float) -> float:
    """`critical_recovery_probability` of matrices (n, n) and one failure probability, correct to the last digit or two.

    inf where the loop is not stable at recovery 1. Raises AnalysisError for more than 5 states.
    """
    _allowed(2 * _unknowns(open_loop), "recovery")
    A, B, f = _moved(rationals(open_loop)), _moved(rationals(closed_loop)), rational(failure)
    none = A * 0
    always = _blocks(B * (1 - f), A, B * f, none)
    if not _inside(always):
        return inf
    t = first_crossing(always, _blocks(B * (1 - f), none, B * f, A))
    return 1.0 - t


def first_crossing(start: Rational, end: Rational) -> float:
    """The smallest t in (0, 1] at which (1 - t) start + t end has an eigenvalue 1, `start` being stable; 1 if there is none."""
    one = rationals(np.eye(start.nrows()))
    largest = fmpq(1)
    for root in eigenvalues((one - start).inv() * (end - start)):
        if root.imag == 0 and root.real > 0:
            largest = max(largest, _middle(root.real))
    return float(int(largest.q) / int(largest.p))


def _allowed(unknowns: int, what: str) -> None:
    if unknowns > LARGEST:
        raise AnalysisError(
            f"critical {what} probability: rounding shows in the answer, and {unknowns} unknowns are too many for exact "
            f"fractions; bracket it with critical_{what}_interval"
        )


def _unknowns(matrix: FloatArray) -> int:
    return len(matrix) * (len(matrix) + 1) // 2


def _inside(matrix: Rational) -> bool:
    return all(root.abs_upper() < 1 for root in eigenvalues(matrix))


def _moved(A: Rational) -> Rational:
    """The matrix of X -> A X A' on the entries x_ij, i <= j, without irrational weights."""
    n = A.nrows()
    places = [(i, j) for i in range(n) for j in range(i, n)]

    def entry(i: int, j: int, k: int, m: int) -> Any:
        return A[i, k] * A[j, m] + (A[i, m] * A[j, k] if k != m else 0)

    return fmpq_mat([[entry(*row, *column) for column in places] for row in places])


def _blocks(a: Rational, b: Rational, c: Rational, d: Rational) -> Rational:
    """[[a, b], [c, d]]."""
    rows = []
    for left, right in ((a, b), (c, d)):
        rows += [
            [*(left[i, j] for j in range(left.ncols())), *(right[i, j] for j in range(right.ncols()))]
            for i in range(left.nrows())
        ]
    return fmpq_mat(rows)


def _middle(ball: Any) -> fmpq:
    mantissa, exponent = ball.mid().man_exp()
    return fmpq(int(mantissa)) * fmpq(2) ** int(exponent)
