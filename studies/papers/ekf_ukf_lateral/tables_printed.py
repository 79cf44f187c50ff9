"""Table I of P4 with what follows from it, and what the misprinted output equation costs."""

from __future__ import annotations

import numpy as np

from estimators.sideslip import FourWheelModel
from studies.papers.ekf_ukf_lateral.claims_table import LIMIT
from studies.papers.ekf_ukf_lateral.observability import LOADS, STATE, substitute_car
from studies.papers.ekf_ukf_lateral.published_table import table_1
from studies.study import Cell, Table


def printed_table() -> Table:
    """Table I, its averages, and the comparison with the text."""
    columns = ("quantity", "max", "unit", "mean EKF [%]", "mean UKF [%]", "std EKF [%]", "std UKF [%]",
               f"UKF mean below {LIMIT:g} %", "UKF mean better", "UKF std better")  # fmt: skip
    rows: list[list[Cell]] = [
        [
            row.quantity, row.largest, row.unit, row.mean["ekf"], row.mean["ukf"], row.deviation["ekf"],
            row.deviation["ukf"], row.mean["ukf"] < LIMIT, row.mean["ukf"] < row.mean["ekf"],
            row.deviation["ukf"] < row.deviation["ekf"],
        ]
        for row in table_1()
    ]  # fmt: skip
    averages = [float(np.mean([float(row[k] or 0.0) for row in rows])) for k in range(3, 7)]
    better = [averages[1] < LIMIT, averages[1] < averages[0], averages[3] < averages[2]]
    rows.append(["average", None, None, *(round(value, 3) for value in averages), *better])
    return Table(
        "table-1",
        "Table I of P4 as printed (road test of a Peugeot 307, errors (13) in percent of the maximum), with its "
        "averages and whether the statement 'globally less than 8 %' holds.",
        columns,
        rows,
    )


def output_table() -> Table:
    """Lateral acceleration by both forms of y_4 in the same bend, for several drive forces and steering angles."""
    car, x = substitute_car(), np.array([float(value) for value in STATE.values()])
    rows: list[list[Cell]] = []
    for degrees in (1.0, 3.0, 8.0):
        for drive in (-3000.0, 700.0, 3000.0):
            angle, state = np.radians(degrees), x.copy()
            state[7] = drive
            loads = np.array([float(value) for value in LOADS.values()])
            right = FourWheelModel.at(car, 0.01, np.array(angle), loads, 1.0).measurement(state)[3]
            printed = right + (state[5] - drive) * np.sin(angle) / car.mass
            rows.append([degrees, drive, *(round(float(value), 4) for value in (right, printed, printed - right))])
    return Table(
        "output-equation",
        "What the misprint in y4 of (12) costs: lateral acceleration of the same bend (front forces 1.4 and 2.2 "
        "kN, rear 1.1 and 1.7 kN) with the corrected term x8 sin(u1) and with the printed x6 sin(u1). The error is "
        "(F_y21 - F_x1) sin(delta) / m.",
        (
            "steering angle [deg]",
            "front drive force [N]",
            "a_y corrected [m/s^2]",
            "a_y as printed [m/s^2]",
            "error [m/s^2]",
        ),
        rows,
    )
