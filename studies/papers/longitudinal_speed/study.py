"""The study of P2: its topics in the order of the paper."""

from __future__ import annotations

from functools import partial

from studies.papers.longitudinal_speed import (
    accuracy,
    experiments,
    model,
    observability,
    slip_threshold,
    steady_filter,
    stochastic_observability,
    unknown_input_observer,
)
from studies.papers.longitudinal_speed.inputs import PARAMETERS
from studies.papers.parameter_table import parameter_part
from studies.study import Part, Study

CONSTANTS = (
    "Vehicle and tire constants of P2, as every result of this study uses them; of the two radii that it prints, 0.35 m in "
    "the text and 0.33 m in Table I, that of the text."
)
TOPICS = (
    model.TOPIC, observability.TOPIC, stochastic_observability.TOPIC, steady_filter.TOPIC,
    unknown_input_observer.TOPIC, slip_threshold.TOPIC, accuracy.TOPIC,
)  # fmt: skip
CLAIMS = {name: compute for topic in TOPICS for name, compute in topic.claims.items()}
"""What computes each claim, by its id."""

STUDY = Study(
    PARAMETERS,
    "Longitudinal speed estimation robust to road conditions",
    "P2",
    "Wheel forces from a simple unknown-input observer or a UKF, normalised and fed to a three-state time-varying Kalman "
    "filter at each wheel. Recomputed: the model, its observability, what an unknown initial state does to the filter, the "
    "recursions of the appendix, the bound of the force observer, the slip threshold and the accuracy that the text claims.",
    (
        Part("parameters", "Table I: vehicle and tire", partial(parameter_part, PARAMETERS, CONSTANTS), 0.1),
        *(part for topic in TOPICS for part in topic.parts),
        *experiments.PARTS,
    ),
)
