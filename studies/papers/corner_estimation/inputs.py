"""What the claims of P1 start from: models, printed gains and matrices, and values that no parameter set holds."""

from __future__ import annotations

from functools import cache
from typing import TypeVar

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from synthesis.errors import SpecError
from synthesis.hinf_observer import Channel, ObserverDesign
from synthesis.lmi.settings import LmiSettings
from synthesis.models.catalogue.corner import Direction, corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, Published, load_parameter_set
from synthesis.polynomials.matrix import FloatArray

T = TypeVar("T")
PACKAGE = "studies.papers.corner_estimation"
PARAMETERS = "corner-estimation"
DIRECTIONS: tuple[Direction, ...] = ("longitudinal", "lateral")
STATED_SPEED = 180.0  # rad/s: the range that the stability claims name, text before (29)
DESIGN_SPEED = 140.0  # rad/s: the range that the gains are designed on, text after (32)
SPEED = "wheel speed [rad/s]"  # the axis of most figures

# The parameter sets with printed gains that the stability claims are about: (name, direction).
DESIGNS: tuple[tuple[str, Direction], ...] = (
    (PARAMETERS, "longitudinal"), (PARAMETERS, "lateral"),
    ("resilient-velocity", "longitudinal"), ("resilient-velocity", "lateral"),
)  # fmt: skip
POINTS = 140  # wheel speeds on the design range, text after (32)
STATES = ("bristle_deflection", "relative_velocity")  # of the corner model
PAPER = {PARAMETERS: "P1", "resilient-velocity": "P3"}  # whose gains they are


@cache
def parameters(name: str = PARAMETERS) -> ParameterSet:
    """A shipped parameter set; the values of P1 unless another one is named."""
    return load_parameter_set(name)


@cache
def corner_model(direction: Direction, maximum: float = STATED_SPEED, name: str = PARAMETERS) -> LpvModel:
    """The corner velocity model of P1 (22), (37) over 0..`maximum` rad/s and +-800 rad/s^2."""
    return corner_velocity_model(parameters(name), direction, maximum)


def constants(direction: Direction) -> dict[str, float]:
    """sigma0, sigma1, sigma2, kappa and effective_radius of the corner model, in its units."""
    return {name: constant.value for name, constant in corner_model(direction).constants.items()}


def exact_constants(direction: Direction, name: str = PARAMETERS) -> dict[str, sp.Rational]:
    """The constants of the corner model as the rational numbers of their printed decimals."""
    model = corner_model(direction, STATED_SPEED, name)
    return {key: sp.Rational(str(constant.value)) for key, constant in model.constants.items()}


def error_matrices(direction: Direction, omega: ArrayLike, name: str = PARAMETERS) -> FloatArray:
    """A_e = A - L C of (25), (39) with the printed gains at wheel speeds (g,) in rad/s: (g, 2, 2) in 1/s, m and s."""
    gain = np.array(printed_gains(direction, name))[:, None]
    return corner_model(direction, STATED_SPEED, name).on(np.asarray(omega)).error_dynamics(gain)[0]


def literal_design(degree: int, errors: tuple[str, ...] = STATES, points: int = POINTS) -> ObserverDesign:
    """(30)-(32) and nothing else: one channel from both disturbances to the errors C_e, minimised."""
    channel = Channel(("friction", "acceleration_error"), errors)
    return ObserverDesign((channel,), degree, settings=LmiSettings(relaxation="grid", points=points))


def printed_gains(direction: Direction, name: str = PARAMETERS) -> tuple[float, ...]:
    """[L1 in m/s, L2 in m/s^2] that the stability claims are about. Raises SpecError where none are printed."""
    return _given(_published(direction, name).gains, f"{direction} gains in '{name}'")


def printed_box(direction: Direction) -> tuple[tuple[float, float], ...]:
    """The printed box of gains: (lowest, highest) of L1 and of L2."""
    return _given(_published(direction).gain_box, f"{direction} gain box")


def printed_matrix(direction: Direction) -> list[list[list[str]]]:
    """[P0, P1] of (29) or (41) as printed decimals."""
    matrix = _given(_published(direction).lyapunov, f"{direction} Lyapunov matrix")
    return [[list(row) for row in coefficient] for coefficient in matrix]


def _published(direction: Direction, name: str = PARAMETERS) -> Published:
    return _given(parameters(name).tire[direction].published, f"{direction} design in '{name}'")


def _given(value: T | None, what: str) -> T:
    if value is None:
        raise SpecError(f"no {what} is printed")
    return value
