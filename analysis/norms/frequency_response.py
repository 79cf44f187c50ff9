"""Largest gain of stacks of systems at given frequencies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from analysis.checks import as_stack, leading, square
from analysis.errors import AnalysisError
from analysis.state_space import given_system
from estimators.arrays import AnyArray, ComplexArray, FloatArray, IndexArray


@dataclass(frozen=True)
class Systems:
    """x' = A x + B u, y = C x + D u (or x+ = ...) as one flat stack: A (g, n, n), B (g, n, m), C (g, p, n), D (g, p, m)."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    discrete: bool = False

    def __len__(self) -> int:
        return len(self.A)

    def pick(self, index: IndexArray | slice) -> Systems:
        """Some of the systems."""
        return Systems(self.A[index], self.B[index], self.C[index], self.D[index], self.discrete)

    def poles(self) -> ComplexArray:
        """Eigenvalues of A, (g, n)."""
        return np.asarray(np.linalg.eigvals(self.A), np.complex128)


def read_systems(
    A: Any, B: ArrayLike | None, C: ArrayLike | None, D: ArrayLike | None, discrete: bool | None
) -> tuple[tuple[int, ...], Systems]:
    """Check four stacks, broadcast their leading axes and flatten them; also returns the leading shape.

    D = None means zero; A may be a system object (`analysis.state_space`), or be empty for a static gain D. Raises
    AnalysisError for matrices that are not finite, not square or do not fit.
    """
    A, B, C, D, discrete = given_system(A, B, C, D, discrete)
    if B is None or C is None:
        raise AnalysisError(
            f"{'B' if B is None else 'C'} is missing; give A, B and C, or a system object with all of them"
        )
    if D is not None and np.size(A) == 0 and np.ndim(A) <= 2:
        A, B, C = _static(as_stack("D", D), discrete)
    a, b, c = square("A", A), as_stack("B", B), as_stack("C", C)
    n, m, p = a.shape[-1], b.shape[-1], c.shape[-2]
    d = np.zeros((p, m)) if D is None else as_stack("D", D)
    for name, found, wanted in (("B", b.shape[-2:], (n, m)), ("C", c.shape[-2:], (p, n)), ("D", d.shape[-2:], (p, m))):
        if found != wanted or not all(found):
            raise AnalysisError(
                f"{name} is {found[0]} x {found[1]}, but {n} states, {m} inputs and {p} outputs need "
                f"{wanted[0]} x {wanted[1]} and at least one of each"
            )
    shape = leading({"A": a, "B": b, "C": c, "D": d})
    flat = [
        np.ascontiguousarray(np.broadcast_to(x, (*shape, *x.shape[-2:])).reshape(-1, *x.shape[-2:]))
        for x in (a, b, c, d)
    ]
    return shape, Systems(flat[0], flat[1], flat[2], flat[3], discrete)


def _static(D: FloatArray, discrete: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A static gain as a system with one stable state that nothing reaches."""
    p, m = D.shape[-2:]
    return np.full((1, 1), 0.0 if discrete else -1.0), np.zeros((1, m)), np.zeros((p, 1))


def largest_gain(systems: Systems, s: ArrayLike) -> FloatArray:
    """sigma_max of C (s I - A)^-1 B + D at k points s (g, k) of each system: array (g, k). A pole gives inf.

    s is j omega for a continuous system and e^{j theta} for a discrete one; real points stay in real arithmetic.
    """
    points: Any = np.asarray(s)
    n = systems.A.shape[-1]
    resolvent = points[..., None, None] * np.eye(n) - systems.A[:, None]
    force = np.broadcast_to(systems.B[:, None], (*points.shape, *systems.B.shape[1:]))
    try:
        states = np.linalg.solve(resolvent, force)
    except np.linalg.LinAlgError:  # a point sits on a pole of one system: solve the others, leave inf there
        singular = np.linalg.cond(resolvent) > 1.0 / np.finfo(float).eps
        states = np.linalg.solve(np.where(singular[..., None, None], np.eye(n), resolvent), force)
        gain = sigma_max(systems.C[:, None] @ states + systems.D[:, None])
        return np.where(singular, np.inf, gain)
    return sigma_max(systems.C[:, None] @ states + systems.D[:, None])


def sigma_max(G: AnyArray) -> FloatArray:
    """Largest singular value of a stack (..., p, m): closed form for ranks one and two, which is what most loops are."""
    p, m = G.shape[-2:]
    if min(p, m) > 2:
        return np.asarray(np.linalg.svd(G, compute_uv=False)[..., 0])
    rows = G if p <= m else np.swapaxes(G, -1, -2)
    scale = np.abs(G).max(axis=(-2, -1))
    safe = np.where(scale > 0.0, scale, 1.0)
    rows = rows / safe[..., None, None]  # so that squares neither overflow nor vanish
    first = _energy(rows[..., 0, :])
    if rows.shape[-2] == 1:
        return np.asarray(np.sqrt(first) * scale)
    second = _energy(rows[..., 1, :])
    cross = (rows[..., 0, :] * np.conj(rows[..., 1, :])).sum(axis=-1)
    largest = 0.5 * (first + second) + np.sqrt(0.25 * (first - second) ** 2 + np.abs(cross) ** 2)
    return np.asarray(np.sqrt(largest) * scale)


def _energy(rows: AnyArray) -> FloatArray:
    return np.asarray((rows.real**2 + rows.imag**2).sum(axis=-1))
