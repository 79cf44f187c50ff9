r"""The critical drop probability of systems with two states, in closed form: no LAPACK call, whole stacks at once.

K of `analysis.drops.frozen` is 3 x 3 and mu the largest real root of its characteristic polynomial

    mu^3 - a mu^2 + b mu - c = 0,    a = tr K, b = sum of principal minors, c = det K.

At mu = 1 (p = 1) it equals det(I - S(A0)) / det(I - S(A1)), and det(I - S(X)) = det(I - X) det(I + X) (1 - det X), because the
eigenvalues of S are products of two of X. Where A0 has an eigenvalue 1 (an integrator) the root mu = 1 is exact: it is divided
out, and the other two come from a quadratic.
"""

from __future__ import annotations

import numpy as np

from estimators.arrays import BoolArray, FloatArray

# |det(I - A0)| up to so many roundings of its terms counts as an eigenvalue 1 of A0.
ROUNDINGS = 8.0
VISIBLE = 1e-9  # relative change of an answer that rounding may make before it is left open
POLISH = 3  # Newton steps on the closed form


def critical_planar(A0: FloatArray, A1: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Critical drop probability (...) of pairs (..., 2, 2), and where rounding leaves it open; see
    `critical_drop_probability`.
    """
    numbers, sizes, stable, clear, integrator = _characteristic(A0, A1)
    n0 = np.where(stable, numbers[0], 1.0)
    a, b, c = (n / n0 for n in numbers[1:])
    # Divided by mu - 1: mu^2 - (a - 1) mu + c.
    largest = _largest_of_quadratic(0.5 * (a - 1.0), c)
    general = stable & ~integrator
    if general.any():
        shape = np.broadcast_shapes(general.shape, a.shape)
        chosen = np.broadcast_to(general, shape)
        largest = np.array(np.broadcast_to(largest, shape))
        largest[chosen] = largest_cubic_root(*(np.broadcast_to(x, shape)[chosen] for x in (a, b, c)))
    p = np.asarray(np.where(stable, 1.0 / np.maximum(largest, 1.0), 0.0))
    shown = (A0[..., 0, 1] == 0.0) | (A0[..., 1, 0] == 0.0)
    exact = shown & ((A0[..., 0, 0] == 1.0) | (A0[..., 1, 1] == 1.0))
    crossing = largest > 1.0
    open_ = _ill_posed(numbers, sizes, p, crossing, integrator) & ~(exact & ~crossing)
    return p, ~clear | (stable & open_)


def _ill_posed(
    numbers: tuple[FloatArray, ...],
    sizes: tuple[FloatArray, ...],
    p: FloatArray,
    crossing: BoolArray,
    integrator: BoolArray,
) -> BoolArray:
    """Whether rounding moves the first root of q(p) = n0 - n1 p + n2 p^2 - n3 p^3 visibly, makes one in [0, 1], or removes
    one.
    """
    n0, n1, n2, n3 = numbers
    s0, s1, s2, s3 = sizes

    def rounding(x: FloatArray) -> FloatArray:
        return np.asarray(ROUNDINGS * np.finfo(float).eps * (s0 + x * (s1 + x * (s2 + x * s3))))

    slope = np.abs(n1 - p * (2.0 * n2 - 3.0 * n3 * p))
    at = np.abs(n0 - p * (n1 - p * (n2 - p * n3)))
    visible = crossing & ~(rounding(p) + at <= VISIBLE * p * slope)
    # An eigenvalue 1 of A0 that is nearly double: a root beside mu = 1 may be meant, unless A0 shows its eigenvalues.
    visible |= integrator & ~crossing & ~(rounding(p) <= VISIBLE * np.abs(n1 - 2.0 * n2 + 3.0 * n3))
    # Where q has no root it must stay clear of zero at its lowest points: the ends, and where q' = 0.
    with np.errstate(divide="ignore", invalid="ignore"):
        under = np.sqrt(n2 * n2 - 3.0 * n1 * n3)
        turns = [(n2 + sign * under) / (3.0 * n3) for sign in (-1.0, 1.0)]
        turns.append(0.5 * n1 / n2)
    near = ~crossing & ~integrator & ~(n0 - n1 + n2 - n3 > rounding(np.ones_like(p)))
    for turn in turns:
        inside = (turn > 0.0) & (turn < np.where(crossing, p * (1.0 - 1e-3), 1.0 - 1e-3))
        x = np.where(inside, turn, 0.0)
        near |= inside & ~(n0 - x * (n1 - x * (n2 - x * n3)) > rounding(x))
    return np.asarray(visible | near)


def _square(X: FloatArray) -> tuple[tuple[FloatArray, ...], ...]:
    """S(X) in the coordinates (x11, x12, x22); any coordinates give the same K up to similarity."""
    p, q, r, s = X[..., 0, 0], X[..., 0, 1], X[..., 1, 0], X[..., 1, 1]
    return (p * p, 2.0 * p * q, q * q), (p * r, p * s + q * r, q * s), (r * r, 2.0 * r * s, s * s)


def _characteristic(
    A0: FloatArray, A1: FloatArray
) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...], BoolArray, BoolArray, BoolArray]:
    """n0..n3 of det(I - M(p)), the sizes of their terms, where A1 is stable, where that is clear, where A0 has an
    eigenvalue 1.
    """
    trace, det = A1[..., 0, 0] + A1[..., 1, 1], _det2(A1)
    gap = np.minimum(1.0 + det - np.abs(trace), 1.0 - np.abs(det))  # Jury
    stable = gap > 0.0
    products = np.abs(A1[..., 0, 0] * A1[..., 1, 1]) + np.abs(A1[..., 0, 1] * A1[..., 1, 0])
    clear = np.abs(gap) > ROUNDINGS * np.finfo(float).eps * (
        1.0 + np.abs(A1[..., 0, 0]) + np.abs(A1[..., 1, 1]) + products
    )
    trace0, det0 = A0[..., 0, 0] + A0[..., 1, 1], _det2(A0)
    size = 1.0 + np.abs(A0[..., 0, 0]) + np.abs(A0[..., 1, 1]) + np.abs(A0[..., 0, 0] * A0[..., 1, 1])
    size = size + np.abs(A0[..., 0, 1] * A0[..., 1, 0])
    integrator = np.abs(1.0 - trace0 + det0) <= ROUNDINGS * np.finfo(float).eps * size
    A, B = _square(A0), _square(A1)
    A_size, B_size = _square(np.abs(A0)), _square(np.abs(A1))
    one = np.eye(3)
    numbers = _pencil(
        [[one[i, j] - B[i][j] for j in range(3)] for i in range(3)],
        [[A[i][j] - B[i][j] for j in range(3)] for i in range(3)],
        -1.0,
    )
    sizes = _pencil(
        [[one[i, j] + B_size[i][j] for j in range(3)] for i in range(3)],
        [[A_size[i][j] + B_size[i][j] for j in range(3)] for i in range(3)],
        1.0,
    )
    return numbers, sizes, stable, clear, integrator


def _pencil(N: list[list[FloatArray]], D: list[list[FloatArray]], sign: float) -> tuple[FloatArray, ...]:
    """n0..n3 of det(N - p D) = n0 - n1 p + n2 p^2 - n3 p^3 from cofactors; with sign 1 the sum of the sizes of all terms."""
    cof_n, cof_d = _cofactors(N, sign), _cofactors(D, sign)
    n0 = sum(N[0][j] * cof_n[0][j] for j in range(3))
    n1 = sum(D[i][j] * cof_n[i][j] for i in range(3) for j in range(3))
    n2 = sum(N[i][j] * cof_d[i][j] for i in range(3) for j in range(3))
    n3 = sum(D[0][j] * cof_d[0][j] for j in range(3))
    return tuple(np.asarray(n) for n in (n0, n1, n2, n3))


def _det2(X: FloatArray) -> FloatArray:
    return np.asarray(X[..., 0, 0] * X[..., 1, 1] - X[..., 0, 1] * X[..., 1, 0])


def _cofactors(M: list[list[FloatArray]], sign: float) -> list[list[FloatArray]]:
    """Cofactors of a 3 x 3 matrix of arrays; cyclic indices carry the signs. `sign` 1 adds what -1 subtracts."""
    i1, i2 = (1, 2, 0), (2, 0, 1)
    return [
        [M[i1[i]][i1[j]] * M[i2[i]][i2[j]] + sign * M[i1[i]][i2[j]] * M[i2[i]][i1[j]] for j in range(3)]
        for i in range(3)
    ]


def _largest_of_quadratic(half: FloatArray, product: FloatArray) -> FloatArray:
    """Largest real root of mu^2 - 2 half mu + product, without cancellation; -inf where there is none."""
    square = half * half
    under = square - product
    # A double root (A0 = I) must not split by the square root of the rounding error.
    under = np.where(np.abs(under) <= ROUNDINGS * np.finfo(float).eps * (square + np.abs(product)), 0.0, under)
    root = np.sqrt(np.maximum(under, 0.0))
    far = half + np.where(half < 0.0, -root, root)
    with np.errstate(divide="ignore", invalid="ignore"):
        other = np.where(far == 0.0, 0.0, product / far)
    return np.asarray(np.where(under >= 0.0, np.maximum(far, other), -np.inf))


def largest_cubic_root(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Largest real root of mu^3 - a mu^2 + b mu - c, by Viete and Cardano, polished by Newton from the closed form."""
    third = a / 3.0
    q = third * third - b / 3.0
    r = third * (third * third - 0.5 * b) + 0.5 * c  # t = mu - third: t^3 - 3 q t - 2 r = 0
    three_real = r * r <= q * q * q
    safe = np.maximum(q, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        angle = np.arccos(np.clip(np.where(safe > 0.0, r / safe**1.5, 0.0), -1.0, 1.0))
    viete = 2.0 * np.sqrt(safe) * np.cos(angle / 3.0)
    outer = np.cbrt(np.abs(r) + np.sqrt(np.maximum(r * r - q * q * q, 0.0)))
    with np.errstate(divide="ignore", invalid="ignore"):
        cardano = np.sign(r) * (outer + np.where(outer > 0.0, q / outer, 0.0))
    mu = third + np.where(three_real, viete, cardano)
    for _ in range(POLISH):
        value = ((mu - a) * mu + b) * mu - c
        slope = (3.0 * mu - 2.0 * a) * mu + b
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(slope > 0.0, value / slope, 0.0)
        mu = mu - np.where(np.abs(step) <= 1e-3 * np.abs(mu), step, 0.0)
    return np.asarray(mu)
