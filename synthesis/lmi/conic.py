"""Direct assembly of conic data: minimise q'x subject to A x + s = b, s in a product of cones (Clarabel's form)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from estimators.arrays import FloatArray, IndexArray
from synthesis.lmi.relaxation import RelaxedProblem, SampledInequality, SosInequality


@dataclass(frozen=True)
class ConicData:
    """Equality rows first, then one triangle of rows for each positive semidefinite cone.

    `b` already has the margins taken off; `slack` is what they took, so that b + slack is the problem without margins.
    `weights` (one for every variable) is the diagonal of a quadratic cost x' diag(weights) x / 2.
    """

    A: sparse.csc_array
    b: FloatArray
    slack: FloatArray
    q: FloatArray
    weights: FloatArray
    equalities: int
    semidefinite: tuple[int, ...]  # sizes of the matrices


def triangle(size: int) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Row and column indices of the upper triangle, column by column, and the weights sqrt(2) of svec."""
    columns, rows = np.tril_indices(size)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0))


def assemble(relaxed: RelaxedProblem) -> ConicData:
    """Stack all cones; no canonicalisation, only array operations."""
    decisions = len(relaxed.cost)
    equalities: list[sparse.csc_array] = []
    equality_b: list[FloatArray] = []
    cone_rows: list[sparse.csc_array] = []
    cone_b: list[FloatArray] = []
    equality_slack: list[FloatArray] = []
    cone_slack: list[FloatArray] = []
    sizes: list[int] = []
    if relaxed.sampled:  # small and dense: stacked first, converted once
        parts = [_sampled_rows(sampled) for sampled in relaxed.sampled]
        free, fixed = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
        equalities.append(sparse.csc_array(-fixed[:, 1:]))
        cone_rows.append(sparse.csc_array(-free[:, 1:]))
        equality_b.append(fixed[:, 0])
        cone_b.append(free[:, 0])
        equality_slack.append(np.zeros(len(fixed)))
        for sampled, (_, _, size) in zip(relaxed.sampled, parts, strict=True):
            rows, columns, _ = triangle(size)
            cone_slack.append(np.tile(sampled.margin * (rows == columns), len(sampled.values)))
            sizes += [size] * (len(sampled.values) if size else 0)
    extra = 0
    for sos in relaxed.sos:
        matching = gram_matrices(sos)
        rows, columns, _ = triangle(sos.values.shape[1])
        values = sos.values[:, rows, columns].reshape(-1, decisions + 1)
        width = sum(block.shape[1] for block in matching)
        left = [sparse.csc_array(-values[:, 1:]), sparse.csc_array((len(values), extra))]
        equalities.append(sparse.hstack(left + [sparse.csc_array(block) for block in matching], format="csc"))
        equality_b.append(values[:, 0])
        equality_slack.append(np.tile(sos.margin * (rows == columns), len(sos.values)))
        extra += width
        sizes += [sos.values.shape[1] * basis.shape[1] for basis in sos.bases]
    if extra:
        cone_rows.append(sparse.hstack([sparse.csc_array((extra, decisions)), -sparse.eye_array(extra)], format="csc"))
        cone_b.append(np.zeros(extra))
        cone_slack.append(np.zeros(extra))
    width = decisions + extra
    equality = sparse.vstack([_widen(block, width) for block in equalities], format="csc")
    cones = sparse.vstack([_widen(block, width) for block in cone_rows], format="csc")
    slack = np.concatenate([*equality_slack, *cone_slack])
    return ConicData(
        sparse.vstack([equality, cones], format="csc"),
        np.concatenate([*equality_b, *cone_b]) - slack,
        slack,
        np.concatenate([relaxed.cost, np.zeros(extra)]),
        np.concatenate([relaxed.weights, np.zeros(extra)]),
        equality.shape[0],
        tuple(sizes),
    )


def _widen(block: sparse.csc_array, width: int) -> sparse.csc_array:
    """Append empty columns for the Gram matrices."""
    return sparse.csc_array((block.data, block.indices, _pointers(block, width)), shape=(block.shape[0], width))


def _pointers(block: sparse.csc_array, width: int) -> IndexArray:
    return np.concatenate([block.indptr, np.full(width - block.shape[1], block.indptr[-1])])


def structural_zeros(values: FloatArray) -> IndexArray:
    """Indices whose diagonal entry is zero for every decision: their whole row must vanish (facial reduction).

    Multi-convexity of the corner models is of this kind: A1 has a zero column, so the condition has no interior and an
    interior-point method would only approach it.
    """
    scale = np.abs(values).max() or 1.0
    diagonal = np.abs(np.einsum("giim->gim", values)).max(axis=(0, 2))
    return np.flatnonzero(diagonal <= 1e-14 * scale)


def _sampled_rows(sampled: SampledInequality) -> tuple[FloatArray, FloatArray, int]:
    """svec rows of the cone, rows of the equalities, and the size of the cone."""
    values = sampled.values
    zero = structural_zeros(values)
    keep = np.setdiff1d(np.arange(values.shape[1]), zero)
    forced = values[:, zero].reshape(-1, values.shape[-1])
    forced = forced[np.abs(forced).max(axis=1) > 0.0] if len(forced) else forced
    rows, columns, weights = triangle(len(keep))
    cone = values[:, keep[rows], keep[columns]] * weights[:, None] if len(keep) else values[:, :0, 0]
    return cone.reshape(-1, values.shape[-1]), forced, len(keep)


def gram_matrices(sos: SosInequality) -> list[FloatArray]:
    """Linear maps svec(X_t) -> entries of w_t(u) (b_t (x) I)' X_t (b_t (x) I) at the nodes, shape (nodes * tri(k), tri)."""
    size = sos.values.shape[1]
    rows, columns, _ = triangle(size)
    out = []
    for weights, basis in zip(sos.weights, sos.bases, strict=True):
        first, second, svec = triangle(size * basis.shape[1])
        (a, i), (c, j) = np.divmod(first, size), np.divmod(second, size)
        direct = (i == rows[:, None]) & (j == columns[:, None])
        mirrored = (j == rows[:, None]) & (i == columns[:, None]) & (first != second)
        product = weights[:, None] * basis[:, a] * basis[:, c] / svec
        out.append((product[:, None, :] * (direct + mirrored.astype(float))[None]).reshape(-1, len(first)))
    return out
