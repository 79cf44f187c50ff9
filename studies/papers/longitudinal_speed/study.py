"""The study of P2: its topics in the order of the paper, its Table II (P2-tab2), and its manoeuvres on the truth vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from estimators.forces import UnknownInputForceObserver, WheelForceFilter
from estimators.vehicle import CORNERS
from studies.claim import Finding
from studies.papers.longitudinal_speed import (
    model,
    slip_threshold,
    steady_filter,
    stochastic_observability,
    unknown_input_observer,
)
from studies.papers.longitudinal_speed.inputs import PACKAGE, PARAMETERS, topic
from studies.papers.longitudinal_speed.speed_trial import speed_part
from studies.papers.longitudinal_speed.truth_records import truth_part
from studies.papers.published import printed_numbers
from studies.papers.topic import constants_part
from studies.papers.verdicts import partly
from studies.plots import Axis, Bars, Figure, Level, Mark, Panel, colours, dots
from studies.study import PartResult, Scope, Study, Table
from studies.trials.estimation import Parts
from studies.trials.forces import ForceTest, force_part
from studies.trials.motion import MotionTest, motion_part
from studies.trials.simulations import trial_part

CONSTANTS = constants_part(
    PARAMETERS,
    "Vehicle and tire constants of P2, as every result of this study uses them; of the two radii that it prints, 0.35 m in "
    "the text and 0.33 m in Table I, that of the text.",
)
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


def _printed(k: int) -> dict[tuple[str, str, str], float]:
    """Table II of the test ``k`` by signal, corner and method."""
    columns = (("F_x", "UKF", FORCES, 1), ("F_x", "UIO", FORCES, 2), ("F_z", "pipeline", LOADS, 1))
    return {(signal, corner, method): row[first + 2 * k] for signal, method, rows, first in columns
            for corner, row in zip(CORNERS, rows, strict=True)}  # fmt: skip


TABLE_2 = (
    ForceTest("p2-steer-wet-dry", "steering, wet and dry", _printed(0)),
    ForceTest("p2-double-lane-change-snow", "double lane change, snow", _printed(1)),
    ForceTest("p2-brake-in-turn-snow", "braking in a turn and accelerating, snow", _printed(2)),
)
FIG_6 = (
    ForceTest("p2-throttle-brake-low", "alternating throttle and brake, friction 0.3 (Fig. 6a)"),
    ForceTest("p2-acceleration-in-turn-dry", "acceleration in a turn, dry (Fig. 6b)"),
    ForceTest("p2-acceleration-in-turn-low", "acceleration in a turn, friction 0.25 (Fig. 6c)"),
)
FIG_9 = (
    MotionTest("p2-step-steer-dry", "step steer, dry"),
    MotionTest("p2-turn-throttle-dry", "full throttle in a turn, dry"),
    MotionTest("p2-turn-throttle-low", "full throttle in a turn, friction 0.3"),
)
FIG_10 = (
    MotionTest("p2-launch-wet-dry", "launch, wet to dry, braking"),
    MotionTest("p2-acceleration-in-turn-wet-dry", "acceleration in a turn, wet to dry, braking"),
)
FIG_12 = (
    MotionTest("p2-brake-in-turn-snow", "braking in a turn and accelerating, snow"),
    MotionTest("p2-harsh-steering-ice", "harsh steering, snow and ice"),
)
MOTION = (
    MotionTest("p2-steer-wet-dry", "Harsh steering, wet and dry (Fig. 7)", rear=True),
    MotionTest("p2-double-lane-change-snow", "Double lane change, snow (Fig. 8)", rear=True),
    MotionTest("p2-launch-wet-dry", "Launch, wet to dry, braking (Fig. 10)"),
    MotionTest("p2-acceleration-in-turn-wet-dry", "Acceleration in a turn, wet to dry, braking (Fig. 10)"),
    MotionTest("p2-brake-in-turn-snow", "Braking in a turn and accelerating, snow (Fig. 12)"),
    MotionTest("p2-harsh-steering-ice", "Harsh steering, snow and ice (Fig. 12)"),
)
OBSERVERS: dict[str, Parts] = {
    # in its linear form: the model is linear, so both are equal to round-off, and this one is faster
    "UKF": lambda car, step, shape: {"longitudinal_force": WheelForceFilter(car, step, (*shape, 4), method="linear")},
    "UIO": lambda car, step, shape: {"longitudinal_force": UnknownInputForceObserver(car, step, (*shape, 4))},
}
EXPERIMENTS = (
    trial_part("table-2-driven", "Table II on the truth vehicle", partial(force_part, "table-2", TABLE_2, OBSERVERS), 67.0),
    trial_part("forces-fig-6", "Fig. 6 on the truth vehicle: forces under throttle and brake, and accelerating in a turn",
                partial(force_part, "fig-6", FIG_6, OBSERVERS), 79.0),
    trial_part("speed-fig-9", "Fig. 9 on the truth vehicle: step steer, throttle in a turn",
                partial(speed_part, "fig-9", FIG_9), 79.0),
    trial_part("speed-fig-10", "Figs. 10 and 11 on the truth vehicle: wet, then dry",
                partial(speed_part, "fig-10", FIG_10), 54.0, quick=True),
    trial_part("speed-fig-12", "Figs. 12 and 13 on the truth vehicle: snow and ice", partial(speed_part, "fig-12", FIG_12), 69.0),
    trial_part("tests-driven", "Figs. 1 to 3 on the truth vehicle: gramian and unknown start", truth_part, 8.0),
    trial_part("motion", "Figs. 7, 8, 10 and 12 on the truth vehicle: accelerations, yaw rate, rear wheels",
                partial(motion_part, "motion", MOTION), 5.0),
)  # fmt: skip

EARLIER = (model, stochastic_observability, steady_filter, unknown_input_observer, slip_threshold)
TOPICS = [*(earlier.TOPIC for earlier in EARLIER), TOPIC]
CLAIMS = {name: compute for each in TOPICS for name, compute in each.claims.items()}  # by the id of the claim
STUDY = Study(
    PARAMETERS, "Longitudinal speed estimation robust to road conditions", "P2",
    "Wheel forces from a simple unknown-input observer or a UKF, normalised and fed to a three-state time-varying Kalman "
    "filter at each wheel. Recomputed: the model, its observability, what an unknown initial state does to the filter, the "
    "recursions of the appendix, the bound of the force observer, the slip threshold and the accuracy that the text claims.",
    (CONSTANTS, *(part for each in TOPICS for part in each.parts), *EXPERIMENTS),
)  # fmt: skip
