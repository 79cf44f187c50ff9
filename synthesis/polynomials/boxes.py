r"""Matrix polynomials on many boxes at once, enclosed in float64: the quick road of a proof, taken before ball arithmetic.

    M_g(t) lies in  sum over |k| <= D of t^k middle[g, k]  +-  radius[g],    t in [-1, 1]^v

Rounding is bounded a priori (Higham, Accuracy and Stability, section 3): a product of A and B is off by at most gamma S(A)
S(B), entry by entry, S(A) the sum of the absolute coefficients, whatever the order of summation and whether or not products
are fused; terms above the order D widen the radius by their size. Radii are themselves computed in float64 and inflated after
every operation. What is shown here is shown; what is not is left to `synthesis.polynomials.enclosure`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, reduce
from itertools import product
from typing import Any

import numpy as np

from estimators.arrays import BoolArray, FloatArray, IndexArray
from synthesis.polynomials.rational import as_float

EPS = 2.0**-52
INFLATE = 1.0 + 1e-9  # after every operation on radii, each of which is off by fewer than 10^5 roundings
SHORT = 2.0**-28  # share of the diagonal that is given away for lower degrees, at first
TINY = 1e-290  # what underflow may take away


@dataclass(frozen=True)
class Orders:
    """The monomials t^k of total degree up to `highest` in v variables, by degree; `place[k + l]` adds exponents."""

    powers: tuple[tuple[int, ...], ...]
    upto: tuple[int, ...]  # number of monomials that may multiply number k without leaving the table
    sums: tuple[IndexArray, ...]


@cache
def orders(variables: int, highest: int) -> Orders:
    """The table of monomials."""
    powers = sorted(
        (k for k in product(range(highest + 1), repeat=variables) if sum(k) <= highest), key=lambda k: (sum(k), k)
    )
    place = {k: i for i, k in enumerate(powers)}
    upto = tuple(sum(sum(k) + sum(m) <= highest for m in powers) for k in powers)
    sums = tuple(
        np.array([place[tuple(a + b for a, b in zip(k, m, strict=True))] for m in powers[:count]], dtype=np.intp)
        for k, count in zip(powers, upto, strict=True)
    )
    return Orders(tuple(powers), upto, sums)


@dataclass(frozen=True)
class Boxes:
    """`middle` (g, K, rows, columns) and `radius` (g, rows, columns); g = 1 stands for all boxes."""

    middle: FloatArray
    radius: FloatArray
    variables: int
    highest: int

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.middle.shape[2], self.middle.shape[3]

    @property
    def size(self) -> FloatArray:
        """Bounds of |M_g(t)|, entry by entry, radius included."""
        return np.asarray(INFLATE * (np.abs(self.middle).sum(axis=1) + self.radius))

    @property
    def T(self) -> Boxes:
        """The transpose."""
        return self._like(np.swapaxes(self.middle, 2, 3), np.swapaxes(self.radius, 1, 2))

    def _like(self, middle: FloatArray, radius: FloatArray) -> Boxes:
        return Boxes(middle, radius, self.variables, self.highest)

    def __neg__(self) -> Boxes:
        return self._like(-self.middle, self.radius)

    def __add__(self, other: Boxes) -> Boxes:
        middle = self.middle + other.middle
        rounding = EPS * np.abs(middle).sum(axis=1)
        return self._like(middle, INFLATE * (self.radius + other.radius + rounding))

    def __sub__(self, other: Boxes) -> Boxes:
        return self + (-other)

    def __mul__(self, factor: Any) -> Boxes:
        """Times a number: exact if it is a float, else enclosed."""
        number, off = _number(factor)
        middle = self.middle * number
        spread = self.radius * abs(number) + off * self.size + EPS * np.abs(middle).sum(axis=1) + TINY
        return self._like(middle, INFLATE * spread)

    __rmul__ = __mul__

    def __matmul__(self, other: Boxes) -> Boxes:
        table = orders(self.variables, self.highest)
        count = max(len(self.middle), len(other.middle))
        out = np.zeros((count, len(table.powers), self.shape[0], other.shape[1]))
        beyond = np.cumsum(np.abs(other.middle)[:, ::-1], axis=1)[
            :, ::-1
        ]  # sums of the absolute coefficients from number k on
        total = beyond[:, 0]
        last = int(np.flatnonzero(total_by_order(other.middle))[-1]) + 1 if other.middle.any() else 0
        lost: Any = 0.0
        for k, (upto, sums) in enumerate(zip(table.upto, table.sums, strict=True)):
            left = self.middle[:, k]
            if not left.any():
                continue
            kept = min(upto, last)
            out[:, sums[:kept]] += left[:, None] @ other.middle[:, :kept]
            if upto < last:
                lost = lost + np.abs(left) @ beyond[:, upto]
        gamma = EPS * (self.shape[1] + 2 * len(table.powers) + 8)
        size = np.abs(self.middle).sum(axis=1)
        spread = lost + size @ (gamma * total + other.radius) + self.radius @ (total + other.radius) + TINY
        return self._like(out, INFLATE * spread).trimmed()

    def trimmed(self) -> Boxes:
        """Without the monomials that are below a rounding in every entry of every box; they go into the radius."""
        sizes = np.abs(self.middle)
        return self._without(sizes, np.asarray((sizes <= EPS * sizes.sum(axis=1, keepdims=True)).all(axis=(0, 2, 3))))

    def shortened(self) -> Boxes:
        """Without the monomials that hardly matter for the sign: far below the diagonal's mean of their row and column."""
        sizes, diagonal = np.abs(self.middle), np.abs(np.diagonal(self.middle[:, 0], axis1=1, axis2=2))
        scale = SHORT * np.sqrt(diagonal[:, :, None] * diagonal[:, None, :])
        return self._without(sizes, np.asarray((sizes <= scale[:, None]).all(axis=(0, 2, 3))))

    def _without(self, sizes: FloatArray, idle: BoolArray) -> Boxes:
        idle[0] = False
        if not idle.any():
            return self
        middle = self.middle.copy()
        middle[:, idle] = 0.0
        return self._like(middle, INFLATE * (self.radius + sizes[:, idle].sum(axis=1)))

    def scaled_by(self, scalar: Boxes) -> Boxes:
        """Times a 1 x 1 polynomial."""
        diagonal = np.einsum("gkij,ab->gkab", scalar.middle, np.eye(self.shape[0]))
        spread = np.einsum("gij,ab->gab", scalar.radius, np.eye(self.shape[0]))
        return self._like(diagonal, spread) @ self

    def truncated(self, order: int) -> Boxes:
        """Itself: nothing above `highest` is kept anyway."""
        return self

    def widened(self, radius: FloatArray) -> Boxes:
        """Uncertain by so much more."""
        return self._like(self.middle, INFLATE * (self.radius + radius))

    def tiled(self, times: int) -> Boxes:
        """All boxes once more, and once more."""
        return self._like(np.tile(self.middle, (times, 1, 1, 1)), np.tile(self.radius, (times, 1, 1)))


