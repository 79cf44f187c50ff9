"""P4-y4: the last output of (12) contradicts the force balance (1) as printed and follows from it corrected."""

from __future__ import annotations

import numpy as np
import sympy as sp

from estimators.sideslip import FourWheelModel
from studies.claim import Finding
from studies.papers.ekf_ukf_lateral.inputs import CAR, PACKAGE, STATES, WHEEL_LOADS, Outputs, model_with
from studies.papers.topic import Topic
from studies.papers.verdicts import erratum
from studies.study import Cell, Table
from synthesis.models.nonlinear import NonlinearModel

TOPIC = Topic(PACKAGE)


def acceleration_mismatch(model: NonlinearModel) -> sp.Expr:
    r"""y_4 minus V (beta' + r) cos(beta) + V' sin(beta): the lateral acceleration that the states of (11) really have.

    Zero for every state and input if (12) belongs to (11); with (1) this is the force balance across the car.
    """
    v, beta, r = sp.symbols("speed sideslip yaw_rate")
    kinematic = v * (model.f[2] + r) * sp.cos(beta) + model.f[1] * sp.sin(beta)
    return sp.factor(sp.simplify(sp.expand_trig(sp.expand(model.h[3] - kinematic))))


@TOPIC.claim("P4-y4")
def lateral_output(printed: Outputs = "y4 as printed") -> Finding:
    """Both forms of y_4 against the acceleration that the states of (11) have."""
    wrong, right = (acceleration_mismatch(model_with(outputs)) for outputs in (printed, "y4 corrected"))
    computed = {"printed_minus_true": str(wrong), "corrected_minus_true": str(right), "term": "x8 sin(u1)"}
    return Finding(computed, erratum(wrong == 0, right == 0), (
        "By the force balance (1) the term is F_x1 sin(delta) = x_8 sin(u_1). With it y_4 equals the acceleration of the "
        "states identically; with the printed x_6 the two differ by (F_y21 - F_x1) sin(delta) / m."))  # fmt: skip


def _table() -> Table:
    state, rows = STATES.copy(), list[list[Cell]]()
    for degrees in (1.0, 3.0, 8.0):
        for drive in (-3000.0, 700.0, 3000.0):
            angle, state[7] = np.radians(degrees), drive
            right = FourWheelModel.at(CAR, 0.01, np.array(angle), WHEEL_LOADS, 1.0).measurement(state)[3]
            printed = right + (state[5] - drive) * np.sin(angle) / CAR.mass
            rows.append([degrees, drive, *(round(float(value), 4) for value in (right, printed, printed - right))])
    return Table("output-equation",
        "What the misprint in y4 of (12) costs: lateral acceleration of the same bend (front forces 1.4 and 2.2 kN, rear 1.1 "
        "and 1.7 kN) with the corrected term x8 sin(u1) and with the printed x6 sin(u1). The error is (F_y21 - F_x1) "
        "sin(delta) / m.",
        ("steering angle [deg]", "front drive force [N]", "a_y corrected [m/s^2]", "a_y as printed [m/s^2]", "error [m/s^2]"),
        rows)  # fmt: skip


TOPIC.show("output-equation", "The measured lateral acceleration", 1.5, tables=[_table])
