r"""Bounds between grid points: a matrix inequality with matrix exponentials, checked on a whole cell of the parameter.

On a cell w = low + h t, t in [0, 1], inside one segment of the table, the exponent of each update is a matrix polynomial
M(t) = c_0 + c_1 t + ... (plant and linear gains), and with m1 >= |M'|, m2 >= |M''|, beta >= |e^{s M(t)}| for s in [0, 1]

    |Phi'| <= beta^2 m1,    |Phi''| <= beta^2 m2 + beta^3 m1^2,    Phi = e^M,

from d e^M = int_0^1 e^{(1-s) M} dM e^{s M} ds and its derivative. Linear interpolation of Phi' P Phi errs by at most 1/8 of its
second derivative, |P| (2 |Phi| |Phi''| + 2 |Phi'|^2) / 8: if an inequality that is linear in t otherwise holds at both ends of
the cell by more than that, it holds inside. beta comes from samples of s and the logarithmic norm mu between them,
|e^{(s + r) M}| <= |e^{s M}| e^{r mu}, and from c_0 to M(t) by Gronwall: beta e^{beta |M(t) - c_0|}.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from estimators.schedule import GainSchedule, PlantPolynomial
from synthesis.polynomials.matrix import FloatArray

SAMPLES = 32  # of s in the bound on e^{s M}
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


def exponents(schedule: GainSchedule, cells: Cells, scale: FloatArray) -> FloatArray:
    """Coefficients (2, c, degree+1, n, n) in t of T A (dropped) and T (A - L C) (received), states scaled: S M S^-1."""
    A, C = (_local(schedule.plant[key], cells) for key in ("A", "C"))
    ends = schedule.gain(np.stack([cells.low, cells.high], axis=1))
    gain = np.stack([ends[:, 0], ends[:, 1] - ends[:, 0]], axis=1)
    degree = max(A.shape[1], C.shape[1] + 1)
    out = np.zeros((2, len(cells.low), degree, *A.shape[-2:]))
    out[:, :, : A.shape[1]] = A
    for power in (0, 1):
        out[1, :, power : power + C.shape[1]] -= gain[:, power, None] @ C
    return np.asarray(schedule.sample_time * (scale @ out @ np.linalg.inv(scale)))


def _local(polynomial: PlantPolynomial, cells: Cells) -> FloatArray:
    """Coefficients (c, degree+1, rows, columns) in t of a matrix polynomial in w."""
    highest = int(polynomial.powers.max(initial=0))
    out = np.zeros((len(cells.low), highest + 1, *polynomial.coefficients.shape[1:]))
    for power, matrix in zip(polynomial.powers, polynomial.coefficients, strict=True):
        binomial = np.ones(1)
        for k in range(int(power) + 1):  # C(power, k) low^(power-k) h^k
            weight = binomial[0] * cells.low ** (power - k) * (cells.high - cells.low) ** k
            out[:, k] += weight[:, None, None] * matrix
            binomial = binomial * (int(power) - k) / (k + 1)
    return out


def ends(exponent: FloatArray) -> FloatArray:
    """Phi at both ends of every cell, (2 updates, 2 ends, c, n, n)."""
    return np.asarray(expm(np.stack([exponent[:, :, 0], exponent.sum(axis=2)], axis=1)))


def curvature(exponent: FloatArray) -> FloatArray:
    """1/8 of a bound on |d2/dt2 Phi' P Phi| for |P| = 1, (2 updates, c)."""
    powers = np.arange(exponent.shape[2], dtype=float)
    size = np.linalg.norm(exponent, ord=2, axis=(-2, -1))
    first, second = size @ powers, size @ (powers * (powers - 1.0))
    change = size[..., 1:].sum(axis=-1)
    start = exponent[:, :, 0]
    growth = np.linalg.eigvalsh(0.5 * (start + np.swapaxes(start, -1, -2)))[..., -1]
    step = power = expm(start / SAMPLES)
    sampled = np.ones(start.shape[:-2])
    for _ in range(SAMPLES):
        sampled = np.maximum(sampled, np.linalg.norm(power, ord=2, axis=(-2, -1)))
        power = power @ step
    beta = sampled * np.exp(np.maximum(growth, 0.0) / SAMPLES)
    beta = beta * np.exp(beta * change)
    slope = beta**2 * first
    bend = beta**2 * second + beta**3 * first**2
    return np.asarray((2.0 * beta * bend + 2.0 * slope**2) / 8.0)
