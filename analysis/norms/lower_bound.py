"""Good first guesses for the peak of a frequency response: only guesses, the level test decides."""

from __future__ import annotations

import numpy as np

from analysis.norms.frequency_response import Systems, largest_gain, sigma_max
from analysis.norms.hamiltonian import gain_at
from estimators.arrays import BoolArray, ComplexArray, FloatArray, IndexArray

STEPS = (0.4, 0.05, 2e-3, 4e-5)  # of the parabolas through three points, in half-widths of the resonance


def starting_bound(systems: Systems, continuous: Systems, poles: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """The largest of the gains at zero, at infinite frequency and near the tallest resonance, and where; (g,), (g,).

    A system that is zero up to rounding gets 0. `poles` (g, n) are those of the continuous systems.
    """
    still = np.zeros((len(poles), 1))
    static = largest_gain(systems, still + 1.0 if systems.discrete else still)[:, 0]
    direct = sigma_max(continuous.D)
    gain, at = np.maximum(static, direct), np.where(direct > static, np.inf, 0.0)
    swinging = np.flatnonzero((poles.imag != 0.0).any(axis=-1))
    if len(swinging):
        _raise_bound(gain, at, systems, swinging, tallest_resonance(continuous.pick(swinging)))
    zero = is_zero(systems)
    blind = np.flatnonzero((gain == 0.0) & ~zero)  # real poles and a zero of G at both ends
    if len(blind):
        middle = np.sqrt(np.abs(poles[blind]).min(axis=-1) * np.abs(poles[blind]).max(axis=-1))
        for factor in (1.0, 0.37, 1.71):
            _raise_bound(gain, at, systems, blind, factor * middle)
    return np.where(zero, 0.0, gain), np.where(zero, 0.0, at)


def _raise_bound(gain: FloatArray, at: FloatArray, systems: Systems, index: IndexArray, frequency: FloatArray) -> None:
    found = gain_at(systems.pick(index), frequency[:, None])[:, 0]
    better = found > gain[index] * (1.0 + 1e-13)  # a plateau keeps its simplest frequency
    gain[index[better]], at[index[better]] = found[better], frequency[better]


def tallest_resonance(systems: Systems) -> FloatArray:
    """Frequency of the largest gain near the poles, from the modal form G = D + sum_k r_k / (s - lambda_k); (g,).

    Cheap: no linear system is solved. A defective A spoils the modal form, and with it only the quality of the guess.
    """
    poles, vectors = np.linalg.eig(systems.A)
    with np.errstate(all="ignore"):
        singular = np.abs(np.linalg.det(vectors)) == 0.0
        vectors[singular] = np.eye(poles.shape[-1])
        left = np.linalg.solve(vectors, systems.B.astype(complex))
        residues = np.swapaxes(systems.C @ vectors, -1, -2)[..., None] * left[:, :, None, :]
        flat = residues.reshape(*poles.shape, -1)
        direct = systems.D.reshape(len(poles), 1, -1)

        def gain(frequency: FloatArray) -> FloatArray:
            weights = 1.0 / (1j * frequency[..., None] - poles[:, None])
            response = weights @ flat + direct
            return np.nan_to_num(sigma_max(response.reshape(*response.shape[:2], *systems.D.shape[-2:])), nan=0.0)

        # a resonance with damping ratio z peaks at |lambda| sqrt(1 - 2 z^2)
        tried = np.sqrt(np.maximum(poles.imag**2 - poles.real**2, 0.0))
        best = gain(tried).argmax(axis=-1)[:, None]
        frequency = np.take_along_axis(tried, best, -1)
        width = np.abs(np.take_along_axis(poles, best, -1).real)
        for step in STEPS:
            h = step * width
            low, middle, high = np.moveaxis(gain(frequency + h * np.array([-1.0, 0.0, 1.0])), -1, 0)
            bend = low - 2.0 * middle + high
            move = np.where(bend < 0.0, 0.5 * (low - high) / np.where(bend < 0.0, bend, 1.0), np.sign(high - low))
            frequency = np.maximum(frequency + h * np.clip(move, -3.0, 3.0)[:, None], 0.0)
    return np.asarray(np.nan_to_num(frequency[:, 0], nan=0.0, posinf=0.0))


def is_zero(systems: Systems) -> BoolArray:
    """Whether D and all Markov parameters C A^k B vanish up to rounding: then G is zero although B and C need not be.

    Rounding is bounded entry by entry by |C| |A|^k |B|, which no scaling of the states can fool.
    """
    zero = np.asarray(~systems.D.any(axis=(-2, -1)))
    suspect = np.flatnonzero(zero)
    moved, bound, C = systems.B[suspect], np.abs(systems.B[suspect]), systems.C[suspect]
    A, n = np.zeros((len(suspect), 0, 0)), systems.A.shape[-1]
    for power in range(n):
        roundoff = 4 * n * (power + 1) * np.finfo(float).eps * (np.abs(C) @ bound)
        keep = (np.abs(C @ moved) <= roundoff).all(axis=(-2, -1))
        zero[suspect[~keep]] = False
        suspect, C = suspect[keep], C[keep]
        if not len(suspect):
            break
        A = A[keep] if power else systems.A[suspect]
        A = A / np.maximum(np.abs(A).max(axis=(-2, -1), keepdims=True), np.finfo(float).tiny)  # against overflow only
        moved, bound = A @ moved[keep], np.abs(A) @ bound[keep]
    return zero
