r"""Enclosures of the leading eigenvalue of matrices, for every matrix within an entrywise error of the given ones.

With computed eigenvectors V and K near V^-1, V^-1 M V = (K V)^-1 K M V is nearly diagonal, and every eigenvalue lies in a
disc about a diagonal entry whose radius is the sum of the row beside it (Gershgorin 1931). A union of discs that touch no
other holds as many eigenvalues as discs. Rounding and the error of M enter the radii through |K| |M| |V|; nothing is
believed of V. Nearly defective matrices have large |K|: there V is taken from matrices that differ
a little, too, which spreads their eigenvectors.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from estimators.arrays import AnyArray, BoolArray, FloatArray
from synthesis.lmi.result import Verdict

EPS = float(np.finfo(float).eps)
POOR = 1e-6  # relative width from which eigenvectors of slightly different matrices are tried, too
SHAKES = (1e-14, 1e-12, 1e-10, 1e-8, 1e-6)  # the difference, relative to the largest entry
DATA = 0.5 * EPS  # relative error of an entry that was rounded to the nearest float


class Enclosure(NamedTuple):
    """`value` as computed, and lower <= largest modulus (or real part) <= upper for all matrices within the error, (...)."""

    value: FloatArray
    lower: FloatArray
    upper: FloatArray


def enclosed(matrix: FloatArray, error: FloatArray, *, modulus: bool = True) -> Enclosure:
    """The largest modulus (spectral radius) of matrices (..., d, d), or their largest real part; |change| <= error, entrywise."""
    values, V = np.linalg.eig(matrix)
    value = (np.abs(values) if modulus else values.real).max(axis=-1)
    lower, upper = (np.atleast_1d(bound) for bound in _discs(matrix, error, V, modulus))
    poor = ~(upper - lower <= POOR * np.abs(np.atleast_1d(value)))
    if poor.any():
        d = matrix.shape[-1]
        left, slack = (
            np.broadcast_to(x, (*value.shape, d, d)).reshape(*poor.shape, d, d)[poor] for x in (matrix, error)
        )
        shake = np.random.default_rng(0).normal(size=(d, d)) * np.abs(left).max(axis=(-2, -1))[:, None, None]
        for size in SHAKES:
            low, high = _discs(left, slack, np.linalg.eig(left + size * shake)[1], modulus)
            lower[poor], upper[poor] = np.maximum(lower[poor], low), np.minimum(upper[poor], high)
    return Enclosure(value, lower.reshape(value.shape), upper.reshape(value.shape))


def _discs(matrix: FloatArray, error: FloatArray, V: AnyArray, modulus: bool) -> tuple[FloatArray, FloatArray]:
    """Bounds (...) from any matrices V (..., d, d): near eigenvectors they are tight."""
    d = matrix.shape[-1]
    K, regular = _inverse(V)
    gamma = 4.0 * (d + 2) * EPS
    defect = (np.abs(K @ V - np.eye(d)) + gamma * np.abs(K) @ np.abs(V)).sum(axis=-1).max(axis=-1)
    regular &= defect < 0.5
    middle = K @ matrix @ V
    spread = np.abs(K) @ (error + gamma * np.abs(matrix)) @ np.abs(V)
    share = np.where(regular, defect / (1.0 - np.minimum(defect, 0.5)), 1.0)
    rows = (np.abs(middle) + spread).sum(axis=-1)
    centre = np.einsum("...ii->...i", middle)
    beside = np.abs(middle * (1.0 - np.eye(d))).sum(axis=-1) + spread.sum(axis=-1)
    # (K V)^-1 = I + D with |D| <= share in the norm of largest row sums, so that a row changes by no more than the largest sum
    radius = beside + share[..., None] * rows.max(axis=-1)[..., None]
    place = np.abs(centre) if modulus else centre.real
    lower = np.where(_cluster(centre, radius, place), place - radius, np.inf).min(axis=-1)
    upper = (place + radius).max(axis=-1)
    bound = _norm(np.abs(matrix) + error)
    least = np.zeros_like(bound) if modulus else -bound
    return (
        np.array(np.where(regular, np.maximum(lower, least), least)),
        np.array(np.where(regular, np.minimum(upper, bound), bound)),
    )


def verdicts(lower: FloatArray, upper: FloatArray, border: float = 1.0) -> Verdict | AnyArray:
    """CERTIFIED where upper < border, REFUTED where lower >= border, INCONCLUSIVE between: undecided at this precision.

    One verdict for plain numbers, an object array for stacks.
    """
    below, above = np.asarray(upper) < border, np.asarray(lower) >= border
    out = np.full(below.shape, Verdict.INCONCLUSIVE, dtype=object)
    out[below], out[above] = Verdict.CERTIFIED, Verdict.REFUTED
    return Verdict(str(out[()])) if out.ndim == 0 else out


def _inverse(V: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Inverses, with the identity where there is none, and where there is one."""
    regular = np.linalg.slogdet(V)[0] != 0.0
    eye = np.eye(V.shape[-1])
    return np.linalg.inv(np.where(regular[..., None, None], V, eye)), np.asarray(regular)


def _cluster(centre: FloatArray, radius: FloatArray, place: FloatArray) -> BoolArray:
    """The discs (..., d) that hang together with the one about the largest centre."""
    touching = np.abs(centre[..., :, None] - centre[..., None, :]) <= radius[..., :, None] + radius[..., None, :]
    inside = place >= place.max(axis=-1, keepdims=True)
    for _ in range(place.shape[-1]):
        more = (touching & inside[..., None, :]).any(axis=-1)
        if (more == inside).all():
            break
        inside = more
    return np.asarray(inside)


def _norm(size: FloatArray) -> FloatArray:
    """A bound of the spectral radius by row sums."""
    return np.asarray(size.sum(axis=-1).max(axis=-1) * (1.0 + 2.0 * size.shape[-1] * EPS))
