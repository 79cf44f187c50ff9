r"""A feedback law in closed loop over a sample, from plant and table alone: independent of the runtime.

    x+ = Phi x + T phi(TA) (B u + E d),  xk+ = Ak xk + Bk v,  u = Ck xk + Dk v,  K = [[Ak, Bk], [Ck, Dk]]

with v the states, or y = C x + D u + F d, where Dk uses no output that u acts on; everything at the parameter of the sample's
start (synthesis.loop.feedback). Performance outputs are all states, then all outputs, then all inputs.
"""

from __future__ import annotations

import numpy as np

from analysis.simulation.flow import phi_times
from analysis.simulation.linear import Linear
from analysis.simulation.plants import Matrices
from estimators.arrays import FloatArray


def closed_loop(plant: Matrices, K: FloatArray, by_states: bool, order: int, period: float) -> Linear:
    """Of states (x, xk), inputs d, outputs (x, y, u); stacks (g, rows, columns)."""
    A, B, C, D, E, F = plant
    g, n, nu, nd, nk = len(A), A.shape[-1], B.shape[-1], E.shape[-1], order
    moved = phi_times(period * A, period * np.concatenate([A, B, E], axis=-1))
    free, into, forced = np.eye(n) + moved[..., :n], moved[..., n : n + nu], moved[..., n + nu :]
    seen, noise = (np.broadcast_to(np.eye(n), A.shape), 0.0 * E) if by_states else (C, F)
    Ak, Bk, Ck, Dk = K[:, :nk, :nk], K[:, :nk, nk:], K[:, nk:, :nk], K[:, nk:, nk:]
    memory = np.zeros((g, n, nk))
    u, u_of_d = np.concatenate([Dk @ seen, Ck], axis=-1), Dk @ noise
    y, y_of_d = np.concatenate([C, np.zeros((g, C.shape[1], nk))], axis=-1) + D @ u, F + D @ u_of_d
    x = np.concatenate([np.broadcast_to(np.eye(n), A.shape), memory], axis=-1)
    v, v_of_d = (x, noise) if by_states else (y, y_of_d)
    own = np.concatenate([np.zeros((g, nk, n)), Ak], axis=-1)
    return Linear(
        np.concatenate([np.concatenate([free, memory], axis=-1) + into @ u, own + Bk @ v], axis=1),
        np.concatenate([forced + into @ u_of_d, Bk @ v_of_d], axis=1),
        np.concatenate([x, y, u], axis=1),
        np.concatenate([np.zeros((g, n, nd)), y_of_d, u_of_d], axis=1),
    )
