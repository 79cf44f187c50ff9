"""What no observer gain can change: static gains from disturbances to errors, with a symbolic gain."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp

from analysis.errors import AnalysisError
from analysis.norms.observer_error import selection
from estimators.display import Display
from synthesis.models.lpv import LpvModel


@dataclass(frozen=True, repr=False)
class StaticGain(Display):
    """`expression` in the model's symbols and the entries L_i_j of the gain; `free_of_gain` if none of them is left."""

    expression: sp.Expr
    gain: sp.Matrix

    @property
    def free_of_gain(self) -> bool:
        """Whether no observer gain changes it: then its size is a floor of every H-infinity norm of the channel."""
        return not (self.expression.free_symbols & self.gain.free_symbols)


def static_gain(model: LpvModel, disturbance: str, error: str) -> StaticGain:
    r"""-z (A - L C)^-1 (E - L F) d with every entry of L a symbol L_i_j (P3 section IV).

    For the corner models friction -> relative velocity is -sigma0/(sigma0 + sigma2 a), a = kappa R_e |omega|, for every L:
    at standstill of the error friction cannot be told from slip velocity. Raises AnalysisError for unknown names and for
    a model whose error has an integrator that no gain reaches.

    >>> model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=140.0)
    >>> print(static_gain(model, "friction", "relative_velocity").expression)  # no gain L in it
    -sigma0/(effective_radius*kappa*sigma2*wheel_speed + sigma0)
    """
    model.refuse_tables("a formula of the static gain")
    d, z = selection(model, (disturbance,), (error,))
    gain = sp.Matrix(len(model.states), len(model.outputs), lambda i, j: sp.Symbol(f"L_{i + 1}_{j + 1}"))
    A_e, B_e = sp.Matrix(model.A) - gain * sp.Matrix(model.C), sp.Matrix(model.E) - gain * sp.Matrix(model.F)
    if sp.simplify(A_e.det()) == 0:
        raise AnalysisError(
            f"model '{model.name}': A - L C is singular for every gain L (an undetectable integrator), so there is no static gain"
        )
    row, column = [int(i) for i in z[0].nonzero()[0]], [int(i) for i in d[:, 0].nonzero()[0]]
    solved = A_e.LUsolve(B_e.extract(list(range(B_e.rows)), column))
    return StaticGain(sp.cancel(sp.together(-solved[row[0]])), gain)
