r"""Lower bounds of the joint spectral radius: rho(A_w)^(1/|w|) over products, searched by branch and bound (Gripenberg 1996).

A product whose norm shows that no continuation can beat the best rate by more than the tolerance is dropped. The norm is
that of an ellipsoid made for these modes, which prunes far better than the Euclidean one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flint import fmpq, fmpq_mat, fmpq_poly

from analysis.exact import Rational, rationals, total
from estimators.arrays import FloatArray, IndexArray
from synthesis.polynomials.rational import as_float, rational

WIDTH = 4000  # products kept at each length


@dataclass(frozen=True)
class Search:
    """Best product found (`word`, the mode applied first stands first) and its rate."""

    word: tuple[int, ...]
    rate: float
    depth: int


def search_products(modes: FloatArray, tolerance: float, depth: int) -> Search:
    """Products of length up to `depth` of modes (m, n, n), given in coordinates in which their norms are small."""
    radii = np.abs(np.linalg.eigvals(modes)).max(axis=-1)
    word: tuple[int, ...] = (int(radii.argmax()),)
    rate = float(radii.max())
    products, words = modes, np.arange(len(modes))[:, None]
    bound = np.linalg.norm(modes, 2, axis=(-2, -1))
    for length in range(2, depth + 1):
        keep = _open(bound, rate, tolerance)
        if not len(keep):
            return Search(word, rate, length - 1)
        products = np.einsum("aij,gjk->gaik", modes, products[keep]).reshape(-1, *modes.shape[1:])
        letters = np.tile(np.arange(len(modes)), len(keep))[:, None]
        words = np.concatenate([np.repeat(words[keep], len(modes), axis=0), letters], axis=1)
        found = _fastest(products, length, rate)
        if found is not None:
            word, rate = _first_rotation([int(i) for i in words[found[0]]]), found[1]
        bound = np.minimum(np.repeat(bound[keep], len(modes)), _rates(products, length, rate * (1.0 + tolerance)))
    return Search(word, rate, depth)


def _first_rotation(word: list[int]) -> tuple[int, ...]:
    """Rotations have the same eigenvalues but for rounding, which must not choose among them."""
    return min(tuple(word[k:] + word[:k]) for k in range(len(word)))


def _fastest(products: FloatArray, length: int, rate: float) -> tuple[int, float] | None:
    """The product whose eigenvalues beat `rate`, if any, with its own rate; eigenvalues only where |P^4|^(1/4) lets them."""
    least = rate * (1.0 + 1e-12)  # a power of the same product does not count
    size = np.maximum(_frobenius(products), np.finfo(float).tiny)
    fourth = products / size[:, None, None]
    fourth = fourth @ fourth
    fourth = fourth @ fourth
    hopeful = np.flatnonzero((size * _frobenius(fourth) ** 0.25) ** (1.0 / length) > least * (1.0 - 1e-9))
    if not len(hopeful):
        return None
    radii = np.abs(np.linalg.eigvals(products[hopeful])).max(axis=-1) ** (1.0 / length)
    best = int(radii.argmax())
    return (int(hopeful[best]), float(radii[best])) if radii[best] > least else None


def _rates(products: FloatArray, length: int, enough: float) -> FloatArray:
    """|P|^(1/length) in the Euclidean norm; where Frobenius' norm is below `enough` already, that."""
    out = _frobenius(products) ** (1.0 / length)
    open_ = np.flatnonzero(out > enough)
    out[open_] = np.linalg.norm(products[open_], 2, axis=(-2, -1)) ** (1.0 / length)
    return out


def _frobenius(products: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("gij,gij->g", products, products)))


def _open(bound: FloatArray, rate: float, tolerance: float) -> IndexArray:
    """Products that may still lead to a better rate, the most promising ones if there are too many."""
    keep = np.flatnonzero(bound > rate * (1.0 + tolerance))
    return keep if len(keep) <= WIDTH else keep[np.argsort(-bound[keep], kind="stable")[:WIDTH]]


def multiply_out(modes: FloatArray, word: tuple[int, ...]) -> FloatArray:
    """A_(i_k) ... A_(i_1) of a word (i_1, ..., i_k)."""
    out = np.eye(modes.shape[-1])
    for letter in word:
        out = modes[letter] @ out
    return out


def proved_rate(modes: FloatArray, word: tuple[int, ...]) -> float:
    """A float that is certainly not above rho(A_w)^(1/|w|).

    The product is exact, the roots of its characteristic polynomial are enclosed by certified balls, and the answer r is
    checked by r^|w| <= rho in rationals.
    """
    exact = [rationals(mode) for mode in modes]
    product = exact[word[0]]
    for letter in word[1:]:
        product = exact[letter] * product
    characteristic = fmpq_poly(product.charpoly().coeffs())
    radius = max((abs(root) for root, _ in characteristic.roots()), default=fmpq(0))  # rational eigenvalues, exactly
    for root, _ in characteristic.complex_roots():
        radius = max(radius, _floor(root.abs_lower()))
    if radius == 0:
        return 0.0
    rate = float(as_float(radius) ** (1.0 / len(word)))
    while rational(rate) ** len(word) > radius:
        rate = float(np.nextafter(rate, 0.0))
    return rate


def _floor(number: Rational) -> fmpq:
    """A rational that is not above a ball (python-flint's arb), as near as a double can be."""
    middle = float(number.mid())
    radius = float(number.rad())
    low = max(0.0, float(np.nextafter(np.nextafter(middle, 0.0) - np.nextafter(radius, np.inf), -np.inf)))
    return rational(low)


def vanishes(modes: FloatArray) -> bool:
    """Whether every product of n modes is zero, exactly: then, and only then, the joint spectral radius is zero."""
    exact = [rationals(mode) for mode in modes]
    one = rationals(np.eye(modes.shape[-1]))
    mixture, power = total([mode * (i + 1) for i, mode in enumerate(exact)]), one
    for _ in range(modes.shape[-1]):
        power = power * mixture
    if power != one * 0:  # every product of n modes is a term of it: the quick way out
        return False
    basis = [one]
    for _ in range(modes.shape[-1]):
        # a basis of the span of all products of this length is enough, and never has more than n^2 elements
        basis = _independent([mode * element for mode in exact for element in basis])
        if not basis:
            return True
    return False


def _independent(matrices: list[Rational]) -> list[Rational]:
    kept: list[Rational] = []
    rows: list[list[fmpq]] = []
    for matrix in matrices:
        flat = matrix.entries()
        if fmpq_mat([*rows, flat]).rank() > len(rows):
            rows.append(flat)
            kept.append(matrix)
    return kept
