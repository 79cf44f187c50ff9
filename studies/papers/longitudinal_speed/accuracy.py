"""P2-tab2: three statements of the text against Table II."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from studies.claim import Finding
from studies.papers.longitudinal_speed.inputs import PACKAGE
from studies.papers.published import printed_numbers
from studies.papers.topic import Topic
from studies.papers.verdicts import partly
from studies.plots import Axis, Bars, Figure, Level, Mark, Panel, dots
from studies.plots.colours import BLUE, GREY, ORANGE, RED
from studies.study import PartResult, Scope, Table

TOPIC = Topic(PACKAGE)
FORCES, LOADS = (printed_numbers(PACKAGE)[f"table_2_{what}"]["rows"] for what in ("forces", "loads"))
MANOEUVRES = printed_numbers(PACKAGE)["table_2_forces"]["manoeuvres"]


@TOPIC.claim("P2-tab2")
def force_table(forces: Sequence[Sequence[Any]] = FORCES) -> Finding:
    """UKF against unknown-input observer cell by cell, and both limits."""
    limit = TOPIC.printed("P2-tab2")
    cells = [[row[0], name, *row[1 + 2 * k : 3 + 2 * k]] for row in forces for k, name in enumerate(MANOEUVRES)]
    loads = [value for row in LOADS for value in row[1::2]]
    worse = [cell for cell in cells if cell[3] < cell[2]]
    ukf, uio = ([cell[i] for cell in cells] for i in (2, 3))
    statements = {
        "ukf_better_everywhere": not worse,
        "ukf_below_limit": max(ukf) < limit["ukf"],
        "loads_within_limit": max(loads) <= limit["load"],
    }
    computed = {
        "largest_ukf_percent": max(ukf), "largest_load_percent": max(loads), "mean_ukf_percent": sum(ukf) / len(ukf),
        "mean_uio_percent": sum(uio) / len(uio), "cells": len(cells), "uio_better": worse, "statements": statements,
    }  # fmt: skip
    shown = ", ".join(f"{corner} in {test} ({a:g} against {b:g} %)" for corner, test, a, b in worse) or "none"
    reading = (
        f"Largest UKF error {max(ukf):g} % (below {limit['ukf']:g}: {'yes' if statements['ukf_below_limit'] else 'no'}), "
        f"largest load error {max(loads):g} % (at most {limit['load']:g}: "
        f"{'yes' if statements['loads_within_limit'] else 'no'}). The unknown-input observer is better in {len(worse)} of "
        f"{len(cells)} cells: {shown}. On average the UKF has {computed['mean_ukf_percent']:.2f} %, the other "
        f"{computed['mean_uio_percent']:.2f} %."
    )
    return Finding(computed, partly(all(statements.values()), any(statements.values())), reading)


@TOPIC.part("accuracy", "Accuracy claims")
def accuracy(scope: Scope) -> PartResult:
    """Table II against the text."""
    forces = Table(
        "table-2-forces",
        "Table II of P2 as printed: normalised error (NRMS) of the longitudinal force of each corner, measured on the road.",
        ["corner", *(f"{name}: {observer} [%]" for name in MANOEUVRES for observer in ("UKF", "UIO"))],
        FORCES,
    )
    loads = Table(
        "table-2-loads",
        "Table II of P2 as printed: normalised error and largest value of the vertical loads, measured on the road.",
        ["corner", *(f"{name}: {what}" for name in MANOEUVRES for what in ("NRMS [%]", "largest [kN]"))],
        LOADS,
    )
    return PartResult(TOPIC.found(), [forces, loads], [table_figure()])


def table_figure() -> Figure:
    """Table II: force errors of both observers, beside the limit of the text."""
    limit = float(TOPIC.printed("P2-tab2")["ukf"])
    places, corners = np.arange(len(FORCES)), {float(k): row[0] for k, row in enumerate(FORCES)}
    panels = []
    for k, name in enumerate(MANOEUVRES):
        ukf, uio = (np.array([row[i + 2 * k] for row in FORCES]) for i in (1, 2))
        worse = np.flatnonzero(uio < ukf)
        marks: list[Mark] = [
            Bars(places - 0.2, ukf, "UKF", BLUE, 0.38),
            Bars(places + 0.2, uio, "unknown-input observer", ORANGE, 0.38),
            dots(worse, ukf[worse] + 0.35, "UKF is worse", RED, "v"),
            Level(y=limit, label=f"{limit:g} %, the text on the UKF", color=GREY, dash="dashed", width=1.2),
        ]
        what = "normalised force error [%]" if k == 0 else ""
        panels.append(Panel(marks, Axis(ticks=corners, turned=30), what, name.replace(", ", ",\n", 1)))
    return Figure(
        "table-2",
        "Longitudinal force errors of Table II as the paper prints them (three drives on the road, four corners), with the "
        "limit that the text states for the UKF. In the three marked cells of twelve the simpler observer is better.",
        "Grouped bars per corner for three drives; three red marks over pairs whose second bar is lower.",
        panels, (7.2, 3.6), legend="below", share_y="all",
    )  # fmt: skip
