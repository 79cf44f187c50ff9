r"""Claims about frozen poles: where every pole lies while the parameters stand still, however they stand.

With S = P A + A'P and K = P A - A'P (Chilali, Gahinet 1996; P may follow the parameters, and owes nothing to their rates):

    continuous (poles s of the error equation)
    slowest pole a      -(S + 2 a P) > 0                                            Re s < -a
    pole radius r       [r P, P A; *, r P] > 0                                      |s| < r
    damping ratio c     [-(1 - c^2) S, c K; *, -S] > 0                              |Im s| < tan(arccos c) |Re s|, Re s < 0
    imaginary part w    [2 w P, K; *, 2 w P] > 0                                    |Im s| < w

    discrete (poles z = e^(T s) of the update of one sample of length T)
    slowest pole a      exp(-2 a T) P - A'P A > 0                                   Re s < -a
    fastest pole b      A'P A - exp(-2 b T) P > 0                                   Re s > -b
    imaginary part w    [(1 - c^2) S, c K; *, S] > 0, c = cos(w T), w T < pi/2      |Im s| < w
    disc r about q      r^2 P - (A - q)'P (A - q) > 0                               |z - q| < r

Whoever asks about a disc subtracts its centre q from A before.

A vertical strip is the pair of a slowest and a fastest pole, a horizontal one a bound on imaginary parts.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb, arb_mat, fmpq

from estimators.arrays import FloatArray
from synthesis.polynomials.enclosure import Entries
from synthesis.polynomials.stable import is_hurwitz, is_schur

CONTINUOUS = ("slowest pole", "pole radius", "damping ratio", "imaginary part")
DISCRETE = ("sampled slowest pole", "sampled fastest pole", "sampled imaginary part", "sampled disc")


def pole_inequality(kind: str, level: Any, period: Any, A: Any, P: Any, wide: Any, arithmetic: Any) -> Any:
    """The matrix that must be positive definite; `wide` is P times the denominator of A, as often as A stands in it."""
    product = P @ A
    S, K = product + product.T, product - product.T
    match kind:
        case "slowest pole":
            return -(S + wide * (2 * level))
        case "pole radius":
            return arithmetic.block([[wide * level, product], [None, wide * level]])
        case "damping ratio":
            return arithmetic.block([[S * (level * level - 1), K * level], [None, -S]])
        case "imaginary part":
            return arithmetic.block([[wide * (2 * level), K], [None, wide * (2 * level)]])
        case "sampled imaginary part":
            cosine = arithmetic.cos(level * period)
            return arithmetic.block([[S * (1 - cosine * cosine), K * cosine], [None, S]])
        case "sampled disc":
            return wide * (level * level) - A.T @ product
    distance = wide * arithmetic.exp(-2 * level * period) - A.T @ product
    return distance if kind == "sampled slowest pole" else -distance


def pole_outside(kind: str, level: fmpq, period: fmpq | None, A: Entries) -> bool:
    """Whether a pole of the frozen loop is certainly not where the claim says: exact signs, whatever P was tried."""
    if kind in ("slowest pole", "imaginary part"):
        turned = A if kind == "slowest pole" else _turned(A, arb(0), arb(1))
        shift = level if kind == "slowest pole" else -level
        return is_hurwitz(turned + _unit(turned.nrows()) * shift) is False
    if kind in ("pole radius", "sampled disc"):
        return is_schur(A * (1 / arb(level))) is False
    if kind == "damping ratio":
        return is_hurwitz(_turned(A, (1 - arb(level) ** 2).sqrt(), arb(level))) is False
    T = arb(0) if period is None else arb(period)
    if kind == "sampled imaginary part":
        angle = level * T
        return bool(angle < arb.pi() / 2) and is_hurwitz(_turned(A * -1, angle.sin(), angle.cos())) is False
    factor = (level * T).exp()
    if kind == "sampled slowest pole":
        return is_schur(A * factor) is False
    try:
        return is_schur(arb_mat(A).inv() * (1 / factor)) is False
    except ZeroDivisionError:
        return False


def pole_levels(kind: str, poles: Any, period: float) -> FloatArray:
    """The best level at each place (g,), in floats, from its poles (g, n), in discrete time z (of a disc z - q)."""
    if kind == "sampled disc":
        return np.asarray(np.abs(poles).max(axis=-1), float)
    if kind in DISCRETE:
        with np.errstate(divide="ignore"):
            poles = np.log(poles.astype(complex)) / period
        kind = kind.removeprefix("sampled ")
    match kind:
        case "slowest pole":
            return np.asarray(-poles.real.max(axis=-1), float)
        case "fastest pole":
            return np.asarray(-poles.real.min(axis=-1), float)
        case "pole radius":
            return np.asarray(np.abs(poles).max(axis=-1), float)
        case "damping ratio":
            return np.asarray((-poles.real / np.maximum(np.abs(poles), 1e-300)).min(axis=-1), float)
    return np.asarray(np.abs(poles.imag).max(axis=-1), float)


def _turned(A: Entries, cosine: arb, sine: arb) -> arb_mat:
    """[c A, -s A; s A, c A]: the poles of A turned in the plane by the angle, and by its opposite."""
    n, rows = A.nrows(), A.tolist()
    signs = ((cosine, -sine), (sine, cosine))
    return arb_mat(
        2 * n, 2 * n, [rows[i][j] * signs[k][m] for k in range(2) for i in range(n) for m in range(2) for j in range(n)]
    )


def _unit(n: int) -> arb_mat:
    return arb_mat(n, n, [int(i == j) for i in range(n) for j in range(n)])
