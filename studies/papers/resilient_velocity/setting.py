"""What P3 prints, as one object from which every claim, table and figure of the study is computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.linalg import expm

from synthesis.models.catalogue.corner import Direction, corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import ParameterSet, load_parameter_set
from synthesis.polynomials.matrix import FloatArray

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Gain: TypeAlias = tuple[float, float]
DIRECTIONS: tuple[Direction, Direction] = ("longitudinal", "lateral")
DISTURBANCES = ("friction", "acceleration_error")  # the two inputs of (8), (13)
NO_GAIN: Gain = (0.0, 0.0)
HIGHEST_SPEED = 140.0  # rad/s, the end of the axes of Figs 2 to 8


@dataclass(frozen=True, eq=False)
class Setting:
    """Table I with the printed gains, the sample time and the numbers of the examples. `dataclasses.replace` varies it."""

    parameters: ParameterSet
    gains: Mapping[Direction, Gain]
    high_slip: Gain  # Example 2, longitudinal
    gravity: float = 9.81  # m/s^2, of the load examples
    sample_time: float = 0.005  # s, 200 Hz
    similarity: float = 9000.0  # gamma of T = diag(gamma, 1), Example 1
    example_speed: float = 40.0  # rad/s, Example 1
    example_drop: float = 0.2  # Example 3

    @cached_property
    def models(self) -> Mapping[Direction, LpvModel]:
        """The corner models (5), (6) and (11) over 0..140 rad/s."""
        return {d: corner_velocity_model(self.parameters, d, HIGHEST_SPEED) for d in DIRECTIONS}

    @property
    def transform(self) -> FloatArray:
        """T = diag(gamma, 1) of Proposition 1."""
        return np.diag([self.similarity, 1.0])

    def rolling_rate(self, direction: Direction, speeds: ArrayLike) -> FloatArray:
        """a = kappa R_e |omega| in 1/s."""
        kappa = self.parameters.tire[direction].kappa.value
        return np.asarray(kappa * self.parameters.vehicle["effective_radius"].value * np.abs(speeds))

    def plant(self, direction: Direction, speeds: ArrayLike) -> FloatArray:
        """A (g, 2, 2) of (5) at wheel speeds (g,) in rad/s."""
        return self.models[direction].on(_grid(speeds)).A

    def error(self, direction: Direction, speeds: ArrayLike, gain: Gain | None = None) -> tuple[FloatArray, FloatArray]:
        """A_e (g, 2, 2) and B_e (g, 2, 2) of (8), (13); the printed gain unless another is given."""
        L = np.reshape(self.gains[direction] if gain is None else gain, (2, 1))
        A_e, B_e = self.models[direction].on(_grid(speeds)).error_dynamics(L)
        return A_e, np.asarray(B_e[..., :2])

    def sampled(self, direction: Direction, speeds: ArrayLike, gain: Gain | None = None) -> FloatArray:
        """exp(A_e T_s) (g, 2, 2): the error form of (10)."""
        return np.asarray(expm(self.sample_time * self.error(direction, speeds, gain)[0]))

    def dropped(self, direction: Direction, speeds: ArrayLike) -> FloatArray:
        """exp(A T_s) (g, 2, 2): the update without the force, (24)."""
        return np.asarray(expm(self.sample_time * self.plant(direction, speeds)))


def _grid(speeds: ArrayLike) -> FloatArray:
    return np.atleast_1d(np.asarray(speeds, float))


def printed_setting() -> Setting:
    """Table I and the gains of the road tests as P3 prints them."""
    parameters = load_parameter_set("resilient-velocity")
    published = {d: parameters.tire[d].published for d in DIRECTIONS}
    gains: dict[Direction, Gain] = {}
    for direction, entry in published.items():
        if entry is None or entry.gains is None:
            raise ValueError(f"parameter set '{parameters.id}' has no published gains ({direction})")
        gains[direction] = (entry.gains[0], entry.gains[1])
    high = published["longitudinal"]
    if high is None or high.gains_high_slip is None:
        raise ValueError(f"parameter set '{parameters.id}' has no published gains for high slip")
    return Setting(parameters, gains, (high.gains_high_slip[0], high.gains_high_slip[1]))


PRINTED = printed_setting()
