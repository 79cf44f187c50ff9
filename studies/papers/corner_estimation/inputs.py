"""What the claims of P1 start from: the corner models, what is printed for them, and the problem (30)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import TypeVar, get_args

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from estimators.arrays import FloatArray
from studies.papers.topic import Topic
from studies.plots import Axis
from synthesis.design.hinf_observer import Channel, ObserverDesign
from synthesis.errors import SpecError
from synthesis.lmi.settings import LmiSettings
from synthesis.models.catalogue.corner import Direction, corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, Published, load_parameter_set

T = TypeVar("T")
PACKAGE = "studies.papers.corner_estimation"
topic = partial(Topic, PACKAGE)  # one for each file
PARAMETERS = "corner-estimation"
PAPER = {PARAMETERS: "P1", "resilient-velocity": "P3"}  # that prints a parameter set
STATED_SPEED = 180.0  # rad/s: the range that the stability claims name, text before (29)
DESIGN_SPEED = 140.0  # rad/s: the range that the gains are designed on, text after (32)
PRINTED_GRAVITY = 9.81  # m/s^2, of the load examples
POINTS = 140  # wheel speeds on the design range, text after (32)
STATES = ("bristle_deflection", "relative_velocity")  # of the corner models
SPEED_AXIS = Axis("wheel speed [rad/s]", 0.0, STATED_SPEED)


@cache
def parameters(name: str = PARAMETERS) -> ParameterSet:
    """A shipped parameter set; the values of P1 unless another one is named."""
    return load_parameter_set(name)


@dataclass(frozen=True)
class Corner:
    """The velocity model of one direction with a parameter set, and what is printed for it. Gains: [L1 in m/s, L2 in m/s^2].

    Raises SpecError where something is asked for that is not printed.
    """

    direction: Direction
    name: str = PARAMETERS

    def __str__(self) -> str:
        return f"{PAPER[self.name]} {self.direction}"

    @cached_property
    def model(self) -> LpvModel:
        """P1 (22), (37) over the stated 0..180 rad/s and +-800 rad/s^2."""
        return corner_velocity_model(parameters(self.name), self.direction, STATED_SPEED)

    @cached_property
    def design_model(self) -> LpvModel:
        """The same over the range that the gains are designed on, 0..140 rad/s."""
        return corner_velocity_model(parameters(self.name), self.direction, DESIGN_SPEED)

    @property
    def constants(self) -> dict[str, float]:
        """sigma0, sigma1, sigma2, kappa and effective_radius in the units of the model."""
        return {name: constant.value for name, constant in self.model.constants.items()}

    @property
    def exact_constants(self) -> dict[str, sp.Rational]:
        """The constants as the rational numbers of their printed decimals."""
        return {name: sp.Rational(str(value)) for name, value in self.constants.items()}

    @property
    def gains(self) -> tuple[float, ...]:
        """The gains that the stability claims are about."""
        return self._given(self._published.gains, "gains")

    @property
    def box(self) -> tuple[tuple[float, float], ...]:
        """The box of gains: (lowest, highest) of L1 and of L2."""
        return self._given(self._published.gain_box, "gain box")

    @property
    def lyapunov(self) -> list[list[list[str]]]:
        """[P0, P1] of (29) or (41) as printed decimals."""
        matrix = self._given(self._published.lyapunov, "Lyapunov matrix")
        return [[list(row) for row in coefficient] for coefficient in matrix]

    def error_matrices(self, omega: ArrayLike) -> FloatArray:
        """A_e = A - L C of (25), (39) with the printed gains at wheel speeds (g,) in rad/s: (g, 2, 2), states in m and m/s."""
        return self.model.on(np.asarray(omega)).error_dynamics(np.array(self.gains)[:, None])[0]

    @property
    def _published(self) -> Published:
        return self._given(parameters(self.name).tire[self.direction].published, "design")

    def _given(self, value: T | None, what: str) -> T:
        if value is None:
            raise SpecError(f"no {self.direction} {what} in '{self.name}' is printed")
        return value


# The printed gains that the stability claims are about: of P1 and of P3.
DESIGNS = tuple(Corner(direction, name) for name in PAPER for direction in get_args(Direction))
CORNERS: dict[Direction, Corner] = {corner.direction: corner for corner in DESIGNS[:2]}


def literal_design(degree: int, errors: tuple[str, ...] = STATES, points: int = POINTS) -> ObserverDesign:
    """(30)-(32) and nothing else: one channel from both disturbances to the errors C_e, minimised."""
    channel = Channel(("friction", "acceleration_error"), errors)
    return ObserverDesign((channel,), degree, settings=LmiSettings(relaxation="grid", points=points))