def total_by_order(middle: FloatArray) -> FloatArray:
    """Sums (K,) of all absolute coefficients of each monomial."""
    return np.asarray(np.abs(middle).sum(axis=(0, 2, 3)))


def constants(matrix: FloatArray, variables: int, highest: int) -> Boxes:
    """A matrix of floats (rows, columns), the same on all boxes."""
    array = np.asarray(matrix, float)
    middle = np.zeros((1, len(orders(variables, highest).powers), *array.shape))
    middle[0, 0] = array
    return Boxes(middle, np.zeros((1, *array.shape)), variables, highest)


def _number(factor: Any) -> tuple[float, float]:
    """A float, and by how much the number may be another, relative to it."""
    if isinstance(factor, float):
        return factor, 0.0
    if isinstance(factor, int):
        return float(factor), 0.0
    if hasattr(factor, "mid"):
        value = float(factor.mid())
        return value, 4 * EPS + (float(factor.rad()) * (1 + 1e-9) / abs(value) if value else float(factor.rad()))
    return as_float(factor), EPS


class BoxArithmetic:
    """Arithmetic of boxes for the inequalities (`synthesis.certificate.inequalities.Arithmetic`)."""

    def eye(self, size: int, like: Boxes) -> Boxes:
        """The unit matrix."""
        return constants(np.eye(size), like.variables, like.highest)

    def known(self, rows: Any, like: Boxes) -> Boxes:
        """A matrix of rationals."""
        array = np.array([[as_float(x) for x in row] for row in rows.tolist()]).reshape(rows.nrows(), rows.ncols())
        return constants(array, like.variables, like.highest).widened(EPS * np.abs(array)[None])

    def block(self, rows: Any) -> Boxes:
        """A symmetric block matrix from its upper triangle."""
        diagonal = [row[i] for i, row in enumerate(rows)]
        ends = np.concatenate([[0], np.cumsum([part.shape[0] for part in diagonal])])
        count = max(len(part.middle) for row in rows for part in row if part is not None)
        like = diagonal[0]
        middle = np.zeros((count, like.middle.shape[1], ends[-1], ends[-1]))
        radius = np.zeros((count, ends[-1], ends[-1]))
        for i, row in enumerate(rows):
            for j in range(i, len(rows)):
                if row[j] is None:
                    continue
                across, down = slice(ends[i], ends[i + 1]), slice(ends[j], ends[j + 1])
                middle[:, :, across, down], radius[:, across, down] = row[j].middle, row[j].radius
                middle[:, :, down, across] = np.swapaxes(row[j].middle, 2, 3)
                radius[:, down, across] = np.swapaxes(row[j].radius, 1, 2)
        return Boxes(middle, radius, like.variables, like.highest)

    def trace(self, matrix: Boxes) -> Boxes:
        """The sum of the diagonal, 1 x 1."""
        places = [slice(i, i + 1) for i in range(matrix.shape[0])]
        parts = [matrix._like(matrix.middle[:, :, i, i], matrix.radius[:, i, i]) for i in places]
        return reduce(Boxes.__add__, parts)

    def exp(self, exponent: Any) -> Any:
        """e^x as a ball."""
        from flint import arb

        return arb(exponent).exp()

    def cos(self, angle: Any) -> Any:
        """The cosine as a ball."""
        from flint import arb

        return arb(angle).cos()
