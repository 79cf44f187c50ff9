"""The designs that are varied (those of the shipped specifications) and the printed gains that belong to them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from estimators.arrays import FloatArray
from studies.beyond.observers import PAPERS, printed
from studies.spec import load_spec
from synthesis.design.hinf_observer import ObserverDesign
from synthesis.errors import SpecError
from synthesis.models.lpv import LpvModel

PACKAGE = "studies.beyond.well_posed_design"
VELOCITY = ("relative_velocity",)


@dataclass(frozen=True)
class Case:
    """A model with its well-posed base design, and the gains and gain ranges that the paper prints for it."""

    name: str
    title: str
    model: LpvModel
    design: ObserverDesign
    printed: tuple[float, float]
    printed_range: tuple[tuple[float, float], tuple[float, float]]

    def grid(self, points: int = 29) -> FloatArray:
        """Wheel speeds over the range, rad/s."""
        (parameter,) = self.model.parameters
        return np.linspace(parameter.minimum, parameter.maximum, points)


@cache
def case(name: str) -> Case:
    """By the name of a shipped specification. Raises SpecError if its parameter set prints no gains or ranges of them."""
    spec, folder = load_spec(name)
    parameters, direction = spec.parameter_set(folder), str(spec.model.id).removeprefix("corner-velocity-")
    gains, published = printed(parameters, direction)
    if published.gain_range is None:
        raise SpecError(f"specification '{name}': its parameter set has no published gains with ranges to compare with")
    title, (first, second) = f"{PAPERS[parameters.id]} {direction}", published.gain_range
    return Case(name, title, spec.build_model(parameters), spec.observer_design(), gains, (first, second))


def p1_cases() -> tuple[Case, Case]:
    """Longitudinal and lateral tires of P1."""
    return case("corner-estimation-longitudinal"), case("corner-estimation-lateral")


def all_cases() -> tuple[Case, ...]:
    """P1 and P3, longitudinal and lateral."""
    return (*p1_cases(), case("resilient-velocity-longitudinal"), case("resilient-velocity-lateral"))
