r"""H2 norms of a linear system along given trajectories, by recursions of its gramians, for a batch of runs at once.

H2 norm: the energies of z after an impulse in each input at sample k, added up, are tr(B'X+B + D'D) with X = A'X+A + C'C
backwards from the end; the largest over k counts. Energy to peak: the largest |z_k|^2 per energy of w is the largest eigenvalue
of C W C' + D D' with W+ = A W A' + B B' from zero. Both are lower bounds of a level for all trajectories.
"""

from __future__ import annotations

import numpy as np

from analysis.simulation.linear import Linear
from estimators.arrays import FloatArray


def h2_along(system: Linear) -> FloatArray:
    """(R,), from stacks (R, N+1, ..)."""
    A, B, C, D = system
    X, best = _square(C[:, -1]), np.zeros(len(A))
    for k in range(A.shape[1] - 2, -1, -1):
        energy = np.swapaxes(B[:, k], -1, -2) @ X @ B[:, k] + _square(D[:, k])
        best = np.maximum(best, np.trace(energy, axis1=-2, axis2=-1))
        X = np.swapaxes(A[:, k], -1, -2) @ X @ A[:, k] + _square(C[:, k])
    return np.sqrt(best)


def peak_along(system: Linear) -> FloatArray:
    """(R,), from stacks (R, N+1, ..)."""
    A, B, C, D = system
    W, best = np.zeros_like(A[:, 0]), np.zeros(len(A))
    for k in range(A.shape[1]):
        shown = C[:, k] @ W @ np.swapaxes(C[:, k], -1, -2) + D[:, k] @ np.swapaxes(D[:, k], -1, -2)
        best = np.maximum(best, np.linalg.eigvalsh(shown)[:, -1])
        W = A[:, k] @ W @ np.swapaxes(A[:, k], -1, -2) + B[:, k] @ np.swapaxes(B[:, k], -1, -2)
    return np.sqrt(best)


def _square(M: FloatArray) -> FloatArray:
    return np.asarray(np.swapaxes(M, -1, -2) @ M)
