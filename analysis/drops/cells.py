r"""Bounds between grid points: a matrix inequality with matrix exponentials, checked on a whole cell of the parameter.

On a cell w = low + h t, t in [0, 1], inside one segment of the table, each update is Phi(t) = e^{M(t)} + G(t), both matrix
polynomials in t (plant and linear gains), over the denominator d(t) of a rational plant: G = 0 and M = T A for a dropped sample;
M = T (A - L C) for a received one, or, where the gains correct once a sample, M = T A and G = -K C. With m1 >= |M'|,
m2 >= |M''|, g1 >= |G'|, g2 >= |G''| and beta >= |e^{s M(t)}| for s in [0, 1]

    |Phi'| <= beta^2 m1 + g1,    |Phi''| <= beta^2 m2 + beta^3 m1^2 + g2,    |Phi| <= beta + |G|,    |Phi| <= |Phi(0)| + |Phi'|,

from d e^M = int_0^1 e^{(1-s) M} dM e^{s M} ds and its derivative. Linear interpolation of Phi' P Phi errs by at most 1/8 of its
second derivative, |P| (2 |Phi| |Phi''| + 2 |Phi'|^2) / 8: if an inequality that is linear in t otherwise holds at both ends of
the cell by more than that, it holds inside. (Q / d^k)' = (Q' d - k Q d') / d^(k+1) bounds the derivatives of quotients, with
the least Bernstein coefficient of d below it. beta comes from samples of s and the logarithmic norm mu between them,
|e^{(s + r) M}| <= |e^{s M}| e^{r mu}, and from M(0) to M(t) by Gronwall: beta e^{beta |M(t) - M(0)|}.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np
from scipy.linalg import expm

from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule, PlantPolynomial, PlantQuotient

SAMPLES = 32  # of s in the bound on e^{s M}
_HOPELESS = 1e100  # a bound that proves nothing: larger ones overflow
ROUNDING = 1e-10  # relative guard for the rounding of exponentials and eigenvalues


@dataclass(frozen=True)
class Cells:
    """c cells [low, high] of the parameter, (c,) each, none across a breakpoint."""

    low: FloatArray
    high: FloatArray

    def halved(self, chosen: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Cells:
        """The chosen cells, each cut in two."""
        low, high = self.low[chosen], self.high[chosen]
        middle = 0.5 * (low + high)
        return Cells(np.concatenate([low, middle]), np.concatenate([middle, high]))


@dataclass(frozen=True)
class CellUpdates:
    """Coefficients in t, lowest first, of `exponent` M and `added` G, (2 updates: dropped and received, c, degree+1, n, n).

    Both are over `below` (c, degree+1).
    """

    exponent: FloatArray
    added: FloatArray
    below: FloatArray


def cell_updates(schedule: GainSchedule, cells: Cells, scale: FloatArray) -> CellUpdates:
    """Both updates of the runtime on every cell, states scaled: S M S^-1, S G S^-1."""
    A, C, below = (_local(polynomial, cells) for polynomial in _plant(schedule))
    ends = schedule.gain(np.stack([cells.low, cells.high], axis=1))
    gain = np.stack([ends[:, 0], ends[:, 1] - ends[:, 0]], axis=1)
    corrected = np.zeros((len(cells.low), C.shape[1] + 1, *A.shape[-2:]))  # -L C or -K C
    for power in (0, 1):
        corrected[:, power : power + C.shape[1]] -= gain[:, power, None] @ C
    exponent = np.zeros((2, len(cells.low), max(A.shape[1], corrected.shape[1]), *A.shape[-2:]))
    added = np.zeros((2, *corrected.shape))
    exponent[:, :, : A.shape[1]] = schedule.sample_time * A
    if schedule.observer_update == "sampled":
        added[1] = corrected
    else:
        exponent[1, :, : corrected.shape[1]] += schedule.sample_time * corrected
    back = np.linalg.inv(scale)
    return CellUpdates(scale @ exponent @ back, scale @ added @ back, below[..., 0, 0])


def _plant(schedule: GainSchedule) -> tuple[PlantPolynomial, ...]:
    """Numerators of A and C, and what they are over."""
    A, C = schedule.plant["A"], schedule.plant["C"]
    if not isinstance(A, PlantQuotient) or not isinstance(C, PlantQuotient):
        given = schedule.polynomials
        return given["A"], given["C"], given["A"]._replace(coefficients=np.ones((1, 1, 1)))
    _ = schedule.parameter  # refuses several
    return tuple(m for m in (A.numerator, C.numerator, A.denominator) if isinstance(m, PlantPolynomial))


def _local(polynomial: PlantPolynomial, cells: Cells) -> FloatArray:
    """Coefficients (c, degree+1, rows, columns) in t of a matrix polynomial in w: Clenshaw's recurrence on power series."""
    start = (cells.low - polynomial.middle) / polynomial.half
    slope = (cells.high - cells.low) / polynomial.half
    count, *shape = polynomial.coefficients.shape

    def times_u(series: FloatArray) -> FloatArray:  # u = start + slope t; the highest power is never needed
        moved = start[:, None, None, None] * series
        moved[:, 1:] += slope[:, None, None, None] * series[:, :-1]
        return moved

    here, later = np.zeros((2, len(cells.low), max(count, 1), *shape))
    for k in range(count - 1, -1, -1):
        here, later = (2.0 if k else 1.0) * times_u(here) - later, here
        here[:, 0] += polynomial.coefficients[k]
    return np.asarray(here)


