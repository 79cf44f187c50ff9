"""The study of P1: its topics in the order of the paper."""

from __future__ import annotations

from functools import partial

from studies.papers.corner_estimation import (
    accuracy,
    conditioning,
    error_matrix,
    experiments,
    hinf_design,
    loads,
    observability,
    printed_lyapunov,
    quadratic_stability,
    sigma_points,
    solve_size,
    wheel_force,
)
from studies.papers.corner_estimation.inputs import PARAMETERS
from studies.papers.parameter_table import parameter_part
from studies.study import Part, Study

CONSTANTS = "Vehicle and tire constants of P1, as every result of this study uses them."
TOPICS = (
    error_matrix.TOPIC, printed_lyapunov.TOPIC, quadratic_stability.TOPIC, conditioning.TOPIC, hinf_design.TOPIC,
    solve_size.TOPIC, wheel_force.TOPIC, sigma_points.TOPIC, observability.TOPIC, loads.TOPIC, accuracy.TOPIC,
)  # fmt: skip
CLAIMS = {name: compute for topic in TOPICS for name, compute in topic.claims.items()}
"""What computes each claim, by its id."""

STUDY = Study(
    PARAMETERS,
    "Corner-based estimation of tire forces and vehicle velocities",
    "P1",
    "Forces at each wheel from spin and planar dynamics, normalised and fed to a two-state bristle observer at each "
    "corner, with gains scheduled over wheel speed. Recomputed: the error dynamics and their Lyapunov proofs, the "
    "H-infinity design and its gains, the force observers, loads, observability and the accuracy that the text claims.",
    (
        Part("parameters", "Table I: vehicle and tire", partial(parameter_part, PARAMETERS, CONSTANTS), 0.1),
        *(part for topic in TOPICS for part in topic.parts),
        *experiments.PARTS,
    ),
)
