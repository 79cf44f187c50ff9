"""The manoeuvres of Figs. 9 to 14, driven on the truth vehicle: launch, acceleration in a turn, lane change."""

from __future__ import annotations

from functools import partial

from studies.papers.resilient_velocity.compliance_report import TESTS, compliance_part
from studies.trials.driven import MAGIC_FORMULA, driven_part
from studies.trials.forces import Driven, differentiated_pid, force_part
from studies.trials.motion import Moved, motion_part
from studies.trials.velocities import Printed, corner_observers, velocity_part

OBSERVERS = corner_observers("resilient-velocity")
ROWS = (
    Printed("p3-launch-split", "harsh launch, ice and dry", 5.8),
    Printed("p3-acceleration-in-turn-dry", "acceleration in a turn, dry", 5.8, None, 7.5),
    Printed("p3-lane-change-snow", "lane change, accelerating and braking, snow", 5.8, None, 7.5),
)
"""P3 prints no table: its text bounds the RMS error by 5.8 % (longitudinal) and 7.5 % (lateral)."""
FORCES = (Driven("p3-lane-change-snow", "lane change on snow (Fig. 14)"),)


MOTION = (
    Moved("p3-acceleration-in-turn-dry", "Acceleration in a turn, dry (Fig. 11)"),
    Moved("p3-lane-change-snow", "Lane change, accelerating and braking, snow (Fig. 13)"),
)

PARTS = (
    driven_part(
        "velocities",
        "Figs. 9, 11, 13 on the truth vehicle",
        partial(velocity_part, "velocities", ROWS, OBSERVERS),
        cost=40.0,
    ),
    driven_part(
        "velocities-other-tire",
        "Figs. 9, 11, 13 on a tire that no estimator knows: Magic Formula with slip lag",
        partial(velocity_part, "velocities-other-tire", ROWS, OBSERVERS),
        cost=44.0,
        tire=MAGIC_FORMULA,
    ),
    driven_part(
        "normal-forces",
        "Fig. 14 on the truth vehicle: forces",
        partial(force_part, "forces", FORCES, {"PID": differentiated_pid}),
        cost=20.0,
    ),
    driven_part(
        "compliance",
        "Figs. 9, 10 and 12 on the truth vehicle: wheels, with and without the suspension compliance",
        partial(compliance_part, "compliance", TESTS),
        cost=46.0,
    ),
    driven_part(
        "motion",
        "Figs. 11 and 13 on the truth vehicle: accelerations and yaw rate",
        partial(motion_part, "motion", MOTION),
        cost=5.0,
    ),
)
