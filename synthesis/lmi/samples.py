"""Matrices at many places at once, affine in the decisions: the ring in which an inequality is evaluated place by place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from synthesis.errors import ProblemError


@dataclass(frozen=True)
class Samples:
    """M_g(x) = values[g, :, :, 0] + sum_j x_j values[g, :, :, j]; one place stands for all where g = 1."""

    values: FloatArray  # (g, rows, columns, 1+N)

    @classmethod
    def known(cls, matrices: FloatArray) -> Samples:
        """From numbers (g, rows, columns) or (rows, columns)."""
        array = np.asarray(matrices, float)
        return cls((array[None] if array.ndim == 2 else array)[..., None])

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.values.shape[1], self.values.shape[2]

    @property
    def T(self) -> Samples:
        """The transpose."""
        return Samples(np.swapaxes(self.values, 1, 2))

    def __neg__(self) -> Samples:
        return Samples(-self.values)

    def __add__(self, other: Samples) -> Samples:
        small, large = sorted((self.values, other.values), key=lambda v: v.shape[-1])
        out = np.broadcast_to(large, (max(len(small), len(large)), *large.shape[1:])).copy()
        out[..., : small.shape[-1]] += small
        return Samples(out)

    def __sub__(self, other: Samples) -> Samples:
        return self + (-other)

    def __mul__(self, factor: float) -> Samples:
        return Samples(self.values * factor)

    __rmul__ = __mul__

    def __matmul__(self, other: Samples) -> Samples:
        """The product; at most one factor may contain decisions."""
        if other.values.shape[-1] == 1:
            return Samples(np.moveaxis(np.moveaxis(self.values, -1, 1) @ other.values[:, None, ..., 0], 1, -1))
        if self.values.shape[-1] > 1:
            raise ProblemError("a product of two unknown matrices is not affine: substitute a new variable for it")
        g, rows, columns, width = other.values.shape
        flat = self.values[..., 0] @ other.values.reshape(g, rows, columns * width)
        return Samples(flat.reshape(len(flat), -1, columns, width))

    def scaled_by(self, scalar: Samples) -> Samples:
        """Times a 1 x 1 matrix."""
        if min(self.values.shape[-1], scalar.values.shape[-1]) > 1:
            raise ProblemError("a product of two unknowns is not affine: substitute a new variable for it")
        return Samples(self.values * scalar.values)


class Sampling:
    """Arithmetic of samples for the inequalities (`synthesis.certificate.inequalities.Arithmetic`)."""

    def eye(self, size: int, like: Any) -> Samples:
        """The unit matrix."""
        return Samples.known(np.eye(size))

    def known(self, rows: Any, like: Any) -> Samples:
        """A matrix of numbers."""
        return Samples.known(np.asarray(rows, float))

    def block(self, rows: Any) -> Samples:
        """A symmetric block matrix from its upper triangle; None below the diagonal is the transpose, above it zero."""
        sizes = [row[i].shape[0] for i, row in enumerate(rows)]
        present = [part for row in rows for part in row if part is not None]
        places = max(len(part.values) for part in present)
        width = max(part.values.shape[-1] for part in present)
        ends = np.concatenate([[0], np.cumsum(sizes)])
        out = np.zeros((places, ends[-1], ends[-1], width))
        for i, row in enumerate(rows):
            for j in range(i, len(row)):
                if row[j] is None:
                    continue
                part = row[j].values
                across, down = slice(ends[i], ends[i + 1]), slice(ends[j], ends[j + 1])
                out[:, across, down, : part.shape[-1]] = part
                out[:, down, across, : part.shape[-1]] = np.swapaxes(part, 1, 2)
        return Samples(out)

    def trace(self, matrix: Samples) -> Samples:
        """The sum of the diagonal, 1 x 1."""
        return Samples(np.einsum("giim->gm", matrix.values)[:, None, None])

    def exp(self, exponent: Any) -> float:
        """e^x."""
        return float(np.exp(exponent))

    def cos(self, angle: Any) -> float:
        """The cosine."""
        return float(np.cos(angle))
