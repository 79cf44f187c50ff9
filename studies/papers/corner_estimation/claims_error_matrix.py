"""P1-26 and P1-C-abs: the printed error matrix and output matrix against the equations that they come from."""

from __future__ import annotations

import numpy as np
import sympy as sp

from studies.claim import ClaimFunction, Finding
from studies.papers.corner_estimation.inputs import DIRECTIONS, corner_model, printed_gains
from studies.papers.verdicts import erratum
from synthesis.models.catalogue.corner import Direction
from synthesis.polynomials.matrix import FloatArray

L1, L2, P1 = sp.symbols("L1 L2 p1")
PRINTED_ENTRY = -L1 * P1
BACKWARD = -90.0  # rad/s, a wheel that rolls backward at mid-range speed


def derived_entry() -> sp.Expr:
    """Entry (1,2) of A - L C at standstill, with p1 = sigma1 + sigma2."""
    model = corner_model("longitudinal")
    entry = (model.A - sp.Matrix([L1, L2]) * model.C)[0, 1].subs("wheel_speed", 0)
    return sp.expand(entry.subs("sigma2", P1 - sp.Symbol("sigma1")))


def standstill_matrix(direction: Direction, entry: sp.Expr) -> FloatArray:
    """A_e at zero wheel speed with the printed gains and this entry (1,2), 1/s."""
    model, (first, second) = corner_model(direction), printed_gains(direction)
    matrix = model.on([0.0]).error_dynamics(np.array([[first], [second]]))[0][0].copy()
    p1 = model.constants["sigma1"].value + model.constants["sigma2"].value
    matrix[0, 1] = float(entry.subs({L1: first, L2: second, P1: p1}))
    return np.asarray(matrix)


def entry_of_the_error_matrix(printed: sp.Expr = PRINTED_ENTRY) -> Finding:
    """The printed entry of (26) against A - L C, and what each makes of the poles at standstill."""
    derived = derived_entry()
    slowest = {
        form: {d: float(np.linalg.eigvals(standstill_matrix(d, entry)).real.max()) for d in DIRECTIONS}
        for form, entry in (("printed", printed), ("corrected", derived))
    }
    sigma0 = sp.Symbol("sigma0")
    determinant = sp.expand(-L1 * sigma0 * (-L2 * P1) - printed * (-L2 * sigma0))
    wrong = sp.expand(printed - derived)
    corrected_holds = all(value < 0.0 for value in slowest["corrected"].values())
    computed = {
        "entry": str(derived),
        "printed_minus_entry": str(wrong),
        "determinant_of_printed_A0": str(determinant),
        "slowest_pole_at_standstill_1_s": slowest,
    }
    reading = (
        f"A - L C has {derived} in place (1,2) of A0. With the printed {printed} the determinant of A0 is "
        f"{determinant}: the slowest pole at standstill is {slowest['printed']['longitudinal']:.3g} 1/s "
        f"longitudinally, against {slowest['corrected']['longitudinal']:.4g} 1/s with the corrected entry."
    )
    return Finding(computed, erratum(wrong == 0, corrected_holds), reading)


def absolute_value(signed: bool = True) -> Finding:
    """The output matrix that follows from the bristle equation with |omega|, against the printed one in omega."""
    omega = sp.Symbol("omega", real=True)
    model = corner_model("longitudinal")
    values = {name: sp.Rational(str(constant.value)) for name, constant in model.constants.items()}
    # mu = sigma0 z + sigma1 z' + sigma2 v_r with z' = v_r - kappa R_e |omega| z of (20)
    s0, s1, kappa, radius = sp.symbols("sigma0 sigma1 kappa effective_radius")
    derived = s0 - s1 * kappa * radius * sp.Abs(omega)
    printed = s0 - s1 * kappa * radius * (omega if signed else sp.Abs(omega))
    error = {w: float((printed - derived).subs(values).subs(omega, w)) for w in (-BACKWARD, BACKWARD)}
    share = abs(error[BACKWARD]) / float(derived.subs(values).subs(omega, BACKWARD))
    decay = float((kappa * radius).subs(values)) * abs(BACKWARD)
    computed = {
        "wheel_speed_rad_s": [-BACKWARD, BACKWARD],
        "printed_minus_derived_1_m": [error[-BACKWARD], error[BACKWARD]],
        "share_of_C11": share,
        "open_loop_pole_if_A_is_signed_too_1_s": decay,
    }
    reading = (
        f"The output follows from (20), which has |omega|. At {-BACKWARD:g} rad/s the printed form agrees; at "
        f"{BACKWARD:g} rad/s its first entry is off by {error[BACKWARD]:.4g} 1/m, {100 * share:.0f} % of its value. "
        f"Signs in A as well would let the bristle grow at {decay:.4g} 1/s. |omega| must stand in all of them, as "
        "P3 (6) has it."
    )
    same = sp.simplify(printed - derived) == 0
    return Finding(computed, erratum(same, error[-BACKWARD] == 0.0), reading)


CLAIMS: dict[str, ClaimFunction] = {"P1-26": entry_of_the_error_matrix, "P1-C-abs": absolute_value}
