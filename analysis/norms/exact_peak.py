r"""The H-infinity norm of one hard system, proved in exact rationals: the two-step method without rounding.

The characteristic polynomial of the Hamiltonian matrix H(gamma) (`analysis.norms.hamiltonian`) is even; as a polynomial in x
= -s^2 its real roots x >= 0 are exactly the squares of the frequencies at which gamma is a singular value. All of it is exact
(flint), the roots are isolated in ball arithmetic, and gains are evaluated there with 212 bits.
"""

from __future__ import annotations

from itertools import pairwise
from math import inf, nextafter, sqrt
from typing import Any

import numpy as np

from analysis.exact import rationals
from analysis.norms.frequency_response import Systems, sigma_max
from estimators.arrays import FloatArray
from synthesis.polynomials.rational import rational

MOST_STATES = 12
ROUNDS = 40
BITS = 212


def exact_peak(
    system: Systems, gain: float, frequency: float, band: tuple[float, float], tolerance: float
) -> tuple[float, float, float]:
    """Norm, frequency and proved upper bound over a band of the continuous frequency, of a stack of one without poles on the
    axis.

    `gain` and `frequency` are a first guess. An upper bound of inf says that there is no proof.
    """
    matrices = _continuous(system)
    if matrices is None:
        return gain, frequency, inf
    points = [frequency, *(w for w in band if w != frequency)]
    best, where = 0.0, frequency
    for _ in range(ROUNDS):
        for point in points:
            found = _gain(system, point)
            if found > best:
                best, where = found, point
        if best == 0.0:
            return 0.0, where, 0.0 if _vanishes(*matrices) else inf
        level = nextafter(best * (1.0 + tolerance), inf)
        crossings = _crossings(*matrices, level)
        if crossings is None:  # the level is a singular value of D: one above it is not
            level = best * (1.0 + 2.0 * tolerance)
            crossings = _crossings(*matrices, level)
        if crossings is None:
            return best, where, inf
        inside = [w for w in crossings if band[0] < w < band[1]]
        if not inside:
            return best, where, level
        marks = [band[0], *inside, *([band[1]] if band[1] < inf else [])]
        points = [0.5 * (a + b) for a, b in pairwise(marks)]
        points += [sqrt(a * b) for a, b in pairwise(marks)]
    return best, where, inf


def _continuous(system: Systems) -> tuple[Any, Any, Any, Any] | None:
    """Exact matrices; a discrete system is mapped by z = (1 + s)/(1 - s), without the factors sqrt(2) of B and C."""
    A, B, C, D = (rationals(M[0]) for M in (system.A, system.B, system.C, system.D))
    if not system.discrete:
        return A, B, C, D
    eye = rationals(np.eye(len(system.A[0])))
    try:
        inverse = (A + eye).inv()
    except ZeroDivisionError:
        return None
    return inverse * (A - eye), 2 * (inverse * B), C * inverse, D - C * inverse * B


def _crossings(A: Any, B: Any, C: Any, D: Any, level: float) -> list[float] | None:
    """Frequencies at which the level is a singular value, ascending; None if it is not above sigma_max(D)."""
    from flint import fmpq_mat, fmpq_poly

    square = rational(level) ** 2
    n, m = A.nrows(), B.ncols()
    Dt = D.transpose()
    try:
        inverse = (square * rationals(np.eye(m)) - Dt * D).inv()
    except ZeroDivisionError:
        return None
    top, right = A + B * inverse * Dt * C, B * inverse * B.transpose()
    left = -1 * (C.transpose() * (rationals(np.eye(D.nrows())) + D * inverse * Dt) * C)
    H = fmpq_mat(2 * n, 2 * n)
    for i in range(n):
        for j in range(n):
            H[i, j], H[i, n + j], H[n + i, j], H[n + i, n + j] = top[i, j], right[i, j], left[i, j], -top[j, i]
    even = H.charpoly().coeffs()[::2]
    polynomial = fmpq_poly([c if k % 2 == 0 else -c for k, c in enumerate(even)]).numer()
    signs = {c > 0 for c in polynomial.coeffs() if c != 0}
    if len(signs) == 1 and polynomial[0] != 0:
        return []  # Descartes: no positive root
    roots = [root for root, _ in polynomial.complex_roots() if root.imag == 0 and not root.real < 0]
    return sorted({sqrt(max(float(root.real.mid()), 0.0)) for root in roots})


def _vanishes(A: Any, B: Any, C: Any, D: Any) -> bool:
    """Whether D and all Markov parameters are exactly zero."""
    zero, moved = D == 0 * D, B
    for _ in range(A.nrows()):
        zero = zero and C * moved == 0 * D
        moved = A * moved
    return bool(zero)


def _gain(system: Systems, frequency: float) -> float:
    """sigma_max at a continuous frequency, evaluated with many digits on the system as it is given."""
    from flint import acb, acb_mat, ctx

    if frequency == inf and not system.discrete:
        return float(sigma_max(system.D)[0])
    before, ctx.prec = ctx.prec, BITS
    try:
        A, B, C, D = (
            acb_mat([[float(x) for x in row] for row in M[0]]) for M in (system.A, system.B, system.C, system.D)
        )
        s = acb(0, frequency) if frequency < inf else acb(0)
        point = s if not system.discrete else acb(-1) if frequency == inf else (1 + s) / (1 - s)
        eye = acb_mat([[float(i == j) for j in range(A.nrows())] for i in range(A.nrows())])
        response = C * (point * eye - A).solve(B) + D
        values = np.array([[complex(x) for x in row] for row in response.table()])
    except ZeroDivisionError:
        return 0.0
    finally:
        ctx.prec = before
    return float(sigma_max(values))


def proved_peaks(
    systems: Systems, norm: FloatArray, frequency: FloatArray, band: FloatArray, tolerance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """`exact_peak` of each member; systems with more than twelve states keep their guess and get no upper bound."""
    upper = np.full(len(systems), inf)
    if systems.A.shape[-1] > MOST_STATES:
        return norm, frequency, upper
    for i in range(len(systems)):
        ends = (float(band[0, i]), float(band[1, i]))
        norm[i], frequency[i], upper[i] = exact_peak(
            systems.pick(slice(i, i + 1)), float(norm[i]), float(frequency[i]), ends, tolerance
        )
    return norm, frequency, upper
