"""P2-tab2: three statements of the text against Table II."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from studies.claim import Finding
from studies.papers.longitudinal_speed.inputs import PACKAGE, topic
from studies.papers.published import printed_numbers
from studies.papers.verdicts import partly
from studies.plots import Axis, Bars, Figure, Level, Mark, Panel, colours, dots
from studies.study import PartResult, Scope, Table

TOPIC = topic()
FORCES, LOADS = (printed_numbers(PACKAGE)[f"table_2_{what}"]["rows"] for what in ("forces", "loads"))
MANOEUVRES = printed_numbers(PACKAGE)["table_2_forces"]["manoeuvres"]
LIMIT = TOPIC.printed("P2-tab2")


@TOPIC.claim("P2-tab2")
def force_table(forces: Sequence[Sequence[Any]] = FORCES) -> Finding:
    """UKF against unknown-input observer cell by cell, and both limits."""
    cells = [[row[0], name, *row[1 + 2 * k : 3 + 2 * k]] for row in forces for k, name in enumerate(MANOEUVRES)]
    largest_load = max(value for row in LOADS for value in row[1::2])
    worse = [cell for cell in cells if cell[3] < cell[2]]
    ukf, uio = ([cell[i] for cell in cells] for i in (2, 3))
    below, within = max(ukf) < LIMIT["ukf"], largest_load <= LIMIT["load"]
    statements = {"ukf_better_everywhere": not worse, "ukf_below_limit": below, "loads_within_limit": within}
    computed = {
        "largest_ukf_percent": max(ukf), "largest_load_percent": largest_load, "mean_ukf_percent": sum(ukf) / len(ukf),
        "mean_uio_percent": sum(uio) / len(uio), "cells": len(cells), "uio_better": worse, "statements": statements,
    }  # fmt: skip
    shown = ", ".join(f"{corner} in {test} ({a:g} against {b:g} %)" for corner, test, a, b in worse) or "none"
    reading = (
        f"Largest UKF error {max(ukf):g} % (below {LIMIT['ukf']:g}: {'yes' if below else 'no'}), largest load error "
        f"{largest_load:g} % (at most {LIMIT['load']:g}: {'yes' if within else 'no'}). The unknown-input observer is better "
        f"in {len(worse)} of {len(cells)} cells: {shown}. On average the UKF has {computed['mean_ukf_percent']:.2f} %, the other "
        f"{computed['mean_uio_percent']:.2f} %."
    )
    return Finding(computed, partly(all(statements.values()), any(statements.values())), reading)


@TOPIC.part("accuracy", "Accuracy claims")
def accuracy(scope: Scope) -> PartResult:
    """Table II against the text."""
    tables = [
        Table(name, f"Table II of P2 as printed: {what}, measured on the road.",
              ["corner", *(f"{manoeuvre}: {column}" for manoeuvre in MANOEUVRES for column in columns)], rows)
        for name, what, columns, rows in (
            ("table-2-forces", "normalised error (NRMS) of the longitudinal force of each corner",
             ("UKF [%]", "UIO [%]"), FORCES),
            ("table-2-loads", "normalised error and largest value of the vertical loads", ("NRMS [%]", "largest [kN]"), LOADS),
        )
    ]  # fmt: skip
    limit = float(LIMIT["ukf"])
    places, corners = np.arange(len(FORCES)), {float(k): row[0] for k, row in enumerate(FORCES)}
    panels = []
    for k, name in enumerate(MANOEUVRES):
        ukf, uio = (np.array([row[i + 2 * k] for row in FORCES]) for i in (1, 2))
        worse = np.flatnonzero(uio < ukf)
        marks: list[Mark] = [
            Bars(places - 0.2, ukf, "UKF", colours.BLUE, 0.38),
            Bars(places + 0.2, uio, "unknown-input observer", colours.ORANGE, 0.38),
            dots(worse, ukf[worse] + 0.35, "UKF is worse", colours.RED, "v"),
            Level(y=limit, label=f"{limit:g} %, the text on the UKF", color=colours.GREY, dash="dashed", width=1.2),
        ]
        x, y = Axis(ticks=corners, turned=30), "" if k else "normalised force error [%]"
        panels.append(Panel(marks, x, y, name.replace(", ", ",\n", 1)))
    figure = Figure(
        "table-2",
        "Longitudinal force errors of Table II as the paper prints them (three drives on the road, four corners), with the "
        "limit that the text states for the UKF. In the three marked cells of twelve the simpler observer is better.",
        "Grouped bars per corner for three drives; three red marks over pairs whose second bar is lower.",
        panels, (7.2, 3.6), legend="below", share_y="all",
    )  # fmt: skip
    return PartResult(TOPIC.found(), tables, [figure])
