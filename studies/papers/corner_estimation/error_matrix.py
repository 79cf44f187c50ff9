"""P1-26, P1-C-abs: the printed error matrix and output matrix against the equations that they come from."""

from __future__ import annotations

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray
from studies.claim import Finding
from studies.papers.corner_estimation.inputs import CORNERS, SPEED_AXIS, STATED_SPEED, Corner, topic
from studies.papers.verdicts import erratum
from studies.plots import ZERO, Figure, Line, Mark, Panel, colours, dots
from studies.study import PartResult, Scope, Table

TOPIC = topic()
L1, L2, P1 = sp.symbols("L1 L2 p1")
PRINTED_ENTRY = -L1 * P1
BACKWARD = -90.0  # rad/s, a wheel that rolls backward at mid-range speed
SPEEDS = (0.0, 40.0, 90.0, 140.0, 180.0)  # rad/s, of the table


def derived_entry() -> sp.Expr:
    """Entry (1,2) of A - L C at standstill, with p1 = sigma1 + sigma2."""
    model = CORNERS["longitudinal"].model
    entry = (model.A - sp.Matrix([L1, L2]) * model.C)[0, 1]
    return sp.expand(entry.subs({"wheel_speed": 0, "sigma2": P1 - sp.Symbol("sigma1")}))


def poles_with(entry: sp.Expr, corner: Corner, omega: ArrayLike) -> FloatArray:
    """Real parts of both frozen error poles in 1/s, (g, 2) ascending, with this entry (1,2) and the printed gains."""
    (first, second), values = corner.gains, corner.constants
    A_e = corner.error_matrices(omega).copy()
    A_e[:, 0, 1] = float(entry.subs({L1: first, L2: second, P1: values["sigma1"] + values["sigma2"]}))
    return np.sort(np.linalg.eigvals(A_e).real, axis=1)


@TOPIC.claim("P1-26")
def entry_of_the_error_matrix(printed: sp.Expr = PRINTED_ENTRY) -> Finding:
    """The printed entry of (26) against A - L C, and what each makes of the poles at standstill."""
    derived = derived_entry()
    forms = {"printed": printed, "corrected": derived}
    slowest = {form: {d: float(poles_with(entry, corner, [0.0]).max()) for d, corner in CORNERS.items()}
               for form, entry in forms.items()}  # fmt: skip
    determinant = sp.expand(sp.Symbol("sigma0") * (L1 * L2 * P1 + printed * L2))
    wrong = sp.expand(printed - derived)
    computed = {"entry": str(derived), "printed_minus_entry": str(wrong), "determinant_of_printed_A0": str(determinant),
                "slowest_pole_at_standstill_1_s": slowest}  # fmt: skip
    reading = (
        f"A - L C has {derived} in place (1,2) of A0. With the printed {printed} the determinant of A0 is "
        f"{determinant}: the slowest pole at standstill is {slowest['printed']['longitudinal']:.3g} 1/s "
        f"longitudinally, against {slowest['corrected']['longitudinal']:.4g} 1/s with the corrected entry."
    )
    return Finding(computed, erratum(wrong == 0, max(slowest["corrected"].values()) < 0.0), reading)


@TOPIC.claim("P1-C-abs")
def absolute_value(signed: bool = True) -> Finding:
    """The output matrix that follows from the bristle equation with |omega|, against the printed one in omega."""
    omega = sp.Symbol("omega", real=True)
    values = CORNERS["longitudinal"].exact_constants
    # mu = sigma0 z + sigma1 z' + sigma2 v_r with z' = v_r - kappa R_e |omega| z of (20)
    s0, s1, kappa, radius = sp.symbols("sigma0 sigma1 kappa effective_radius")
    derived = s0 - s1 * kappa * radius * sp.Abs(omega)
    printed = s0 - s1 * kappa * radius * (omega if signed else sp.Abs(omega))
    forward, backward = (float((printed - derived).subs(values).subs(omega, w)) for w in (-BACKWARD, BACKWARD))
    share = abs(backward) / float(derived.subs(values).subs(omega, BACKWARD))
    decay = float((kappa * radius).subs(values)) * abs(BACKWARD)
    computed = {"wheel_speed_rad_s": [-BACKWARD, BACKWARD], "printed_minus_derived_1_m": [forward, backward],
                "share_of_C11": share, "open_loop_pole_if_A_is_signed_too_1_s": decay}  # fmt: skip
    reading = (
        f"The output follows from (20), which has |omega|. At {-BACKWARD:g} rad/s the printed form agrees; at "
        f"{BACKWARD:g} rad/s its first entry is off by {backward:.4g} 1/m, {100 * share:.0f} % of its value. Signs in "
        f"A as well would let the bristle grow at {decay:.4g} 1/s. |omega| must stand in all of them, as P3 (6) has it."
    )
    return Finding(computed, erratum(sp.simplify(printed - derived) == 0, forward == 0.0), reading)


@TOPIC.part("error-matrix", "Error dynamics of the velocity observer", 2.0)
def error_matrix(scope: Scope) -> PartResult:
    """The misprints of (26) and (23), and both poles of the velocity observer at five wheel speeds."""
    rows, columns, panels = [[speed] for speed in SPEEDS], [SPEED_AXIS.label], []
    omega = np.linspace(0.0, STATED_SPEED, 361)
    for direction, corner in CORNERS.items():
        for row, poles in zip(rows, np.linalg.eigvals(corner.error_matrices(SPEEDS)), strict=True):
            first, second = sorted(poles, key=lambda pole: (pole.real, -pole.imag))
            row.extend([float(first.real), float(second.real), float(abs(first.imag))])
        columns += [f"{direction}, {p} [1/s]" for p in ("faster real part", "slower real part", "imaginary part +-")]
        right, wrong = (poles_with(entry, corner, omega) for entry in (derived_entry(), PRINTED_ENTRY))
        marks: list[Mark] = [
            Line(omega, right, "A − L C (corrected entry)"), Line(omega, wrong, "A₀ as printed in (26)", colours.RED, "dashed"),
            ZERO, dots([0.0], [wrong[0, 1]], color=colours.RED),
        ]  # fmt: skip
        title = "{}, L = [{:g}, {:g}]".format(direction, *corner.gains)
        panels.append(Panel(marks, SPEED_AXIS, "real part of the poles [1/s]", title))
    gains = " and ".join(str(list(corner.gains)) for corner in CORNERS.values())
    caption = f"Poles of the velocity observer error A - L C with the printed gains {gains} at constant wheel speed."
    figure = Figure(
        "poles",
        "Real parts of the two poles of the velocity observer error over wheel speed, with the printed gains. With entry (1,2) "
        "of A0 as printed, without its one, a pole lies at zero at standstill (dot): nothing could be proved. P1 (26).",
        "Two panels, longitudinal and lateral. Corrected poles stay below zero; the printed ones reach zero at standstill.",
        panels, legend="below",
    )  # fmt: skip
    return PartResult(TOPIC.found(), [Table("poles", caption, columns, rows)], [figure])
