"""The rotating plant of Wu, Yang, Packard and Becker, Int. J. Robust and Nonlinear Control 6 (1996), Induced L2-norm control.

    v' = [0.75 2; 0 0.5] v + [cos, sin; -sin, cos](rho) a + [0; 3] f,    a' = 10 (u - a),    y = v - r + n

with r = 20/(s + 0.2) d_r and n = 10 (s + 10)/(s + 1000) d_n; v - r and u/280 are to stay small; |d rho/dt| <= 5 rad/s, any rho.
Cosine and sine are Chebyshev interpolants: to 4e-5 with degree 9 over the whole circle, to 1e-5 with degree 5 over an eighth
to both sides.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import sympy as sp

from estimators.arrays import FloatArray
from synthesis.design.feedback_channel import FeedbackChannel
from synthesis.models.lpv import LpvModel
from synthesis.models.param import SchedulingParameter
from tests.support.lmi_cases import small_model

CHANNEL = FeedbackChannel(("d1", "d2", "d3", "d4", "d5"), ("x1", "x2", "u1", "u2"), sizes=(1.0, 1.0, 280.0, 280.0))


def wu_plant(half_width: float = np.pi, degree: int = 9) -> LpvModel:
    """States v - r, a, r, and those of the filters of the noise; disturbances f, d_r and d_n."""
    angle = sp.Symbol("rho")

    def fitted(function: Callable[[FloatArray], FloatArray]) -> sp.Expr:
        series = np.polynomial.chebyshev.chebinterpolate(lambda u: function(half_width * u), degree)
        series[np.abs(series) < 1e-14] = 0.0
        powers = np.polynomial.chebyshev.cheb2poly(series)
        return sum(
            sp.Rational(repr(float(c))) * (angle / sp.Rational(repr(half_width))) ** k for k, c in enumerate(powers)
        )

    cosine, sine = fitted(np.cos), fitted(np.sin)
    own, slow = sp.Matrix([[sp.Rational(3, 4), 2], [0, sp.Rational(1, 2)]]), sp.Rational(1, 5)
    eye, none = sp.eye(2), sp.zeros(2, 2)
    turn = sp.Matrix([[cosine, sine], [-sine, cosine]])
    A = sp.Matrix(sp.BlockMatrix([
        [own, turn, own + slow * eye, none], [none, -10 * eye, none, none], [none, none, -slow * eye, none],
        [none, none, none, -1000 * eye],
    ]))  # fmt: skip
    force, rest = sp.Matrix([0, 3]), sp.zeros(2, 1)
    E = sp.Matrix(sp.BlockMatrix([
        [force, -20 * eye, none], [rest, none, none], [rest, 20 * eye, none], [rest, none, 99 * eye]
    ]))  # fmt: skip
    C, F = sp.Matrix.hstack(eye, none, none, -100 * eye), sp.Matrix.hstack(rest, none, 10 * eye)
    rho = SchedulingParameter("rho", "rad", -half_width, half_width, -5.0, 5.0)
    return small_model(A, C, [rho], B=sp.Matrix.vstack(none, 10 * eye, none, none), E=E, F=F)
