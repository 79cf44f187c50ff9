r"""The input that a linear system along given trajectories amplifies most, for a batch of runs at once.

z = G w over a finite horizon, x = 0 at its beginning; w is moved to G* G w, G* the adjoint system run backwards in time, and
scaled to energy one. |G w|/|w| never falls from round to round and is the amplification of an actual input: a lower bound of
every certified level, whenever the rounds end.
"""

from __future__ import annotations

import numpy as np

from analysis.simulation.linear import Linear
from estimators.arrays import FloatArray


def amplified(system: Linear, w: FloatArray) -> tuple[FloatArray, FloatArray]:
    """States (R, N+1, n) and outputs (R, N+1, q) under inputs w (R, N, m), from zero; the last output without an input.

    The stacks of the system are (R, N+1, ..), one for every sample and one for the state that is left at the end.
    """
    runs, count = w.shape[:2]
    x = np.zeros((runs, count + 1, system.A.shape[-1]))
    driven = (system.B[:, :count] @ w[..., None])[..., 0]
    for k in range(count):
        x[:, k + 1] = (system.A[:, k] @ x[:, k, :, None])[..., 0] + driven[:, k]
    z = (system.C @ x[..., None])[..., 0]
    z[:, :count] += (system.D[:, :count] @ w[..., None])[..., 0]
    return x, z


def worst_inputs(system: Linear, w: FloatArray, rounds: int) -> tuple[FloatArray, FloatArray]:
    """Ratios |z|/|w| (R,) and the inputs (R, N, m) that have them, of energy one, after so many rounds from w."""
    w = _unit(w)
    _, z = amplified(system, w)
    for _ in range(rounds):
        w = _unit(_adjoint(system, z))
        _, z = amplified(system, w)
    return np.sqrt((z**2).sum(axis=(1, 2))), w


def _adjoint(system: Linear, z: FloatArray) -> FloatArray:
    """G* z (R, N, m)."""
    count = z.shape[1] - 1
    shown = (np.swapaxes(system.C, -1, -2) @ z[..., None])[..., 0]
    later = np.empty_like(shown)  # costate of the state at each sample
    later[:, count] = shown[:, count]
    back = np.swapaxes(system.A, -1, -2)
    for k in range(count - 1, 0, -1):
        later[:, k] = shown[:, k] + (back[:, k] @ later[:, k + 1, :, None])[..., 0]
    direct = (np.swapaxes(system.D, -1, -2)[:, :count] @ z[:, :count, :, None])[..., 0]
    return np.asarray(direct + (np.swapaxes(system.B, -1, -2)[:, :count] @ later[:, 1:, :, None])[..., 0])


def _unit(w: FloatArray) -> FloatArray:
    size = np.sqrt((w**2).sum(axis=(1, 2), keepdims=True))
    return np.asarray(np.divide(w, size, out=np.zeros_like(w), where=size > 0.0))
