r"""H2 norm of stacks of systems: trace(C X C')^(1/2) with the controllability gramian X, by a doubling iteration."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.errors import AnalysisError
from analysis.norms.frequency_response import read_systems
from estimators.arrays import FloatArray

DOUBLINGS = 64  # covers spectral radii up to 1 - 2^-60


def h2_norm(
    A: Any,
    B: ArrayLike | None = None,
    C: ArrayLike | None = None,
    D: ArrayLike | None = None,
    discrete: bool | None = None,
) -> FloatArray:
    r"""||G||_2^2 = trace(C X C') with A X + X A' + B B' = 0, or trace(C X C' + D D') with X = A X A' + B B'.

    Stacks or a system object as in `hinf_norm`; an array over the leading axes. Unstable systems give inf, and so does a
    continuous system with D != 0 (white noise passes straight through). Raises AnalysisError for matrices that do not fit or are
    not finite.
    """
    shape, systems = read_systems(A, B, C, D, discrete)
    discrete, poles = systems.discrete, systems.poles()
    stable = (np.abs(poles) < 1.0 if discrete else poles.real < 0.0).all(axis=-1)
    feedthrough = systems.D.any(axis=(-2, -1))
    index = np.flatnonzero(stable if discrete else stable & ~feedthrough)
    out = np.full(len(systems), np.inf)
    part = systems.pick(index)
    power = part.B @ np.swapaxes(part.B, -1, -2)
    X = discrete_gramian(part.A, power) if discrete else continuous_gramian(part.A, power, np.abs(poles[index]))
    energy = np.einsum("gij,gjk,gik->g", part.C, X, part.C)
    if discrete:
        energy = energy + (part.D**2).sum(axis=(-2, -1))
    out[index] = np.sqrt(np.maximum(energy, 0.0))
    return out.reshape(shape)


def discrete_gramian(A: FloatArray, Q: FloatArray) -> FloatArray:
    """X = A X A' + Q = sum_k A^k Q A'^k by doubling (Smith): X <- X + A X A', A <- A A. A (g, n, n) stable, Q >= 0."""
    power, X = A, Q
    for _ in range(DOUBLINGS):
        step = power @ X @ np.swapaxes(power, -1, -2)
        X = X + step
        size = np.sqrt(
            np.maximum(np.einsum("gii->gi", X), 0.0)
        )  # each entry against its own size: states differ in theirs
        if not (np.abs(step) > 1e-17 * size[:, :, None] * size[:, None, :]).any():
            return X
        power = power @ power
    raise AnalysisError("a gramian did not converge: a pole is within 1e-16 of the stability boundary; check the model")


def continuous_gramian(A: FloatArray, Q: FloatArray, poles: FloatArray) -> FloatArray:
    """A X + X A' + Q = 0 through s = c (z - 1)/(z + 1), c the geometric middle of the pole sizes (g, n): stiffness costs
    doublings, not accuracy."""
    if not len(A):
        return np.zeros_like(A)
    middle = np.sqrt(poles.min(axis=-1) * poles.max(axis=-1))[:, None, None]
    eye = np.eye(A.shape[-1])
    inverse = np.linalg.inv(middle * eye - A)
    return discrete_gramian(inverse @ (middle * eye + A), 2.0 * middle * (inverse @ Q @ np.swapaxes(inverse, -1, -2)))
