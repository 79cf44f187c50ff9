"""Tables of the lateral force filter's readings, sigma weights, vertical loads and Table III."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_discrete_are

from estimators.forces.planar import planar_model
from estimators.vehicle import VehicleParameters
from studies.claim import Finding
from studies.papers.corner_estimation.claims_forces import STEP
from studies.papers.corner_estimation.inputs import printed_numbers
from studies.papers.corner_estimation.sigma_points import weights
from studies.study import Table

KILO = {"N": 1.0, "kN": 1e3}


def filter_lag(process: float, measurement: float, newtons: float) -> float:
    """Slowest time constant in s of the steady filter of (10) for the axle forces, straight ahead.

    Random walk of F_yf, F_yr with covariance `process` I in units of `newtons` N, outputs a_y and dr/dt with `measurement` I
    in m/s^2 and rad/s^2; the front difference is not seen at zero steering and left out.
    """
    C = planar_model(VehicleParameters.published_suv(), np.array(0.0), np.zeros(4)).C[1:, :2] * newtons
    Q, R = process * np.eye(2), measurement * np.eye(2)
    P = solve_discrete_are(np.eye(2), C.T, Q, R)
    kept = np.eye(2) - P @ C.T @ np.linalg.inv(C @ P @ C.T + R) @ C
    return float(-STEP / np.log(np.abs(np.linalg.eigvals(kept)).max()))


def filter_table() -> Table:
    """Lag of the lateral force filter in every reading of its covariances."""
    rows = [
        [
            entry["name"],
            unit,
            entry["process"],
            entry["measurement"],
            filter_lag(entry["process"], entry["measurement"], size),
        ]
        for entry in printed_numbers()["force_filter"]["readings"]
        for unit, size in KILO.items()
    ]
    caption = (
        "Slowest time constant of the lateral force filter straight ahead at 200 Hz, for every reading of the "
        "printed covariances Q I and R I: with forces in newtons it cannot follow a lane change, with kilonewtons "
        "it can. The unit is not printed."
    )
    return Table("filter-lag", caption, ["covariances", "unit of force", "Q", "R", "time constant [s]"], rows)


def weight_table() -> Table:
    """Sigma point weights of both papers, printed and corrected."""
    rows = [
        [f"N = {n}", form, str(w.centre_mean), str(w.centre_spread), str(w.outer), str(w.total), str(w.second_moment)]
        for n in (3, 1)
        for form, w in (("printed", weights(n, "printed")), ("corrected", weights(n, "corrected")))
    ]
    columns = [
        "states",
        "form",
        "W0 of the mean",
        "W0 of the covariance",
        "W_i",
        "sum of the mean weights",
        "second moment",
    ]
    return Table(
        "sigma-weights",
        "Sigma point weights with epsilon = sqrt(3/N), beta = 2 in rational numbers; sum and second moment must be "
        "one.",
        columns,
        rows,
    )


def load_table(finding: Finding) -> Table:
    """Static loads and transfer per unit of acceleration."""
    static, along, across = (finding.computed[key] for key in ("static_N", "per_unit_a_x_N", "per_unit_a_y_N"))
    rows = []
    for name in ("front_left", "front_right", "rear_left", "rear_right"):
        axle = name.partition("_")[0]
        rows.append([name.replace("_", " "), static[name], along[axle] / 2.0, across[name]])
    columns = ["corner", "static load [N]", "per m/s^2 of a_x [N]", "per m/s^2 of a_y [N]"]
    return Table(
        "vertical-loads", "Corner loads of the level car of Table I by (15), (17), g = 9.81 m/s^2.", columns, rows
    )


def velocity_table_3() -> Table:
    """Table III as printed."""
    printed = printed_numbers()["table_3"]
    caption = (
        "Table III of P1 as printed: velocity errors at the centre of gravity, measured on the road by its authors."
    )
    return Table("table-3", caption, printed["columns"], printed["rows"])
