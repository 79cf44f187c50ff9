"""What P3 prints, as one object from which every claim, table and figure of the study is computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm
from scipy.optimize import brentq

from estimators.arrays import FloatArray
from studies.plots import Axis
from studies.plots.colours import BLUE, RED
from synthesis.models.catalogue.corner import Direction, corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, load_parameter_set

PACKAGE = "studies.papers.resilient_velocity"
DIRECTIONS: tuple[Direction, Direction] = ("longitudinal", "lateral")
HIGHEST_SPEED = 140.0  # rad/s, the end of the axes of Figs 2 to 8
SPEEDS = np.linspace(0.0, HIGHEST_SPEED, 141)
FINE = np.linspace(0.0, HIGHEST_SPEED, 281)  # for curves
SPEED_AXIS = Axis("wheel speed |ω| [rad/s]", 0.0, HIGHEST_SPEED)
COLOUR: Mapping[Direction, str] = {"longitudinal": BLUE, "lateral": RED}
NOTE = (
    "All sampled results use the exact closed-loop update e+ = exp((A - L C) T) e at T = 5 ms while the force is "
    "received and exp(A T) while it is lost. That is what the runtime observer does; the printed gains diverge if "
    "the innovation is sampled and held instead."
)
Gain: TypeAlias = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Setting:
    """Table I with the printed gains, the sample time and the numbers of the examples. `dataclasses.replace` varies it."""

    parameters: ParameterSet
    gains: Mapping[Direction, Gain]
    high_slip: Gain  # Example 2, longitudinal
    sample_time: float = 0.005  # s, 200 Hz
    similarity: float = 9000.0  # gamma of T = diag(gamma, 1), Example 1
    example_speed: float = 40.0  # rad/s, Example 1
    example_drop: float = 0.2  # Example 3
    gravity: float = 9.81  # m/s^2, of the load examples

    @cached_property
    def models(self) -> Mapping[Direction, LpvModel]:
        """The corner models (5), (6) and (11) over 0..140 rad/s."""
        return {d: corner_velocity_model(self.parameters, d, HIGHEST_SPEED) for d in DIRECTIONS}

    @cached_property
    def vehicle(self) -> Mapping[str, float]:
        """The vehicle's numbers of Table I by name, SI units."""
        return {name: quantity.value for name, quantity in self.parameters.vehicle.items()}

    @property
    def switched(self) -> tuple[Gain, Gain]:
        """The normal and the high-slip gain of Example 2, longitudinal."""
        return self.gains["longitudinal"], self.high_slip

    @property
    def transform(self) -> FloatArray:
        """T = diag(gamma, 1) of Proposition 1."""
        return np.diag([self.similarity, 1.0])

    def rolling_rate(self, direction: Direction, speeds: ArrayLike) -> FloatArray:
        """a = kappa R_e |omega| in 1/s."""
        kappa = self.parameters.tire[direction].kappa.value
        return np.asarray(kappa * self.vehicle["effective_radius"] * np.abs(speeds))

    def error(self, direction: Direction, speeds: ArrayLike, gain: Gain | None = None) -> tuple[FloatArray, FloatArray]:
        """A_e (g, 2, 2) and B_e (g, 2, 2) of (8), (13) at wheel speeds (g,) in rad/s, with the printed or another gain."""
        L = np.reshape(self.gains[direction] if gain is None else gain, (2, 1))
        A_e, B_e = self.models[direction].on(np.atleast_1d(np.asarray(speeds, float))).error_dynamics(L)
        return A_e, np.asarray(B_e[..., :2])

    def sampled(self, direction: Direction, speeds: ArrayLike, gain: Gain | None = None) -> FloatArray:
        """exp(A_e T_s) (g, 2, 2): the error form of (10)."""
        return np.asarray(expm(self.sample_time * self.error(direction, speeds, gain)[0]))

    def dropped(self, direction: Direction, speeds: ArrayLike) -> FloatArray:
        """exp(A T_s) (g, 2, 2): the update without the force, (24)."""
        numeric = self.models[direction].on(np.atleast_1d(np.asarray(speeds, float)))
        return np.asarray(expm(self.sample_time * numeric.A))


def printed_gain(parameters: ParameterSet, direction: Direction, high_slip: bool = False) -> Gain:
    """A gain that the paper of a parameter set prints. Raises ValueError if there is none."""
    published = parameters.tire[direction].published
    gains = None if published is None else published.gains_high_slip if high_slip else published.gains
    if gains is None:
        raise ValueError(f"parameter set '{parameters.id}' has no published gains ({direction}, {high_slip = })")
    return gains[0], gains[1]


_TABLE_1 = load_parameter_set("resilient-velocity")
PRINTED = Setting(
    _TABLE_1, {d: printed_gain(_TABLE_1, d) for d in DIRECTIONS}, printed_gain(_TABLE_1, "longitudinal", high_slip=True)
)
"""Table I and the gains of the road tests as P3 prints them."""


def crossing(
    function: Callable[[float], float], level: float = 0.0, grid: ArrayLike = (0.0, HIGHEST_SPEED)
) -> float | None:
    """The first wheel speed in rad/s at which a function of it passes ``level``; None without a change of sign on the grid."""
    speeds = np.asarray(grid, float)
    values = np.array([function(float(w)) for w in speeds]) - level
    change = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    if not len(change):
        return None
    low, high = speeds[change[0] : change[0] + 2]
    return float(brentq(lambda w: function(w) - level, low, high, xtol=1e-10))
