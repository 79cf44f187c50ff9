"""The observers under test: the five shipped schedules, and the constant gains that P3 prints on the same plants."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from estimators import GainSchedule
from estimators.velocity import with_constant_gain
from studies.beyond.observers import PAPERS, SHIPPED, printed

PACKAGE = "studies.beyond.drop_tolerance"
PRINTED = {"printed-longitudinal": "longitudinal", "printed-lateral": "lateral"}
NAMES = (*SHIPPED, *PRINTED)
QUICK = ("corner-estimation-longitudinal",)  # observers of a quick run; the overview has all of them
SPEED_LABEL = "wheel speed |ω| [rad/s]"


@dataclass(frozen=True)
class Observer:
    """A schedule under a name for tables and figures; `plant` says whose tires it has."""

    name: str
    plant: str
    title: str
    schedule: GainSchedule

    @property
    def step(self) -> float:
        """Sample time in ms."""
        return 1e3 * self.schedule.sample_time


@cache
def observer(name: str) -> Observer:
    """The observer of this name, one of `NAMES`. Raises KeyError for another."""
    if name in PRINTED:
        direction, plant = PRINTED[name], f"P3 vehicle, {PRINTED[name]}"
        gain, _ = printed("resilient-velocity", direction)
        schedule = with_constant_gain(GainSchedule.shipped(f"resilient-velocity-{direction}"), gain)
        return Observer(name, plant, f"{plant}: printed gain [{gain[0]:g}, {gain[1]:g}]", schedule)
    parameters, direction = SHIPPED[name]
    plant = f"{PAPERS[parameters]} vehicle, {direction}"
    return Observer(name, plant, f"{plant}: shipped schedule", GainSchedule.shipped(name))
