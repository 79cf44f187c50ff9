r"""|G|_F^2 and the sum of squared 2 x 2 minors of G as partial fractions in x = omega^2.

G(-s)'G(s) is even in s and has simple poles at lambda_k and -lambda_k, so each invariant is a constant + sum_k c_k / (x +
lambda_k^2). With r = min(p, m) <= 2 they give all gains, sigma_max^2 = (f + (f^2 - 4 k)^(1/2)) / 2, at the price of a few
real operations.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import combinations

import numpy as np

from analysis.norms.modal import Modal, norm
from estimators.arrays import BoolArray, ComplexArray, FloatArray, IndexArray

MINORS = 10


@dataclass(frozen=True)
class Invariants:
    r"""Both invariants (t = 0, 1) of a stack: `constant` (2, g), residues (2, k, g), and `error` (2, k, g), what rounding
    adds to them.

    The poles are lambda = -`decay` + j `turn` (k, g), one of each pair, with twice its residue; 0 fills up. The last axis is
    the stack, because numpy adds over the first one much faster.
    """

    decay: FloatArray
    turn: FloatArray
    constant: FloatArray
    real: FloatArray
    imag: FloatArray
    error: FloatArray

    def pick(self, index: IndexArray | BoolArray) -> Invariants:
        """Some of the systems."""
        return Invariants(*(getattr(self, field.name)[..., index] for field in fields(self)))

    def gain(self, frequency: FloatArray) -> FloatArray:
        """sigma_max at frequencies (j, g); accurate to rounding unless both singular values nearly agree."""
        with np.errstate(all="ignore"):
            decay, turn = self.decay[:, None], self.turn[:, None]
            dr = decay * decay - (turn - frequency) * (turn + frequency)
            di = -2.0 * decay * turn
            square = 1.0 / (dr * dr + di * di)
            dr *= square
            di = di * square
            f, k = (
                (r[:, None] * dr + i[:, None] * di).sum(axis=0) + c
                for r, i, c in zip(self.real, self.imag, self.constant, strict=True)
            )
            gain = np.sqrt(np.maximum(0.5 * (f + np.sqrt(np.maximum(f * f - 4.0 * k, 0.0))), 0.0))
        return np.where(np.isfinite(gain), gain, 0.0)


def available(p: int, m: int) -> bool:
    """Whether two invariants give the gain of p x m systems, and without too many minors."""
    return min(p, m) == 1 or (min(p, m) == 2 and max(p, m) * (max(p, m) - 1) // 2 <= MINORS)


def invariants(modal: Modal) -> Invariants:
    """The residues from those of G: sum_ij R_ij,k G_ij(-lambda_k) for |G|_F^2, and likewise for the minors."""
    poles, residues, direct = modal.poles, modal.residues, modal.direct
    g = len(poles)
    p, m = direct.shape[-2:]
    flat, size = direct.reshape(g, 1, p * m), norm(residues)
    plain = np.sqrt((direct * direct).sum(axis=(-2, -1)))[:, None]
    # without the second pole of each pair
    order = np.argsort(poles.imag < 0.0, axis=-1, kind="stable")
    order = order[:, : int((poles.imag >= 0.0).sum(axis=-1).max(initial=0))]
    lam = np.take_along_axis(poles, order, -1)
    own_residues, own_size = np.take_along_axis(residues, order[..., None], 1), np.take_along_axis(size, order, -1)
    with np.errstate(all="ignore"):
        weights = -1.0 / (lam[:, :, None] + poles[:, None, :])
        mirrored = weights @ residues + flat  # G(-lambda_k)
        bound = (_modulus(weights) @ size[..., None])[..., 0] + plain
        found, error = [(own_residues * mirrored).sum(axis=-1)], [own_size * bound]
        constant = [(direct * direct).sum(axis=(-2, -1))]
        if min(p, m) == 2:
            apart = lam[:, :, None] - poles[:, None, :]
            np.put_along_axis(apart, order[..., None], np.inf, -1)
            weights = 1.0 / apart
            rest = weights @ residues + flat
            area, square = np.zeros_like(lam), np.zeros(g)
            for a, b, c, d in minors(p, m):
                r, o, q = own_residues, rest, mirrored
                change = r[..., a] * o[..., d] + r[..., d] * o[..., a] - r[..., b] * o[..., c] - r[..., c] * o[..., b]
                area += change * (q[..., a] * q[..., d] - q[..., b] * q[..., c])
                square += (flat[:, 0, a] * flat[:, 0, d] - flat[:, 0, b] * flat[:, 0, c]) ** 2
            rest_bound = (_modulus(weights) @ size[..., None])[..., 0] + plain
            found.append(area)
            error.append(2.0 * own_size * rest_bound * bound**2)
            constant.append(square)
        else:
            found.append(np.zeros_like(lam))
            error.append(np.zeros(lam.shape))
            constant.append(np.zeros(g))
        factor = -2.0 * lam * (np.sign(lam.imag) + 1.0)  # both of a pair; none for what only fills up
        factor = np.where(lam.imag < 0.0, 0.0, factor)
        change = np.stack([factor * x for x in found])
        sizes = np.stack([_modulus(factor) * x for x in error])
    turned = np.ascontiguousarray(np.swapaxes(change, 1, 2))
    return Invariants(
        np.ascontiguousarray(-lam.real.T), np.ascontiguousarray(lam.imag.T), np.stack(constant),
        np.ascontiguousarray(turned.real), np.ascontiguousarray(turned.imag), np.ascontiguousarray(np.swapaxes(sizes, 1, 2)),
    )  # fmt: skip


def minors(p: int, m: int) -> list[tuple[int, int, int, int]]:
    """Places of the entries (11, 12, 21, 22) of each 2 x 2 minor in the flat p x m matrix."""
    if m == 2:
        return [(2 * i, 2 * i + 1, 2 * k, 2 * k + 1) for i, k in combinations(range(p), 2)]
    return [(i, k, m + i, m + k) for i, k in combinations(range(m), 2)]


def _modulus(z: ComplexArray) -> FloatArray:
    """|z| without the care for overflow that makes np.abs slow."""
    return np.asarray(np.sqrt(z.real**2 + z.imag**2))
