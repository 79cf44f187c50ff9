"""The numeric side of a model: read-only float64 arrays on a grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from synthesis.models.extract import MATRICES, PolynomialModel
from synthesis.models.param import SchedulingParameter
from synthesis.polynomials.matrix import MatrixPolynomial


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
    scaled = (points - np.array([p.middle for p in parameters])) / np.array([p.half_width for p in parameters])
    below = values(model.denominator, scaled)
    arrays = {key: values(getattr(model, key), scaled) / below for key in MATRICES}
    points = points.copy()
    for array in (points, *arrays.values()):
        array.setflags(write=False)
    return NumericModel(points, **arrays)


def values(coefficients: FloatArray, points: FloatArray) -> FloatArray:
    """A coefficient array (d_1+1, ..., rows, columns) at scaled points (g, p)."""
    return MatrixPolynomial(np.asarray(coefficients)[..., None]).at(points)[..., 0]
