"""Constant diagonal Lyapunov matrices of the corner observers, found and proved in closed form.

For P = diag(w, 1) the inequality A_e'P + P A_e < 0 with A_e = [[a, b], [c, d]] says a < 0, d < 0 and
(b w + c)^2 < 4 a d w: an interval of w. A constant P proves stability for any rate of the wheel speed, and A_e is affine
in each of omega, L1 and L2 separately, so the corners of a box of these three decide for the whole box.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import sympy as sp

from studies.papers.corner_estimation.inputs import PARAMETERS, STATED_SPEED, corner_model
from synthesis.models.catalogue.corner import Direction

Span = tuple[float, float]
Box = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class DiagonalProof:
    """Weights w for which diag(w, 1) proves stability at every vertex; empty (low >= high) if there is none.

    `chosen` is a round number from the middle of them, and `proved` what exact arithmetic says of it at all `vertices`.
    """

    low: float
    high: float
    chosen: int
    proved: bool
    vertices: int


def diagonal_proof(
    direction: Direction,
    box: Box,
    name: str = PARAMETERS,
    speeds: Span = (0.0, STATED_SPEED),
    weight: int | None = None,
) -> DiagonalProof:
    """Stability of all gains of `box` ((low, high) of L1 and of L2) at all wheel speeds of `speeds` and any rate.

    `weight` tries a certain w instead of one from the middle.
    """
    matrices = exact_matrices(direction, box, name, speeds)
    spans = [admissible(matrix) for matrix in matrices]
    low, high = max(span[0] for span in spans), min(span[1] for span in spans)
    if weight is None:
        weight = _round(float(np.sqrt(low * high))) if 0.0 < low < high else 1
    return DiagonalProof(low, high, weight, all(decreases(matrix, weight) for matrix in matrices), len(matrices))


def exact_matrices(direction: Direction, box: Box, name: str, speeds: Span) -> list[sp.Matrix]:
    """A_e at every vertex of wheel speed and gains, in rational numbers read from the printed decimals."""
    model = corner_model(direction, STATED_SPEED, name)
    values = {key: sp.Rational(str(constant.value)) for key, constant in model.constants.items()}
    A, C = (sp.Matrix(matrix.subs(values)) for matrix in (model.A, model.C))
    ends = [sorted({sp.Rational(str(end)) for end in span}) for span in (speeds, *box)]
    return [(A - sp.Matrix([first, second]) * C).subs("wheel_speed", w) for w, first, second in product(*ends)]


def admissible(A_e: sp.Matrix) -> Span:
    """All w with diag(w, 1) A_e + A_e' diag(w, 1) < 0: roots of b^2 w^2 + (2 b c - 4 a d) w + c^2; (inf, -inf) if none."""
    a, b, c, d = (float(x) for x in A_e)
    if not (a < 0.0 and d < 0.0):
        return np.inf, -np.inf
    if b == 0.0:
        return c * c / (4.0 * a * d), np.inf
    middle = 2.0 * a * d - b * c
    inside = middle * middle - (b * c) ** 2
    if not (inside > 0.0 and middle > 0.0):
        return np.inf, -np.inf
    larger = (middle + np.sqrt(inside)) / (b * b)
    return float(c * c / (b * b * larger)), float(larger)


def decreases(A_e: sp.Matrix, weight: int) -> bool:
    """Whether diag(weight, 1) proves stability of A_e: signs of rational minors, no rounding."""
    P = sp.diag(weight, 1)
    total = -(A_e.T * P + P * A_e)
    return bool(total[0, 0] > 0 and total.det() > 0)


def _round(value: float, digits: int = 2) -> int:
    """To so many significant digits."""
    step = int(10 ** max(int(np.floor(np.log10(value))) + 1 - digits, 0))
    return round(value / step) * step
