"""The study of P3: its parts, among them the percentages of the conclusion and Figs 9 to 14 on the truth vehicle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from estimators.arrays import FloatArray
from studies.claim import Finding
from studies.papers.resilient_velocity import discretisation, drops, error_dynamics, sensitivity, switching, vehicle
from studies.papers.resilient_velocity.compliance import BOUNDS, TESTS, compliance_part
from studies.papers.resilient_velocity.inputs import PACKAGE
from studies.papers.topic import Topic
from studies.papers.verdicts import open_choice
from studies.study import Study
from studies.trials.forces import ForceTest, differentiated_pid, force_part
from studies.trials.motion import MotionTest, motion_part
from studies.trials.simulations import LUGRE, MAGIC_FORMULA, trial_part
from studies.trials.velocities import VelocityTest, corner_observers, velocity_part

TOPIC = Topic(PACKAGE)
NORMALISERS: Mapping[str, Callable[[FloatArray], float]] = {
    "largest value": lambda v: float(np.abs(v).max()),
    "range": lambda v: float(np.ptp(v)),
    "mean size": lambda v: float(np.abs(v).mean()),
    "root mean square": lambda v: float(np.sqrt(np.mean(v**2))),
}
MOTIONS: Mapping[str, FloatArray] = {
    "longitudinal": np.linspace(0.0, 1.0, 100_001),
    "lateral": np.sin(np.linspace(0.0, 2.0 * np.pi, 100_001)),
}
"""Speed over its end value in a launch at constant acceleration; lateral velocity over its amplitude in one period of a sine."""
OBSERVERS = corner_observers("resilient-velocity")
ROWS = (
    VelocityTest("p3-launch-split", "harsh launch, ice and dry", BOUNDS[0]),
    VelocityTest("p3-acceleration-in-turn-dry", "acceleration in a turn, dry", BOUNDS[0], None, BOUNDS[1]),
    VelocityTest("p3-lane-change-snow", "lane change, accelerating and braking, snow", BOUNDS[0], None, BOUNDS[1]),
)
"""P3 prints no table: its text bounds the RMS error by 5.8 % (longitudinal) and 7.5 % (lateral)."""
FORCES = (ForceTest("p3-lane-change-snow", "lane change on snow (Fig. 14)"),)
MOTION = (
    MotionTest("p3-acceleration-in-turn-dry", "Acceleration in a turn, dry (Fig. 11)"),
    MotionTest("p3-lane-change-snow", "Lane change, accelerating and braking, snow (Fig. 13)"),
)


@TOPIC.claim("P3-nrms")
def normalised_errors(motions: Mapping[str, FloatArray] = MOTIONS) -> Finding:
    """One error in m/s, chosen to be the print of its largest value, under each way of normalising it."""
    computed: dict[str, dict[str, float]] = {}
    for (direction, signal), bound in zip(motions.items(), BOUNDS, strict=True):
        error = bound * NORMALISERS["largest value"](signal)
        computed[direction] = {name: error / normaliser(signal) for name, normaliser in NORMALISERS.items()}
    readings = [[entry[name] for entry in computed.values()] for name in NORMALISERS]
    reading = (
        "Neither a table nor the normaliser of the percentages is given. One and the same error that is 5.8 % of the largest "
        f"speed of a launch at constant acceleration is {computed['longitudinal']['mean size']:.1f} % of its mean; 7.5 % of "
        f"the amplitude of a sinusoidal lane change is {computed['lateral']['range']:.2f} % of the range and "
        f"{computed['lateral']['mean size']:.1f} % of the mean size. What our observers reach is measured on simulated drives."
    )
    return Finding(computed, open_choice(readings, 0.05), reading)


TOPIC.show("accuracy", "The percentages of the conclusion", 0.1)
for name, title, run, cost, tire in (
    ("velocities", "Figs. 9, 11, 13 on the truth vehicle",
     partial(velocity_part, "velocities", ROWS, OBSERVERS), 40.0, LUGRE),
    ("velocities-other-tire", "Figs. 9, 11, 13 on a tire that no estimator knows: Magic Formula with slip lag",
     partial(velocity_part, "velocities-other-tire", ROWS, OBSERVERS), 44.0, MAGIC_FORMULA),
    ("normal-forces", "Fig. 14 on the truth vehicle: forces",
     partial(force_part, "forces", FORCES, {"PID": differentiated_pid}), 20.0, LUGRE),
    ("compliance", "Figs. 9, 10 and 12 on the truth vehicle: wheels, with and without the suspension compliance",
     partial(compliance_part, "compliance", TESTS), 46.0, LUGRE),
    ("motion", "Figs. 11 and 13 on the truth vehicle: accelerations and yaw rate",
     partial(motion_part, "motion", MOTION), 5.0, LUGRE),
):  # fmt: skip
    TOPIC.parts.append(trial_part(name, title, run, cost, tire))

TOPICS = (*(m.TOPIC for m in (error_dynamics, sensitivity, switching, drops, discretisation, vehicle)), TOPIC)
STUDY = Study(
    "resilient-velocity", "Resilient corner-based velocity estimation", "P3",
    "Pirani et al.: two-state corner observers for slip velocity, their boundedness, H∞ norms and sensitivity, switched gains, "
    "and force measurements that are lost. Its examples, claims and figures are recomputed from Table I and the printed gains.",
    tuple(part for topic in TOPICS for part in topic.parts),
)  # fmt: skip
