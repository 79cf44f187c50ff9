"""The printed Lyapunov matrices of P1 (29), (41) in four readings, and how fast V falls by each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from studies.papers.corner_estimation.inputs import STATED_SPEED, corner_model, printed_gains, published
from synthesis.errors import SpecError
from synthesis.models.catalogue.corner import Direction
from synthesis.models.lpv import LpvModel
from synthesis.polynomials.matrix import FloatArray
from synthesis.published_certificate import CertifiedRange, check_certificate
from synthesis.stability import Form

Reading = Literal["primal", "swapped", "dual", "adjugate"]
READINGS: tuple[Reading, ...] = ("primal", "swapped", "dual", "adjugate")
Coefficients = list[list[list[str]]]
RATES = (-800.0, 800.0)  # rad/s^2


@dataclass(frozen=True)
class Certificate:
    """M(omega) = matrix[0] + omega matrix[1] with printed decimals, offered for a model with these gains."""

    model: LpvModel
    gains: list[list[str]]
    matrix: Coefficients
    form: Form

    def judgement(self, search: tuple[float, float] = (0.0, STATED_SPEED)) -> CertifiedRange:
        """Where it proves stability, in exact arithmetic."""
        return check_certificate(self.model, self.gains, self.matrix, self.form, search)

    def at(self, omega: FloatArray) -> tuple[FloatArray, FloatArray]:
        """M (g, 2, 2) and its inequality at both rate bounds (2, g, 2, 2), to be negative: (28), (40) or the dual."""
        constant, slope = (np.array(part, float) for part in self.matrix)
        M = constant + omega[:, None, None] * slope
        A_e = self.model.on(omega).error_dynamics(np.array(self.gains, float))[0]
        product = M @ A_e if self.form == "primal" else A_e @ M
        total = product + np.swapaxes(product, 1, 2)
        sign = 1.0 if self.form == "primal" else -1.0
        return M, np.stack([total + sign * rate * slope for rate in RATES])

    def eigenvalues(self, omega: FloatArray) -> FloatArray:
        """Eigenvalues of the inequality at both rate bounds, (g, 4)."""
        return np.concatenate(list(np.linalg.eigvalsh(self.at(omega)[1])), axis=1)

    def growth(self, omega: FloatArray) -> FloatArray:
        """Largest growth rate of V in 1/s at each wheel speed, (g,): eigenvalue of the inequality relative to M.

        NaN where M is not positive definite; then V measures nothing.
        """
        M, total = self.at(omega)
        definite = np.linalg.eigvalsh(M)[:, 0] > 0.0
        root = np.linalg.cholesky(np.where(definite[:, None, None], M, np.eye(2)))
        inner = np.linalg.solve(root, total)
        relative = np.linalg.solve(root, np.swapaxes(inner, -1, -2))
        largest = np.linalg.eigvalsh(0.5 * (relative + np.swapaxes(relative, -1, -2)))[..., -1].max(axis=0)
        return np.where(definite, largest, np.nan)


def printed_matrix(direction: Direction) -> Coefficients:
    """P0 and P1 of (29) or (41) as printed decimals."""
    matrix = published(direction).lyapunov
    if matrix is None:
        raise SpecError(f"no {direction} Lyapunov matrix is printed")
    return [[list(row) for row in coefficient] for coefficient in matrix]


def certificate(direction: Direction, reading: Reading, matrix: Coefficients | None = None) -> Certificate:
    """The printed matrix (or `matrix`) as printed, with the states exchanged, as a dual matrix, or as an adjugate."""
    found = printed_matrix(direction) if matrix is None else matrix
    if reading in ("swapped", "adjugate"):
        found = [[row[::-1] for row in coefficient[::-1]] for coefficient in found]
    if reading == "adjugate":
        found = [[[a, _negated(b)], [_negated(c), d]] for ((a, b), (c, d)) in found]
    gains = [[str(gain)] for gain in printed_gains(direction)]
    return Certificate(corner_model(direction), gains, found, "dual" if reading == "dual" else "primal")


def multi_convexity(offered: Certificate) -> FloatArray:
    """The multi-convexity matrix of an offered certificate, (2, 2)."""
    gain, slope = np.array(offered.gains, float), np.array(offered.matrix[1], float)
    return convexity(offered.model, gain, slope, offered.form)


def convexity(model: LpvModel, gain: FloatArray, slope: FloatArray, form: Form = "primal") -> FloatArray:
    """A1'P1 + P1 A1 (primal) or A1 Q1 + Q1 A1' (dual), with A1 the part of A_e linear in the wheel speed, (2, 2)."""
    A_e = model.on([0.0, 1.0]).error_dynamics(gain)[0]
    A1 = A_e[1] - A_e[0]
    A1[:, 1] = 0.0  # exactly, as (26) has it; the difference above leaves rounding
    product = A1.T @ slope if form == "primal" else A1 @ slope
    return np.asarray(product + product.T)


def _negated(decimal: str) -> str:
    return decimal[1:] if decimal.startswith("-") else f"-{decimal}"
