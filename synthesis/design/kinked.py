"""Unknown gains that may bend where the plant does: polynomial, and one slope more beyond every border of its cells.

    X(u) = sum over k of X_k T_k(u) + sum over borders b of each u_i of X_ib max(0, u_i - b)

On a cell this is a polynomial; across a border it is continuous, as the table that is deployed. With degree 1 and one parameter
it is every continuous matrix that is straight on each cell.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from estimators.arrays import FloatArray
from synthesis.lmi.problem import LmiProblem
from synthesis.models.lpv import LpvModel
from synthesis.models.pieces import ModelPiece
from synthesis.polynomials.matrix import MatrixPolynomial, variable


@dataclass(frozen=True)
class KinkedUnknown:
    """X of the module docstring in a problem."""

    problem: LmiProblem
    smooth: MatrixPolynomial
    bends: tuple[tuple[int, float, MatrixPolynomial], ...]  # parameter, border, X_ib

    @classmethod
    def of(cls, problem: LmiProblem, model: LpvModel, name: str, shape: tuple[int, int], degree: int) -> KinkedUnknown:
        """New unknowns; constant gains (degree 0) do not bend."""
        problem.matrix(name, *shape, degree)
        for i, border in borders(model) if degree else ():
            problem.matrix(bend(name, i, border), *shape)
        return cls.found(problem, model, name)

    @classmethod
    def found(cls, problem: LmiProblem, model: LpvModel, name: str) -> KinkedUnknown:
        """Those of a problem that has them."""
        own = problem.unknowns
        bends = ((i, border, own.get(bend(name, i, border))) for i, border in borders(model))
        return cls(problem, own[name], tuple((i, border, slope) for i, border, slope in bends if slope is not None))

    def on(self, piece: ModelPiece) -> MatrixPolynomial:
        """The polynomial that it is on a cell that is asked about (`LmiProblem.on_cell`), in its local variables."""
        total, variables = self.smooth, self.problem.variables
        for i, border, slope in self.bends:
            if piece.box[0][i] > border:
                beyond = variable(i, variables) - self.problem.constant(np.array([[border]]))
                total = total + slope.scaled_by(beyond)
        return self.problem.here(total)


def borders(model: LpvModel) -> Iterator[tuple[int, float]]:
    """Parameter and scaled place of every border between cells."""
    for i, line in enumerate(model.cells.borders):
        yield from ((i, float(border)) for border in line)


def bend(name: str, parameter: int, border: float) -> str:
    """The name of one of the slopes."""
    return f"{name} beyond {border:.6g} of parameter {parameter + 1}"


def kinked_values(values: Mapping[str, MatrixPolynomial], model: LpvModel, name: str, u: FloatArray) -> FloatArray:
    """X (g, rows, columns) at scaled parameters (g, p), from the values of the unknowns."""
    still = np.hstack([u, np.zeros_like(u)])
    total = values[name].at(still)[..., 0]
    for i, border in borders(model):
        slope = values.get(bend(name, i, border))
        if slope is not None:
            total = total + slope.at(still)[..., 0] * np.maximum(u[:, i] - border, 0.0)[:, None, None]
    return np.asarray(total)
