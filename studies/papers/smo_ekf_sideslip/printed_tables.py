"""P5-tabs: the printed tables against the text; and Fig. 9, the tire models that the paper compares."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from estimators.arrays import FloatArray
from studies.claim import Finding, reproduced
from studies.papers.smo_ekf_sideslip import inputs
from studies.papers.smo_ekf_sideslip.inputs import CAR, FACTORS, MASSES, PRINTED
from studies.papers.topic import Topic
from studies.plots import Axis, Figure, Line, Mark, Panel, dots
from studies.plots.colours import BLUE, GREEN, ORANGE, PURPLE, RED, TRUTH
from studies.study import Cell, Table

TOPIC = Topic(inputs.PACKAGE)
LIMIT = 6.0  # %
# Burckhardt's c1, c2, c3 as commonly tabulated (Burckhardt 1993; Kiencke and Nielsen 2005); P5 names the model, not the values.
BURCKHARDT = {
    "dry asphalt": (1.2801, 23.99, 0.52), "wet asphalt": (0.857, 33.822, 0.347),
    "dry cobblestone": (1.3713, 6.4565, 0.6691), "snow": (0.1946, 94.129, 0.0646)}  # fmt: skip


@TOPIC.claim("P5-tabs")
def force_tables(tables: Mapping[str, Any] = PRINTED) -> Finding:
    """Largest mean and deviation of Tables 1 and 2, and how far Table 5 spreads with the assumed mass."""
    rows = [row for test in tables.values() for row in test["forces"].values()]
    mean, deviation = (max(row[key] for row in rows) for key in ("mean", "deviation"))
    slalom = tables["slalom"]
    mass = {name: (min(row["mean"]), max(row["mean"])) for name, row in slalom["mass"].items()}
    least = min(mass, key=lambda name: mass[name][1] - mass[name][0])
    nominal = {name: row["mean"] for name, row in slalom["forces"].items()} | {"beta_2": slalom["stiffness"]["mean"][1]}
    agrees = all(row["mean"][1] == nominal[name] for name, row in slalom["mass"].items())
    computed = {
        "largest_mean_percent": mean, "largest_deviation_percent": deviation,
        "mean_by_mass_percent": {name: list(pair) for name, pair in mass.items()}, "least_sensitive_to_mass": least,
        "nominal_columns_agree_between_tables": agrees}  # fmt: skip
    holds = mean < LIMIT and deviation < LIMIT and least == "beta_2" and agrees
    return Finding(computed, reproduced(holds), (
        f"Largest mean {mean:g} % and largest standard deviation {deviation:g} % of Tables 1 and 2, both below {LIMIT:g} %. "
        f"With 300 kg more or less F_y2 runs from {mass['F_y2'][0]:g} to {mass['F_y2'][1]:g} %, the rear sideslip from "
        f"{mass['beta_2'][0]:g} to {mass['beta_2'][1]:g} %: sideslip suffers least. The nominal columns of Tables 1, 3 and 5 "
        "agree."))  # fmt: skip


def _printed_forces() -> Table:
    rows: list[list[Cell]] = [
        [test, name, *(row[key] for key in ("largest", "unit", "mean", "deviation")), max(row["mean"], row["deviation"]) < 6]
        for test, found in PRINTED.items()
        for name, row in found["forces"].items()]  # fmt: skip
    return Table("tables-1-2",
        "Tables 1 and 2 of P5 as printed: errors (8) of the force observer in the two road tests, in percent of the maximum.",
        ("test", "quantity", "max", "unit", "mean [%]", "std [%]", "below 6 %"), rows)  # fmt: skip


def _printed_settings() -> Table:
    factors, changes = [f"stiffness x {k:g}" for k in FACTORS], [f"mass {k:+g} kg" for k in MASSES]
    found = [(n, test, "beta_2", PRINTED[test]["stiffness"], factors) for n, test in ((3, "slalom"), (4, "roundabout"))]
    found += [(5, "slalom", name, row, changes) for name, row in PRINTED["slalom"]["mass"].items()]
    rows: list[list[Cell]] = [
        [number, test, name, setting, mean, deviation]
        for number, test, name, row, settings in found
        for setting, mean, deviation in zip(settings, row["mean"], row["deviation"], strict=True)
    ]
    return Table("tables-3-5",
        "Tables 3, 4 and 5 of P5 as printed: errors (8) with other settings of the stiffness and of the mass, in percent.",
        ("table", "test", "quantity", "setting", "mean [%]", "std [%]"), rows)  # fmt: skip


def burckhardt_force(slip: FloatArray, road: str, load: float) -> FloatArray:
    """F_z (c1 (1 - exp(-c2 s)) - c3 s) in N, odd in the slip angle [rad], with s = |tan(slip)|."""
    c1, c2, c3 = BURCKHARDT[road]
    s = np.abs(np.tan(slip))
    return np.asarray(np.sign(slip) * load * (c1 * (1.0 - np.exp(-c2 * s)) - c3 * s))


def _lateral_models() -> Figure:
    load = CAR.mass * inputs.GRAVITY * CAR.rear_axle_distance / inputs.WHEELBASE
    slip, point = np.radians(np.linspace(0.0, 12.0, 241)), np.radians(6.0)
    secant = float(burckhardt_force(np.array(point), "dry asphalt", load)) / point
    marks: list[Mark] = [
        Line(np.degrees(slip), burckhardt_force(slip, road, load) / 1e3, f"Burckhardt, {road}", color)
        for road, color in zip(BURCKHARDT, (BLUE, ORANGE, GREEN, PURPLE), strict=True)
    ]
    # Straight lines up to 10.4 kN, so that they end below the legend.
    stiffnesses = inputs.published_car().front_stiffness, secant
    linear, adaptive = (np.where(k * slip < 10.4e3, k * slip / 1e3, np.nan) for k in stiffnesses)
    marks.append(Line(np.degrees(slip), linear, "linear, C₁ = 65 kN/rad", TRUTH, "dashed", 1.2))
    marks.append(Line(np.degrees(slip), adaptive, "linear adaptive, through dry asphalt at 6°", RED, width=1.2))
    marks.append(dots(6.0, secant * point / 1e3, color=RED))
    x, y = Axis("front slip angle β₁ [deg]", 0, 12), Axis("front axle lateral force [kN]", 0, 13)
    return Figure("lateral-models",
        "Fig. 9 of P5: lateral force of the front axle over its slip angle by the linear model with the printed stiffness, "
        "the linear adaptive model (the secant at the present slip angle) and Burckhardt's model on several roads, at the "
        f"static axle load of {load / 1e3:.1f} kN. P5 prints no Burckhardt values; the common ones are used. The adaptive "
        "model needs no road: its slope follows.",
        "Rising curves of force over slip angle: two straight lines and four saturating curves, snow far below asphalt.",
        Panel(marks, x, y, legend="upper left", columns=2))  # fmt: skip


TOPIC.show("tables", "Tables 1 to 5 against the text", 0.2, (), [_printed_forces, _printed_settings], [_lateral_models])
