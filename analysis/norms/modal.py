r"""Modal form of stacks of systems, G(s) = D + sum_k R_k / (s - lambda_k): gains without solving, and what rounding does to
them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.norms.frequency_response import Systems, sigma_max
from estimators.arrays import AnyArray, BoolArray, ComplexArray, FloatArray, IndexArray

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Modal:
    r"""Poles (g, n), residues (g, n, p m) and direct gain (g, p, m) of continuous systems of the same gains.

    `spread` (g,) bounds the change of the gain at any frequency of the band by a change |E| <= (rounding) |A| of A, to first
    order: eps |A| sum_k |c_k| kappa_k / d_k sum_l |b_l| / d_l with d the distances of the poles to the stability boundary and
    kappa their condition numbers. It is inf where eigenvectors are dependent. `sizes` (g, n) is what rounding may move each
    eigenvalue `given` (g, n) of A by.
    """

    poles: ComplexArray
    residues: ComplexArray
    direct: FloatArray
    spread: FloatArray
    sizes: FloatArray
    given: ComplexArray

    def pick(self, index: IndexArray | BoolArray | slice) -> Modal:
        """Some of the systems."""
        return Modal(
            self.poles[index],
            self.residues[index],
            self.direct[index],
            self.spread[index],
            self.sizes[index],
            self.given[index],
        )

    @property
    def decay(self) -> FloatArray:
        """Minus the real parts of the poles, (n, g)."""
        return np.asarray(-self.poles.real.T)

    @property
    def turn(self) -> FloatArray:
        """Imaginary parts of the poles, (n, g)."""
        return np.asarray(self.poles.imag.T)

    def gain(self, frequency: FloatArray) -> FloatArray:
        """sigma_max at frequencies (j, g) of the continuous systems."""
        with np.errstate(all="ignore"):
            weights = 1.0 / (1j * frequency.T[..., None] - self.poles[:, None])
            response = (weights @ self.residues).reshape(*weights.shape[:2], *self.direct.shape[-2:])
            return np.nan_to_num(sigma_max(response + self.direct[:, None]).T, nan=0.0, posinf=0.0)


def modal_form(systems: Systems, band: tuple[float, float] = (0.0, np.inf)) -> Modal:
    """The modal form; discrete systems are mapped by z = (1 + s)/(1 - s), pole by pole. `spread` is for the gains in a band."""
    A, B, C, D = systems.A, systems.B, systems.C, systems.D
    n = A.shape[-1]
    given, vectors = np.linalg.eig(A)
    poles = given.astype(complex)
    try:
        inverse = np.linalg.inv(vectors)
        singular = np.zeros(len(A), bool)
    except np.linalg.LinAlgError:
        singular = np.linalg.det(vectors) == 0.0
        inverse = np.linalg.inv(np.where(singular[:, None, None], np.eye(n), vectors))
    with np.errstate(all="ignore"):
        left, right = inverse @ B, np.swapaxes(C @ vectors, -1, -2)
        kappa = norm(inverse)
        distance = _distance(poles, systems.discrete, band)
        rounding = EPS * np.sqrt((A * A).sum(axis=(-2, -1)))
        spread = rounding * (norm(right) * kappa / distance).sum(axis=-1) * (norm(left) / distance).sum(axis=-1)
        spread = np.where(singular | ~np.isfinite(spread), np.inf, spread)
        residues = (
            (right[..., None] * left[:, :, None, :]).reshape(*poles.shape, D.shape[-2] * D.shape[-1]).astype(complex)
        )
        if systems.discrete:
            shifted = 1.0 + poles
            D = D - (residues / shifted[..., None]).sum(axis=1).real.reshape(D.shape)
            residues *= (2.0 / shifted**2)[..., None]
            poles = (poles - 1.0) / shifted
    return Modal(poles, residues, D, spread, rounding[:, None] * kappa, np.asarray(given, complex))


def _distance(poles: ComplexArray, discrete: bool, band: tuple[float, float]) -> FloatArray:
    """From poles to the part of the stability boundary that belongs to a band of the continuous frequency."""
    low, high = band
    turn = np.abs(np.angle(poles) if discrete else poles.imag)
    if not discrete:
        return np.asarray(np.hypot(poles.real, np.maximum(np.maximum(low - turn, turn - high), 0.0)))
    low, high = 2.0 * np.arctan(low), 2.0 * np.arctan(high)
    upper = poles.real + 1j * np.abs(poles.imag)
    ends = np.minimum(np.abs(upper - np.exp(1j * low)), np.abs(upper - np.exp(1j * high)))
    return np.where((turn >= low) & (turn <= high), np.abs(1.0 - np.abs(poles)), ends)


def norm(rows: AnyArray) -> FloatArray:
    """Euclidean length of the last axis."""
    return np.asarray(np.sqrt((rows.real**2 + rows.imag**2).sum(axis=-1)))
