"""Exact discretisation over one sample with inputs and measurements held."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from estimators.arrays import FloatArray


def zero_order_hold(A: FloatArray, B: FloatArray, sample_time: float) -> tuple[FloatArray, FloatArray]:
    r"""Phi = e^{A T} and Gamma = int_0^T e^{A s} ds B for stacks A (..., n, n), B (..., n, m) (P1 Remark 1; P3 (10)).

    Both come from one exponential of [[A, B], [0, 0]] T, so A may be singular.
    """
    A, B = np.asarray(A, float), np.asarray(B, float)
    n, m = B.shape[-2:]
    lead = np.broadcast_shapes(A.shape[:-2], B.shape[:-2])
    augmented = np.zeros((*lead, n + m, n + m))
    augmented[..., :n, :n] = A
    augmented[..., :n, n:] = B
    transition = expm(augmented * sample_time)
    return transition[..., :n, :n], transition[..., :n, n:]


def weights_over_sample(A: FloatArray, B: FloatArray, order: int, sample_time: float) -> tuple[FloatArray, FloatArray]:
    """`zero_order_hold` of states of which the `order` last ones, of weights, see the others as they are when a sample begins."""
    own = A.shape[-1] - order
    seen = (np.arange(A.shape[-1]) >= own)[:, None]
    Phi, Gamma = zero_order_hold(A, B, sample_time)
    held, driven = zero_order_hold(A * seen, B * seen, sample_time)
    return np.where(seen, held, Phi), np.where(seen, driven, Gamma)


def closed_loop_update(
    A: FloatArray, B: FloatArray, C: FloatArray, D: FloatArray, gain: FloatArray, sample_time: float
) -> tuple[FloatArray, FloatArray]:
    r"""x^+ = Phi x^ + Gamma [u; y] of the observer x^' = A x^ + B u + L (y - C x^ - D u) with u, y held (P1 notes 9).

    The observer runs inside the sample, so the update contracts at any sample time at which A - L C is stable, which
    neither forward Euler nor a sampled innovation does.
    """
    closed = A - gain @ C
    driven = B - gain @ D
    held = np.broadcast_to(gain, (*driven.shape[:-2], *np.shape(gain)[-2:]))
    return zero_order_hold(closed, np.concatenate([driven, held], axis=-1), sample_time)
