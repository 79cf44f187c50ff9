"""The numeric side of a model: read-only float64 arrays on a grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray, IndexArray
from synthesis.models.extract import MATRICES, PolynomialModel
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.matrix import MatrixPolynomial

ON_BORDER = 1e-12  # of a half range: what is closer to a border of cells is on it


@dataclass(frozen=True)
class NumericModel:
    """A (g, nx, nx), B (g, nx, nu), C (g, ny, nx), D (g, ny, nu), E (g, nx, nd), F (g, ny, nd) at `points` (g, p)."""

    points: FloatArray
    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    E: FloatArray
    F: FloatArray

    def error_dynamics(self, gain: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A_e = A - L C and B_e = E - L F of the observer error e' = A_e e + B_e d; gain (nx, ny) or (g, nx, ny)."""
        gain = np.asarray(gain, float)
        return self.A - gain @ self.C, self.E - gain @ self.F


def evaluate(model: PolynomialModel, parameters: tuple[SchedulingParameter, ...], points: FloatArray) -> NumericModel:
    """All matrices at all points (g, p), in physical units, at once."""
    return evaluate_pieces([model], [np.zeros(0)] * len(parameters), parameters, points)


def evaluate_pieces(
    pieces: Sequence[PolynomialModel],
    borders: Sequence[FloatArray],
    parameters: tuple[SchedulingParameter, ...],
    points: FloatArray,
) -> NumericModel:
    """The same of a model by cells, whose inner `borders` (b_i,) are scaled; a point on a border is taken above it."""
    scaled = (points - np.array([p.middle for p in parameters])) / np.array([p.half_width for p in parameters])
    owner = owners(borders, scaled)
    arrays = {key: np.zeros((len(points), *getattr(pieces[0], key).shape[-2:])) for key in MATRICES}
    for index in np.unique(owner):
        model, chosen = pieces[index], owner == index
        below = values(model.denominator, scaled[chosen])
        for key in MATRICES:
            arrays[key][chosen] = values(getattr(model, key), scaled[chosen]) / below
    points = points.copy()
    for array in (points, *arrays.values()):
        array.setflags(write=False)
    return NumericModel(points, **arrays)


def owners(borders: Sequence[FloatArray], u: FloatArray) -> IndexArray:
    """The number of the cell that holds each of the scaled parameters (g, p), the last parameter's cells running fastest."""
    owner: IndexArray = np.zeros(len(u), dtype=np.intp)
    for column, border in zip(u.T, borders, strict=True):
        owner = owner * (len(border) + 1) + np.searchsorted(border - ON_BORDER, column, "right")
    return owner


def values(coefficients: FloatArray, points: FloatArray) -> FloatArray:
    """A coefficient array (d_1+1, ..., rows, columns) at scaled points (g, p)."""
    return MatrixPolynomial(np.asarray(coefficients)[..., None]).at(points)[..., 0]
