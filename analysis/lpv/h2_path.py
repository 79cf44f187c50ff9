r"""H2 norms along periodic paths: the energy after an impulse, and the largest output per energy of the input.

With the maps of the intervals (`analysis.lpv.lifted`, without a carrier) and their energies Q_k over the states

    W_k = Q_k + F_k' W_(k+1) F_k,          X_(k+1) = F_k X_k F_k' + G_k G_k'/length,          both periodic,

B(p_k)'W_k B(p_k) is the energy after an impulse at the beginning of interval k, and C(p_k) X_k C(p_k)' belongs to inputs that are
constant on every interval: the H2 norm and the generalised one are at least the roots of its trace and of its largest eigenvalue.
The same recursion is run in floats for a search and in balls for a proof.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from operator import mul
from typing import Any

import numpy as np
from flint import arb, arb_mat, fmpq

from analysis.lpv.lifted import intervals, lift, samples
from analysis.lpv.proved_path import ProvedPath, floor_of
from analysis.lpv.question import Question
from analysis.lpv.trajectory import Path
from analysis.lpv.worst_path import PARTS, Score
from estimators.arrays import FloatArray


def h2_of(question: Question, generalised: bool) -> Score:
    """The squared norm along a path, in floats; inf for one that is not stable, -inf where it cannot be had."""

    def score(path: Path, _: float) -> float:
        lifted = lift(question, path, 0.0, PARTS)
        if lifted is None:
            return -np.inf
        if np.abs(np.linalg.eigvals(lifted.monodromy)).max() >= 1.0:
            return np.inf
        n = lifted.states
        F, G = lifted.step.real[:, :n, :n], lifted.step.real[:, :n, n:]
        B, C, D = question.frozen(samples(path) if question.discrete else intervals(path, PARTS)[0])[1:]
        if generalised:
            R = G @ np.swapaxes(G, -1, -2) / lifted.length[:, None, None]
            seen = C @ np.array(reached(list(F), list(R), _fixed_floats, np.matmul)) @ np.swapaxes(C, -1, -2)
            return float(np.linalg.eigvalsh(seen + _direct(question, D, np.swapaxes(D, -1, -2)))[:, -1].max())
        power = np.array(observed(list(F), list(lifted.energy.real[:, :n, :n]), _fixed_floats, np.matmul))
        if question.discrete:
            power = np.roll(power, -1, axis=0)
        left = np.swapaxes(B, -1, -2) @ power @ B + _direct(question, np.swapaxes(D, -1, -2), D)
        return float(np.einsum("kii->k", left).max())

    return score


def proved_along(question: Question, path: Path, generalised: bool) -> float:
    """A float that is certainly not above the norm along a path (not its square); 0 where nothing can be said."""
    proof = ProvedPath(question, path, 0.0, PARTS)
    if proof.intervals is None:
        return 0.0
    n = question.loop.plant.states
    steps = [arb_mat(one.step.real).tolist()[:n] for one in proof.intervals]
    F = [arb_mat([row[:n] for row in rows]) for rows in steps]
    best = 0.0
    try:
        if generalised:
            G = [arb_mat([row[n:] for row in rows]) for rows in steps]
            R = [g * g.transpose() * (1 / arb(h)) for g, h in zip(G, proof.lengths, strict=True)]
            for u, X in zip(proof.starts, reached(F, R, _fixed_balls, mul), strict=True):
                C, D = (_at(question, key, u) for key in "CD")
                seen = C * X * C.transpose() + (D * D.transpose() if question.discrete else D * D.transpose() * 0)
                best = max(best, _largest(seen))
        else:
            Q = [arb_mat([row[:n] for row in arb_mat(one.energy.real).tolist()[:n]]) for one in proof.intervals]
            W = observed(F, Q, _fixed_balls, mul)
            for u, w in zip(proof.starts, W[1:] + W[:1] if question.discrete else W, strict=True):
                B, D = (_at(question, key, u) for key in "BD")
                left = (B.transpose() * w * B).trace()
                best = max(best, floor_of((left + (D.transpose() * D).trace() if question.discrete else left).sqrt()))
    except ZeroDivisionError:
        return 0.0
    return best


def observed(
    F: Sequence[Any], Q: Sequence[Any], fixed: Callable[[Any, Any], Any], times: Callable[[Any, Any], Any]
) -> list[Any]:
    """W_0 .. W_(N-1) in any arithmetic; `fixed` solves W = Q + F' W F over the period."""

    def back(W: Any, k: int) -> Any:
        return Q[k] + times(times(F[k].transpose(), W), F[k])

    total, whole = Q[-1], F[-1]
    for k in range(len(F) - 2, -1, -1):
        total, whole = back(total, k), times(whole, F[k])
    W, found = fixed(whole, total), []
    for k in range(len(F) - 1, -1, -1):
        W = back(W, k)
        found.append(W)
    return found[::-1]


def reached(
    F: Sequence[Any], R: Sequence[Any], fixed: Callable[[Any, Any], Any], times: Callable[[Any, Any], Any]
) -> list[Any]:
    """X_0 .. X_(N-1): the dual recursion, which runs through the intervals the other way."""
    found = observed([f.transpose() for f in F[::-1]], R[::-1], fixed, times)  # X_N, X_(N-1), .. X_1, and X_N = X_0
    return found[:1] + found[:0:-1]


def _direct(question: Question, left: FloatArray, right: FloatArray) -> FloatArray:
    return left @ right if question.discrete else 0.0 * (left @ right)


def _fixed_floats(F: FloatArray, Q: FloatArray) -> FloatArray:
    n = len(F)
    return np.asarray(np.linalg.solve(np.eye(n * n) - np.kron(F.T, F.T), Q.ravel()).reshape(n, n))


def _fixed_balls(F: Any, Q: Any) -> Any:
    n, f = F.nrows(), F.tolist()
    rows = [
        [int(i == a and j == b) - f[a][i] * f[b][j] for a in range(n) for b in range(n)]
        for i in range(n)
        for j in range(n)
    ]
    return arb_mat(n, n, arb_mat(rows).solve(arb_mat(n * n, 1, Q.entries())).entries())


def _at(question: Question, key: str, u: list[fmpq]) -> Any:
    return arb_mat(question.exact[key].at(u) * (1 / question.exact["denominator"].at(u)[0, 0]))


def _largest(seen: Any) -> float:
    """Below the root of the largest eigenvalue: a quotient at a vector near its eigenvector."""
    n = seen.nrows()
    floats = np.array([float(x.mid()) for x in seen.entries()]).reshape(n, n)
    v = arb_mat([[arb(float(x))] for x in np.linalg.eigh(floats)[1][:, -1]])
    return floor_of(((v.transpose() * seen * v)[0, 0] / (v.transpose() * v)[0, 0]).sqrt())
