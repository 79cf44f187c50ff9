"""The study of P3: every claim, table and figure that follows from its models and their analysis."""

from __future__ import annotations

from studies.papers.resilient_velocity import (
    discretisation,
    drops,
    error_dynamics,
    experiments,
    sensitivity,
    switching,
    vehicle,
)
from studies.study import Study

TOPICS = error_dynamics, sensitivity, switching, drops, discretisation, vehicle, experiments
STUDY = Study(
    "resilient-velocity",
    "Resilient corner-based velocity estimation",
    "P3",
    "Pirani et al.: two-state corner observers for slip velocity, their boundedness, H∞ norms and sensitivity, "
    "switched gains, and force measurements that are lost. Its examples, claims and figures are recomputed from "
    "Table I and the printed gains.",
    tuple(part for topic in TOPICS for part in topic.TOPIC.parts),
)
