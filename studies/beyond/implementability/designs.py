"""The gains that are examined: printed by P1 and P3, and the shipped schedules."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Literal

import numpy as np

from estimators.arrays import FloatArray
from estimators.schedule import GainSchedule
from studies.beyond.observers import PAPERS, SHIPPED, printed
from synthesis.models.catalogue.corner import corner_velocity_model
from synthesis.models.lpv import LpvModel
from synthesis.models.parameter_set import load_parameter_set

WHEEL_SPEED = (0.0, 140.0)  # rad/s, the range of P1 Figs. 3 and 4
PAPER_RATE = 200.0  # Hz, P1 and P3
PRINTED_BY = ("corner-estimation", "resilient-velocity")  # parameter sets of these papers


@dataclass(frozen=True)
class Design:
    """Gains over the wheel speed, as the runtime would read them, with the model they belong to."""

    name: str
    kind: Literal["printed", "shipped"]
    model: LpvModel
    schedule: GainSchedule

    def matrices(self, wheel_speed: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A (g, 2, 2), L (g, 2, 1) and C (g, 1, 2) at wheel speeds (g,) in rad/s."""
        numeric = self.model.on(wheel_speed)
        return numeric.A, self.schedule.gain(wheel_speed), numeric.C

    def grid(self, points: int = 281) -> FloatArray:
        """Wheel speeds over the range, with every breakpoint of the gains."""
        return np.union1d(np.linspace(*WHEEL_SPEED, points), self.schedule.breakpoints)


@cache
def printed_designs() -> tuple[Design, ...]:
    """[0.68, 183.1], [1.11, 16.7] of P1; [1.18, 387], [1.21, 16.8] and, for high slip, [0.22, 0.1] of P3."""
    found = []
    for name, (parameters, direction) in SHIPPED.items():
        if parameters in PRINTED_BY:
            gains, published = printed(parameters, direction)
            variants = {"": gains, ", high slip": published.gains_high_slip}
            title = f"{PAPERS[parameters]} {direction}"
            found += [_constant(title + slip, name, pair) for slip, pair in variants.items() if pair is not None]
    return tuple(found)


@cache
def shipped_designs() -> tuple[Design, ...]:
    """The five schedules that come with the package, that for one direction alone last."""
    names = sorted(SHIPPED, key=lambda name: SHIPPED[name][0] not in PRINTED_BY)
    return tuple(Design(f"schedule {name}", "shipped", _model(name), GainSchedule.shipped(name)) for name in names)


def _model(name: str) -> LpvModel:
    parameters, direction = SHIPPED[name]
    return corner_velocity_model(load_parameter_set(parameters), direction, wheel_speed_maximum=WHEEL_SPEED[1])


def _constant(title: str, name: str, gains: tuple[float, ...]) -> Design:
    """Printed gains in the shape of a schedule, on the plant of the shipped one `name` with the same tires."""
    column, shipped = np.array(gains)[:, None], GainSchedule.shipped(name)
    schedule = replace(shipped, name=title, grid=(np.array(WHEEL_SPEED),), table=np.stack([column, column]))
    return Design(title, "printed", _model(name), schedule)
