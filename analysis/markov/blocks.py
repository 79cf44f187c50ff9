"""What drives what: the pairs (mode, state) of a jump system in blocks that no path leaves and enters again.

In order of the blocks the second-moment operator is block triangular, and cross moments grow no faster than the faster of
their two blocks (Cauchy and Schwarz): its radius, or abscissa, is the largest of the blocks' own.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse.csgraph import connected_components

from estimators.arrays import BoolArray, FloatArray


def step_blocks(modes: FloatArray, transition: FloatArray) -> list[BoolArray]:
    """Masks (m, n) of the blocks of x+ = A_i x; a pair without a path back to itself has radius zero and is left out."""
    moves = np.swapaxes(modes != 0.0, -1, -2)  # [i, k, l]: state k of mode i drives state l
    edges = (transition > 0.0)[:, None, :, None] & moves[:, :, None, :]
    return _strong(edges, lonely=False)


def flow_blocks(modes: FloatArray, generator: FloatArray) -> list[BoolArray]:
    """Masks (m, n) of the blocks of x' = A_i x: a mode moves its own states, and a jump leaves them where they are."""
    m, n = modes.shape[:2]
    moves = np.swapaxes(modes != 0.0, -1, -2)
    edges = np.eye(m, dtype=bool)[:, None, :, None] & moves[:, :, None, :]
    edges |= (generator > 0.0)[:, None, :, None] & np.eye(n, dtype=bool)[None, :, None, :]
    return _strong(edges, lonely=True)


def _strong(edges: BoolArray, *, lonely: bool) -> list[BoolArray]:
    m, n = edges.shape[:2]
    flat = edges.reshape(m * n, m * n)
    count, label = connected_components(flat, directed=True, connection="strong")
    wanted = np.bincount(label, minlength=count) > 1
    wanted[label[np.diagonal(flat)]] = True
    return [(label == k).reshape(m, n) for k in np.flatnonzero(wanted | lonely)]
