r"""States and outputs of pairs (A, C) in sizes that suit each other: D^-1 A D and F C D with powers of two, nothing rounded.

States that drive one another in a circle are balanced by row and column sums [Osborne1960]. That leaves the sizes of whole
groups (strongly connected components of A) to each other free, and with them the couplings that lead from group to group and to
outputs: each group is sized so that the strongest of its couplings towards an output has the size of the entries inside the
groups. Groups that lead to no output are sized by what drives them.
"""

from __future__ import annotations

import numpy as np

from estimators.arrays import BoolArray, FloatArray, IntArray

SWEEPS = 60
LIMIT = 1000.0  # of an exponent: double precision ends at 1023


def balanced_pair(A: FloatArray, C: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """(D^-1 A D, F C D, d, f) for stacks A (..., n, n), C (..., m, n): D = diag(d) (..., n), F = diag(f) (..., m)."""
    n, m, lead = A.shape[-1], C.shape[-2], A.shape[:-2]
    count = int(np.prod(lead))
    flat_A, flat_C = np.abs(A).reshape(count, n, n), np.abs(C).reshape(count, m, n)
    states, outputs = np.zeros((count, n)), np.zeros((count, m))
    patterns = np.concatenate([flat_A, flat_C], axis=1) > 0.0
    kinds, which = np.unique(patterns.reshape(count, (n + m) * n), axis=0, return_inverse=True)
    for number, kind in enumerate(kinds):
        here = np.flatnonzero(which.ravel() == number)
        pattern = kind.reshape(n + m, n)
        states[here], outputs[here] = _exponents(flat_A[here], flat_C[here], pattern[:n], pattern[n:])
    e, f = states.reshape(*lead, n), outputs.reshape(*lead, m)
    factor = np.exp2(e[..., None, :] - e[..., :, None])
    return A * factor, C * np.exp2(f[..., :, None] + e[..., None, :]), np.exp2(e), np.exp2(f)


def _exponents(A: FloatArray, C: FloatArray, drives: BoolArray, shows: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Exponents of D (count, n) and F (count, m) for pairs of one pattern of zeros."""
    group = _groups(drives)
    same = group[:, None] == group
    e = _circles(A * same)
    inside = _scaled(A * same, e).max(axis=(-2, -1), initial=0.0)
    level = np.log2(np.where(inside > 0.0, inside, 1.0))
    f = _to_level(C, e, level)
    # Groups are numbered so that a group drives only groups of lower numbers (see _groups): downstream first.
    leads: set[int] = set()
    for g in range(int(group.max()) + 1):
        members = group == g
        onward = drives & members & ~members[:, None] & np.isin(group, list(leads))[:, None]
        if onward.any() or shows[:, members].any():
            leads.add(g)
            strongest = np.maximum(
                _scaled(A * onward, e).max(axis=(-2, -1), initial=0.0),
                (C * members * np.exp2(f[:, :, None] + e[:, None, :])).max(axis=(-2, -1), initial=0.0),
            )
            e[:, members] += np.rint(level - np.log2(strongest))[:, None]
    for g in reversed(range(int(group.max()) + 1)):
        members = group == g
        driven = drives & members[:, None] & ~members
        if g not in leads and driven.any():
            e[:, members] += np.rint(np.log2(_scaled(A * driven, e).max(axis=(-2, -1))) - level)[:, None]
    return e, _to_level(C, e, level)


def _groups(drives: BoolArray) -> IntArray:
    """The strongly connected component of every state; a component drives (columns to rows) only those of lower numbers."""
    n = len(drives)
    reach = drives.T | np.eye(n, dtype=bool)  # reach[j, i]: state j acts on state i
    for _ in range(max(1, int(np.ceil(np.log2(n))))):
        reach = (reach.astype(float) @ reach) > 0.0
    mutual = reach & reach.T
    # The number of states that a component reaches grows strictly upstream; the first member tells equals apart.
    key = reach.sum(axis=1) * (n + 1) + mutual.argmax(axis=1)
    return np.asarray(np.unique(key, return_inverse=True)[1], dtype=np.int64)


def _circles(A: FloatArray) -> FloatArray:
    """Osborne's exponents (count, n): row and column sums beside the diagonal within a factor of two of each other."""
    n = A.shape[-1]
    beside, e = A * (1.0 - np.eye(n)), np.zeros(A.shape[:-1])
    for _ in range(SWEEPS):
        moved = False
        for i in range(n):
            row = (beside[:, i, :] * np.exp2(e - e[:, i, None])).sum(axis=-1)
            column = (beside[:, :, i] * np.exp2(e[:, i, None] - e)).sum(axis=-1)
            both = (row > 0.0) & (column > 0.0)
            step = np.where(both, np.rint(0.5 * np.log2(np.where(both, row, 1.0) / np.where(both, column, 1.0))), 0.0)
            e[:, i] += step
            moved |= bool(step.any())
        if not moved:
            break
    return e


def _scaled(A: FloatArray, e: FloatArray) -> FloatArray:
    return np.asarray(A * np.exp2(e[:, None, :] - e[:, :, None]))


def _to_level(C: FloatArray, e: FloatArray, level: FloatArray) -> FloatArray:
    """Exponents of F: the largest entry of every output's row to the level."""
    largest = (C * np.exp2(e)[:, None, :]).max(axis=-1)
    exponent = np.rint(level[:, None] - np.log2(np.where(largest > 0.0, largest, 1.0)))
    return np.where(largest > 0.0, np.clip(exponent, -LIMIT, LIMIT), 0.0)
