"""The manoeuvres of Figs. 9 to 14, driven on the truth vehicle: launch, acceleration in a turn, lane change."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from estimators.pipeline import DifferentiatedPid
from estimators.vehicle import VehicleParameters
from studies.experiments.forces import Driven, force_part
from studies.experiments.velocities import Printed, corner_observers, velocity_part
from studies.study import Part

OBSERVERS = corner_observers("resilient-velocity")
ROWS = (
    Printed("p3-launch-split", "harsh launch, ice and dry", 5.8),
    Printed("p3-acceleration-in-turn-dry", "acceleration in a turn, dry", 5.8, None, 7.5),
    Printed("p3-lane-change-snow", "lane change, accelerating and braking, snow", 5.8, None, 7.5),
)
"""P3 prints no table: its text bounds the RMS error by 5.8 % (longitudinal) and 7.5 % (lateral)."""
FORCES = (Driven("p3-lane-change-snow", "lane change on snow (Fig. 14)"),)


def _pid(car: VehicleParameters, sample_time: float, shape: tuple[int, ...]) -> Mapping[str, DifferentiatedPid]:
    return {"longitudinal_force": DifferentiatedPid(car, sample_time, (*shape, 4))}


PARTS = (
    Part(
        "velocities",
        "Figs. 9, 11, 13 on the truth vehicle",
        partial(velocity_part, "velocities", ROWS, OBSERVERS),
        cost=80.0,
    ),
    Part(
        "velocities-other-tire",
        "Figs. 9, 11, 13 on a tire that no estimator knows: Magic Formula with slip lag",
        partial(velocity_part, "velocities-other-tire", ROWS, OBSERVERS, tire="magic-formula"),
        cost=80.0,
    ),
    Part(
        "normal-forces",
        "Fig. 14 on the truth vehicle: forces",
        partial(force_part, "forces", FORCES, {"PID": _pid}),
        cost=40.0,
    ),
)
