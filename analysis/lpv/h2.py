"""H2 norm and generalised H2 norm at frozen parameters: in floats to look for the worst place, and exact to prove it."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb, fmpq, fmpq_mat

from analysis.lpv.proved_path import floor_of
from analysis.lpv.question import Question
from analysis.norms.gramians import gramian_matrix
from estimators.arrays import FloatArray
from synthesis.polynomials.rational import as_float, rational
from synthesis.polynomials.stable import is_hurwitz, is_schur


def frozen_energy(question: Question, u: FloatArray, generalised: bool) -> FloatArray:
    """The norm at places u (g, p), in floats; inf where a pole is not stable."""
    A, B, C, D = question.frozen(u)
    poles = np.linalg.eigvals(A)
    stable = (np.abs(poles) < 1.0 if question.discrete else poles.real < 0.0).all(axis=-1)
    out = np.full(len(u), np.inf)
    X = gramian_matrix(A[stable], B[stable], question.discrete)
    seen = C[stable] @ X @ np.swapaxes(C[stable], -1, -2) + D[stable] @ np.swapaxes(D[stable], -1, -2)
    if generalised:
        out[stable] = np.sqrt(np.maximum(np.linalg.eigvalsh(seen)[:, -1], 0.0))
    else:
        out[stable] = np.sqrt(np.maximum(np.einsum("gii->g", seen), 0.0))
    return out


def proved_h2(question: Question, u: FloatArray) -> float:
    """A float that is not above the frozen H2 norm at u: (tr C X C' + D D')^(1/2), X exact."""
    seen = _seen(question, u)
    return 0.0 if seen is None else floor_of(arb(sum((seen[i, i] for i in range(seen.nrows())), fmpq(0))).sqrt())


def proved_energy_to_peak(question: Question, u: FloatArray) -> float:
    """A float not above the frozen generalised H2 norm at u: the root of v'(C X C' + D D')v/v'v, v near the eigenvector."""
    seen = _seen(question, u)
    if seen is None:
        return 0.0
    n = seen.nrows()
    floats = np.array([as_float(x) for x in seen.entries()]).reshape(n, n)
    v = fmpq_mat([[rational(float(x))] for x in np.linalg.eigh(floats)[1][:, -1]])
    above, below = (v.transpose() * seen * v)[0, 0], (v.transpose() * v)[0, 0]
    return floor_of(arb(above / below).sqrt())


def _seen(question: Question, u: FloatArray) -> Any:
    """C X C' + D D' with A X + X A' + B B' = 0 (or X = A X A' + B B'), exact; None at a place that is not stable."""
    point = [rational(float(x)) for x in u]
    below = question.exact["denominator"].at(point)[0, 0]
    A, B, C, D = (question.exact[key].at(point) * (1 / below) for key in "ABCD")
    if (is_schur(A) if question.discrete else is_hurwitz(A)) is not True:
        return None
    n, power = A.nrows(), B * B.transpose()
    one = [[fmpq(int(i == j)) for j in range(n)] for i in range(n)]
    a = A.tolist()
    if question.discrete:
        rows = [
            [one[i][k] * one[j][m] - a[i][k] * a[j][m] for k in range(n) for m in range(n)]
            for i in range(n)
            for j in range(n)
        ]
    else:
        rows = [
            [-(a[i][k] * one[j][m] + one[i][k] * a[j][m]) for k in range(n) for m in range(n)]
            for i in range(n)
            for j in range(n)
        ]
    flat = fmpq_mat(rows).solve(fmpq_mat(n * n, 1, power.entries()))
    return C * fmpq_mat(n, n, flat.entries()) * C.transpose() + D * D.transpose()
