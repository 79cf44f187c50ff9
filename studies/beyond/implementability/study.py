"""The study of implementability."""

from __future__ import annotations

from studies.beyond.implementability import break_rates, simulation, spectral_radius
from studies.study import Study

STUDY = Study(
    "implementability",
    "Printed gains under the discretisations that people use",
    "",
    "The papers print continuous-time gains and run at 200 Hz. Which discretisation keeps them stable, and down to which "
    "sample rate? Break rates by root finding over all wheel speeds, spectral radius maps, and runs sample by sample, for "
    "printed gains and shipped schedules.",
    (*break_rates.TOPIC.parts, *spectral_radius.TOPIC.parts, *simulation.TOPIC.parts),
)
