"""The gains that are examined: printed by P1 and P3, and the shipped schedules."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from estimators.schedule import GainSchedule
from synthesis.errors import SpecError
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import load_parameter_set
from synthesis.polynomials.matrix import FloatArray

WHEEL_SPEED = (0.0, 140.0)  # rad/s, the range of P1 Figs. 3 and 4
PAPERS = {"corner-estimation": "P1", "resilient-velocity": "P3", "longitudinal-speed": "P2"}


@dataclass(frozen=True)
class Design:
    """Gains over the wheel speed with the model they belong to; `schedule` is what the runtime would read."""

    name: str
    kind: Literal["printed", "shipped"]
    model: LpvModel
    gain: Callable[[FloatArray], FloatArray]  # rad/s (g,) -> (g, 2, 1)
    schedule: GainSchedule

    def matrices(self, wheel_speed: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A (g, 2, 2), L (g, 2, 1) and C (g, 1, 2) at wheel speeds (g,) in rad/s."""
        points = np.atleast_1d(np.asarray(wheel_speed, float))
        numeric = self.model.on(points)
        return numeric.A, self.gain(points), numeric.C

    def grid(self, points: int = 281) -> FloatArray:
        """Wheel speeds over the range, with every breakpoint of the gains."""
        return np.union1d(np.linspace(*WHEEL_SPEED, points), self.schedule.breakpoints)


@cache
def printed_designs() -> tuple[Design, ...]:
    """[0.68, 183.1], [1.11, 16.7] of P1; [1.18, 387], [1.21, 16.8] and, for high slip, [0.22, 0.1] of P3."""
    found = []
    for parameters in ("corner-estimation", "resilient-velocity"):
        tires = load_parameter_set(parameters)
        for direction in ("longitudinal", "lateral"):
            published = tires.tire[direction].published
            if published is None or published.gains is None:
                raise SpecError(
                    f"parameter set '{parameters}' has no published {direction} gains; add them with their source"
                )
            name = f"{PAPERS[parameters]} {direction}"
            found.append(_constant(name, parameters, direction, published.gains))
            if published.gains_high_slip is not None:
                found.append(_constant(f"{name}, high slip", parameters, direction, published.gains_high_slip))
    return tuple(found)


@cache
def shipped_designs() -> tuple[Design, ...]:
    """The five schedules that come with the package."""
    found = []
    for parameters, direction in (
        ("corner-estimation", "longitudinal"),
        ("corner-estimation", "lateral"),
        ("resilient-velocity", "longitudinal"),
        ("resilient-velocity", "lateral"),
        ("longitudinal-speed", "longitudinal"),
    ):
        name = parameters if parameters == "longitudinal-speed" else f"{parameters}-{direction}"
        schedule = GainSchedule.shipped(name)
        found.append(Design(f"schedule {name}", "shipped", _model(parameters, direction), schedule.gain, schedule))
    return tuple(found)


def with_sample_time(design: Design, sample_time: float) -> GainSchedule:
    """The schedule of a design for another sample time [s]; gains and plant are as they were, nothing is proved for it."""
    return replace(design.schedule, sample_time=sample_time)


def _model(parameters: str, direction: str) -> LpvModel:
    return corner_velocity_model(load_parameter_set(parameters), direction, wheel_speed_maximum=WHEEL_SPEED[1])  # type: ignore[arg-type]


def _constant(name: str, parameters: str, direction: str, gains: tuple[float, ...]) -> Design:
    """Printed gains in the shape of a schedule, on the plant of the shipped one with the same tires."""
    column = np.array(gains)[:, None]
    shipped = GainSchedule.shipped(f"{parameters}-{direction}")
    schedule = replace(shipped, name=name, breakpoints=np.array(WHEEL_SPEED), table=np.stack([column, column]))
    return Design(
        name,
        "printed",
        _model(parameters, direction),
        lambda points: np.broadcast_to(column, (len(points), 2, 1)),
        schedule,
    )
