"""What the claims of P1 start from: models, printed gains and matrices, and numbers that no parameter set holds."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from typing import Any

from studies.claim import JsonValue
from studies.papers.claims_file import published_claims
from synthesis.errors import SpecError
from synthesis.models.catalogue.corner import Direction, corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, Published, load_parameter_set

PACKAGE = "studies.papers.corner_estimation"
PARAMETERS = "corner-estimation"
DIRECTIONS: tuple[Direction, ...] = ("longitudinal", "lateral")
STATED_SPEED = 180.0  # rad/s, P1 section 6: the range that the stability claims name
DESIGN_SPEED = 140.0  # rad/s, P1 section 6.2: the range that the gains are designed on
PRINTED_GRAVITY = 9.81  # m/s^2, of the load examples
FORCE_GAINS = (1.8, 11.4, 50.6)  # eta_1 [N s], eta_2 [N m], eta_3 [1/s], P1 section 2

# The parameter sets with printed gains that the stability claims are about: (name, direction).
DESIGNS: tuple[tuple[str, Direction], ...] = (
    (PARAMETERS, "longitudinal"), (PARAMETERS, "lateral"),
    ("resilient-velocity", "longitudinal"), ("resilient-velocity", "lateral"),
)  # fmt: skip
PAPER = {PARAMETERS: "P1", "resilient-velocity": "P3"}  # whose gains they are


@cache
def parameters(name: str = PARAMETERS) -> ParameterSet:
    """A shipped parameter set; the values of P1 unless told otherwise."""
    return load_parameter_set(name)


@cache
def corner_model(direction: Direction, maximum: float = STATED_SPEED, name: str = PARAMETERS) -> LpvModel:
    """The corner velocity model of P1 (22), (37) over 0..`maximum` rad/s and +-800 rad/s^2."""
    return corner_velocity_model(parameters(name), direction, maximum)


def published(direction: Direction, name: str = PARAMETERS) -> Published:
    """Gains, gain box and Lyapunov matrix as printed. Raises SpecError for a set that prints nothing."""
    found = parameters(name).tire[direction].published
    if found is None:
        raise SpecError(f"parameter set '{name}' prints nothing for the {direction} tire")
    return found


def printed_gains(direction: Direction, name: str = PARAMETERS) -> tuple[float, ...]:
    """[L1 in m/s, L2 in m/s^2] that the stability claims are about."""
    gains = published(direction, name).gains
    if gains is None:
        raise SpecError(f"parameter set '{name}' prints no {direction} gains")
    return gains


def printed_box(direction: Direction) -> tuple[tuple[float, float], ...]:
    """The printed box of gains: (lowest, highest) of L1 and of L2."""
    box = published(direction).gain_box
    if box is None:
        raise SpecError(f"parameter set '{PARAMETERS}' prints no {direction} gain box")
    return box


def printed_value(claim_id: str, package: str = PACKAGE) -> JsonValue:
    """What the paper prints for a claim, from ``claims.toml``."""
    return published_claims(package)[claim_id].published


@cache
def printed_numbers() -> dict[str, Any]:
    """Printed tables and values by name, from ``printed.toml``."""
    text = (resources.files(PACKAGE) / "printed.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)
