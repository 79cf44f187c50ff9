"""The error percentages of the conclusion: what a percentage without a normaliser can mean."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from studies.claim import ClaimFunction, Finding
from studies.papers.verdicts import open_choice
from synthesis.polynomials.matrix import FloatArray

PRINTED_PERCENT = {"longitudinal": 5.8, "lateral": 7.5}
HALF_DIGIT = 0.05  # %
NORMALISERS: Mapping[str, Callable[[FloatArray], float]] = {
    "largest value": lambda v: float(np.abs(v).max()),
    "range": lambda v: float(np.ptp(v)),
    "mean size": lambda v: float(np.abs(v).mean()),
    "root mean square": lambda v: float(np.sqrt(np.mean(v**2))),
}


def launch(points: int = 100_001) -> FloatArray:
    """Speed over its end value in a launch from standstill at constant acceleration."""
    return np.linspace(0.0, 1.0, points)


def lane_change(points: int = 100_001) -> FloatArray:
    """Lateral velocity over its amplitude in one period of a sine."""
    return np.sin(np.linspace(0.0, 2.0 * np.pi, points))


def normalised_errors(motions: Mapping[str, FloatArray] | None = None) -> Finding:
    """P3-nrms: one error in m/s, chosen to be the print of its largest value, under each way of normalising it."""
    signals = motions or {"longitudinal": launch(), "lateral": lane_change()}
    computed: dict[str, dict[str, float]] = {}
    for direction, signal in signals.items():
        error = PRINTED_PERCENT[direction] * NORMALISERS["largest value"](signal)
        computed[direction] = {name: error / normaliser(signal) for name, normaliser in NORMALISERS.items()}
    readings = [[entry[name] for entry in computed.values()] for name in NORMALISERS]
    return Finding(
        computed,
        open_choice(readings, HALF_DIGIT),
        "Neither a table nor the normaliser of the percentages is given. One and the same error that is 5.8 % of "
        f"the largest speed of a launch at constant acceleration is {computed['longitudinal']['mean size']:.1f} % "
        f"of its mean; 7.5 % of the amplitude of a sinusoidal lane change is {computed['lateral']['range']:.2f} % "
        f"of the range and {computed['lateral']['mean size']:.1f} % of the mean size. What our observers reach is "
        "measured on simulated drives.",
    )


CLAIMS: dict[str, ClaimFunction] = {"P3-nrms": normalised_errors}
