"""P1-ukf: sigma point weights and covariances of the lateral force filter (P1 notes 3), as printed and corrected."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Literal, NamedTuple

import numpy as np
from scipy.linalg import solve_discrete_are

from estimators.forces.planar import planar_model
from estimators.vehicle import VehicleParameters
from studies.claim import Finding
from studies.papers.corner_estimation.inputs import PACKAGE, topic
from studies.papers.published import printed_numbers
from studies.papers.verdicts import erratum
from studies.plots import Axis, Bars, Figure, Level, Mark, Panel, Words, colours
from studies.study import PartResult, Scope, Table

TOPIC = topic()
BETA = 2  # of P1 and P2
SPREAD = Fraction(3)  # N + eta = epsilon^2 N = tau^2
SIZES = (3, 1)  # states of the lateral filter of P1, and of the force filter of P2
STEP = 0.005  # s
Form = Literal["printed", "corrected"]
FORMS: tuple[Form, Form] = ("printed", "corrected")


class Weights(NamedTuple):
    """W0m, W0c, the weight of the 2 N outer points; the sum of the mean's and the variance per axis, which must be one."""

    centre_mean: Fraction
    centre_spread: Fraction
    outer: Fraction
    total: Fraction
    second_moment: Fraction


def weights(size: int, form: Form) -> Weights:
    """For N states with epsilon^2 = 3/N: W_i = (N + eta)/2 as printed, 1/(2 (N + eta)) corrected."""
    centre = (SPREAD - size) / SPREAD
    outer = SPREAD / 2 if form == "printed" else 1 / (2 * SPREAD)
    return Weights(centre, centre + 1 - SPREAD / size + BETA, outer, centre + 2 * size * outer, 2 * outer * SPREAD)


@TOPIC.claim("P1-ukf")
def sums_of_the_weights(printed_form: Form = "printed", sizes: tuple[int, ...] = SIZES) -> Finding:
    """Sums of the weights and second moments in rational numbers, both forms."""
    wrong, right = ([weights(n, form) for n in sizes] for form in (printed_form, FORMS[1]))
    entries = {"outer_weight": "outer", "sum_of_mean_weights": "total", "second_moment": "second_moment"}
    computed = {
        f"N={size}": {
            "N_plus_eta": float(SPREAD), "centre_weights": [float(w.centre_mean), float(w.centre_spread)],
            **{name: {"printed": float(getattr(printed, of)), "corrected": float(getattr(w, of))}
               for name, of in entries.items()},
        }
        for size, printed, w in zip(sizes, wrong, right, strict=True)
    }  # fmt: skip
    sums = ", ".join(f"{w.total} for N = {size}" for size, w in zip(sizes, wrong, strict=True))
    reading = (
        f"(N + eta)/2 gives mean weights that add up to {sums}. 1/(2 (N + eta)) gives {right[0].outer}, "
        f"a sum of {right[0].total} and the right second moment, with tau = sqrt({SPREAD})."
    )
    good = [all(w.total == 1 and w.second_moment == 1 for w in form) for form in (wrong, right)]
    return Finding(computed, erratum(*good), reading)


def filter_lag(process: float, measurement: float, newtons: float) -> float:
    """Slowest time constant in s of the steady filter of (10) for the axle forces, straight ahead.

    Random walk of F_yf, F_yr with covariance `process` I in units of `newtons` N, outputs a_y and dr/dt with `measurement` I
    in m/s^2 and rad/s^2; the front difference is not seen at zero steering and left out.
    """
    C = planar_model(VehicleParameters.published_suv(), np.array(0.0), np.zeros(4)).C[1:, :2] * newtons
    Q, R = process * np.eye(2), measurement * np.eye(2)
    P = solve_discrete_are(np.eye(2), C.T, Q, R)
    update = np.eye(2) - P @ C.T @ np.linalg.inv(C @ P @ C.T + R) @ C
    return float(-STEP / np.log(np.abs(np.linalg.eigvals(update)).max()))


@TOPIC.part("sigma-weights", "Sigma points and covariances of the lateral force filter", 1.0)
def sigma_weights(scope: Scope) -> PartResult:
    """Weights of both papers in both forms, and the lag of the filter in every reading of its covariances."""
    found = {(f"N = {n}", form): weights(n, form) for n, form in product(SIZES, FORMS)}
    weight_table = Table(
        "sigma-weights",
        "Sigma point weights with epsilon = sqrt(3/N), beta = 2 in rational numbers; sum and second moment must be one.",
        ["states", "form", "W0 of the mean", "W0 of the covariance", "W_i", "sum of the mean weights", "second moment"],
        [[*names, *map(str, w)] for names, w in found.items()],
    )
    units = (("N", 1.0), ("kN", 1e3))
    readings = (entry.values() for entry in printed_numbers(PACKAGE)["force_filter"]["readings"])
    lag_table = Table(
        "filter-lag",
        "Slowest time constant of the lateral force filter straight ahead at 200 Hz, for every reading of the printed "
        "covariances Q I and R I: with forces in newtons it cannot follow a lane change, with kilonewtons it can. The unit "
        "is not printed.",
        ["covariances", "unit of force", "Q", "R", "time constant [s]"],
        [[name, unit, Q, R, filter_lag(Q, R, size)] for (name, Q, R), (unit, size) in product(readings, units)],
    )
    marks: list[Mark] = [Level(1.0)]
    names = ("W = (N + η)/2, as printed", "W = 1/(2 (N + η))")
    for form, name, colour, shift in zip(FORMS, names, (colours.RED, colours.BLUE), (-0.19, 0.19), strict=True):
        totals = {k + shift: weights(n, form).total for k, n in enumerate(SIZES)}
        marks.append(Bars([*totals], [*map(float, totals.values())], name, colour, 0.36, alpha=0.85))
        for place, total in totals.items():
            marks.append(Words(place, float(total), str(total), offset=(0, 2), horizontal="center"))
    x = Axis(ticks={0: "N = 3, lateral forces (P1)", 1: "N = 1, wheel force (P2)"})
    figure = Figure(
        "sigma-weights",
        "What the sigma point weights of the mean add up to, as printed and corrected, in both papers; the line "
        "marks one, without which every predicted mean is off by that factor. P1 notes 3, P2 notes 3.",
        "Bars: the printed weights add up to 9 for three states and 11/3 for one, the corrected ones to 1.",
        Panel(marks, x, "sum of the mean weights [1]", legend="upper right"), size=(4.8, 3.0),
    )  # fmt: skip
    return PartResult(TOPIC.found(), [weight_table, lag_table], [figure])
