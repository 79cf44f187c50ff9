"""The observers under test: the five shipped schedules, and the constant gains that P3 prints on the same plants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from estimators import GainSchedule
from estimators.velocity import with_constant_gain
from studies.papers.resilient_velocity.inputs import PRINTED
from synthesis.models.catalogue.corner import Direction


@dataclass(frozen=True)
class Observer:
    """A schedule under a name for tables and figures; `printed` for the gains of P3."""

    name: str
    title: str
    schedule: GainSchedule
    printed: bool


SHIPPED: Mapping[str, str] = {
    "corner-estimation-longitudinal": "P1 vehicle, longitudinal",
    "corner-estimation-lateral": "P1 vehicle, lateral",
    "longitudinal-speed": "P2 vehicle, longitudinal",
    "resilient-velocity-longitudinal": "P3 vehicle, longitudinal",
    "resilient-velocity-lateral": "P3 vehicle, lateral",
}
PRINTED_NAMES: Mapping[str, Direction] = {"printed-longitudinal": "longitudinal", "printed-lateral": "lateral"}
NAMES = (*SHIPPED, *PRINTED_NAMES)


@cache
def observer(name: str) -> Observer:
    """The observer of this name, one of `NAMES`. Raises KeyError for another."""
    if name in SHIPPED:
        return Observer(name, f"{SHIPPED[name]}: shipped schedule", GainSchedule.shipped(name), printed=False)
    direction = PRINTED_NAMES[name]
    gain = PRINTED.gains[direction]
    plant = GainSchedule.shipped(f"resilient-velocity-{direction}")
    title = f"P3 vehicle, {direction}: printed gain [{gain[0]:g}, {gain[1]:g}]"
    return Observer(name, title, with_constant_gain(plant, gain), printed=True)
