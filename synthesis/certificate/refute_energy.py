r"""H2 norms of a loop that stands still, from below and in balls: what refutes a claim about them, whatever P was tried.

The sums of the series B B' + A B B'A' + .. never exceed the controllability gramian X, and neither does Z (C X C' + D D') Z' with
one of them in its place. In continuous time the Cayley transform, with any h > 0,

    A <- (I - h A)^-1 (I + h A),    B <- (2 h)^(1/2) (I - h A)^-1 B

leads to a discrete system with the same gramian.
"""

from __future__ import annotations

from flint import arb, arb_mat

from synthesis.certificate.inequalities import Question
from synthesis.loop.system import System
from synthesis.polynomials.definite import is_positive_definite
from synthesis.polynomials.enclosure import Entries, PolynomialMatrix

DOUBLINGS = 14  # of the number of terms


def energy_exceeds(question: Question, system: System) -> bool:
    """Whether the frozen system certainly has an H2 norm, or by its kind a generalised one, above the level."""
    below = arb(1) if system.denominator is None else entries_of(system.denominator)[0, 0]
    shared = below if system.shared else arb(1)
    Z, W = arb_mat(question.Z), arb_mat(question.W)
    A, B = entries_of(system.A) * (1 / below), entries_of(system.B[question.group]) * W * (1 / below)
    C, D = (Z * entries_of(m) * (1 / shared) for m in (system.C, system.D[question.group]))
    n, scale = A.nrows(), arb(question.level) ** 2
    if system.time == "continuous":
        size = max((abs(float(x.mid())) for x in A.entries()), default=0.0)
        h = arb(1.0 / size if size > 0.0 else 1.0)
        try:
            inverse = (_eye(n) - A * h).inv()
        except ZeroDivisionError:
            return False
        A, B = inverse * (_eye(n) + A * h), inverse * B * (2 * h).sqrt()
    else:
        scale = scale * arb(question.period)
    X = B * B.transpose()
    for _ in range(DOUBLINGS):
        X, A = X + A * X * A.transpose(), A * A
    D = D * W
    shown = C * X * C.transpose() + D * D.transpose()
    if question.kind.endswith("H2 norm"):
        return bool(sum((shown[i, i] for i in range(shown.nrows())), arb(0)) > scale)
    return is_positive_definite(_eye(shown.nrows()) * scale - shown) is False


def entries_of(polynomial: PolynomialMatrix) -> Entries:
    """Of a matrix that depends on nothing."""
    return polynomial.terms.get((0,) * polynomial.variables, arb_mat(*polynomial.shape))


def _eye(n: int) -> arb_mat:
    return arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])
