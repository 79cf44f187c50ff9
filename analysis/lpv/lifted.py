r"""The system along a periodic path as a map over one period, in floats: what a search for bad trajectories looks at.

With x = e^(jwt) xi and w = e^(jwt) v, v constant on every interval, the error of an interval is linear in (xi, v):

    xi_(k+1) = F_k xi_k + G_k v_k,    energy_k = [xi_k; v_k]* Q_k [xi_k; v_k]
 in continuous time from xi' = (A(p(t)) - jw) xi + B(p(t)) v by Taylor series of short steps, in discrete time as it stands. A
periodic input of this kind has a periodic answer, and the ratio of their energies over one period bounds the L2 gain of the LPV
system from below (Cantoni, Sandberg 2009; Peni, Seiler 2016). All intervals are worked on at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.lpv.question import Searched
from analysis.lpv.trajectory import Path
from estimators.arrays import ComplexArray, FloatArray

TERMS = 8  # of the Taylor series of a step
SHORT = 0.5  # norm of step times A - jw
LONGEST = 6  # halvings of an interval


@dataclass(frozen=True)
class Lifted:
    """`step` (N, n+m, n+m) with rows [F_k G_k] and [0 I], `energy` Q_k (N, n+m, n+m), `length` (N,) of the intervals.

    N states.
    """

    step: ComplexArray
    energy: ComplexArray
    length: FloatArray
    states: int

    @property
    def monodromy(self) -> ComplexArray:
        """F_N ... F_1."""
        total = np.eye(self.states, dtype=complex)
        for F in self.step[:, : self.states, : self.states]:
            total = F @ total
        return total


def lift(question: Searched, path: Path, frequency: float, parts: int) -> Lifted | None:
    """Every piece of the path in `parts` intervals; None where the steps would be too many.

    In discrete time an interval is one sample and `parts` is the number of samples of a piece.
    """
    if question.discrete:
        return _discrete(question, path, frequency)
    start, change = intervals(path, parts)
    length = np.repeat(path.durations / parts, parts)
    A, *_ = question.frozen(np.concatenate([start, start + change]))
    n = A.shape[-1]
    size = float(np.abs(A - 1j * frequency * np.eye(n)).sum(axis=-1).max()) * float(length.max())
    halvings = max(0, int(np.ceil(np.log2(size / SHORT)))) if size > 0.0 else 0
    if halvings > LONGEST:
        return None
    count = 2**halvings
    begin = (start[:, None] + change[:, None] * (np.arange(count) / count)[:, None]).reshape(-1, start.shape[1])
    step, energy = _taylor(
        question, begin, np.repeat(change / count, count, axis=0), frequency, np.repeat(length / count, count)
    )
    for _ in range(halvings):  # two steps after each other
        first, second = step[::2], step[1::2]
        energy = energy[::2] + np.conj(np.swapaxes(first, -1, -2)) @ energy[1::2] @ first
        step = second @ first
    return Lifted(step, energy, length, n)


def intervals(path: Path, parts: int) -> tuple[FloatArray, FloatArray]:
    """u at the beginning of every interval, and its change over it."""
    share = (np.arange(parts) / parts)[:, None]
    change = path.end - path.start
    start = (path.start[:, None] + change[:, None] * share).reshape(-1, path.start.shape[1])
    return start, np.repeat(change / parts, parts, axis=0)


def samples(path: Path) -> FloatArray:
    """u at every sample of a path whose durations are whole numbers of samples."""
    pieces = zip(path.start, path.end, path.durations, strict=True)
    return np.concatenate([a + (b - a) * (np.arange(round(n)) / round(n))[:, None] for a, b, n in pieces])


def _taylor(
    question: Searched, start: FloatArray, change: FloatArray, frequency: float, h: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """Step and energy of intervals of lengths h (N,) with u = start + change s, s in [0, 1]."""
    order = question.order
    nodes = 0.5 - 0.5 * np.cos(np.pi * (np.arange(order) + 0.5) / order)
    inverse = np.linalg.inv(np.vander(nodes, order, increasing=True))
    places = (start[None] + change[None] * nodes[:, None, None]).reshape(-1, start.shape[1])
    A, B, C, D = (m.reshape(order, len(start), *m.shape[1:]) for m in question.frozen(places))
    count, n, m, p = len(start), A.shape[-1], B.shape[-1], C.shape[-2]
    flow = np.concatenate([A - 1j * frequency * np.eye(n), B], axis=-1)
    shown = np.concatenate([C, D], axis=-1)
    flow, shown = (np.tensordot(inverse, x, axes=(1, 0)) for x in (flow, shown))
    rates, seen = (_beside(x[..., :n]) for x in (flow, shown))
    # Rows of xi of the terms, the last one first: those that one product needs stand below each other. Term 0 is the identity.
    terms = np.zeros((count, TERMS * n, n + m), complex)
    for k in range(TERMS):
        above, known = (TERMS - k) * n, min(order, k) * n
        term = rates[..., :known] @ terms[:, above : above + known] + (flow[k] if k < order else 0.0)
        terms[:, above - n : above] = term * (h / (k + 1))[:, None, None]
    powers = TERMS + order
    out = np.zeros((count, powers, p, n + m), complex)
    for k in range(powers):
        low, high = max(0, k - TERMS), min(order, k)
        above = (TERMS - k + low) * n
        out[:, k] = seen[..., low * n : high * n] @ terms[:, above : above + (high - low) * n]
        if k < order:
            out[:, k] += shown[k]
    weights = 1.0 / (1.0 + np.add.outer(np.arange(powers), np.arange(powers))) + 0j
    weighed = (weights @ out.reshape(count, powers, -1)).reshape(count, -1, n + m)
    energy = np.conj(np.swapaxes(out.reshape(count, -1, n + m), -1, -2)) @ weighed
    step = np.broadcast_to(np.eye(n + m, dtype=complex), (count, n + m, n + m)).copy()
    step[:, :n] += terms.reshape(count, TERMS, n, n + m).sum(axis=1)
    return step, energy * h[:, None, None]


def _beside(blocks: ComplexArray) -> ComplexArray:
    """(order, N, rows, n) as (N, rows, order n)."""
    moved = np.moveaxis(blocks, 0, -2)
    return moved.reshape(*moved.shape[:-2], -1)


def _discrete(question: Searched, path: Path, frequency: float) -> Lifted:
    start = samples(path)
    A, B, C, D = question.frozen(start)
    n, m = A.shape[-1], B.shape[-1]
    step = np.zeros((len(start), n + m, n + m), complex)
    step[:, :n, :n], step[:, :n, n:] = A, B
    step[:, :n] *= np.exp(-1j * frequency)
    step[:, n:, n:] = np.eye(m)
    shown = np.concatenate([C, D], axis=-1)
    return Lifted(step, np.swapaxes(shown, -1, -2) @ shown + 0j, np.ones(len(start)), n)


def worst_input(lifted: Lifted) -> tuple[float, ComplexArray]:
    """The largest ratio of output to input norm over one period, and the input v (N, m); (inf, 0) without a periodic answer."""
    n, count = lifted.states, len(lifted.step)
    m = lifted.step.shape[-1] - n
    F, G = lifted.step[:, :n, :n], lifted.step[:, :n, n:]
    free = np.empty((count, n, n), complex)  # xi_k = free_k xi_0 + forced_k V
    forced = np.zeros((count, n, count, m), complex)
    at, held = np.eye(n, dtype=complex), np.zeros((n, count, m), complex)
    for k in range(count):
        free[k], forced[k] = at, held
        held = np.tensordot(F[k], held, axes=(1, 0))
        held[:, k] += G[k]
        at = F[k] @ at
    if not (np.isfinite(at).all() and np.isfinite(held).all()) or np.abs(np.linalg.eigvals(at)).max() >= 1.0:
        return np.inf, np.zeros((count, m), complex)
    start = np.linalg.solve(np.eye(n) - at, held.reshape(n, -1))
    whole = np.zeros((count, n + m, count, m), complex)
    whole[:, :n] = np.tensordot(free, start, axes=(2, 0)).reshape(count, n, count, m) + forced
    whole[np.arange(count), n:, np.arange(count)] = np.eye(m)
    flat = whole.reshape(count, n + m, count * m)
    square = np.conj(flat.reshape(-1, count * m).T) @ (lifted.energy @ flat).reshape(-1, count * m)
    root = np.repeat(np.sqrt(lifted.length), m)
    values, vectors = np.linalg.eigh((square + np.conj(square.T)) / (2.0 * np.outer(root, root)))
    return float(np.sqrt(max(values[-1], 0.0))), (vectors[:, -1] / root).reshape(count, m)
