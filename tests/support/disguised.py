"""One plant twice: polynomial in q from 1/2 to 4/5, and rational in p from 1/4 to 1 with q = 1/(1 + p)."""

from __future__ import annotations

import numpy as np
import sympy as sp

from synthesis.models.lpv import LpvModel
from tests.support.lmi_cases import parameter, small_model


def twins(rate: float = np.inf) -> tuple[LpvModel, LpvModel]:
    """The polynomial and the rational one: x'' = (2 q - 1/2) x - q x' + (1 + q) u + (1 + q^2) d1, x and q x' measured with noise.

    Where the parameter may jump, what a constant P and constant gains reach is the same for both.
    """
    first, second = (
        small_model(
            [[0, 1], [2 * q - sp.Rational(1, 2), -q]], [[1, 0], [0, q]], [axis], B=[[0], [1 + q]],
            E=[[0, 0, 0], [1 + q**2, 0, 0]], F=[[0, sp.Rational(1, 5), 0], [0, 0, q / 5]],
        )
        for q, axis in (
            (sp.Symbol("q"), parameter("q", 0.5, 0.8, rate)),
            (1 / (1 + sp.Symbol("p")), parameter("p", 0.25, 1.0, rate)),
        )
    )  # fmt: skip
    return first, second