def ends(updates: CellUpdates) -> FloatArray:
    """Phi at both ends of every cell, (2 updates, 2 ends, c, n, n)."""
    below = np.stack([updates.below[:, 0], updates.below.sum(axis=1)])[..., None, None]
    exponent, added = (np.stack([m[:, :, 0], m.sum(axis=2)], axis=1) / below for m in (updates.exponent, updates.added))
    return np.asarray(expm(exponent) + added)


def curvature(updates: CellUpdates) -> FloatArray:
    """1/8 of a bound on |d2/dt2 Phi' P Phi| for |P| = 1, (2 updates, c); at most 1e100, which proves nothing."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        found = _curvature(updates)
    return np.where(found < _HOPELESS, found, _HOPELESS)  # also where it is not a number


def _curvature(updates: CellUpdates) -> FloatArray:
    start, added = (m[:, :, 0] / updates.below[:, 0, None, None] for m in (updates.exponent, updates.added))
    whole, first, second = _sizes(updates.exponent, updates.below)
    moved, first_added, second_added = _sizes(updates.added, updates.below)
    growth = np.linalg.eigvalsh(0.5 * (start + np.swapaxes(start, -1, -2)))[..., -1]
    step = power = expm(start / SAMPLES)
    sampled = np.ones(start.shape[:-2])
    for _ in range(SAMPLES):
        sampled = np.maximum(sampled, _norm(power))
        power = power @ step
    beta = sampled * np.exp(np.maximum(growth, 0.0) / SAMPLES)
    beta = beta * np.exp(beta * whole)
    slope = beta**2 * first + first_added
    bend = beta**2 * second + beta**3 * first**2 + second_added
    size = np.minimum(_norm(expm(start) + added) + slope, beta + _norm(added) + moved)
    return np.asarray((2.0 * size * bend + 2.0 * slope**2) / 8.0)


def _norm(matrix: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(matrix, ord=2, axis=(-2, -1)))


def _sizes(above: FloatArray, below: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds on |M(t) - M(0)|, |M'|, |M''| for t in [0, 1], (2 updates, c), of M = above/below; infinite if below may vanish."""
    least = _least(below)
    first = _derivative(above, below, 1)
    second = _derivative(first, below, 2)
    moved = _times(above, below[:, :1]) - _times(above[:, :, :1], below, above.shape[2])
    return (
        _norm(moved).sum(axis=-1) / (least * below[:, 0]),
        _norm(first).sum(axis=-1) / least**2,
        _norm(second).sum(axis=-1) / least**3,
    )


def _derivative(above: FloatArray, below: FloatArray, power: int) -> FloatArray:
    """The numerator over below^(power+1) of the derivative of above/below^power."""
    width = above.shape[2] + below.shape[1] - 1
    falling = _times(above, _slope(below, axis=1), width) * power
    return _times(_slope(above, axis=2), below, width) - falling


def _slope(series: FloatArray, axis: int) -> FloatArray:
    """Coefficients of the derivative; at least one."""
    powers = np.arange(1.0, max(series.shape[axis], 2)).reshape([-1 if i == axis else 1 for i in range(series.ndim)])
    tail = np.take(series, range(1, series.shape[axis]), axis=axis)
    return tail * powers if tail.shape[axis] else np.zeros_like(series)


def _times(above: FloatArray, scalar: FloatArray, width: int = 0) -> FloatArray:
    """The product with a series (c, degree+1), padded to `width` coefficients."""
    count = above.shape[2] + scalar.shape[1] - 1
    out = np.zeros((*above.shape[:2], max(count, width), *above.shape[3:]))
    for k in range(scalar.shape[1]):
        out[:, :, k : k + above.shape[2]] += scalar[:, k, None, None, None] * above
    return out


def _least(below: FloatArray) -> FloatArray:
    """A lower bound (c,) of a series on [0, 1], its least Bernstein coefficient; zero where that is not positive."""
    degree = below.shape[1] - 1
    weights = np.array([[comb(i, k) / comb(degree, k) for k in range(degree + 1)] for i in range(degree + 1)])
    return np.asarray(np.maximum((below @ weights.T).min(axis=1), 0.0))
