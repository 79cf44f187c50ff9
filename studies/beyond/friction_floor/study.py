"""The study of the friction floor: closed form, runtime observers, truth vehicle."""

from __future__ import annotations

from studies.beyond.friction_floor import launches, resting_tire
from studies.study import Study

STUDY = Study(
    "friction-floor",
    "The friction floor: slip velocity that force cannot tell",
    "",
    "When friction saturates, force does not tell the slip velocity any more. How much any observer of the papers' structure "
    "must then miss follows in closed form, independent of its gains; the runtime observers and a truth vehicle confirm it, "
    "and the vehicle-level fusion recovers most of it from acceleration and from the wheels that still roll.",
    (*resting_tire.TOPIC.parts, *launches.TOPIC.parts),
)
